#include "networks/ContactEquations.h"
#include "mechanics/Prefetch.h"
#include "mechanics/SymmetricMatrices.h"
#include "networks/RestGap.h"
#include <algorithm>
#include <cmath>
#include <cstddef>

using namespace cylchain;
using namespace std;

namespace {

/** How near pairs come that are looked at in a step, over their diameter: further iterations move them. */
const double REACH = 0.25;
/** The same where a periodic box is too narrow for that. */
const double LEAST_REACH = 0.2;
/** The largest predicted overlap, and the largest gap that two come back to, over the same. */
const double LARGEST_RETURN = 1;
/** Where pairs with a larger gap are nearest is not looked for, over the same: they come nearer first. */
const double LARGEST_GAP = 0.02;
/** Capsules that have travelled less touch where they did, over the same. */
const double SAME_PLACE = 0.01;
/**
 * What solving the equations leaves. An iteration tells which contacts come back, and what it leaves are iterations
 * that all have to go through: with 0.05, bundles take a seventh more time.
 */
const double RELATIVE_TOLERANCE = 5e-4;
/** The number of iterations that look where capsules touch. */
const int SEARCHING_ITERATIONS = 4;
/**
 * Up to this iteration, contacts that would be behind their surface come back, and are placed. The first of them knows
 * where the step leads without contacts, others what those that come back change of it. With all of them, steps of a
 * dense bundle take two iterations more, and bends had 1.5 % too little energy in equilibrium.
 */
const int RETURNING_ITERATIONS = 3;
/** The number of iterations in which a contact may pass to a neighbour. */
const int PASSING_ITERATIONS = 3;
/** From this iteration on, contacts that touch go on to do so, even if that takes a small force which pulls. */
const int HOLDING_ITERATIONS = 9;
/** Capsules that a thread looks at together. */
const int CHUNK_OF_CONTACTS = 128;

} // namespace

void ContactEquations::setContacts(const ContactSystem& contacts) {
    onCurves = contacts.onCurves;
    search = contacts.search;
    pairs.setSearch(search);
    stiffness = contacts.stiffness;
    box = contacts.box;
}

void ContactEquations::begin(const CoupledStart& start, const Loop& newLoop) {
    loop = &newLoop;
    begun = start.positions;
    active = &start.active;
    kT = start.settings.kT;
    stepSize = start.settings.stepSize;
    wallDepth = findDepthOfWall(kT, stiffness);
    responses.begin(start.places, stepSize);
    const vector<Capsule>& capsules = search->getSystem().capsules;
    places.begin(start, capsules, *onCurves, *loop);
    packs.resize(capsules.size());
    mobilities.resize(capsules.size());
    double diameter = 0;
    for (const Capsule& capsule : capsules)
        diameter = max(diameter, 2*capsule.radius);
    runInChunks(*loop, capsules.size(), CHUNK_OF_CONTACTS, [&] (int i) {
        const PlaceOnChain& place = places.get(i);
        packs[i] = place.pack;
        mobilities[i] = {};
        if (place.pack >= 0)
            mobilities[i] = {responses.findLeast(place.chain), start.places.findLateralFriction(place)};
    });
    reaches[0] = REACH*diameter;
    reaches[1] = LEAST_REACH*diameter;
    movesTooFar = isEndless = false;
    pairs.clear();
    motion.clear();
    selection.selectAll();
    crossingsKnown = false;
}

double ContactEquations::getRelativeTolerance() const {
    return RELATIVE_TOLERANCE;
}

void ContactEquations::beginStage(int, int, const double*) {
    iterations = 0;
}

