#include "couplings/ContactSearchImplementation.h"
#include "mechanics/Prefetch.h"
#include <algorithm>

using namespace cylchain;
using namespace std;

namespace {

/** Segments with a lesser sin^2 of their angle are nearly parallel. */
const double LARGEST_PARALLEL = 1e-3;
/** Fractions of a segment that are less than this are zero. */
const double AT_END = 1e-9;
/** Gaps that differ by less, relative to distances, are equal. */
const double LEAST_DIFFERENCE = 1e-10;
/** Capsules whose motion is noted together. */
const int CHUNK_OF_MOTIONS = 512;

/** Where two segments touch: where they are nearest, or if they are nearly parallel at both ends of their overlap. */
struct Places {
    bool parallel;
    double s[2], t[2], distance;
};

/** What is at an end but for rounding is there: joints are looked at apart. */
double takenToEnd(double fraction) {
    return fraction < AT_END ? 0 : fraction > 1-AT_END ? 1 : fraction;
}

Places findPlaces(const SegmentPair& pair) {
    const NearestPoints nearest = findNearestPoints(pair);
    Places places = {false, {takenToEnd(nearest.s), 0}, {takenToEnd(nearest.t), 0}, sqrt(nearest.squared)};
    const double a = pair.p.squared(), b = pair.p.dot(pair.q), e = pair.q.squared();
    if (a > 0 && e > 0 && a*e-b*b < LARGEST_PARALLEL*a*e) {
        // The ends of b, as fractions of a.
        const double c = pair.p.dot(pair.w), f = pair.q.dot(pair.w), first = -c/a, second = (b-c)/a;
        const double lower = max(0.0, min(first, second)), upper = min(1.0, max(first, second));
        places.parallel = upper > lower;
        if (places.parallel)
            for (int i = 0; i < 2; i++) {
                const double s = i == 0 ? lower : upper;
                places.s[i] = takenToEnd(s);
                places.t[i] = s == first ? 0 : s == second ? 1 : takenToEnd(clampToUnit((b*s+f)/e));
            }
    }
    return places;
}

/** A unit vector across both segments, or across one of them if they are parallel or the other has no length. */
Vec3d findNormal(const SegmentPair& pair, int side) {
    Vec3d normal = pair.p.cross(pair.q)*(side < 0 ? -1 : 1);
    if (!(normal.squared() > 0)) {
        const Vec3d& along = pair.p.squared() > 0 ? pair.p : pair.q;
        const double x = fabs(along.x), y = fabs(along.y), z = fabs(along.z);
        normal = along.cross({x <= y && x <= z ? 1.0 : 0.0, y < x && y <= z ? 1.0 : 0.0, z < x && z < y ? 1.0 : 0.0});
    }
    return normal.squared() > 0 ? normal*(1/sqrt(normal.squared())) : Vec3d{1, 0, 0};
}

} // namespace

/** Replace one of two segments by its neighbor in its chain, which lies along a vector. */
static SegmentPair withNeighbor(const SegmentPair& segments, const Vec3d& beside, bool ofA, bool atEnd) {
    if (ofA)
        return {beside, segments.q, atEnd ? segments.w+segments.p : segments.w-beside};
    return {segments.p, beside, atEnd ? segments.w-segments.q : segments.w+beside};
}

/** Get whether a contact belongs to its pair, or to a neighbor of a, or of b, in its chain. */
bool ContactSearch::Implementation::isOwned(const Contact& contact, const ContactPair& pair, const SegmentPair& start,
        const SegmentPair& end, bool parallel, bool ofA, const Ends& ends) const {
    const int own = ofA ? pair.a : pair.b, other = ofA ? pair.b : pair.a;
    const double fraction = ofA ? contact.s : contact.t, sum = radii(pair.a, pair.b);
    const double least = LEAST_DIFFERENCE*(sum+fabs(contact.gap));
    const Vec3d &ownAlong = ofA ? end.p : end.q, &otherAlong = ofA ? end.q : end.p;
    for (bool atEnd : {false, true}) {
        const int neighbor = atEnd ? next[own] : previous[own];
        const bool atJoint = fraction == (atEnd ? 1 : 0);
        if (neighbor < 0 || (parallel && !atJoint) || isExcluded(neighbor, other))
            continue;
        const Vec3d later = ends.along(neighbor, true);
        auto withNeighborBefore = [&] {
            return withNeighbor(start, ends.along(neighbor, false), ofA, atEnd);
        };
        if (!atJoint) {
            // If the distance from the other capsule grows as one goes from the joint into the neighbor, that has no
            // place nearer than the joint, unless it has been crossed.
            const Vec3d joint = (ofA ? end.w : end.w*-1)+ownAlong*(atEnd ? 1 : 0);
            const Vec3d fromOther = joint-otherAlong*nearestFraction(otherAlong, joint*-1);
            const Vec3d into = later*(atEnd ? 1 : -1);
            const double distance = sqrt(fromOther.squared());
            if (fromOther.dot(into) >= 0 && distance-sum > contact.gap+2*least &&
                    (!ends.moves || !mayPass(withNeighborBefore(), withNeighbor(end, later, ofA, atEnd), distance,
                    sum)))
                continue;
        }
        const SegmentPair beside = withNeighbor(end, later, ofA, atEnd);
        const Places places = findPlaces(beside);
        bool endsThere = false;
        if (places.parallel)
            for (int i = 0; i < 2; i++)
                endsThere = endsThere || (ofA ? places.s[i] : places.t[i]) == (atEnd ? 0 : 1);
        if (endsThere) {
            // The neighbor has a contact at the joint.
            const Vec3d joint = (ofA ? end.w : end.w*-1)+ownAlong*(atEnd ? 1 : 0);
            const Vec3d fromOther = joint-otherAlong*nearestFraction(otherAlong, joint*-1);
            if (parallel ? !atEnd : !(contact.gap < sqrt(fromOther.squared())-sum-least))
                return false;
            continue;
        }
        const SegmentPair before = ends.moves ? withNeighborBefore() : beside;
        const double gap = findGap(before, beside, radii(neighbor, other));
        // What differs by rounding is equal. Then the one that ends there counts.
        if (parallel || atEnd ? gap < contact.gap-least : !(contact.gap < gap-least))
            return false;
    }
    return true;
}

