#include "dynamics/ContactGaps.h"
#include "beams/ElementPlace.h"
#include "couplings/Crossings.h"
#include <algorithm>
#include <cmath>
#include <cstddef>

using namespace cylchain;
using namespace std;

namespace {

/** Gaps that are closed with a chance of less than exp(-this) are left out. */
const double LARGEST_EXPONENT = 6;
/** By how much responses that are found from lengths may be too small. */
const double RESPONSE_MARGIN = 1.2;
/** How much farther than needed pairs are looked for, over the diameter: further iterations move them. */
const double SLACK = 0.25;
/** Parts of all this that pairs are looked for in where a periodic box is too narrow for more. */
const double NARROWER[] = {1, 0.6, 0.35, 0.2};
/** The number of iterations that look where capsules touch. */
const int SEARCHING_ITERATIONS = 3;
/** Capsules that have travelled less, over the sum of the radii, touch where they did. */
const double SAME_PLACE = 0.01;
/** The number of iterations in which places and normals move. */
const int MOVING_ITERATIONS = 3;
/** The largest depth of a hard surface, over the sum of the radii: it is before the axes. */
const double LARGEST_DEPTH = 0.95;
/** The least sine of the angle of lines. */
const double LEAST_SINE = 0.3;
/** Capsules or pairs that a thread looks at together. */
const int CHUNK_OF_CONTACTS = 256;

/** Where a pair touches at the start or at the end, and the distance there, signed if the two have crossed. */
struct Touch {
    double s, t, distance;
    Vec3d normal;
};

Touch touchAt(const SegmentPair& pair, const NearestPoints& nearest) {
    const Vec3d r = pair.between(nearest.s, nearest.t);
    const double distance = sqrt(nearest.squared);
    return {nearest.s, nearest.t, distance, distance > 0 ? r*(1/distance) : Vec3d {0, 0, 0}};
}

/** Where two capsules are nearest; for one of two contacts, at the end of a segment at which it is. */
Touch findTouch(const SegmentPair& pair, const Contact& contact, bool only) {
    NearestPoints nearest = {contact.s, contact.t, HUGE_VAL};
    if (only)
        nearest = findNearestPoints(pair);
    else if (contact.s == 0 || contact.s == 1)
        considerEndOfA(pair, contact.s, nearest);
    else
        considerEndOfB(pair, contact.t, nearest);
    return touchAt(pair, nearest);
}

/** The same at the end, where two that have passed through each other are on the wrong side. */
Touch findLastTouch(const SegmentPair& start, const SegmentPair& end, const Contact& contact, bool only, double radii) {
    const Touch touch = findTouch(end, contact, only);
    if (!mayPass(start, end, touch.distance, radii))
        return touch;
    if (hasSphere(start)) {
        Passage passage;
        if (!findPassage(start, end, radii, passage))
            return touch;
        return {passage.s, passage.t, passage.distance, passage.normal};
    }
    Crossing crossings[2];
    if (findCrossings(start, end, crossings) == 0)
        return touch;
    const Crossing& first = crossings[0];
    return {first.s, first.t, end.between(first.s, first.t).dot(first.normal), first.normal};
}

/** The lines of two segments: where they are nearest, their distance, signed as p x q is, and the sine of their angle. */
struct LinePair {
    double s, t, distance, sine;
    Vec3d normal;
};

LinePair findLines(const SegmentPair& pair) {
    const double a = pair.p.squared(), b = pair.p.dot(pair.q), e = pair.q.squared();
    const double c = pair.p.dot(pair.w), f = pair.q.dot(pair.w), determinant = a*e-b*b;
    LinePair result = {0, 0, 0, 0, {0, 0, 0}};
    if (!(determinant > 0))
        return result;
    result.sine = sqrt(determinant/(a*e));
    result.s = (b*f-c*e)/determinant;
    result.t = (a*f-b*c)/determinant;
    result.normal = pair.p.cross(pair.q)*(1/sqrt(determinant));
    result.distance = result.normal.dot(pair.w);
    return result;
}

} // namespace

void ContactGaps::setContacts(ContactSearch* newSearch, double newStiffness, const double* newBox,
        const vector<CapsuleOnCurve>& newOnCurves, int newForce) {
    onCurves = &newOnCurves;
    search = newSearch;
    stiffness = newStiffness;
    box = newBox;
    force = newForce;
}

