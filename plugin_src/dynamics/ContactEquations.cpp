#include "dynamics/ContactEquations.h"
#include "dynamics/RestGap.h"
#include "dynamics/SymmetricMatrices.h"
#include "mechanics/Prefetch.h"
#include <algorithm>
#include <cmath>
#include <cstddef>

using namespace cylchain;
using namespace std;

namespace {

/** How near pairs come that are looked at in a step, over their diameter: further iterations move them. */
const double REACH = 0.5;
/** The same where a periodic box is too narrow for that. */
const double LEAST_REACH = 0.2;
/** The largest predicted overlap, and the largest gap that two come back to, over the same. */
const double LARGEST_RETURN = 1;
/** Where pairs with a larger gap are nearest is not looked for, over the same. */
const double LARGEST_GAP = 0.3;
/** Capsules that have travelled less touch where they did, over the same. */
const double SAME_PLACE = 0.01;
/** The largest change of a gap in the last iteration, over the thermal fluctuation of a contact. */
const double TOLERANCE = 0.3;
/** The same for the change of a gap that one of the two does not know of. */
const double DRIFT_TOLERANCE = 0.1;
/** After so many iterations, this times as much is enough: one contact in thousands must not keep others waiting. */
const int PATIENT_ITERATIONS = 11;
const double LATE = 4;
/** What counts as no change of a gap, over how near pairs come. */
const double LEAST_CHANGE = 3e-3;
/** The number of iterations that look where capsules touch. */
const int SEARCHING_ITERATIONS = 6;
/**
 * Up to this iteration, contacts that would be behind their surface come back. The first of them knows where the step
 * leads without contacts, the second one what others that come back change of it. With one alone, bends of a dense
 * bundle have 2 % too much energy in equilibrium, with three, 2 % too little.
 */
const int RETURNING_ITERATIONS = 2;
/** The number of iterations in which a contact may pass to a neighbour. */
const int PASSING_ITERATIONS = 3;
/** From this iteration on, contacts that touch go on to do so, even if that takes a small force which pulls. */
const int HOLDING_ITERATIONS = 9;
/** Contacts of a pair are the same if their fractions differ by less, in all. */
const double SAME_FRACTIONS = 0.3;
/** Pairs or capsules that a thread looks at together. */
const int CHUNK = 128;

} // namespace

void ContactEquations::setContacts(ContactSearch* newSearch, double newStiffness, const double* newBox) {
    search = newSearch;
    stiffness = newStiffness;
    box = newBox;
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
    places.resize(capsules.size());
    packs.resize(capsules.size());
    double diameter = 0;
    for (const Capsule& capsule : capsules)
        diameter = max(diameter, 2*capsule.radius);
    runInChunks(*loop, capsules.size(), CHUNK, [&] (int i) {
        const Capsule& capsule = capsules[i];
        Place place;
        place.first = capsule.first;
        place.second = capsule.second;
        PlaceOnChain& found = places[i].place;
        places[i].direction = 0;
        if (start.places.find(place, found) && start.taken[found.chain])
            places[i].direction = capsule.second < 0 ? 0 : found.fraction == 0 ? 1 : -1;
        else
            found = PlaceOnChain();
        packs[i] = found.pack;
    });
    reaches[0] = REACH*diameter;
    reaches[1] = LEAST_REACH*diameter;
    leavesBox = false;
    pairs.clear();
    states.clear();
    watches.clear();
    searched.clear();
}

void ContactEquations::beginStage(int, int, const double*) {
    iterations = 0;
}

PlaceOnChain ContactEquations::placeOf(int capsule, double fraction) const {
    PlaceOnChain place = places[capsule].place;
    place.fraction += places[capsule].direction*fraction;
    return place;
}

void ContactEquations::takeNoteOf(int capsule, const double* moved) {
    const Capsule& own = search->getSystem().capsules[capsule];
    copy_n(moved+3*own.first, 3, &searched[6*capsule]);
    copy_n(moved+3*own.end(), 3, &searched[6*capsule+3]);
}