void ContactEquations::findPairs(const double* moved) {
    movesTooFar = true;
    for (int i = 0; i < 2 && movesTooFar && !isEndless; i++)
        try {
            reach = reaches[i];
            search->findPairs(begun, moved, box, reach, found, *loop);
            movesTooFar = false;
        }
        catch (const NarrowBoxError&) {
            found.clear();
        }
        catch (const EndlessMotionError&) {
            found.clear();
            isEndless = true;
        }
    motion.begin(search->getSystem().capsules, moved, *loop);
    pairs.begin(found, places.size());
    // Of most pairs, the search has told that they are far apart.
    runInChunks(*loop, pairs.getNumPairs(), CHUNK_OF_CONTACTS, [&] (int i) {
        const ContactPair& pair = pairs.getPair(i);
        const double radii = pairs.radiiOf(pair);
        if (pair.clearance > 0 && pair.distance-radii >= LARGEST_GAP*radii)
            pairs.getWatch(i).due = pair.distance-radii;
    });
    search->setMotion(begun, moved, *loop);
}

/** How far a unit force across a capsule moves a place on it in the step. */
double ContactEquations::responseOf(int capsule, double fraction) const {
    return places.isHeld(capsule) ? 0 : responses.find(places.get(capsule, fraction), mobilities[capsule].friction);
}

/** a of a contact, see ContactRest. */
double ContactEquations::softnessOf(const ContactPair& pair, const Contact& contact) const {
    return stiffness*(responseOf(pair.a, contact.s)+responseOf(pair.b, contact.t));
}

/** Whether it is looked for where a pair touches: not where that was known a moment ago. */
bool ContactEquations::isLookedFor(int number) const {
    const CapsulePairs::Watch& watch = pairs.getWatch(number);
    if (!takesPart(watch.a) && !takesPart(watch.b))
        return false;
    return watch.count < 0 ||
            (iterations < SEARCHING_ITERATIONS && !(motion.getWay(watch.a, watch.b) < watch.samePlace));
}

/** Take note of when a pair that has had no contact may have one; false if it may now. */
bool ContactEquations::waits(int number, const PairOutlook& outlook) {
    const bool isFar = !outlook.mayCross && outlook.gap >= LARGEST_GAP*outlook.radii;
    if (pairs.hasContacts(number) || !(isFar || outlook.isOfNeighbor))
        return false;
    CapsulePairs::Watch& watch = pairs.getWatch(number);
    const double way = motion.getWay(watch.a, watch.b);
    watch.count = isFar ? -1 : 0;
    watch.samePlace = way+SAME_PLACE*outlook.radii;
    watch.due = outlook.gap > 0 ? way+outlook.gap : -HUGE_VAL;
    return true;
}

/** The same for a pair that may have had contacts, where an iteration has led it, but for some overlap. */
bool ContactEquations::isApart(int number, const PairOutlook& outlook, double overlap) {
    if (!pairs.hasContacts(number))
        return waits(number, outlook);
    CapsulePairs::Watch& watch = pairs.getWatch(number);
    double rest = watch.count > 0 ? -HUGE_VAL : LARGEST_GAP*outlook.radii+pairs.getLargestRestGap(number);
    for (int i = 0; i < watch.count; i++)
        rest = max(rest, restGapOf(pairs.getContact(number, i)));
    const double gap = outlook.gap-rest;
    if (outlook.mayCross || !(gap > -overlap))
        return false;
    watch.due = motion.getWay(watch.a, watch.b)+max(gap, 0.0);
    return true;
}