bool ContactGaps::resolves(const CoupledStart& start) {
    double largest = 0;
    responses.begin(start.places, start.settings.stepSize);
    for (const Capsule& capsule : search->getSystem().capsules) {
        Place place;
        place.first = capsule.first;
        PlaceOnChain found;
        if (start.places.find(place, found))
            largest = max(largest, responses.find(found));
    }
    for (const CapsuleOnCurve& own : *onCurves) {
        PlaceOnChain found;
        if (start.places.find(own.first, found))
            largest = max(largest, responses.find(found));
    }
    return ReflectedGaps::resolves(stiffness, 2*largest);
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
                own.response = max(own.response, RESPONSE_MARGIN*responses.find(placeOf(i, fraction)));
    };
    runInChunks(*loop, capsules.size(), CHUNK_OF_CONTACTS, [&] (int i) {
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
            found.fraction = ElementPlace::onPieces(found.fraction, own.pieces);
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
    reach = sqrt(LARGEST_EXPONENT*kT*response);
    slack = SLACK*diameter;
    movesTooFar = isEndless = false;
    pairs.clear();
    rooms.clear();
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

/** Get whether the gap of a pair may be closed; if not, how far its capsules may travel until it may. */
bool ContactGaps::isNear(int number, const double* moved, bool isNew, double& room) const {
    const ContactPair& pair = pairs.get(number);
    const double least = LARGEST_EXPONENT*kT*(places[pair.a].response+places[pair.b].response), radii = radiiOf(pair);
    auto isFar = [&] (double before, double after) {
        room = after-least/before;
        return before > 0 && room > 0;
    };
    if (isNew && pair.clearance > 0 && isFar(pair.before-radii, pair.distance-radii)) {
        room = min(room, (double) pair.clearance);
        return false;
    }
    const SegmentPair start = search->getSegments(pair, false), half = search->getSegments(pair, true);
    const SegmentPair end = interpolate(start, half, 2);
    const double after = sqrt(findNearestPoints(end).squared);
    if (!isFar(sqrt(findNearestPoints(start).squared)-radii, after-radii))
        return true;
    room = min(room, after);
    return search->crosses(pair, begun, moved);
}

/** Find the pairs from a number on, or those that have travelled far enough, whose gaps may be closed. */
void ContactGaps::selectNear(int firstNew, const double* moved) {
    const int count = pairs.size(), chunks = (count+CHUNK_OF_CONTACTS-1)/CHUNK_OF_CONTACTS;
    rooms.resize(count, 0.0);
    parts.resize(max(parts.size(), (size_t) chunks));
    (*loop)(chunks, [&] (int chunk) {
        vector<int>& own = parts[chunk].pairs;
        own.clear();
        for (int i = chunk*CHUNK_OF_CONTACTS; i < min(count, (chunk+1)*CHUNK_OF_CONTACTS); i++) {
            const ContactPair& pair = pairs.get(i);
            const double way = motion.getWay(pair.a, pair.b);
            double room;
            if (rooms[i] < 0 || (i < firstNew && way < rooms[i]))
                continue;
            if (isHeld(pair))
                rooms[i] = HUGE_VAL;
            else if (isNear(i, moved, i >= firstNew, room))
                own.push_back(i);
            else
                rooms[i] = way+room;
        }
    });
    for (int chunk = 0; chunk < chunks; chunk++)
        for (int i : parts[chunk].pairs) {
            rooms[i] = -1;
            near.emplace_back();
            near.back().pair = i;
        }
}

/** Find where a pair touches half-way, and its gaps there; or where these have moved to, once iterations move it little. */
void ContactGaps::follow(NearPair& own) const {
    const ContactPair& pair = pairs.get(own.pair);
    const double way = motion.getWay(pair.a, pair.b);
    const bool hasGaps = own.gaps[0] >= 0 || own.gaps[1] >= 0;
    own.hasMoved = own.count < 0 || (way-own.way > SAME_PLACE*radiiOf(pair) && (!hasGaps || iterations <= MOVING_ITERATIONS));
    if (!own.hasMoved) {
        const SegmentPair end = interpolate(search->getSegments(pair, false), search->getSegments(pair, true), 2);
        for (int which = 0; which < own.count; which++)
            if (own.gaps[which] >= 0)
                own.found[which].end = own.offsets[which]+findEnd(own, which, end);
        return;
    }
    own.way = way;
    if (!hasGaps && !mayTouch(own)) {
        own.count = 0;
        return;
    }
    if (own.count < 0 || iterations <= SEARCHING_ITERATIONS || !hasGaps)
        own.count = search->evaluate(pair, own.contacts);
    for (int which = 0; which < own.count; which++)
        own.found[which] = gapOf(own, which);
}

/** Get whether any gap of a pair may be closed, from its distances at the start and at the end. */
bool ContactGaps::mayTouch(NearPair& own) const {
    const ContactPair& pair = pairs.get(own.pair);
    const SegmentPair start = search->getSegments(pair, false), half = search->getSegments(pair, true);
    const double before = sqrt(findNearestPoints(start).squared)-radiiOf(pair);
    const double after = sqrt(findNearestPoints(interpolate(start, half, 2)).squared)-radiiOf(pair);
    if (!(before > 0 && after > 0))
        return true;
    double least = HUGE_VAL;
    for (int which = 0; which < 2; which++)
        least = min(least, variatesOf(own, which).exponential);
    const double depth = kT > 0 ? sqrt(2*kT/stiffness*least) : 0;
    return (before+depth)*(after+depth) < LARGEST_EXPONENT*kT*(places[pair.a].response+places[pair.b].response) ||
            search->crosses(pair);
}

/** Name a gap of a pair. */
void ContactGaps::setKey(const NearPair& own, int which, Gap& gap) const {
    const ContactPair& pair = pairs.get(own.pair);
    gap.key[0] = (uint32_t) force*0x9E3779B1u+pair.a;
    gap.key[1] = 2*(uint32_t) pair.b+which;
}

/** What the hard surface of a gap is drawn with. */
const SurfaceVariates& ContactGaps::variatesOf(NearPair& own, int which) const {
    SurfaceVariates& variates = own.variates[which];
    if (variates.exponential < 0) {
        Gap gap;
        setKey(own, which, gap);
        variates = all->getNoise().drawSurface(gap);
    }
    return variates;
}

/** How far the places of the levers of a gap are apart along its gradients. */
double ContactGaps::findEnd(const NearPair& own, int which, const SegmentPair& end) const {
    const Gap& gap = own.found[which];
    double sum = 0;
    for (int lever = 0; lever < gap.numLevers; lever++) {
        const Vec3d r = end.between(own.fractions[which][lever][0], own.fractions[which][lever][1]);
        const double* const g = gap.levers[lever].gradient;
        sum += r.x*g[0]+r.y*g[1]+r.z*g[2];
    }
    return sum;
}

/** Get whether lines are nearest on two segments, or on what continues them. */
bool ContactGaps::areOnSegments(const ContactPair& pair, double s, double t) const {
    auto isOn = [&] (int capsule, double fraction) {
        return (fraction >= 0 || search->getNeighbor(capsule, false) >= 0) &&
                (fraction <= 1 || search->getNeighbor(capsule, true) >= 0);
    };
    return isOn(pair.a, s) && isOn(pair.b, t);
}

/**
 * Find a gap of a pair: from where it starts, and where it is now.
 *
 * Two that cross at an angle are lines. Others have their distances at the start and at the end, and half of the force
 * where they are nearest at each: where they lie along each other, that may be at different ends.
 */
Gap ContactGaps::gapOf(NearPair& own, int which) const {
    const ContactPair& pair = pairs.get(own.pair);
    const Contact& contact = own.contacts[which];
    const SegmentPair start = search->getSegments(pair, false), half = search->getSegments(pair, true);
    const SegmentPair end = interpolate(start, half, 2);
    const double radii = radiiOf(pair);
    Gap gap;
    gap.stiffness = contact.weight*stiffness;
    gap.response = places[pair.a].response+places[pair.b].response;
    setKey(own, which, gap);
    auto setLever = [&] (int number, double s, double t, const Vec3d& gradient) {
        GapLever& lever = gap.levers[number];
        lever.places[0] = placeOf(pair.a, clampToUnit(s));
        lever.places[1] = placeOf(pair.b, clampToUnit(t));
        lever.gradient[0] = gradient.x;
        lever.gradient[1] = gradient.y;
        lever.gradient[2] = gradient.z;
        own.fractions[which][number][0] = clampToUnit(s);
        own.fractions[which][number][1] = clampToUnit(t);
    };
    double before, after;
    const LinePair lines[] = {findLines(start), findLines(half), findLines(end)};
    const bool cross = own.count == 1 && all_of(lines, lines+3, [&] (const LinePair& line) {
        return line.sine > LEAST_SINE && areOnSegments(pair, line.s, line.t);
        });
    if (cross) {
        const double side = lines[0].distance < 0 ? -1 : 1;
        before = side*lines[0].distance;
        after = side*lines[2].distance;
        setLever(0, lines[1].s, lines[1].t, lines[1].normal*side);
    }
    else {
        const bool only = own.count == 1;
        const Touch first = findTouch(start, contact, only), last = findLastTouch(start, end, contact, only, radii);
        before = first.distance;
        after = last.distance;
        gap.numLevers = 2;
        setLever(0, first.s, first.t, first.normal*0.5);
        setLever(1, last.s, last.t, last.normal*0.5);
    }
    gap.end = placeHardSurface(kT, variatesOf(own, which), LARGEST_DEPTH*radii, before-radii, gap)+after-radii;
    own.found[which] = gap;
    own.offsets[which] = gap.end-findEnd(own, which, end);
    return gap;
}

/** Get whether a gap that is not one of those of the step yet is so likely to be closed that it becomes one. */
static bool mayClose(const Gap& gap, double kT) {
    return gap.law != GapLaw::Reflection || !(gap.end > 0) || gap.start*gap.end < LARGEST_EXPONENT*kT*gap.response;
}

bool ContactGaps::findGaps(int iteration, bool settled, const double* moved, ReflectedGaps& gaps) {
    if (movesTooFar)
        return false;
    all = &gaps;
    iterations = iteration;
    middle.resize(3*(size_t) gaps.getNumParticles());
    const int numNumbers = middle.size();
    for (int i = 0; i < numNumbers; i++)
        middle[i] = 0.5*(begun[i]+moved[i]);
    int firstNew = 0;
    if (!motion.hasBegun()) {
        findPairs(moved, PairFilter());
        motion.begin(search->getSystem().capsules, moved, *loop);
        pairs.begin(found, places.size());
        search->setMotion(begun, middle.data(), *loop);
    }
    else {
        motion.follow([] (int) {return true;}, moved, slack, *loop, [&] (const vector<int>& capsules) {
            search->updateMotion(capsules, middle.data());
        });
        firstNew = pairs.size();
        // While much moves, it may come back.
        if (motion.exceedsReach() && settled)
            findNewPairs(moved);
    }
    if (movesTooFar)
        return false;
    selectNear(firstNew, moved);
    runInChunks(*loop, near.size(), CHUNK_OF_CONTACTS, [&] (int i) {
        follow(near[i]);
    });
    for (NearPair& own : near)
        for (int which = 0; which < 2; which++) {
            int& number = own.gaps[which];
            if (which >= own.count) {
                if (number >= 0)
                    gaps.get(number).present = false;
            }
            else if (number >= 0) {
                if (own.hasMoved)
                    gaps.get(number) = own.found[which];
                else
                    gaps.get(number).end = own.found[which].end;
            }
            else if (own.hasMoved && mayClose(own.found[which], kT))
                number = gaps.add(own.found[which]);
        }
    return motion.exceedsReach() && !settled;
}

/** Find pairs that have passed through each other, although their gaps do not see it. */
void ContactGaps::findFailures(const double* moved, vector<bool>& failed) const {
    for (size_t i = 0; movesTooFar && i < places.size(); i++)
        if (places[i].place.pack >= 0)
            failed[places[i].place.chain] = true;
    for (int i = 0; i < pairs.size(); i++)
        if (crosses(i, moved))
            for (int capsule : {pairs.get(i).a, pairs.get(i).b})
                if (places[capsule].place.pack >= 0)
                    failed[places[capsule].place.chain] = true;
}

bool ContactGaps::crosses(int i, const double* moved) const {
    // Those that are not near have been looked at since they moved.
    return rooms[i] < 0 && search->crosses(pairs.get(i), begun, moved);
}

/** The capsule whose first particle has moved most. */
int ContactGaps::findFastest(const double* moved) const {
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

bool ContactGaps::findCulprit(const double* moved, const CouplingEquation*, BrokenCoupling& culprit) const {
    // The chain itself is known.
    if (isEndless)
        return false;
    culprit.kind = BrokenCoupling::Contact;
    auto name = [&] (int number) {
        culprit.places[0] = describePlace(places[pairs.get(number).a].place);
        culprit.places[1] = describePlace(places[pairs.get(number).b].place);
    };
    if (movesTooFar) {
        culprit.reason = BrokenCoupling::LeavesBox;
        culprit.places[0] = describePlace(places[findFastest(moved)].place);
        return true;
    }
    for (int i = 0; i < pairs.size(); i++)
        if (crosses(i, moved)) {
            culprit.reason = BrokenCoupling::Crosses;
            name(i);
            return true;
        }
    for (const NearPair& own : near)
        for (int number : own.gaps)
            if (number >= 0 && all->isUnfinished(number)) {
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