void ContactEquations::findPairs(const double* moved) {
    leavesBox = true;
    for (int i = 0; i < 2 && leavesBox; i++)
        try {
            reach = reaches[i];
            search->findPairs(begun, moved, box, reach, pairs, *loop);
            leavesBox = false;
        }
        catch (const NarrowBoxError&) {
            pairs.clear();
        }
    searched.resize(6*places.size());
    before.resize(6*places.size());
    runInChunks(*loop, places.size(), CHUNK, [&] (int i) {
        takeNoteOf(i, moved);
        copy_n(&searched[6*i], 6, &before[6*i]);
    });
    travelled.assign(places.size(), 0.0);
    motion.assign(places.size(), 0.0);
    firstPairs.assign(places.size()+1, 0);
    for (const ContactPair& pair : pairs) {
        firstPairs[pair.a+1]++;
        addState(pair);
    }
    for (size_t i = 1; i < firstPairs.size(); i++)
        firstPairs[i] += firstPairs[i-1];
    added.assign(places.size(), {});
}

void ContactEquations::addState(const ContactPair& pair) {
    states.push_back({pair, {}});
    watches.push_back({pair.a, pair.b, -HUGE_VAL, 0, -1, pair.clearance});
}

/** Whether a pair takes part already. */
bool ContactEquations::isKnown(const ContactPair& pair) const {
    const auto first = watches.begin()+firstPairs[pair.a], last = watches.begin()+firstPairs[pair.a+1];
    const auto found = lower_bound(first, last, pair.b, [] (const Watch& one, int other) {return one.b < other;});
    const vector<int>& others = added[pair.a];
    return (found != last && found->b == pair.b) || find(others.begin(), others.end(), pair.b) != others.end();
}

/** Look for pairs of some capsules again; false if all that are found take part already. */
bool ContactEquations::findPairsOf(const vector<int>& capsules, const double* moved) {
    try {
        search->findPairsOf(capsules, begun, moved, pairs, *loop);
    }
    catch (const NarrowBoxError&) {
        leavesBox = true;
        return false;
    }
    for (int capsule : capsules) {
        takeNoteOf(capsule, moved);
        motion[capsule] = 0;
    }
    bool any = false;
    for (const ContactPair& pair : pairs)
        if (!isKnown(pair)) {
            added[pair.a].push_back(pair.b);
            addState(pair);
            mark(states.size()-1);
            any = true;
        }
    return any;
}

/** Mark the packs of the pairs that a function finds in each chunk of them; false if there are none. */
template <class Function> bool ContactEquations::markPairs(Function findIn) {
    const int count = states.size(), chunks = (count+CHUNK-1)/CHUNK;
    (*loop)(chunks, [&] (int chunk) {
        parts[chunk].pairs.clear();
        findIn(chunk*CHUNK, min(count, (chunk+1)*CHUNK), parts[chunk]);
    });
    bool any = false;
    for (int chunk = 0; chunk < chunks; chunk++)
        for (int pair : parts[chunk].pairs) {
            mark(pair);
            any = true;
        }
    return any;
}

void ContactEquations::updateGaps(State& state, int count) const {
    const vector<Capsule>& capsules = search->getSystem().capsules;
    const double radii = capsules[state.pair.a].radius+capsules[state.pair.b].radius;
    for (int i = 0; i < count; i++) {
        Contact& contact = state.sides[i].contact;
        double r[3];
        search->findVector(state.pair, contact.s, contact.t, true, r);
        const double* n = contact.normal;
        contact.gap = r[0]*n[0]+r[1]*n[1]+r[2]*n[2]-radii;
    }
}

