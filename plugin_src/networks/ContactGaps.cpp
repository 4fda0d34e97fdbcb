#include "networks/ContactGaps.h"
#include "couplings/Crossings.h"
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>

using namespace cylchain;
using namespace std;

namespace {

/** Capsules that have travelled less, over the sum of the radii, touch where they did. */
const double SAME_TOUCH = 0.01;
/** The number of iterations in which places and normals move. */
const int MOVING_ITERATIONS = 3;
/** How often a gap is found again when all has converged, and from which thermal change of it on. */
const int MOST_TIMES_AGAIN = 4;
const double LARGEST_CHANGE = 1;
/** Capsules, or pairs of them, that a thread looks at together. */
const int CHUNK_OF_CONTACT_GAPS = 256;

Vec3d gradientOf(const Contact& contact) {
    return {contact.normal[0], contact.normal[1], contact.normal[2]};
}

} // namespace

/** The gap of a pair from its contacts; of one whose contact is that of a neighbor, it is not closed. */
ContactGaps::PairGap ContactGaps::findPairGap(const SegmentPair& pair, const Contact* contacts, int count,
        double radii) {
    PairGap result = {};
    double square = 0;
    for (int i = 0; i < count; i++)
        square += contacts[i].gap < 0 ? contacts[i].weight*contacts[i].gap*contacts[i].gap : 0;
    if (square > 0) {
        result.gap = -sqrt(square);
        for (int i = 0; i < count; i++)
            if (contacts[i].gap < 0) {
                result.s[result.count] = contacts[i].s;
                result.t[result.count] = contacts[i].t;
                const double share = contacts[i].weight*contacts[i].gap/result.gap;
                result.gradients[result.count++] = gradientOf(contacts[i])*share;
            }
        return result;
    }
    result.count = 1;
    if (count > 0) {
        const Contact& contact = count == 2 && contacts[1].gap < contacts[0].gap ? contacts[1] : contacts[0];
        result.gap = contact.gap;
        result.s[0] = contact.s;
        result.t[0] = contact.t;
        result.gradients[0] = gradientOf(contact);
        return result;
    }
    const NearestPoints nearest = findNearestPoints(pair);
    const Vec3d r = pair.between(nearest.s, nearest.t);
    const double distance = sqrt(nearest.squared);
    result.gap = max(distance-radii, 0.0);
    result.s[0] = nearest.s;
    result.t[0] = nearest.t;
    result.gradients[0] = distance > 0 ? r*(1/distance) : Vec3d {0, 0, 0};
    return result;
}

void ContactGaps::setContacts(const ContactSystem& contacts) {
    hard.setContacts(contacts);
    onCurves = contacts.onCurves;
    sites = contacts.sites;
    search = contacts.search;
    stiffness = contacts.stiffness;
    candidates.setSearch(search, stiffness, contacts.box);
    impulses = contacts.impulses;
}

void ContactGaps::placeSites(double* positions) const {
    for (const CurveSite& site : *sites)
        locate(site.place, positions, NULL, positions+3*site.particle);
}

double ContactGaps::findLargestSoftness(const CoupledStart& start) {
    double largest = 0;
    responses.begin(start.places, start.settings.stepSize);
    auto include = [&] (const Place& place) {
        PlaceOnChain found;
        if (start.places.find(place, found))
            largest = max(largest, responses.find(found));
    };
    for (const Capsule& capsule : search->getSystem().capsules) {
        Place place;
        place.first = capsule.first;
        include(place);
    }
    for (const CapsuleOnCurve& own : *onCurves)
        include(own.first);
    return 2*stiffness*largest;
}

