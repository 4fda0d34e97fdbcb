#include "networks/ContactGaps.h"
#include "couplings/Crossings.h"
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>

using namespace cylchain;
using namespace std;

namespace {

/** How much farther than needed pairs are looked for, over the diameter: further iterations move them. */
const double SLACK = 0.25;
/** Parts of all this that pairs are looked for in where a periodic box is too narrow for more. */
const double NARROWER[] = {1, 0.6, 0.35, 0.2};
/** Capsules that have travelled less, over the sum of the radii, touch where they did. */
const double SAME_TOUCH = 0.01;
/** The number of iterations in which places and normals move. */
const int MOVING_ITERATIONS = 3;
/** How often a gap is found again when all has converged, and from which thermal change of it on. */
const int MOST_TIMES_AGAIN = 4;
const double LARGEST_CHANGE = 1;
/** The largest depth of a hard surface, over the sum of the radii: it is before the axes. */
const double LARGEST_DEPTH = 0.95;
/** Capsules or pairs that a thread looks at together. */
const int CHUNK_OF_CAPSULES = 256;

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
    box = contacts.box;
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
    places.resize(capsules.size());
    auto note = [&] (int i, double direction) {
        CapsulePlace& own = places[i];
        own.direction = direction;
        own.response = 0;
        for (double fraction : {0, 1})
            if (own.place.pack >= 0)
                own.response = max(own.response, GAP_RESPONSE_MARGIN*responses.find(placeOf(i, fraction)));
    };
    runInChunks(*loop, capsules.size(), CHUNK_OF_CAPSULES, [&] (int i) {
        const Capsule& capsule = capsules[i];
        Place place;
        place.first = capsule.first;
        place.second = capsule.second;
        PlaceOnChain& found = places[i].place;
        double direction = 0;
        if (start.places.find(place, found) && start.taken[found.chain])
            direction = capsule.second < 0 ? 0 : found.fraction == 0 ? 1 : -1;
        else
            found = PlaceOnChain();
        note(i, direction);
    });
    for (const CapsuleOnCurve& own : *onCurves) {
        PlaceOnChain& found = places[own.capsule].place;
        double direction = 0;
        if (start.places.find(own.first, found) && start.taken[found.chain]) {
            found.hold.pieces = own.pieces;
            direction = (own.forwards ? 1.0 : -1.0)/own.pieces;
        }
        else
            found = PlaceOnChain();
        note(own.capsule, direction);
    }
    double diameter = 0, response = 0;
    for (size_t i = 0; i < capsules.size(); i++) {
        diameter = max(diameter, 2*capsules[i].radius);
        response = max(response, 2*places[i].response);
    }
    reach = sqrt(LARGEST_GAP_EXPONENT*kT*response);
    slack = SLACK*diameter;
    movesTooFar = isEndless = false;
    pairs.clear();
    rooms.clear();
    surfaces.clear();
    near.clear();
    motion.clear();
}

PlaceOnChain ContactGaps::placeOf(int capsule, double fraction) const {
    PlaceOnChain place = places[capsule].place;
    place.fraction += places[capsule].direction*fraction;
    return place;
}

/** Look for pairs of all capsules that are not known, as far as the periodic box is wide enough. */
void ContactGaps::findPairs(const double* moved, const PairFilter& known) {
    movesTooFar = true;
    for (double part : NARROWER)
        try {
            search->findPairs(begun, moved, box, part*(reach+slack), found, *loop, known);
            movesTooFar = false;
            return;
        }
        catch (const NarrowBoxError&) {
            found.clear();
        }
        catch (const EndlessMotionError&) {
            found.clear();
            isEndless = true;
            return;
        }
}

/** Look for pairs of capsules that have moved far, which no search has seen. */
void ContactGaps::findNewPairs(const double* moved) {
    const PairFilter known = [&] (int a, int b) {
        return pairs.isKnown(a, b);
    };
    try {
        search->findPairsOf(motion.getMovers(), begun, moved, found, *loop, known);
    }
    catch (const NarrowBoxError&) {
        findPairs(moved, known);
    }
    catch (const EndlessMotionError&) {
        movesTooFar = isEndless = true;
    }
    motion.beginAgain(motion.getMovers(), moved);
    for (const ContactPair& pair : found)
        pairs.add(pair);
}

/**
 * Get whether the gap of a pair may be closed that begins and ends so; if not, how far its capsules may travel until it
 * may.
 */