void ContactEquations::findCourse(const ContactPair& pair, const Contact& contact, ContactCourse& course) const {
    const Capsule &a = search->getSystem().capsules[pair.a], &b = search->getSystem().capsules[pair.b];
    search->findVector(pair, contact.s, contact.t, false, course.begun);
    search->findVector(pair, contact.s, contact.t, true, course.now);
    double ends[3][3];
    search->findVector(pair, 0, 0, false, ends[0]);
    search->findVector(pair, 1, 0, false, ends[1]);
    search->findVector(pair, 0, 1, false, ends[2]);
    for (int k = 0; k < 3; k++) {
        course.along[0][k] = ends[1][k]-ends[0][k];
        course.along[1][k] = ends[0][k]-ends[2][k];
    }
    course.normal = contact.normal;
    course.radii = a.radius+b.radius;
}

/**
 * Take the contacts of a pair that were found, instead of those that do not come back.
 *
 * @param known  the number of contacts that it had
 * @return the number that it has now
 */
int ContactEquations::placeContacts(State& state, int known, const Contact* found, int count) const {
    int kept = 0;
    for (int i = 0; i < known; i++)
        if (state.sides[i].rest.isBack())
            swap(state.sides[kept++], state.sides[i]);
    int total = kept;
    for (int i = 0; i < count; i++) {
        const Side* same = find_if(state.sides, state.sides+kept, [&] (const Side& side) {
            return fabs(side.contact.s-found[i].s)+fabs(side.contact.t-found[i].t) < SAME_FRACTIONS;
        });
        if (same != state.sides+kept || total == 2)
            continue;
        Side& side = state.sides[total++];
        side.contact = found[i];
        if (side.rest.isBack())
            side.rest = ContactRest();
    }
    return total;
}

/** How far a unit force across a capsule moves a place on it in the step. */
double ContactEquations::responseOf(int capsule, double fraction) const {
    const PlaceOnChain place = placeOf(capsule, fraction);
    return place.pack < 0 ? 0 : responses.find(place);
}

/** Whether it is looked for where a pair touches: not where that was known a moment ago. */
bool ContactEquations::isLookedFor(int number) const {
    const Watch& watch = watches[number];
    if (!takesPart(watch.a) && !takesPart(watch.b))
        return false;
    const double way = travelled[watch.a]+travelled[watch.b];
    return watch.count < 0 || (iterations < SEARCHING_ITERATIONS && !(way < watch.samePlace));
}

/** Evaluate some pairs that may touch. */
void ContactEquations::look(int begin, int end, bool first, Part& part) {
    part.due.clear();
    part.numbers.clear();
    for (int i = begin; i < end; i++)
        if (!(travelled[watches[i].a]+travelled[watches[i].b] < watches[i].due)) {
            const bool isDue = isLookedFor(i);
            prefetch(&states[i].pair);
            prefetch(&states[i].sides[0]);
            search->prefetchMotion(watches[i].a, watches[i].b);
            part.numbers.push_back(isDue ? i : -1-i);
            if (isDue)
                part.due.push_back(&states[i].pair);
        }
    part.outlooks.resize(part.due.size());
    search->findOutlooks(part.due.data(), part.due.size(), part.outlooks.data());
    const PairOutlook* next = part.outlooks.data();
    for (int number : part.numbers)
        if (number >= 0)
            evaluate(number, first, next++, part);
        else
            evaluate(-1-number, first, NULL, part);
}