void ContactGaps::begin(const CoupledStart& start, const Loop& newLoop) {
    loop = &newLoop;
    begun = start.positions;
    kT = start.settings.kT;
    responses.begin(start.places, start.settings.stepSize);
    const vector<Capsule>& capsules = search->getSystem().capsules;
    places.begin(start, capsules, *onCurves, newLoop);
    responsesOfCapsules.resize(capsules.size());
    runInChunks(*loop, capsules.size(), CHUNK_OF_CONTACT_GAPS, [&] (int i) {
        double& largest = responsesOfCapsules[i] = 0;
        for (double fraction : {0, 1})
            if (!places.isHeld(i))
                largest = max(largest, GAP_RESPONSE_MARGIN*responses.find(places.get(i, fraction)));
    });
    candidates.begin(start, places, responsesOfCapsules, newLoop);
    near.clear();
}

/**
 * Find where a contact is that has gone on from a pair to segments beside it.
 *
 * @param last      receives these
 * @param contacts  room for two: theirs, the deepest if there are several
 * @return the number of contacts
 */
int ContactGaps::findContactsBeside(const ContactPair& pair, ContactPair& last, Contact* contacts) const {
    int result = 0;
    double deepest = 0;
    for (int a : around(pair.a))
        for (int b : around(pair.b)) {
            if (a < 0 || b < 0 || search->isExcluded(a, b) || (a == pair.a && b == pair.b))
                continue;
            ContactPair beside = pair;
            beside.a = a;
            beside.b = b;
            beside.before = 0;
            Contact found[2], before[2];
            const int count = search->evaluate(beside, found, deepest);
            // What touched there at the start has a gap of its own.
            if (count <= 0 || search->evaluate(beside, begun, begun, before, 0) > 0)
                continue;
            result = count;
            copy_n(found, count, contacts);
            deepest = min(found[0].gap, found[count-1].gap);
            last = beside;
        }
    return result;
}

/** The pair that a lever of a gap holds apart. */
ContactPair ContactGaps::pairOfLever(const NearPair& own, int lever) const {
    ContactPair result = candidates.get(own.pair);
    if (lever >= own.start.count) {
        result.a = own.last[0];
        result.b = own.last[1];
    }
    return result;
}

/**
 * Find the gap of a pair where an iteration has led, or how far it has moved once iterations move it little.
 *
 * @param again  whether the gap is found in any case
 * @return whether it is found
 */
bool ContactGaps::follow(NearPair& own, bool again) const {
    const ContactPair& pair = candidates.get(own.pair);
    const double way = candidates.getWay(own.pair), radii = candidates.radiiOf(own.pair);
    const bool isNew = own.way < 0;
    const bool mayMove = own.number < 0 || iterations <= MOVING_ITERATIONS;
    if (!isNew && !again && !(mayMove && way-own.way > SAME_TOUCH*radii)) {
        if (own.number >= 0)
            own.gap.end = own.offset+findEnd(own);
        return false;
    }
    own.way = way;
    Contact contacts[2];
    if (isNew) {
        const int count = search->evaluate(pair, begun, begun, contacts);
        own.touchedAtStart = count > 0;
        own.start = findPairGap(search->getSegments(pair, false), contacts, count, radii);
        // What a neighbor touched here may be this pair's at the end: then it begins as deep as it does.
        if (count == 0 && own.start.gap == 0)
            own.start.gap = sqrt(findNearestPoints(search->getSegments(pair, false)).squared)-radii;
        own.gap.stiffness = stiffness;
        own.gap.response = responsesOfCapsules[pair.a]+responsesOfCapsules[pair.b];
        own.depth = candidates.placeHardSurface(own.pair, own.start.gap, own.gap);
    }
    int count = search->evaluate(pair, contacts);
    // What touches a neighbor at the start and at the end is no gap of this pair.
    own.gap.present = (count > 0 || own.touchedAtStart) && !(again && own.ofNeighbor);
    ContactPair last = pair;
    if (count == 0 && own.touchedAtStart)
        count = findContactsBeside(pair, last, contacts);
    own.last[0] = last.a;
    own.last[1] = last.b;
    PairGap end = findPairGap(search->getSegments(last, true), contacts, count, radii);
    own.gap.numLevers = 0;
    for (const PairGap* of : {&own.start, &end})
        for (int i = 0; i < of->count; i++) {
            GapLever& lever = own.gap.levers[own.gap.numLevers];
            const ContactPair& touching = of == &end ? last : pair;
            lever.places[0] = places.get(touching.a, of->s[i]);
            lever.places[1] = places.get(touching.b, of->t[i]);
            lever.gradient[0] = 0.5*of->gradients[i].x;
            lever.gradient[1] = 0.5*of->gradients[i].y;
            lever.gradient[2] = 0.5*of->gradients[i].z;
            own.fractions[own.gap.numLevers][0] = of->s[i];
            own.fractions[own.gap.numLevers++][1] = of->t[i];
        }
    own.gap.end = own.depth+end.gap;
    own.offset = own.gap.end-findEnd(own);
    return true;
}