bool ContactGaps::mayClose(int number, double before, double after, double& room) const {
    const ContactPair& pair = pairs.get(number);
    const double least = LARGEST_GAP_EXPONENT*kT*(places[pair.a].response+places[pair.b].response);
    auto isFar = [&] (double depth) {
        const double start = before+depth;
        room = after+depth-least/start;
        return start > 0 && room > 0;
    };
    if (isFar(0))
        return false;
    Gap gap;
    gap.stiffness = stiffness;
    const double depth = placeHardSurface(number, before, gap);
    return gap.law != GapLaw::Reflection || !isFar(depth);
}

double ContactGaps::placeHardSurface(int number, double begun, Gap& gap) const {
    const double deepest = LARGEST_DEPTH*radiiOf(pairs.get(number));
    return cylchain::placeHardSurface(kT, all->getNoise().getLimit(), surfaces[number], deepest, begun, gap);
}

/** Pairs that are looked at together, in memory of a thread. */
struct ContactGaps::Looks {
    vector<const ContactPair*> pairs;
    vector<int> numbers;
    vector<PairOutlook> outlooks;
    static Looks& ofThread() {
        static thread_local Looks memory;
        memory.pairs.clear();
        memory.numbers.clear();
        return memory;
    }
    void add(int number, const ContactPair& pair) {
        pairs.push_back(&pair);
        numbers.push_back(number);
    }
    void look(const ContactSearch& search) {
        outlooks.resize(pairs.size());
        search.findOutlooks(pairs.data(), pairs.size(), outlooks.data());
    }
};

/** Draw what the hard surfaces of some pairs are found with. */
void ContactGaps::drawSurfaces(int first, int last) {
    if (first >= last)
        return;
    static thread_local vector<uint32_t> keys, others;
    keys.clear();
    others.clear();
    for (int i = first; i < last; i++) {
        keys.push_back(keyOf(pairs.get(i)));
        others.push_back(pairs.get(i).b);
    }
    all->getNoise().drawSurfaces(keys.data(), others.data(), last-first, &surfaces[first]);
}

/** Find the pairs from a number on, or those that have travelled far enough, whose gaps may be closed. */
void ContactGaps::selectNear(int firstNew) {
    const int count = pairs.size(), chunks = (count+CHUNK_OF_CAPSULES-1)/CHUNK_OF_CAPSULES;
    rooms.resize(count, 0.0);
    surfaces.resize(count);
    parts.resize(max(parts.size(), (size_t) chunks));
    (*loop)(chunks, [&] (int chunk) {
        Looks& looks = Looks::ofThread();
        const int first = chunk*CHUNK_OF_CAPSULES, last = min(count, first+CHUNK_OF_CAPSULES);
        drawSurfaces(max(first, firstNew), last);
        for (int i = first; i < last; i++) {
            const ContactPair& pair = pairs.get(i);
            const double way = motion.getWay(pair.a, pair.b), radii = radiiOf(pair);
            double room;
            if (rooms[i] < 0 || (i < firstNew && way < rooms[i]))
                continue;
            if (isHeld(pair))
                rooms[i] = HUGE_VAL;
            else if (i >= firstNew && pair.clearance > 0 && !mayClose(i, pair.before-radii, pair.distance-radii, room))
                rooms[i] = way+min(room, (double) pair.clearance);
            else
                looks.add(i, pair);
        }
        looks.look(*search);
        vector<int>& own = parts[chunk].pairs;
        own.clear();
        for (size_t k = 0; k < looks.pairs.size(); k++) {
            const ContactPair& pair = *looks.pairs[k];
            const PairOutlook& outlook = looks.outlooks[k];
            double before = pair.before-outlook.radii, room;
            // The surface of what overlaps is as deep as it does: that must be exact, as the end is.
            if (before < 0)
                before = sqrt(findNearestPoints(search->getSegments(pair, false)).squared)-outlook.radii;
            if (mayClose(looks.numbers[k], before, outlook.gap, room) ||
                    (outlook.mayCross && search->crosses(pair)))
                own.push_back(looks.numbers[k]);
            else
                rooms[looks.numbers[k]] = motion.getWay(pair.a, pair.b)+room;
        }
    });
    for (int chunk = 0; chunk < chunks; chunk++)
        for (int i : parts[chunk].pairs) {
            rooms[i] = -1;
            near.emplace_back();
            near.back().pair = i;
        }
}

/**
 * Find where a contact is that has gone on from a pair to segments beside it.
 *
 * @param last      receives these
 * @param contacts  room for two: theirs, the deepest if there are several
 * @return the number of contacts
 */