/** Add the equations of a pair, with the outlook of one that is looked for. */
void ContactEquations::evaluate(int number, bool first, const PairOutlook* outlook, Part& part) {
    State& state = states[number];
    Watch& watch = watches[number];
    const ContactPair& pair = state.pair;
    if (!takesPart(pair.a) && !takesPart(pair.b))
        return;
    const double diameter = search->getSystem().capsules[pair.a].radius+search->getSystem().capsules[pair.b].radius;
    const double way = travelled[pair.a]+travelled[pair.b];
    double gap = HUGE_VAL;
    // What is farther away is left out, until it may have come near. Gaps of contacts that the step resolves count.
    const double largest = max({0.0, state.sides[0].rest.getGap(), state.sides[1].rest.getGap()});
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
            updateGaps(state, watch.count);
        else {
            const int placed = placeContacts(state, watch.count, contacts, count);
            watch.count = placed > 0 ? placed : count;
            watch.samePlace = way+SAME_PLACE*diameter;
            gap = contacts[0].gap-largest;
        }
    }
    else
        updateGaps(state, watch.count);
    bool touches = false;
    for (int i = 0; i < watch.count; i++) {
        Side& side = state.sides[i];
        const Contact& contact = side.contact;
        if (!side.rest.isKnown()) {
            const double c = responseOf(pair.a, contact.s)+responseOf(pair.b, contact.t);
            side.rest = ContactRest(stiffness*c, first ? max(contact.gap, -LARGEST_RETURN*diameter) : 0);
        }
        if (iterations <= RETURNING_ITERATIONS && !side.rest.isResolved() && !side.rest.isBack() && contact.gap < 0) {
            ContactCourse course;
            findCourse(pair, contact, course);
            side.rest.look(course, contact.gap, wallDepth, LARGEST_RETURN*diameter);
        }
        // Where contacts are not looked for any more, anyCross() sees whether they have come back.
        if (contact.crossed && iterations < SEARCHING_ITERATIONS)
            part.pairs.push_back(number);
        gap = min(gap, contact.gap-restGapOf(side));
        if (addEquation(state, i, part)) {
            touches = true;
            part.contacts.push_back(2*number+i);
        }
    }
    watch.due = touches || gap <= 0 ? -HUGE_VAL : way+gap;
}

/** The gap below which a contact pushes that does not come back. */
double ContactEquations::restGapOf(const Side& side) const {
    return side.rest.isResolved() ? side.rest.getGap() : -wallDepth;
}