/** At a joint, both segments have crossed: the share of the one. */
double ContactSearch::Implementation::shareOf(const Crossing& crossing, const ContactPair& pair) const {
    double share = 1;
    for (bool ofA : {true, false}) {
        const double fraction = takenToEnd(ofA ? crossing.s : crossing.t);
        const int own = ofA ? pair.a : pair.b, other = ofA ? pair.b : pair.a;
        const int neighbor = fraction == 0 ? previous[own] : fraction == 1 ? next[own] : -1;
        if (neighbor >= 0 && !isExcluded(neighbor, other))
            share *= 0.5;
    }
    return share;
}

int ContactSearch::Implementation::evaluate(const ContactPair& pair, const SegmentPair& start, const SegmentPair& end,
        const Ends& ends, Contact* contacts, double limit) const {
    const double sum = radii(pair.a, pair.b);
    const Places places = findPlaces(end);
    if (ends.moves && mayPass(start, end, places.distance+(hasSphere(start) ? 0 : pair.before), sum)) {
        if (hasSphere(start)) {
            Passage passage;
            if (findPassage(start, end, sum, passage)) {
                const Vec3d& n = passage.normal;
                contacts[0] = {takenToEnd(passage.s), takenToEnd(passage.t), {n.x, n.y, n.z}, passage.distance-sum, 1,
                        passage.through};
                if (contacts[0].gap >= limit)
                    return -1;
                return isOwned(contacts[0], pair, start, end, false, true, ends) &&
                        isOwned(contacts[0], pair, start, end, false, false, ends);
            }
        }
        else {
            Crossing crossings[2];
            const int count = findCrossings(start, end, crossings);
            for (int i = 0; i < count; i++) {
                const Crossing& crossing = crossings[i];
                const Vec3d& n = crossing.normal;
                contacts[i] = {crossing.s, crossing.t, {n.x, n.y, n.z},
                        end.between(crossing.s, crossing.t).dot(n)-sum, shareOf(crossing, pair)/count, true};
            }
            if (count > 0)
                return min(contacts[0].gap, contacts[count-1].gap) < limit ? count : -1;
        }
    }
    contacts[0].gap = places.distance-sum;
    if (contacts[0].gap >= limit)
        return -1;
    int kept = 0;
    const int count = places.parallel ? 2 : 1;
    for (int i = 0; i < count; i++) {
        const double s = places.s[i], t = places.t[i];
        const Vec3d r = end.between(s, t);
        const double length = sqrt(r.squared());
        if (length-sum >= limit)
            continue;
        const Vec3d n = length > 0 ? r*(1/length) : findNormal(end, pair.side);
        const Contact contact = {s, t, {n.x, n.y, n.z}, length-sum, 1.0/count, false};
        if (isOwned(contact, pair, start, end, places.parallel, true, ends) &&
                isOwned(contact, pair, start, end, places.parallel, false, ends))
            contacts[kept++] = contact;
    }
    return kept;
}

int ContactSearch::evaluate(const ContactPair& pair, const double* x, const double* y, Contact* contacts,
        double limit) const {
    const SegmentPair end = implementation->segments(pair.a, pair.b, pair.shift, y);
    const SegmentPair start = x == y ? end : implementation->segments(pair.a, pair.b, pair.shift, x);
    return implementation->evaluate(pair, start, end, {*implementation, x, y, x != y}, contacts, limit);
}

int ContactSearch::evaluate(const ContactPair& pair, Contact* contacts, double limit) const {
    const Implementation& search = *implementation;
    return search.evaluate(pair, search.movingSegments(pair, false), search.movingSegments(pair, true),
            {search, NULL, NULL, search.moves}, contacts, limit);
}