/** Get whether a gap that is not one of those of the step yet is so likely to be closed that it becomes one. */
bool ContactGaps::mayClose(const Gap& gap) const {
    return gap.law != GapLaw::Reflection || !(gap.end > 0) || gap.start*gap.end < LARGEST_GAP_EXPONENT*kT*gap.response;
}

/** How far the places of the levers of a gap are apart along its gradients. */
double ContactGaps::findEnd(const NearPair& own) const {
    double sum = 0;
    for (int lever = 0; lever < own.gap.numLevers; lever++) {
        const SegmentPair end = search->getSegments(pairOfLever(own, lever), true);
        const Vec3d r = end.between(own.fractions[lever][0], own.fractions[lever][1]);
        const double* const g = own.gap.levers[lever].gradient;
        sum += r.x*g[0]+r.y*g[1]+r.z*g[2];
    }
    return sum;
}

/** A capsule and its neighbors, or -1. */
array<int, 3> ContactGaps::around(int capsule) const {
    return {capsule, search->getNeighbor(capsule, false), search->getNeighbor(capsule, true)};
}

/**
 * Whether the contact of a pair may become that of its neighbors: the spring of the surface holds it in, or it has gone
 * on. Hard surfaces of the neighbors must not keep it out in the same step.
 */
bool ContactGaps::mayGoOn(const NearPair& own) const {
    const ContactPair& pair = candidates.get(own.pair);
    const bool hasGoneOn = own.last[0] != pair.a || own.last[1] != pair.b;
    return own.touchedAtStart && (own.gap.law == GapLaw::Spring || hasGoneOn);
}

void ContactGaps::findGoing() {
    going.clear();
    for (size_t i = 0; i < near.size(); i++)
        if (goOn[i]) {
            const ContactPair& pair = candidates.get(near[i].pair);
            going.push_back({pair.a, pair.b});
            going.push_back({pair.b, pair.a});
        }
    sort(going.begin(), going.end());
}

/** Get whether the contact of a pair that had none may be that of a neighbor. */
bool ContactGaps::isOfNeighbor(const NearPair& own) const {
    if (own.touchedAtStart)
        return false;
    const ContactPair& pair = candidates.get(own.pair);
    for (int a : around(pair.a))
        for (int b : around(pair.b))
            if (binary_search(going.begin(), going.end(), make_pair(a, b)))
                return true;
    return false;
}