/** Add the equation of a contact, if it touches. */
bool ContactEquations::addEquation(State& state, int number, Part& part) const {
    Side& side = state.sides[number];
    const Contact& contact = side.contact;
    const double overlap = restGapOf(side)-contact.gap;
    const bool touched = side.touched;
    // Contacts that open and close in turn would keep the iteration from ending.
    side.touched = side.rest.isBack() || overlap > 0 || (iterations >= HOLDING_ITERATIONS && touched);
    if (!touched)
        side.drift = -overlap;
    if (!side.touched)
        return false;
    CouplingEquation equation;
    equation.places[0] = placeOf(state.pair.a, contact.s);
    equation.places[1] = placeOf(state.pair.b, contact.t);
    const double own = contact.weight*stiffness;
    if (side.rest.isBack()) {
        double now[3];
        search->findVector(state.pair, contact.s, contact.t, true, now);
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
    if (iteration == 0 && searched.empty())
        return;
    const bool first = searched.empty();
    if (first)
        findPairs(moved);
    search->setMotion(begun, moved, *loop);
    const int count = states.size(), chunks = (count+CHUNK-1)/CHUNK;
    if ((int) parts.size() < chunks)
        parts.resize(chunks);
    (*loop)(chunks, [&] (int chunk) {
        Part& part = parts[chunk];
        part.equations.clear();
        part.contacts.clear();
        part.pairs.clear();
        look(chunk*CHUNK, min(count, (chunk+1)*CHUNK), first, part);
    });
    for (int chunk = 0; chunk < chunks; chunk++) {
        const Part& part = parts[chunk];
        crossed.insert(crossed.end(), part.pairs.begin(), part.pairs.end());
        all.insert(all.end(), part.equations.begin(), part.equations.end());
        contactsOfEquations.insert(contactsOfEquations.end(), part.contacts.begin(), part.contacts.end());
    }
}

/** Find how far some capsules have moved. */
void ContactEquations::follow(int first, int last, const double* moved, Motion& result) {
    const vector<Capsule>& capsules = search->getSystem().capsules;
    result = Motion();
    for (int i = first; i < last; i++) {
        if (!takesPart(i)) {
            result.include(motion[i]);
            continue;
        }
        double square = 0, last = 0;
        for (int end = 0; end < 2; end++) {
            const double* now = moved+3*(end == 0 ? capsules[i].first : capsules[i].end());
            const double* then = &searched[6*i+3*end];
            double* const lately = &before[6*i+3*end];
            double own = 0, late = 0;
            for (int k = 0; k < 3; k++) {
                own += (now[k]-then[k])*(now[k]-then[k]);
                late += (now[k]-lately[k])*(now[k]-lately[k]);
                lately[k] = now[k];
            }
            square = max(square, own);
            last = max(last, late);
        }
        motion[i] = sqrt(square);
        travelled[i] += sqrt(last);
        result.include(motion[i]);
        if (2*motion[i] > reach)
            result.movers.push_back(i);
    }
}

/** Whether pairs that were left out may touch, or new ones: they take part from now on. */
bool ContactEquations::anyComeNear(const double* moved) {
    const int count = places.size(), chunks = (count+CHUNK-1)/CHUNK;
    motions.resize(chunks);
    parts.resize(max(parts.size(), (states.size()+CHUNK-1)/CHUNK));
    (*loop)(chunks, [&] (int chunk) {
        follow(chunk*CHUNK, min(count, (chunk+1)*CHUNK), moved, motions[chunk]);
    });
    if (iterations < 2)
        return true;
    const double tolerance = TOLERANCE*sqrt(kT/stiffness)+LEAST_CHANGE*reach;
    bool any = markPairs([&] (int begin, int end, Part& part) {
        for (int i = begin; i < end; i++)
            if (watches[i].due > 0 && travelled[watches[i].a]+travelled[watches[i].b] > watches[i].due+tolerance)
                part.pairs.push_back(i);
    });
    Motion all;
    for (const Motion& motion : motions) {
        all.include(motion.largest);
        all.include(motion.second);
        all.movers.insert(all.movers.end(), motion.movers.begin(), motion.movers.end());
    }
    // Pairs that no search has seen were out of reach: one of the two has moved by more than half of it.
    if (all.largest+all.second > reach)
        any |= findPairsOf(all.movers, moved);
    return any;
}

/** Whether a contact has moved too much in the last iteration, or by itself since one of its packs took part. */
bool ContactEquations::isUnfinished(int number, const double* move) {
    const int contact = contactsOfEquations[number];
    const CouplingEquation& equation = (*equations)[firstEquation+number];
    Side& side = states[contact/2].sides[contact%2];
    // The squared change of the gap, times the stiffness.
    double pull[3];
    multiply(equation.stiffness, move, pull);
    double change = pull[0]*move[0]+pull[1]*move[1]+pull[2]*move[2];
    if (side.rest.isBack())
        change /= ContactRest::STIFFENING;
    const double least = LEAST_CHANGE*LEAST_CHANGE*reach*reach*stiffness;
    const double tolerance = TOLERANCE*(iterations < PATIENT_ITERATIONS ? 1 : LATE);
    if (!(change < tolerance*tolerance*kT+least))
        return true;
    double& drift = side.drift;
    const double* n = side.contact.normal;
    drift += n[0]*move[0]+n[1]*move[1]+n[2]*move[2];
    const int a = equation.places[0].pack, b = equation.places[1].pack;
    if (a < 0 || b < 0 || (*active)[a] == (*active)[b])
        drift = 0;
    return !(drift*drift*stiffness < DRIFT_TOLERANCE*DRIFT_TOLERANCE*kT+least);
}

bool ContactEquations::finishIteration(const double* moves, const double* moved) {
    clear = false;
    unsettled = -1;
    unfinished.assign(active->size(), 0);
    if (leavesBox)
        return false;
    if (searched.empty())
        return true;
    bool any = anyComeNear(moved);
    if (leavesBox)
        return false;
    if (iterations < 2)
        return true;
    for (int pair : crossed)
        mark(pair);
    any |= !crossed.empty();
    for (size_t i = 0; i < contactsOfEquations.size(); i++)
        if (isUnfinished(i, moves+3*i)) {
            mark(contactsOfEquations[i]/2);
            if (unsettled < 0)
                unsettled = i;
            any = true;
        }
    if (any)
        return true;
    clear = !anyCross(moved);
    return !clear;
}

bool ContactEquations::markUnfinished(PackFlags& packs) const {
    for (size_t pack = 0; pack < packs.size(); pack++)
        packs[pack] |= unfinished[pack];
    return iterations >= 2;
}

/** The packs of a pair take part in the next iteration. */
void ContactEquations::mark(int pair) {
    for (int capsule : {watches[pair].a, watches[pair].b})
        if (places[capsule].place.pack >= 0)
            unfinished[places[capsule].place.pack] = 1;
}

/** Find pairs that cross. */
void ContactEquations::findCrossed(int begin, int end, const double* moved, Part& part) const {
    part.due.clear();
    part.numbers.clear();
    for (int i = begin; i < end; i++)
        if (!(travelled[watches[i].a]+travelled[watches[i].b] < watches[i].clearance)) {
            part.numbers.push_back(i);
            part.due.push_back(&states[i].pair);
        }
    part.outlooks.resize(part.due.size());
    search->findOutlooks(part.due.data(), part.due.size(), part.outlooks.data());
    for (size_t i = 0; i < part.due.size(); i++)
        if (part.outlooks[i].mayCross && search->crosses(*part.due[i], begun, moved))
            part.pairs.push_back(part.numbers[i]);
}

/** Whether pairs cross elsewhere than where they were last seen to touch: they are looked at again. */
bool ContactEquations::anyCross(const double* moved) {
    search->setMotion(begun, moved, *loop);
    return markPairs([&] (int begin, int end, Part& part) {
        findCrossed(begin, end, moved, part);
        for (int pair : part.pairs) {
            watches[pair].count = -1;
            watches[pair].due = -HUGE_VAL;
        }
    });
}

void ContactEquations::findFailures(const double* moved, vector<bool>& failed) const {
    if (clear)
        return;
    for (size_t i = 0; leavesBox && i < places.size(); i++)
        if (places[i].place.pack >= 0)
            failed[places[i].place.chain] = true;
    for (const State& state : states)
        if (search->crosses(state.pair, begun, moved))
            for (int capsule : {state.pair.a, state.pair.b})
                if (places[capsule].place.pack >= 0)
                    failed[places[capsule].place.chain] = true;
}

/** The capsule whose first particle has moved most. */
int ContactEquations::findFastest(const double* moved) const {
    const vector<Capsule>& capsules = search->getSystem().capsules;
    auto motionOf = [&] (const Capsule& capsule) {
        double square = 0;
        for (int k = 3*capsule.first; k < 3*capsule.first+3; k++)
            square += (moved[k]-begun[k])*(moved[k]-begun[k]);
        return square;
    };
    return max_element(capsules.begin(), capsules.end(), [&] (const Capsule& one, const Capsule& other) {
        return motionOf(one) < motionOf(other);
    })-capsules.begin();
}

bool ContactEquations::findCulprit(const double* moved, const CouplingEquation* equations,
        BrokenCoupling& culprit) const {
    if (leavesBox) {
        culprit.kind = BrokenCoupling::Contact;
        culprit.reason = BrokenCoupling::LeavesBox;
        culprit.places[0] = describePlace(places[findFastest(moved)].place);
        return true;
    }
    for (const State& state : states)
        if (search->crosses(state.pair, begun, moved)) {
            culprit.kind = BrokenCoupling::Contact;
            culprit.reason = BrokenCoupling::Crosses;
            culprit.places[0] = describePlace(places[state.pair.a].place);
            culprit.places[1] = describePlace(places[state.pair.b].place);
            return true;
        }
    if (unsettled < 0)
        return false;
    culprit.kind = BrokenCoupling::Contact;
    for (int side = 0; side < 2; side++)
        culprit.places[side] = describePlace(equations[unsettled].places[side]);
    return true;
}

void ContactEquations::findNeighbours(vector<pair<int, int> >& neighbours) const {
    for (const State& state : states) {
        const PlaceOnChain &a = places[state.pair.a].place, &b = places[state.pair.b].place;
        if (a.pack >= 0 && b.pack >= 0)
            neighbours.push_back(make_pair(a.chain, b.chain));
    }
}