void ContactSearch::setMotion(const double* x, const double* y, const Loop& run) {
    Implementation& search = *implementation;
    const vector<Capsule>& capsules = search.system.capsules;
    search.moves = x != y;
    vector<MovingSegment>& moving = search.moving;
    moving.resize(capsules.size());
    const int count = capsules.size();
    runParts(run, (count+CHUNK_OF_MOTIONS-1)/CHUNK_OF_MOTIONS, [&] (int chunk) {
        for (int i = chunk*CHUNK_OF_MOTIONS; i < min(count, (chunk+1)*CHUNK_OF_MOTIONS); i++) {
            const Capsule& own = capsules[i];
            const int next = search.next[i];
            MovingSegment& segment = moving[i];
            set(segment.first, position(x, own.first));
            set(segment.along, search.along(own, x));
            set(segment.laterFirst, position(y, own.first));
            set(segment.laterAlong, search.along(own, y));
            set(segment.laterNext, next < 0 ? Vec3d {0, 0, 0} : search.along(capsules[next], y));
            segment.radius = own.radius;
        }
    });
}

void ContactSearch::updateMotion(const vector<int>& numbers, const double* y) {
    Implementation& search = *implementation;
    for (int i : numbers) {
        const Capsule& own = search.system.capsules[i];
        const Vec3d along = search.along(own, y);
        set(search.moving[i].laterFirst, position(y, own.first));
        set(search.moving[i].laterAlong, along);
        if (search.previous[i] >= 0)
            set(search.moving[search.previous[i]].laterNext, along);
    }
}

/** Whether a contact that is not parallel and has not crossed is surely not owned: see isOwned(). */
bool ContactSearch::Implementation::isOfNeighbor(const ContactPair& pair, int flags) const {
    // What starts at a joint is the neighbor's that ends there, or nearer than that.
    auto counts = [&] (int neighbor, int other) {
        return neighbor >= 0 && !isExcluded(neighbor, other);
    };
    return ((flags & FIRST_AT_START) != 0 && counts(previous[pair.a], pair.b)) ||
            ((flags & FIRST_GOES_NEARER) != 0 && counts(next[pair.a], pair.b)) ||
            ((flags & SECOND_AT_START) != 0 && counts(previous[pair.b], pair.a)) ||
            ((flags & SECOND_GOES_NEARER) != 0 && counts(next[pair.b], pair.a));
}

void ContactSearch::findOutlooks(const ContactPair* const* pairs, int count, PairOutlook* outlooks) const {
    const int most = 64;
    int first[most], second[most], flags[most];
    double x[most], y[most], z[most], distance[most];
    float before[most];
    const CandidateKernels& kernels = candidateKernels();
    const vector<MovingSegment>& moving = implementation->moving;
    for (int start = 0; start < count; start += most) {
        const int own = min(most, count-start);
        for (int i = 0; i < (own+7)/8*8; i++) {
            const ContactPair& pair = *pairs[start+min(i, own-1)];
            first[i] = pair.a;
            second[i] = pair.b;
            x[i] = pair.shift[0];
            y[i] = pair.shift[1];
            z[i] = pair.shift[2];
            before[i] = pair.before;
        }
        kernels.outlook(moving.data(), LARGEST_PARALLEL, AT_END,
                {first, second, {x, y, z}, before, distance, flags}, own);
        for (int i = 0; i < own; i++) {
            const ContactPair& pair = *pairs[start+i];
            // How near a sphere comes on its way is not known here.
            const MovingSegment &a = moving[pair.a], &b = moving[pair.b];
            const bool mayCross = !a.hasLength() || !b.hasLength() || (flags[i] & MAY_CROSS) != 0;
            const bool isKnown = !mayCross && (flags[i] & MAY_BE_PARALLEL) == 0;
            const double radii = a.radius+b.radius;
            outlooks[start+i] = {distance[i]-radii, radii, mayCross,
                    isKnown && implementation->isOfNeighbor(pair, flags[i])};
        }
    }
}

void ContactSearch::prefetchMotion(int a, int b) const {
    for (int capsule : {a, b}) {
        prefetch(&implementation->moving[capsule]);
        prefetch(&implementation->system.capsules[capsule]);
        prefetch(&implementation->next[capsule]);
        prefetch(&implementation->previous[capsule]);
    }
}

SegmentPair ContactSearch::getSegments(const ContactPair& pair, bool atEnd) const {
    return implementation->movingSegments(pair, atEnd);
}

bool ContactSearch::Implementation::crosses(const ContactPair& pair, const SegmentPair& start,
        const SegmentPair& end) const {
    if (hasSphere(start)) {
        Passage passage;
        return findPassage(start, end, radii(pair.a, pair.b), passage) && passage.through;
    }
    Crossing crossings[2];
    return findCrossings(start, end, crossings) > 0;
}

bool ContactSearch::crosses(const ContactPair& pair, const double* x, const double* y) const {
    const Implementation& search = *implementation;
    return search.crosses(pair, search.segments(pair.a, pair.b, pair.shift, x),
            search.segments(pair.a, pair.b, pair.shift, y));
}

bool ContactSearch::crosses(const ContactPair& pair) const {
    const Implementation& search = *implementation;
    return search.crosses(pair, search.movingSegments(pair, false), search.movingSegments(pair, true));
}