int ContactGaps::findContactsBeside(const ContactPair& pair, ContactPair& last, Contact* contacts) const {
    auto around = [&] (int capsule) {
        return array<int, 3> {capsule, search->getNeighbor(capsule, false), search->getNeighbor(capsule, true)};
    };
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
    ContactPair result = pairs.get(own.pair);
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
 */
void ContactGaps::follow(NearPair& own, bool again) const {
    const ContactPair& pair = pairs.get(own.pair);
    const double way = motion.getWay(pair.a, pair.b), radii = radiiOf(pair);
    const bool isNew = own.way < 0;
    const bool mayMove = own.number < 0 || iterations <= MOVING_ITERATIONS;
    own.hasMoved = isNew || again || (mayMove && way-own.way > SAME_TOUCH*radii);
    if (!own.hasMoved) {
        if (own.number >= 0)
            own.gap.end = own.offset+findEnd(own);
        return;
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
        own.gap.key[0] = keyOf(pair);
        own.gap.key[1] = pair.b;
        own.gap.stiffness = stiffness;
        own.gap.response = places[pair.a].response+places[pair.b].response;
        own.depth = placeHardSurface(own.pair, own.start.gap, own.gap);
    }
    int count = search->evaluate(pair, contacts);
    // What touches a neighbor at the start and at the end is no gap of this pair.
    own.gap.present = count > 0 || own.touchedAtStart;
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
            lever.places[0] = placeOf(touching.a, of->s[i]);
            lever.places[1] = placeOf(touching.b, of->t[i]);
            lever.gradient[0] = 0.5*of->gradients[i].x;
            lever.gradient[1] = 0.5*of->gradients[i].y;
            lever.gradient[2] = 0.5*of->gradients[i].z;
            own.fractions[own.gap.numLevers][0] = of->s[i];
            own.fractions[own.gap.numLevers++][1] = of->t[i];
        }
    own.gap.end = own.depth+end.gap;
    own.offset = own.gap.end-findEnd(own);
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

/**
 * Get whether a contact may come from a neighbor that is held in by the spring of the surface: a hard one must not keep
 * it out in the same step.
 */
bool ContactGaps::isOfNeighbor(const NearPair& own, const vector<const NearPair*>& deep) const {
    const vector<Capsule>& capsules = search->getSystem().capsules;
    auto areNeighbors = [&] (int a, int b) {
        return a == b || capsules[a].first == capsules[b].second || capsules[a].second == capsules[b].first;
    };
    const ContactPair& pair = pairs.get(own.pair);
    return !own.touchedAtStart && any_of(deep.begin(), deep.end(), [&] (const NearPair* other) {
        const ContactPair& deeper = pairs.get(other->pair);
        return areNeighbors(pair.a, deeper.a) && areNeighbors(pair.b, deeper.b);
    });
}

bool ContactGaps::findGaps(int iteration, bool settled, const double* moved, ReflectedGaps& gaps) {
    crossedAreKnown = false;
    if (movesTooFar)
        return false;
    all = &gaps;
    iterations = iteration;
    int firstNew = 0;
    if (!motion.hasBegun()) {
        findPairs(moved, PairFilter());
        motion.begin(search->getSystem().capsules, moved, *loop);
        pairs.begin(found, places.size());
        search->setMotion(begun, moved, *loop);
    }
    else {
        motion.follow([] (int) {return true;}, moved, slack, *loop, [&] (const vector<int>& capsules) {
            search->updateMotion(capsules, moved);
        });
        firstNew = pairs.size();
        // While much moves, it may come back.
        if (motion.exceedsReach() && settled)
            findNewPairs(moved);
    }
    if (movesTooFar)
        return false;
    selectNear(firstNew);
    runInChunks(*loop, near.size(), CHUNK_OF_CAPSULES, [&] (int i) {
        follow(near[i]);
        if (near[i].number < 0)
            return;
        if (near[i].hasMoved)
            gaps.get(near[i].number) = near[i].gap;
        else
            gaps.get(near[i].number).end = near[i].gap.end;
    });
    vector<const NearPair*> deep;
    for (const NearPair& own : near)
        if (own.touchedAtStart && (own.gap.law == GapLaw::Spring || own.hasGoneOn(pairs.get(own.pair))))
            deep.push_back(&own);
    for (NearPair& own : near)
        if (own.number < 0 && own.hasMoved && own.gap.numLevers > 0 && own.gap.present && mayClose(own.gap) &&
                !isOfNeighbor(own, deep))
            own.number = gaps.add(own.gap);
    return motion.exceedsReach() && !settled;
}

bool ContactGaps::followAgain(ReflectedGaps& gaps) {
    findCrossed();
    const double largest = LARGEST_CHANGE*sqrt(kT/stiffness);
    runInChunks(*loop, near.size(), CHUNK_OF_CAPSULES, [&] (int i) {
        NearPair& own = near[i];
        own.hasMoved = false;
        if (own.number < 0 || own.timesAgain == MOST_TIMES_AGAIN)
            return;
        const ContactPair& pair = pairs.get(own.pair);
        const bool hasCrossed = binary_search(crossed.begin(), crossed.end(), own.pair);
        // Neither the gap nor what its places make of it has changed by more than this way.
        if (!hasCrossed && !(2*(motion.getWay(pair.a, pair.b)-own.way) > largest))
            return;
        NearPair again = own;
        again.timesAgain++;
        follow(again, true);
        const bool isOther = again.gap.present != own.gap.present || fabs(again.gap.end-own.gap.end) > largest;
        if (hasCrossed || (isOther && min(again.gap.end, own.gap.end) < 0))
            own = again;
    });
    bool any = false;
    for (const NearPair& own : near)
        if (own.hasMoved) {
            gaps.get(own.number) = own.gap;
            any = true;
        }
    return any;
}

void ContactGaps::findFailures(const double*, vector<bool>& failed) {
    if (movesTooFar)
        for (const CapsulePlace& own : places)
            if (own.place.pack >= 0)
                failed[own.place.chain] = true;
    if (!crossedAreKnown)
        findCrossed();
    for (int i : crossed)
        for (int capsule : {pairs.get(i).a, pairs.get(i).b})
            if (places[capsule].place.pack >= 0)
                failed[places[capsule].place.chain] = true;
}

/** Find pairs that have passed through each other, although their gaps do not see it, or they have none. */
void ContactGaps::findCrossed() {
    crossed.clear();
    crossedAreKnown = true;
    if (movesTooFar)
        return;
    const int count = pairs.size(), chunks = (count+CHUNK_OF_CAPSULES-1)/CHUNK_OF_CAPSULES;
    (*loop)(chunks, [&] (int chunk) {
        Looks& looks = Looks::ofThread();
        for (int i = chunk*CHUNK_OF_CAPSULES; i < min(count, (chunk+1)*CHUNK_OF_CAPSULES); i++) {
            const ContactPair& pair = pairs.get(i);
            if (!isHeld(pair) && !(motion.getWay(pair.a, pair.b) < pair.clearance))
                looks.add(i, pair);
        }
        looks.look(*search);
        vector<int>& own = parts[chunk].pairs;
        own.clear();
        for (size_t k = 0; k < looks.pairs.size(); k++)
            if (looks.outlooks[k].mayCross && search->crosses(*looks.pairs[k]))
                own.push_back(looks.numbers[k]);
    });
    for (int chunk = 0; chunk < chunks; chunk++)
        crossed.insert(crossed.end(), parts[chunk].pairs.begin(), parts[chunk].pairs.end());
}

bool ContactGaps::findCulprit(const double* moved, const CouplingEquation*, BrokenCoupling& culprit) const {
    // The chain itself is known.
    if (isEndless)
        return false;
    auto name = [&] (int number) {
        culprit.places[0] = describePlace(places[pairs.get(number).a].place);
        culprit.places[1] = describePlace(places[pairs.get(number).b].place);
    };
    if (movesTooFar) {
        culprit.reason = BrokenCoupling::LeavesBox;
        culprit.places[0] = describePlace(places[findFastest(search->getSystem().capsules, begun, moved)].place);
        return true;
    }
    if (!crossed.empty()) {
        culprit.reason = BrokenCoupling::Crosses;
        name(crossed[0]);
        return true;
    }
    for (const NearPair& own : near)
        if (own.number >= 0 && all->isUnfinished(own.number)) {
            name(own.pair);
            return true;
        }
    return false;
}

void ContactGaps::findNeighbours(vector<pair<int, int> >& neighbours) const {
    for (const NearPair& own : near) {
        const PlaceOnChain &a = places[pairs.get(own.pair).a].place, &b = places[pairs.get(own.pair).b].place;
        if (a.pack >= 0 && b.pack >= 0)
            neighbours.push_back(make_pair(a.chain, b.chain));
    }
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
            pushes.back().chains[0] = places[pair.a].place.chain;
            pushes.back().chains[1] = places[pair.b].place.chain;
        }
    }
}