bool ContactGaps::findGaps(int iteration, bool settled, const double* moved, ReflectedGaps& gaps) {
    all = &gaps;
    iterations = iteration;
    if (!candidates.follow(settled, moved, gaps.getNoise()))
        return false;
    for (int pair : candidates.getNew()) {
        near.emplace_back();
        near.back().pair = pair;
    }
    areFound.assign(near.size(), 0);
    goOn.resize(near.size());
    runInChunks(*loop, near.size(), CHUNK_OF_CONTACT_GAPS, [&] (int i) {
        NearPair& own = near[i];
        if (own.way >= 0 && !candidates.hasMoved(own.pair))
            return;
        areFound[i] = follow(own);
        if (areFound[i])
            goOn[i] = mayGoOn(own);
        if (own.number < 0)
            return;
        if (areFound[i])
            gaps.turn(own.number, own.gap);
        else
            gaps.get(own.number).end = own.gap.end;
    });
    vector<NearPair*> found;
    for (size_t i = 0; i < near.size(); i++)
        if (areFound[i])
            found.push_back(&near[i]);
    if (!found.empty())
        findGoing();
    runInChunks(*loop, found.size(), CHUNK_OF_CONTACT_GAPS, [&] (int i) {
        found[i]->ofNeighbor = isOfNeighbor(*found[i]);
    });
    for (NearPair* own : found) {
        Gap& gap = own->gap;
        if (own->number >= 0 && own->ofNeighbor)
            gaps.get(own->number).present = gap.present = false;
        else if (own->number < 0 && gap.numLevers > 0 && gap.present && mayClose(gap) && !own->ofNeighbor)
            own->number = gaps.add(gap);
    }
    return candidates.mayLackPairs() && !settled;
}

bool ContactGaps::followAgain(ReflectedGaps& gaps) {
    const vector<int>& crossed = candidates.getCrossed();
    const double largest = LARGEST_CHANGE*sqrt(kT/stiffness);
    areFound.assign(near.size(), 0);
    runInChunks(*loop, near.size(), CHUNK_OF_CONTACT_GAPS, [&] (int i) {
        NearPair& own = near[i];
        if (own.number < 0 || own.timesAgain == MOST_TIMES_AGAIN)
            return;
        const bool hasCrossed = binary_search(crossed.begin(), crossed.end(), own.pair);
        // Neither the gap nor what its places make of it has changed by more than this way.
        if (!hasCrossed && !(2*(candidates.getWay(own.pair)-own.way) > largest))
            return;
        NearPair again = own;
        again.timesAgain++;
        follow(again, true);
        const bool isOther = again.gap.present != own.gap.present || fabs(again.gap.end-own.gap.end) > largest;
        areFound[i] = hasCrossed || (isOther && min(again.gap.end, own.gap.end) < 0);
        if (!areFound[i])
            return;
        own = again;
        goOn[i] = mayGoOn(own);
        gaps.turn(own.number, own.gap);
    });
    return find(areFound.begin(), areFound.end(), 1) != areFound.end();
}

void ContactGaps::findFailures(const double*, vector<bool>& failed) {
    if (candidates.movesTooFar())
        places.failAll(failed);
    for (int pair : candidates.getCrossed())
        places.fail(candidates.get(pair), failed);
}

bool ContactGaps::findCulprit(const double* moved, const CouplingEquation*, BrokenCoupling& culprit) const {
    const bool known = candidates.findCulprit(moved, culprit);
    if (known || candidates.movesTooFar())
        return known;
    for (const NearPair& own : near)
        if (own.number >= 0 && all->isUnfinished(own.number)) {
            places.name(candidates.get(own.pair), culprit);
            return true;
        }
    return false;
}

void ContactGaps::findNeighbours(vector<pair<int, int> >& neighbours) const {
    for (const NearPair& own : near)
        places.addNeighbours(candidates.get(own.pair), neighbours);
}

void ContactGaps::findPushes(const double*, vector<Push>& pushes) const {
    for (const NearPair& own : near) {
        const double force = own.number < 0 ? 0 : all->getForce(own.number);
        if (force == 0)
            continue;
        for (int lever = 0; lever < own.gap.numLevers; lever++) {
            const ContactPair pair = pairOfLever(own, lever);
            pushes.push_back(pushOfContact(search->getSystem(), pair.a, pair.b, own.fractions[lever][0],
                    own.fractions[lever][1], force, own.gap.levers[lever].gradient));
            pushes.back().chains[0] = places.get(pair.a).chain;
            pushes.back().chains[1] = places.get(pair.b).chain;
        }
    }
}