/** Evaluate some pairs that may touch. */
void ContactEquations::look(int run, bool first, Part& part) {
    Looks& looks = Looks::ofThread();
    selection.forPairs(pairs, selection.hasAll(), run, [&] (int i) {
        const CapsulePairs::Watch& watch = pairs.getWatch(i);
        motion.prefetchWay(watch.a, watch.b);
        prefetch(&packs[watch.b]);
    });
    selection.forPairs(pairs, selection.hasAll(), run, [&] (int i) {
        const CapsulePairs::Watch& watch = pairs.getWatch(i);
        if (motion.getWay(watch.a, watch.b) < watch.due)
            return;
        const bool isDue = isLookedFor(i);
        prefetch(&pairs.getPair(i));
        if (pairs.hasContacts(i))
            prefetch(&pairs.getContact(i, 0));
        search->prefetchMotion(watch.a, watch.b);
        for (int capsule : {watch.a, watch.b})
            places.prefetchPlace(capsule);
        looks.numbers.push_back(isDue ? i : -1-i);
        if (isDue)
            looks.due.push_back(&pairs.getPair(i));
    });
    looks.outlooks.resize(looks.due.size());
    search->findOutlooks(looks.due.data(), looks.due.size(), looks.outlooks.data());
    const PairOutlook* next = looks.outlooks.data();
    for (int number : looks.numbers)
        if (number < 0)
            evaluate(-1-number, first, NULL, part);
        else if (const PairOutlook& outlook = *next++; !waits(number, outlook))
            evaluate(number, first, &outlook, part);
}

/** Add the equations of a pair, with the outlook of one that is looked for. */
void ContactEquations::evaluate(int number, bool first, const PairOutlook* outlook, Part& part) {
    CapsulePairs::Watch& watch = pairs.getWatch(number);
    const ContactPair& pair = pairs.getPair(number);
    if (!takesPart(pair.a) && !takesPart(pair.b))
        return;
    const double diameter = pairs.radiiOf(pair);
    const double way = motion.getWay(pair.a, pair.b);
    double gap = HUGE_VAL;
    // What is farther away is left out, until it may have come near. Gaps of contacts that the step resolves count.
    const double largest = pairs.getLargestRestGap(number);
    const double limit = LARGEST_GAP*diameter+largest;
    if (outlook != NULL) {
        Contact contacts[2];
        int count;
        contacts[0].gap = outlook->gap;
        if (!outlook->mayCross && outlook->gap >= limit)
            count = -1;
        else
            count = outlook->isOfNeighbor ? 0 : search->evaluate(pair, contacts, limit);
        // A contact at a joint may pass from one segment to the next and back: in the end, it must not be lost.
        if (count == 0 && watch.count > 0 && iterations >= PASSING_ITERATIONS)
            pairs.updateGaps(number);
        else {
            pairs.placeContacts(number, contacts, count);
            watch.samePlace = way+SAME_PLACE*diameter;
            gap = contacts[0].gap-largest;
        }
    }
    else
        pairs.updateGaps(number);
    bool touches = false;
    for (int i = 0; i < watch.count; i++) {
        PairContact& side = pairs.getContact(number, i);
        Contact& contact = side.contact;
        if (!side.rest.isKnown()) {
            double softness = stiffness*(mobilities[pair.a].least+mobilities[pair.b].least);
            if (softness < 1)
                softness = softnessOf(pair, contact);
            side.rest = ContactRest(softness, first ? max(contact.gap, -LARGEST_RETURN*diameter) : 0);
        }
        const bool late = iterations > RETURNING_ITERATIONS;
        if (side.rest.isInMiddle() && !late)
            side.rest.follow(pairs.getSegments(number, false), pairs.getSegments(number, true), contact);
        else if (!side.rest.isResolved() && !side.rest.isBack() && contact.gap < -wallDepth &&
                (!late || contact.crossed)) {
            const double softness = softnessOf(pair, contact);
            const SegmentPair begun = pairs.getSegments(number, false), now = pairs.getSegments(number, true);
            side.rest.look({begun, now, diameter, softness, late}, contact, wallDepth, LARGEST_RETURN*diameter);
        }
        // Where contacts are not looked for any more, anyCross() sees whether they have come back.
        if (contact.crossed && iterations < SEARCHING_ITERATIONS)
            part.pairs.push_back(number);
        gap = min(gap, contact.gap-restGapOf(side));
        if (addEquation(number, i, part)) {
            touches = true;
            part.contacts.push_back(2*number+i);
        }
    }
    watch.due = touches || gap <= 0 ? -HUGE_VAL : way+gap;
}

/** The gap below which a contact pushes that does not come back. */
double ContactEquations::restGapOf(const PairContact& contact) const {
    return contact.rest.isResolved() ? contact.rest.getGap() : -wallDepth;
}

/** Add the equation of a contact, if it touches. */
bool ContactEquations::addEquation(int number, int which, Part& part) {
    const ContactPair& pair = pairs.getPair(number);
    PairContact& side = pairs.getContact(number, which);
    const Contact& contact = side.contact;
    const double overlap = restGapOf(side)-contact.gap;
    const bool touched = side.touched;
    // Contacts that open and close in turn would keep the iteration from ending.
    side.touched = side.rest.isBack() || overlap > 0 || (iterations >= HOLDING_ITERATIONS && touched);
    if (!touched) {
        side.drift = -overlap;
        side.changeBefore = 0;
    }
    if (!side.touched)
        return false;
    CouplingEquation equation;
    equation.places[0] = places.get(pair.a, contact.s);
    equation.places[1] = places.get(pair.b, contact.t);
    const double own = contact.weight*stiffness;
    if (side.rest.isBack()) {
        const Vec3d now = pairs.getSegments(number, true).between(contact.s, contact.t);
        side.rest.findForce(now, own, equation.force, equation.stiffness);
    }
    else {
        const double* n = contact.normal;
        for (int k = 0; k < 3; k++)
            equation.force[k] = own*overlap*n[k];
        setOuter(own, n, equation.stiffness);
    }
    part.equations.push_back(equation);
    return true;
}

void ContactEquations::linearise(int iteration, const double* moved, vector<CouplingEquation>& all) {
    iterations = iteration;
    equations = &all;
    firstEquation = all.size();
    contactsOfEquations.clear();
    crossed.clear();
    const bool first = !motion.hasBegun();
    if (iteration == 0 && first)
        return;
    if (first)
        findPairs(moved);
    selection.select(pairs, packs, *active);
    const int runs = selection.getNumRuns(pairs, selection.hasAll());
    if ((int) parts.size() < runs)
        parts.resize(runs);
    (*loop)(runs, [&] (int run) {
        Part& part = parts[run];
        part.equations.clear();
        part.contacts.clear();
        part.pairs.clear();
        look(run, first, part);
    });
    for (int run = 0; run < runs; run++) {
        const Part& part = parts[run];
        crossed.insert(crossed.end(), part.pairs.begin(), part.pairs.end());
        all.insert(all.end(), part.equations.begin(), part.equations.end());
        contactsOfEquations.insert(contactsOfEquations.end(), part.contacts.begin(), part.contacts.end());
    }
}

void ContactEquations::findPushes(const double*, vector<Push>& pushes) const {
    for (int number = 0; number < pairs.getNumPairs(); number++) {
        if (!pairs.hasContacts(number))
            continue;
        const ContactPair& pair = pairs.getPair(number);
        for (int i = 0; i < pairs.getWatch(number).count; i++) {
            const PairContact& own = pairs.getContact(number, i);
            if (!own.touched)
                continue;
            const double s = own.contact.s, t = own.contact.t, stiff = own.contact.weight*stiffness;
            const Vec3d now = pairs.getSegments(number, true).between(s, t);
            double size = 1, force[3], projection[6];
            if (own.rest.isBack())
                own.rest.findForce(now, stiff, force, projection);
            else {
                const double* const n = own.contact.normal;
                size = stiff*(restGapOf(own)-(now.x*n[0]+now.y*n[1]+now.z*n[2]-pairs.radiiOf(pair)));
                copy_n(n, 3, force);
            }
            pushes.push_back(pushOfContact(search->getSystem(), pair.a, pair.b, s, t, size, force));
            pushes.back().chains[0] = places.get(pair.a).chain;
            pushes.back().chains[1] = places.get(pair.b).chain;
        }
    }
}
