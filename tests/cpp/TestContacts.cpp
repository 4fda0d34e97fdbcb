/**
 * This tests contacts between capsules: nearest points, crossings and pairs against other formulas and against all
 * pairs of capsules in all images, signed gaps along paths, and what is seen around joints.
 */

#include "TestChains.h"
#include "couplings/CandidateLoops.h"
#include "couplings/ContactSearch.h"
#include "couplings/Crossings.h"
#include <algorithm>
#include <cstring>
#include <map>
#include <set>
#include <thread>

static double uniform(mt19937_64& generator, double lower = 0, double upper = 1) {
    return uniform_real_distribution<double>(lower, upper)(generator);
}

static Vec3d randomVector(mt19937_64& generator, double scale = 1) {
    normal_distribution<double> normal;
    const double x = normal(generator), y = normal(generator), z = normal(generator);
    return Vec3d{x, y, z}*scale;
}

static Vec3d at(const Array& x, int particle) {
    return {x[3*particle], x[3*particle+1], x[3*particle+2]};
}

static void add(Array& x, const Vec3d& v) {
    x.insert(x.end(), {v.x, v.y, v.z});
}

static double length(const Vec3d& v) {
    return sqrt(v.dot(v));
}

static double distanceToSegment(const Vec3d& point, const Vec3d& from, const Vec3d& to) {
    const Vec3d along = to-from;
    const double square = along.dot(along);
    const double fraction = square > 0 ? min(1.0, max(0.0, (point-from).dot(along)/square)) : 0.0;
    return length(point-from-along*fraction);
}

/** The distance of two segments: that of an end from the other segment, or else that of the lines. */
static double distanceByHand(const Vec3d& a0, const Vec3d& a1, const Vec3d& b0, const Vec3d& b1) {
    double result = min(min(distanceToSegment(a0, b0, b1), distanceToSegment(a1, b0, b1)),
            min(distanceToSegment(b0, a0, a1), distanceToSegment(b1, a0, a1)));
    const Vec3d n = (a1-a0).cross(b1-b0);
    const double nn = n.dot(n);
    if (nn > 1e-20*(a1-a0).dot(a1-a0)*(b1-b0).dot(b1-b0)) {
        // Where the lines are nearest, by Cramer's rule with the vector between them along n.
        const double s = (b0-a0).cross(b1-b0).dot(n)/nn, t = (b0-a0).cross(a1-a0).dot(n)/nn;
        if (s >= 0 && s <= 1 && t >= 0 && t <= 1)
            result = min(result, fabs((b0-a0).dot(n))/sqrt(nn));
    }
    return result;
}

static void testNearestPoints() {
    mt19937_64 generator(1);
    for (int trial = 0; trial < 200000; trial++) {
        const int kind = trial%8;
        Vec3d a0 = randomVector(generator, 50), p = randomVector(generator, 60);
        Vec3d b0 = randomVector(generator, 50), q = randomVector(generator, 60);
        if (kind == 1)
            q = p*uniform(generator, -2, 2);
        if (kind == 2)
            q = p*uniform(generator, -2, 2)+randomVector(generator, pow(10, uniform(generator, -9, 0)));
        if (kind == 3)
            p = {0, 0, 0};
        if (kind == 4)
            q = {0, 0, 0};
        if (kind == 5)
            p = q = {0, 0, 0};
        if (kind == 6)
            b0 = a0+p*uniform(generator)-q*uniform(generator);
        if (kind == 7) {
            // On one line.
            q = p*uniform(generator, -1, 1);
            b0 = a0+p*uniform(generator, -3, 3);
        }
        const SegmentPair pair = {p, q, a0-b0};
        const NearestPoints nearest = findNearestPoints(pair);
        check(nearest.s >= 0 && nearest.s <= 1 && nearest.t >= 0 && nearest.t <= 1, "fractions of segments");
        checkClose(length(pair.between(nearest.s, nearest.t)), sqrt(nearest.squared), 100, 1e-12, "distance there");
        checkClose(distanceByHand(a0, a0+p, b0, b0+q), sqrt(nearest.squared), 100, 1e-9, "distance of segments");
    }
}

/** The volume of four points as they are at a time, by a determinant. */
static double volumeByHand(const Vec3d* start, const Vec3d* end, double u) {
    Vec3d r[4];
    for (int i = 0; i < 4; i++)
        r[i] = start[i]*(1-u)+end[i]*u;
    const Vec3d d[3] = {r[0]-r[2], r[1]-r[0], r[3]-r[2]};
    return d[0].x*(d[1].y*d[2].z-d[1].z*d[2].y)-d[0].y*(d[1].x*d[2].z-d[1].z*d[2].x)+
            d[0].z*(d[1].x*d[2].y-d[1].y*d[2].x);
}

struct CrossingByHand {
    int count = 0;
    double time = -1;
    /** Whether it can be told: nothing happens at an end. */
    bool clear = true;
};

/** Count crossings in many short parts of the time. */
static CrossingByHand crossingsByHand(const Vec3d* start, const Vec3d* end) {
    CrossingByHand result;
    const int parts = 2000;
    double before = volumeByHand(start, end, 0);
    for (int i = 0; i < parts; i++) {
        const double after = volumeByHand(start, end, (i+1.0)/parts);
        if ((before < 0) != (after < 0)) {
            double lower = (double) i/parts, upper = (i+1.0)/parts;
            for (int turn = 0; turn < 60; turn++) {
                const double middle = 0.5*(lower+upper);
                ((volumeByHand(start, end, middle) < 0) == (before < 0) ? lower : upper) = middle;
            }
            Vec3d r[4];
            for (int k = 0; k < 4; k++)
                r[k] = start[k]*(1-lower)+end[k]*lower;
            // Do the segments meet there? A bit shorter or longer ones, too?
            double distances[3];
            for (int k = -1; k <= 1; k++) {
                const Vec3d p = (r[1]-r[0])*(1e-6*k), q = (r[3]-r[2])*(1e-6*k);
                distances[k+1] = distanceByHand(r[0]-p, r[1]+p, r[2]-q, r[3]+q);
            }
            const bool shorter = distances[0] < 1e-9, longer = distances[2] < 1e-9;
            if (shorter != longer)
                result.clear = false;
            if (longer && result.count++ == 0)
                result.time = lower;
        }
        before = after;
    }
    return result;
}

static SegmentPair pairOf(const Vec3d* r) {
    return {r[1]-r[0], r[3]-r[2], r[0]-r[2]};
}

static bool findCrossing(const SegmentPair& start, const SegmentPair& end, Crossing& crossing) {
    Crossing found[2];
    const int count = findCrossings(start, end, found);
    crossing = found[0];
    return count > 0;
}

static void testCrossings() {
    mt19937_64 generator(2);
    int crossed = 0, twice = 0, none = 0, sameSide = 0;
    for (int trial = 0; trial < 6000; trial++) {
        Vec3d start[4], end[4];
        const bool meet = trial%2 == 0;
        for (int i = 0; i < 4; i++) {
            start[i] = randomVector(generator, 40);
            end[i] = start[i]+randomVector(generator, trial%6 < 3 ? 20 : 60);
        }
        if (meet) {
            // Move b so that they meet at some time, perhaps near an end, or just beyond it.
            const double u = uniform(generator);
            const bool atEnd = trial%4 == 0;
            const double s = atEnd ? (trial%8 == 0 ? 1e-5 : -1e-5) : uniform(generator), t = uniform(generator);
            Vec3d r[4];
            for (int i = 0; i < 4; i++)
                r[i] = start[i]*(1-u)+end[i]*u;
            const Vec3d shift = r[0]*(1-s)+r[1]*s-r[2]*(1-t)-r[3]*t;
            for (int i = 2; i < 4; i++) {
                start[i] = start[i]+shift;
                end[i] = end[i]+shift;
            }
        }
        const CrossingByHand expected = crossingsByHand(start, end);
        if (!expected.clear)
            continue;
        Crossing crossing;
        const bool found = findCrossing(pairOf(start), pairOf(end), crossing);
        check(found == (expected.count%2 == 1), "crossing found or not, in trial "+to_string(trial));
        if (found) {
            checkClose(expected.time, crossing.time, 1, 1e-6, "time of crossing");
            const double u = crossing.time;
            const SegmentPair a = pairOf(start), b = pairOf(end);
            const SegmentPair pair = {a.p*(1-u)+b.p*u, a.q*(1-u)+b.q*u, a.w*(1-u)+b.w*u};
            checkClose(0, length(pair.between(crossing.s, crossing.t)), 1, 1e-6, "place of crossing");
            checkClose(0, pair.p.dot(crossing.normal)/length(pair.p), 1, 1e-9, "normal");
            checkClose(0, pair.q.dot(crossing.normal)/length(pair.q), 1, 1e-9, "normal");
            checkClose(1, length(crossing.normal), 1, 1e-12, "unit normal");
            // Just before, a is on the side to which the normal points.
            const double v = max(0.0, u-1e-4);
            if (volumeByHand(start, end, v)*volumeByHand(start, end, u-1e-7) > 0) {
                const SegmentPair before = {a.p*(1-v)+b.p*v, a.q*(1-v)+b.q*v, a.w*(1-v)+b.w*v};
                check(before.between(crossing.s, crossing.t).dot(crossing.normal) > 0, "side before");
            }
            if (volumeByHand(start, end, 0)*volumeByHand(start, end, 1) > 0)
                sameSide++;
        }
        crossed += found;
        twice += expected.count > 1;
        none += expected.count == 0;
    }
    check(crossed > 1000 && none > 1000 && twice > 5 && sameSide > 20, "all kinds of crossings were tried");

    // Where nothing can cross.
    Crossing crossing;
    const SegmentPair apart = {{10, 0, 0}, {0, 10, 0}, {-5, 5, 1}}, below = {{10, 0, 0}, {0, 10, 0}, {-5, 5, -1}};
    check(findCrossing(apart, below, crossing), "two rods");
    checkClose(0.5, crossing.time, 1, 1e-12, "time");
    check(crossing.normal.z > 0.999, "normal of before");
    check(!findCrossing(apart, apart, crossing), "no motion");
    check(!findCrossing({{10, 0, 0}, {10, 0, 0}, {0, 0, 1}}, {{10, 0, 0}, {10, 0, 0}, {0, 1, -1}}, crossing),
            "parallel, past each other");
    check(!findCrossing(apart, {{10, 0, 0}, {0, 10, 0}, {-5, 5, 0.001}}, crossing), "it stops before");
    // A segment that turns through the direction of the other, beside it, does not cross it.
    check(!findCrossing({{10, 1, 0}, {10, 0, 0}, {0, 0, 3}}, {{10, -1, 0}, {10, 0, 0}, {0, 0, 3}}, crossing),
            "it turns");
}

/** Whether two segments in the plane z = 0 meet. */
static bool meetInPlane(const Vec3d* r) {
    auto area = [&] (int i, int j, int k) {
        return (r[j]-r[i]).cross(r[k]-r[i]).z;
    };
    return area(0, 1, 2)*area(0, 1, 3) < 0 && area(2, 3, 0)*area(2, 3, 1) < 0;
}

/** Segments that move in one plane: they have crossed if they lie across each other, or have done so on the way. */
static void testPlanarCrossings() {
    mt19937_64 generator(11);
    int across = 0, passed = 0, none = 0, back = 0;
    for (int trial = 0; trial < 20000; trial++) {
        // In the plane z = 0, and the same turned and moved anywhere, with the rounding that this makes.
        Vec3d start[4], end[4], turnedStart[4], turnedEnd[4];
        const bool small = trial%3 != 0;
        for (int i = 0; i < 4; i++) {
            start[i] = randomVector(generator, 40);
            end[i] = start[i]+randomVector(generator, small ? 5 : 30);
            start[i].z = end[i].z = 0;
        }
        if (trial%5 == 0) {
            // Side by side.
            start[2] = start[0]+randomVector(generator, 3);
            start[3] = start[1]+randomVector(generator, 3);
            start[2].z = start[3].z = 0;
        }
        if (meetInPlane(start))
            continue;
        const Vec3d a = randomVector(generator), b = a.cross(randomVector(generator));
        const Vec3d u = a*(1/length(a)), v = b*(1/length(b)), origin = randomVector(generator, 1000);
        for (int i = 0; i < 4; i++) {
            turnedStart[i] = origin+u*start[i].x+v*start[i].y;
            turnedEnd[i] = origin+u*end[i].x+v*end[i].y;
        }
        Crossing found[2], turned[2];
        const int count = findCrossings(pairOf(start), pairOf(end), found);
        check(findCrossings(pairOf(turnedStart), pairOf(turnedEnd), turned) == count, "the same in another plane");
        bool met = false;
        const int parts = 3000;
        for (int i = 1; i < parts && !met; i++) {
            Vec3d r[4];
            for (int k = 0; k < 4; k++)
                r[k] = start[k]+(end[k]-start[k])*((double) i/parts);
            met = meetInPlane(r);
        }
        if (meetInPlane(end))
            check(count > 0, "they lie across each other, in trial "+to_string(trial));
        if (!met)
            check(count == 0 || found[count-1].time-found[0].time < 2.0/parts, "they have never met");
        across += meetInPlane(end);
        passed += !meetInPlane(end) && count > 0;
        back += met && count == 0;
        none += !met;
        for (int i = 0; i < count; i++) {
            check(found[i].s == 0 || found[i].s == 1 || found[i].t == 0 || found[i].t == 1, "an end has crossed");
            const SegmentPair pair = interpolate(pairOf(start), pairOf(end), found[i].time);
            checkClose(0, length(pair.between(found[i].s, found[i].t)), 1, 1e-9, "place of crossing");
            checkClose(1, length(found[i].normal), 1, 1e-12, "unit normal");
            checkClose(found[i].time, turned[i].time, 1, 1e-6, "time in another plane");
            checkClose(0, found[i].normal.z, 1, 1e-12, "normal in the plane");
            const double before = max(0.0, found[i].time-1e-5);
            check(interpolate(pairOf(start), pairOf(end), before).between(found[i].s, found[i].t).dot(
                    found[i].normal) > -1e-9, "normal of before");
        }
    }
    check(across > 500 && passed > 300 && none > 5000 && back > 10, "all kinds were tried");
}

struct TestSystem {
    CapsuleSystem system;
    Array x, y;
};

/** Chains, rings and spheres; some of the chains lie in bundles. Whole chains are taken to other images of a box. */
static TestSystem makeSystem(mt19937_64& generator, int chains, int segments, double extent, double segment,
            double diameter, double motion, const double* box) {
    TestSystem result;
    auto place = [&] {
        const double a = uniform(generator), b = uniform(generator), c = uniform(generator);
        if (box == NULL)
            return Vec3d{a*extent, b*extent, c*extent};
        const int i = generator()%5-2, j = generator()%5-2, k = generator()%5-2;
        return Vec3d{(a+i)*box[0]+(b+j)*box[3]+(c+k)*box[6], (b+j)*box[4]+(c+k)*box[7], (c+k)*box[8]};
    };
    Vec3d last = {1, 0, 0}, origin = place();
    for (int chain = 0; chain < chains; chain++) {
        Vec3d node = place(), direction = randomVector(generator);
        if (chain%3 == 0) {
            node = origin+randomVector(generator, diameter);
            direction = last+randomVector(generator, 1e-3);
        }
        origin = node;
        direction = direction*(1/length(direction));
        last = direction;
        const int first = result.x.size()/3;
        const bool closed = chain%5 == 4 && segments > 3;
        for (int s = 0; s < segments; s++) {
            add(result.x, node);
            direction = direction+randomVector(generator, chain%2 == 0 ? 0.002 : 0.2);
            if (closed)
                direction = randomVector(generator);
            direction = direction*(1/length(direction));
            node = node+direction*segment;
        }
        if (!closed)
            add(result.x, node);
        const int radiusClass = chain%4;
        for (int s = 0; s < segments; s++)
            result.system.capsules.push_back({first+s, closed && s == segments-1 ? first : first+s+1,
                    0.5*diameter*(1+0.1*radiusClass), chain, s});
        result.system.chains.push_back({segments, closed, 1+chain%2});
    }
    for (int sphere = 0; sphere < chains; sphere++) {
        result.system.capsules.push_back({(int) result.x.size()/3, -1, 0.3*diameter, -1, 0});
        add(result.x, place());
    }
    // Random order of capsules.
    shuffle(result.system.capsules.begin(), result.system.capsules.end(), generator);
    const int count = result.system.capsules.size();
    for (int i = 0; i < count; i++)
        result.system.exclusions.push_back({(int) (generator()%count), (int) (generator()%count)});
    result.y = result.x;
    normal_distribution<double> normal;
    for (double& coordinate : result.y)
        coordinate += motion*normal(generator);
    return result;
}

static bool excludedByHand(const CapsuleSystem& system, int a, int b) {
    const Capsule &one = system.capsules[a], &other = system.capsules[b];
    for (int i : {one.first, one.second})
        for (int j : {other.first, other.second})
            if (i >= 0 && i == j)
                return true;
    if (one.chain >= 0 && one.chain == other.chain) {
        const CapsuleChain& chain = system.chains[one.chain];
        for (int apart = 0; apart <= chain.excludedNeighbors; apart++)
            for (int sign : {-1, 1}) {
                int index = one.index+sign*apart;
                if (chain.closed)
                    index = (index+chain.numCapsules)%chain.numCapsules;
                if (index == other.index)
                    return true;
            }
    }
    for (const pair<int, int>& exclusion : system.exclusions)
        if (exclusion == make_pair(a, b) || exclusion == make_pair(b, a))
            return true;
    return false;
}

struct FoundPairs {
    int near = 0, crossing = 0;
};

/** Compare the pairs of a search with all pairs in all images. */
static FoundPairs comparePairs(const TestSystem& test, const vector<ContactPair>& pairs, const double* box,
        double reach) {
    map<pair<int, int>, const ContactPair*> found;
    for (size_t i = 0; i < pairs.size(); i++) {
        check(pairs[i].a < pairs[i].b, "a < b");
        if (i > 0)
            check(make_pair(pairs[i-1].a, pairs[i-1].b) < make_pair(pairs[i].a, pairs[i].b), "sorted, each one once");
        found[{pairs[i].a, pairs[i].b}] = &pairs[i];
    }
    FoundPairs result;
    const vector<Capsule>& capsules = test.system.capsules;
    const int images = box == NULL ? 0 : 12;
    int explained = 0;
    for (int a = 0; a < (int) capsules.size(); a++)
        for (int b = a+1; b < (int) capsules.size(); b++) {
            if (excludedByHand(test.system, a, b))
                continue;
            const Vec3d a0 = at(test.x, capsules[a].first), a1 = at(test.x, capsules[a].end());
            const Vec3d b0 = at(test.x, capsules[b].first), b1 = at(test.x, capsules[b].end());
            const Vec3d A0 = at(test.y, capsules[a].first), A1 = at(test.y, capsules[a].end());
            const Vec3d B0 = at(test.y, capsules[b].first), B1 = at(test.y, capsules[b].end());
            const double limit = capsules[a].radius+capsules[b].radius+reach;
            const double motion = max(max(length(A0-a0-B0+b0), length(A0-a0-B1+b1)),
                    max(length(A1-a1-B0+b0), length(A1-a1-B1+b1)));
            // Spheres pass through others at a distance, and iterations move all by the reach.
            const bool sphere = capsules[a].second < 0 || capsules[b].second < 0;
            const double farthest = motion+2*reach+(sphere ? 2*DEEP*(limit-reach) : 0);
            bool must = false, may = false, later = false;
            Vec3d image = {0, 0, 0};
            // Images that are far from each other need not be looked at one by one.
            const double largest = length(a1-a0)+length(b1-b0)+limit+2*farthest;
            for (int k = -images; k <= images; k++) {
                if (box != NULL && fabs(a0.z-b0.z+k*box[8]) > largest)
                    continue;
                for (int j = -images; j <= images; j++) {
                    if (box != NULL && fabs(a0.y-b0.y+j*box[4]+k*box[7]) > largest)
                        continue;
                    for (int i = -images; i <= images; i++) {
                        Vec3d shift = {0, 0, 0};
                        if (box != NULL)
                            shift = {i*box[0]+j*box[3]+k*box[6], j*box[4]+k*box[7], k*box[8]};
                        if (length(a0-b0+shift) > largest)
                            continue;
                        const double before = distanceByHand(a0+shift, a1+shift, b0, b1);
                        const double after = distanceByHand(A0+shift, A1+shift, B0, B1);
                        bool mustBe = before < limit-1e-9 || after < limit-1e-9;
                        if (!mustBe && before+after <= motion+1e-9) {
                            const Vec3d start[] = {a0+shift, a1+shift, b0, b1}, end[] = {A0+shift, A1+shift, B0, B1};
                            const CrossingByHand crossing = crossingsByHand(start, end);
                            mustBe = crossing.clear && crossing.count > 0;
                            result.crossing += mustBe;
                        }
                        if (mustBe || before < limit+1e-9 || after < limit+1e-9 || before+after <= motion+1e-9) {
                            check(!may, "a pair meets in one image");
                            may = true;
                            must = mustBe;
                            image = shift;
                        }
                        else if (before+after <= farthest+1e-9 && !may) {
                            later = true;
                            image = shift;
                        }
                    }
                }
            }
            const auto entry = found.find({a, b});
            const string name = "pair "+to_string(a)+", "+to_string(b);
            if (must)
                check(entry != found.end(), "lost "+name);
            if (entry == found.end())
                continue;
            check(may || later, "too far: "+name);
            explained++;
            const ContactPair& contact = *entry->second;
            const Vec3d shift = {contact.shift[0], contact.shift[1], contact.shift[2]};
            checkClose(0, length(shift-image), 1, 1e-9, "image of "+name);
            const Vec3d start[] = {a0+shift, a1+shift, b0, b1};
            const double volume = volumeByHand(start, start, 0);
            if (fabs(volume) > 1e-6)
                check((volume > 0 ? 1 : -1) == contact.side, "side of "+name);
            result.near += must;
        }
    check(explained == (int) pairs.size(), "excluded pairs were found");
    return result;
}

static vector<ContactPair> findPairs(const TestSystem& test, const double* box, double reach,
        const Loop& run = Loop()) {
    ContactSearch search(test.system);
    vector<ContactPair> pairs;
    search.findPairs(test.x.data(), test.y.data(), box, reach, pairs, run);
    return pairs;
}

static void testPairs() {
    mt19937_64 generator(3);
    FoundPairs all;
    for (int trial = 0; trial < 30; trial++) {
        // Thin ones that cross must be found though they are far from each other at the start and at the end.
        const bool thin = trial >= 24;
        const double segment = trial%3 == 0 ? 30 : 100, motion = thin ? 25 : trial%4 == 0 ? 0 : 5;
        const double diameter = thin ? 0.5 : 30, reach = thin || trial%3 == 1 ? 0 : 15;
        // Random boxes, in reduced form.
        const double size = 900;
        const double tilt = trial%2 == 0 ? 0 : 0.5;
        double box[9] = {size*uniform(generator, 1, 1.3), 0, 0, 0, size*uniform(generator, 1, 1.3), 0, 0, 0,
                size*uniform(generator, 1, 1.3)};
        box[3] = tilt*box[0]*uniform(generator, -1, 1);
        box[6] = tilt*box[0]*uniform(generator, -1, 1);
        box[7] = tilt*box[4]*uniform(generator, -1, 1);
        const double* vectors = trial%6 < 4 ? box : NULL;
        TestSystem test = makeSystem(generator, 40, 8, size, segment, diameter, motion, vectors);
        if (motion == 0 && trial%8 == 0) {
            // The same array, too.
            ContactSearch search(test.system);
            vector<ContactPair> pairs, same = findPairs(test, vectors, reach);
            search.findPairs(test.x.data(), test.x.data(), vectors, reach, pairs);
            check(pairs.size() == same.size(), "one array or two");
        }
        const FoundPairs found = comparePairs(test, findPairs(test, vectors, reach), vectors, reach);
        all.near += found.near;
        all.crossing += found.crossing;
    }
    check(all.near > 3000 && all.crossing > 50, "many pairs were compared");
}

/** A box that is as small as allowed: two cells in each direction. And one that is a bit smaller. */
static void testSmallBoxes() {
    mt19937_64 generator(4);
    int compared = 0;
    for (int trial = 0; trial < 30; trial++) {
        const double tilt = trial%2 == 0 ? 0 : 0.5;
        auto boxOfSize = [&] (double size, double* box) {
            const double vectors[9] = {size, 0, 0, tilt*size*0.7, 0.9*size, 0, -tilt*0.9*size, tilt*0.8*size,
                    0.95*size};
            copy(vectors, vectors+9, box);
        };
        double box[9];
        boxOfSize(400, box);
        TestSystem test = makeSystem(generator, 6, 1+trial%3, 0, 60, 20, 4, box);
        double lower = 100, upper = 1200;
        while (upper-lower > 1e-3) {
            const double size = 0.5*(lower+upper);
            boxOfSize(size, box);
            try {
                findPairs(test, box, 10);
                upper = size;
            }
            catch (const invalid_argument& error) {
                check(string(error.what()).find("too small") != string::npos, error.what());
                lower = size;
            }
        }
        check(upper < 500, "a box that is large enough is taken");
        boxOfSize(upper, box);
        compared += comparePairs(test, findPairs(test, box, 10), box, 10).near;
    }
    check(compared > 300, "many pairs were compared in small boxes");
}

/** Nearly parallel segments of all distances, far from the origin: none must be lost in single precision. */
static void testRounding() {
    mt19937_64 generator(5);
    for (double far : {0.0, 1e3, 1e6}) {
        int near = 0;
        for (int trial = 0; trial < 60; trial++) {
            TestSystem test;
            const Vec3d direction = randomVector(generator);
            const Vec3d along = direction*(100/length(direction)), across = randomVector(generator);
            const Vec3d origin = randomVector(generator, far);
            const double angle = pow(10, uniform(generator, -9, -0.5));
            for (int i = 0; i < 40; i++) {
                const Vec3d start = origin+across*uniform(generator, 0, 60)+along*uniform(generator, -2, 2);
                add(test.x, start);
                add(test.x, start+along+randomVector(generator, 100*angle));
                test.system.capsules.push_back({2*i, 2*i+1, trial%2 == 0 ? 15.0 : 0.01});
            }
            test.y = test.x;
            near += comparePairs(test, findPairs(test, NULL, 0), NULL, 0).near;
        }
        check(near > 1000, "many pairs were compared");
    }
}

/** What a first look says must be so. */
static void testOutlooks() {
    mt19937_64 generator(11);
    int crossing = 0, touching = 0, ofNeighbors = 0;
    for (int trial = 0; trial < 6; trial++) {
        const double box[9] = {700, 0, 0, 100, 700, 0, -50, 80, 700}, *vectors = trial%2 == 0 ? box : NULL;
        const TestSystem test = makeSystem(generator, 60, 8, 700, 50, 20, trial < 4 ? 6 : 0, vectors);
        const double *x = test.x.data(), *y = test.y.data();
        ContactSearch search(test.system);
        vector<ContactPair> pairs;
        search.findPairs(x, y, vectors, 10, pairs);
        vector<const ContactPair*> pointers;
        for (const ContactPair& pair : pairs)
            pointers.push_back(&pair);
        vector<PairOutlook> outlooks(pairs.size());
        search.setMotion(x, y, [] (int count, const function<void(int)>& iteration) {
            for (int i = 0; i < count; i++)
                iteration(i);
        });
        search.findOutlooks(pointers.data(), pointers.size(), outlooks.data());
        for (size_t i = 0; i < pairs.size(); i++) {
            const Capsule &a = test.system.capsules[pairs[i].a], &b = test.system.capsules[pairs[i].b];
            const Vec3d shift = {pairs[i].shift[0], pairs[i].shift[1], pairs[i].shift[2]};
            const double distance = distanceByHand(at(test.y, a.first)+shift, at(test.y, a.end())+shift,
                    at(test.y, b.first), at(test.y, b.end()));
            checkClose(distance-a.radius-b.radius, outlooks[i].gap, 1, 1e-6, "gap");
            const bool crosses = search.crosses(pairs[i], x, y);
            check(outlooks[i].mayCross || !crosses, "a pair that crosses may do so");
            Contact contacts[2];
            const int count = search.evaluate(pairs[i], x, y, contacts);
            check(!outlooks[i].isOfNeighbor || count == 0, "a neighbor's contact");
            crossing += crosses;
            touching += !outlooks[i].mayCross && !outlooks[i].isOfNeighbor && count > 0;
            ofNeighbors += outlooks[i].isOfNeighbor;
        }
    }
    check(crossing > 10 && touching > 100 && ofNeighbors > 100, "all of them occur");
}

/** Pairs that a search has not found come to be known when one of their capsules has moved by half of the reach. */
static void testSearchingAgain() {
    mt19937_64 generator(12);
    const double reach = 10;
    int added = 0;
    for (int trial = 0; trial < 4; trial++) {
        const double box[9] = {900, 0, 0, 100, 900, 0, -50, 80, 900}, *vectors = trial%2 == 0 ? box : NULL;
        const TestSystem test = makeSystem(generator, 60, 8, 900, 50, 20, 5, vectors);
        ContactSearch search(test.system);
        vector<ContactPair> pairs, others;
        search.findPairs(test.x.data(), test.y.data(), vectors, reach, pairs);
        set<pair<int, int> > known;
        for (const ContactPair& one : pairs)
            known.insert({one.a, one.b});
        // In some chains, all nodes move far, and more than once.
        vector<double> y = test.y;
        for (int turn = 0; turn < 3; turn++) {
            vector<int> moved;
            for (int i = 0; i < (int) test.system.capsules.size(); i++) {
                const Capsule& capsule = test.system.capsules[i];
                if (capsule.chain < 0 || capsule.chain%3 != turn%2)
                    continue;
                moved.push_back(i);
                for (int k = 0; k < 3 && capsule.index == 0; k++)
                    y[3*capsule.first+k] += 30;
                for (int k = 0; k < 3; k++)
                    y[3*capsule.end()+k] += 30;
            }
            search.findPairsOf(moved, test.x.data(), y.data(), others);
            for (const ContactPair& one : others)
                added += known.insert({one.a, one.b}).second;
            vector<ContactPair> all;
            ContactSearch(test.system).findPairs(test.x.data(), y.data(), vectors, reach, all);
            const set<int> again(moved.begin(), moved.end());
            for (const ContactPair& one : all)
                check(known.count({one.a, one.b}) == 1 || (again.count(one.a) == 0 && again.count(one.b) == 0),
                        "lost pair "+to_string(one.a)+", "+to_string(one.b));
        }
    }
    check(added > 100, "pairs were added");
}

static void testLoops() {
    mt19937_64 generator(6);
    const double box[9] = {1200, 0, 0, 300, 1200, 0, -100, 200, 1200};
    const TestSystem test = makeSystem(generator, 100, 10, 0, 100, 30, 8, box);
    const vector<ContactPair> expected = findPairs(test, box, 20);
    const Loop backwards = [] (int count, const function<void(int)>& iteration) {
        for (int i = count-1; i >= 0; i--)
            iteration(i);
    };
    for (int numThreads : {1, 2, 3, 5}) {
        const Loop run = [numThreads] (int count, const function<void(int)>& iteration) {
            vector<thread> threads;
            for (int t = 0; t < numThreads; t++)
                threads.emplace_back([=, &iteration] {
                    for (int i = t; i < count; i += numThreads)
                        iteration(i);
                });
            for (thread& worker : threads)
                worker.join();
        };
        for (const Loop& runner : {run, backwards}) {
            const vector<ContactPair> pairs = findPairs(test, box, 20, runner);
            check(pairs.size() == expected.size(), "as many pairs");
            for (size_t i = 0; i < pairs.size(); i++)
                check(pairs[i].a == expected[i].a && pairs[i].b == expected[i].b && pairs[i].side == expected[i].side &&
                        memcmp(pairs[i].shift, expected[i].shift, sizeof(pairs[i].shift)) == 0, "the same pairs");
        }
    }
    // A search may be used again, with other positions and boxes.
    ContactSearch search(test.system);
    vector<ContactPair> pairs;
    for (int turn = 0; turn < 2; turn++) {
        search.findPairs(test.x.data(), test.y.data(), NULL, 5, pairs);
        search.findPairs(test.x.data(), test.y.data(), box, 20, pairs);
        check(pairs.size() == expected.size(), "a search that was used before");
    }
}

static vector<Contact> evaluateAll(const ContactSearch& search, const vector<ContactPair>& pairs, const Array& x,
        const Array& y) {
    vector<Contact> contacts;
    for (const ContactPair& pair : pairs) {
        Contact found[2];
        const int count = search.evaluate(pair, x.data(), y.data(), found);
        check(count >= 0 && count <= 2, "at most two contacts");
        contacts.insert(contacts.end(), found, found+count);
    }
    return contacts;
}

/** A joint that goes through a rod in their plane, and a rod through a joint: one contact, which pushes back. */
static void testPlanarJoints() {
    mt19937_64 generator(12);
    for (int trial = 0; trial < 500; trial++) {
        // A chain with a bend whose joint points down, above a rod along x, in any plane.
        const double left = uniform(generator, 10, 30), right = uniform(generator, 10, 30);
        const double way = uniform(generator, 3, 8);
        const Vec3d a = randomVector(generator), b = a.cross(randomVector(generator));
        const Vec3d u = a*(1/length(a)), v = b*(1/length(b)), origin = randomVector(generator, 500);
        CapsuleSystem system = {{{0, 1, 5, 0, 0}, {1, 2, 5, 0, 1}, {3, 4, 5}}, {{2, false, 1}}, {}};
        Array x;
        for (const Vec3d& place : {Vec3d{-40, left, 0}, Vec3d{0, 2, 0}, Vec3d{40, right, 0}, Vec3d{-60, 0, 0},
                Vec3d{60, 0, 0}})
            add(x, origin+u*place.x+v*place.y);
        Array y = x;
        for (int particle = 0; particle < 3; particle++)
            for (int k = 0; k < 3; k++)
                y[3*particle+k] -= way*(k == 0 ? v.x : k == 1 ? v.y : v.z);
        ContactSearch search(system);
        vector<ContactPair> pairs;
        search.findPairs(x.data(), y.data(), NULL, 0, pairs);
        double weight = 0;
        for (const Contact& contact : evaluateAll(search, pairs, x, y)) {
            const Vec3d normal = {contact.normal[0], contact.normal[1], contact.normal[2]};
            const bool deepest = contact.gap < -10;
            if (deepest) {
                checkClose(2-way-10, contact.gap, 10, 1e-9, "signed gap");
                checkClose(1, normal.dot(v), 1, 1e-9, "it pushes back");
                check(contact.crossed, "it has crossed");
                weight += contact.weight;
            }
        }
        checkClose(1, weight, 1, 1e-12, "a joint counts once");
        for (const ContactPair& pair : pairs)
            if (pair.b == 2)
                check(search.crosses(pair, x.data(), y.data()), "both segments at the joint cross");
    }
}

/** A sphere that goes through a rod is pushed back; one that goes around it is not. */
static void testSpheres() {
    mt19937_64 generator(13);
    for (bool rod : {true, false})
        for (int trial = 0; trial < 2000; trial++) {
            const bool sphereFirst = trial%2 == 0;
            const Vec3d a = randomVector(generator), b = a.cross(randomVector(generator));
            const Vec3d u = a*(1/length(a)), v = b*(1/length(b)), w = u.cross(v), origin = randomVector(generator, 100);
            const double height = uniform(generator, 11, 25), depth = uniform(generator, -25, 20);
            const double beside = uniform(generator, -18, 18), along = uniform(generator, -40, 40);
            Array x, y;
            CapsuleSystem system;
            const Vec3d from = origin+w*height+u*(rod ? along : 0), to = origin+w*depth+v*beside+u*(rod ? along : 0);
            auto addSphere = [&] {
                system.capsules.push_back({(int) x.size()/3, -1, 8});
                add(x, from);
                add(y, to);
            };
            auto addOther = [&] {
                const int first = x.size()/3;
                system.capsules.push_back({first, rod ? first+1 : -1, 2});
                for (int end = 0; end < (rod ? 2 : 1); end++)
                    for (Array* positions : {&x, &y})
                        add(*positions, rod ? origin+u*(end == 0 ? -50 : 50) : origin);
            };
            if (sphereFirst) {
                addSphere();
                addOther();
            }
            else {
                addOther();
                addSphere();
            }
            // How near it comes, in small parts of the way.
            double nearest = 1e9;
            for (int i = 0; i <= 2000; i++)
                nearest = min(nearest, hypot(height+(depth-height)*i/2000.0, beside*i/2000.0));
            if (fabs(nearest-7) < 0.01 || fabs(depth) < 1e-3)
                continue;
            const bool deep = nearest < 7, through = deep && depth < 0;
            ContactSearch search(system);
            vector<ContactPair> pairs;
            search.findPairs(x.data(), y.data(), NULL, 0, pairs);
            check(!deep || pairs.size() == 1, "what goes through is found");
            if (pairs.empty())
                continue;
            check(search.crosses(pairs[0], x.data(), y.data()) == through, "through or not");
            const vector<Contact> contacts = evaluateAll(search, pairs, x, y);
            check(contacts.size() == 1, "one contact");
            const Vec3d normal = Vec3d{contacts[0].normal[0], contacts[0].normal[1], contacts[0].normal[2]}*
                    (sphereFirst ? 1 : -1);
            check(contacts[0].crossed == through, "crossed");
            checkClose((deep ? depth : hypot(depth, beside))-10, contacts[0].gap, 10, 1e-9, "gap");
            if (deep)
                checkClose(1, normal.dot(w), 1, 1e-9, "normal of the start");
        }
}

/** A rod that moves through another: its gap goes on below what the distance alone can be. */
static void testSignedGap() {
    mt19937_64 generator(7);
    for (int trial = 0; trial < 200; trial++) {
        CapsuleSystem system = {{{0, 1, 15}, {2, 3, 10}}, {}, {}};
        const Vec3d p = randomVector(generator, 60), q = randomVector(generator, 60);
        const Vec3d n = p.cross(q)*(1/length(p.cross(q)));
        if (n.squared() < 0.9 || length(p.cross(q)) < 0.1*length(p)*length(q))
            continue;
        const double s = uniform(generator, 0.05, 0.95), t = uniform(generator, 0.05, 0.95);
        Array x;
        const Vec3d first = n*20-p*s, second = q*-t;
        add(x, first);
        add(x, first+p);
        add(x, second);
        add(x, second+q);
        ContactSearch search(system);
        for (double way : {0.0, 5.0, 19.9, 20.1, 27.0, 50.0}) {
            Array y = x;
            for (int particle = 0; particle < 2; particle++) {
                y[3*particle] -= way*n.x;
                y[3*particle+1] -= way*n.y;
                y[3*particle+2] -= way*n.z;
            }
            vector<ContactPair> pairs;
            search.findPairs(x.data(), y.data(), NULL, 0, pairs);
            check(pairs.size() == 1, "one pair");
            const vector<Contact> contacts = evaluateAll(search, pairs, x, y);
            check(contacts.size() == 1, "one contact");
            checkClose(20-way-25, contacts[0].gap, 100, 1e-11, "signed gap");
            check(contacts[0].crossed == (way > 20), "crossed or not");
            check(search.crosses(pairs[0], x.data(), y.data()) == (way > 20), "crosses or not");
            checkClose(s, contacts[0].s, 1, 1e-9, "s");
            checkClose(t, contacts[0].t, 1, 1e-9, "t");
            const double* normal = contacts[0].normal;
            checkClose(1, n.dot({normal[0], normal[1], normal[2]}), 1, 1e-9, "normal");
            checkClose(1, contacts[0].weight, 1, 0, "weight");
        }
    }
}

/** Rods side by side: a contact at each end of their overlap, with half of the stiffness. */
static void testParallel() {
    CapsuleSystem system = {{{0, 1, 10}, {2, 3, 10}}, {}, {}};
    ContactSearch search(system);
    for (double offset : {-120.0, -90.0, -30.0, 0.0, 20.0, 99.0, 110.0})
        for (bool reversed : {false, true}) {
            const double from = reversed ? 100+offset : offset, to = reversed ? offset : 100+offset;
            const Array x = {0, 0, 0, 100, 0, 0, from, 0, 12, to, 0, 12};
            vector<ContactPair> pairs;
            search.findPairs(x.data(), x.data(), NULL, 50, pairs);
            check(pairs.size() == 1, "one pair");
            const vector<Contact> contacts = evaluateAll(search, pairs, x, x);
            const bool overlap = fabs(offset) < 100;
            check(contacts.size() == (overlap ? 2 : 1), "contacts at the ends of the overlap");
            double places = 0;
            for (const Contact& contact : contacts) {
                const double apart = overlap ? 0 : fabs(offset)-100;
                checkClose(sqrt(144+apart*apart)-20, contact.gap, 10, 1e-12, "gap");
                checkClose(overlap ? 0.5 : 1, contact.weight, 1, 0, "weight");
                check(!contact.crossed, "they do not cross");
                places += contact.s;
            }
            if (overlap)
                checkClose((max(0.0, offset)+min(100.0, 100+offset))/100, places, 1, 1e-12, "ends of the overlap");
        }
    // Segments that meet in a point.
    const Array x = {0, 0, 0, 100, 0, 0, 50, -50, 0, 50, 50, 0};
    vector<ContactPair> pairs;
    search.findPairs(x.data(), x.data(), NULL, 0, pairs);
    const vector<Contact> contacts = evaluateAll(search, pairs, x, x);
    check(contacts.size() == 1 && fabs(contacts[0].gap+20) < 1e-12 && fabs(fabs(contacts[0].normal[2])-1) < 1e-12,
            "segments that meet");
}

/** Something slides along a chain with bends: its energy is that of the nearest place of the chain, at joints, too. */
static void testJoints() {
    const double stiffness = 2;
    mt19937_64 generator(8);
    double largestJump = 0;
    int several = 0;
    for (double bend : {0.0, 1e-4, 0.05, 0.3, 0.8, 1.5})
        for (int side : {-1, 1})
            for (bool rod : {false, true})
                for (bool chainFirst : {false, true}) {
                    // A chain that turns to and fro in the plane z = 0, and a sphere, or a rod across the plane.
                    Array x;
                    CapsuleSystem system;
                    double angle = -0.5*bend;
                    Vec3d node = {0, 0, 0};
                    const int segments = 6;
                    for (int s = 0; s <= segments; s++) {
                        add(x, node);
                        node = node+Vec3d{cos(angle), sin(angle), 0}*40;
                        angle += s%2 == 0 ? bend : -bend;
                        if (s < segments)
                            system.capsules.push_back({s, s+1, 10, 0, s});
                    }
                    system.chains.push_back({segments, false, 1});
                    system.capsules.push_back({segments+1, rod ? segments+2 : -1, 5});
                    if (!chainFirst)
                        rotate(system.capsules.begin(), system.capsules.end()-1, system.capsules.end());
                    ContactSearch search(system);
                    double last = -1;
                    for (double place = -5; place < 240; place += 0.01) {
                        Array y = x;
                        const Vec3d body = {place, side*12.0, 0};
                        add(y, rod ? body+Vec3d{3, 2, -30} : body);
                        if (rod)
                            add(y, body+Vec3d{-3, -2, 30});
                        vector<ContactPair> pairs;
                        search.findPairs(y.data(), y.data(), NULL, 0, pairs);
                        double energy = 0, least = 1e9;
                        int count = 0;
                        for (const Contact& contact : evaluateAll(search, pairs, y, y))
                            if (contact.gap < 0) {
                                energy += 0.5*stiffness*contact.weight*contact.gap*contact.gap;
                                count++;
                            }
                        for (int s = 0; s < segments; s++)
                            least = min(least, distanceByHand(at(y, s), at(y, s+1), at(y, segments+1),
                                    at(y, rod ? segments+2 : segments+1))-15);
                        const double expected = least < 0 ? 0.5*stiffness*least*least : 0;
                        checkClose(expected, energy, 1, 1e-9, "energy beside a joint");
                        if (last >= 0)
                            largestJump = max(largestJump, fabs(energy-last));
                        last = energy;
                        several += pairs.size() > 1;
                    }
                }
    check(several > 1000, "joints were passed");
    // The force times a step of the place.
    check(largestJump < 15*stiffness*0.01*1.01, "the energy is continuous");
}

/** Two bodies across each other count once, however their chains are divided. */
static void testDivision() {
    double expected = 0;
    for (int segments : {1, 2, 5, 17})
        for (int otherSegments : {1, 4}) {
            Array x;
            CapsuleSystem system;
            for (int s = 0; s <= segments; s++)
                add(x, {200.0*s/segments, 0, 0});
            for (int s = 0; s < segments; s++)
                system.capsules.push_back({s, s+1, 10, 0, s});
            // They meet at joints of both.
            for (int s = 0; s <= otherSegments; s++)
                add(x, {100, -100+200.0*s/otherSegments, 12});
            for (int s = 0; s < otherSegments; s++)
                system.capsules.push_back({segments+1+s, segments+2+s, 10, 1, s});
            system.chains = {{segments, false, segments}, {otherSegments, false, otherSegments}};
            ContactSearch search(system);
            vector<ContactPair> pairs;
            search.findPairs(x.data(), x.data(), NULL, 0, pairs);
            double energy = 0;
            for (const Contact& contact : evaluateAll(search, pairs, x, x))
                energy += contact.weight*contact.gap*contact.gap;
            if (expected == 0)
                expected = energy;
            checkClose(64, energy, 64, 1e-9, "energy of divided chains");
        }
}

/** A rod is carried through a chain, at joints or beside them: what crosses is seen, and pushed back. */
static void testCrossingChains() {
    mt19937_64 generator(10);
    int crossed = 0, atJoints = 0, wrong = 0;
    for (int trial = 0; trial < 4000; trial++) {
        CapsuleSystem system;
        Array x;
        Vec3d node = {0, 0, 0}, direction = {1, 0, 0};
        const int segments = 5;
        for (int s = 0; s <= segments; s++) {
            add(x, node);
            direction = direction+randomVector(generator, 0.3);
            direction = direction*(1/length(direction));
            node = node+direction*40;
            if (s < segments)
                system.capsules.push_back({s, s+1, 8, 0, s});
        }
        system.chains.push_back({segments, false, 1});
        // Through a place of the chain, half of the time near a joint.
        const int segment = 1+generator()%3;
        const bool joint = trial%2 == 0;
        const double fraction = joint ? uniform(generator, -0.02, 0.02) : uniform(generator, 0.1, 0.9);
        const Vec3d place = at(x, segment)+(at(x, segment+1)-at(x, segment))*max(0.0, fraction)+
                (at(x, segment)-at(x, segment-1))*min(0.0, fraction);
        const Vec3d along = Vec3d{uniform(generator, -0.5, 0.5), 1, uniform(generator, -0.5, 0.5)}*60;
        const Vec3d way = {uniform(generator, -2, 2), uniform(generator, -2, 2), uniform(generator, 4, 16)};
        const double before = uniform(generator, 0.1, 0.9);
        add(x, place-along*0.5-way*before);
        add(x, place+along*0.5-way*before);
        Array y = x;
        for (int particle = segments+1; particle <= segments+2; particle++)
            for (int k = 0; k < 3; k++)
                y[3*particle+k] += k == 0 ? way.x : k == 1 ? way.y : way.z;
        system.capsules.push_back({segments+1, segments+2, 8});
        ContactSearch search(system);
        vector<ContactPair> pairs;
        search.findPairs(x.data(), y.data(), NULL, 0, pairs);
        int throughs = 0;
        bool clear = true, seen = false;
        for (int s = 0; s < segments; s++) {
            const Vec3d start[] = {at(x, s), at(x, s+1), at(x, segments+1), at(x, segments+2)};
            const Vec3d end[] = {at(y, s), at(y, s+1), at(y, segments+1), at(y, segments+2)};
            const CrossingByHand one = crossingsByHand(start, end);
            throughs += one.count;
            clear = clear && one.clear;
        }
        Vec3d force = {0, 0, 0};
        for (const Contact& contact : evaluateAll(search, pairs, x, y)) {
            seen = seen || contact.crossed;
            // On the rod, which is b.
            if (contact.gap < 0)
                force = force+Vec3d{contact.normal[0], contact.normal[1], contact.normal[2]}*
                        (contact.weight*contact.gap);
        }
        if (!clear || throughs != 1)
            continue;
        bool verified = false;
        for (const ContactPair& pair : pairs)
            verified = verified || search.crosses(pair, x.data(), y.data());
        check(seen && verified, "what crosses a chain is seen");
        crossed++;
        atJoints += joint;
        wrong += force.dot(way) >= 0;
    }
    check(crossed > 2000 && atJoints > 800, "chains were crossed");
    check(wrong == 0, "what has crossed is pushed back");
}

/** Segments taken as their shortest images give the same contacts as whole chains, around joints, too. */
static void testNearestImages() {
    mt19937_64 generator(9);
    const double box[9] = {800, 0, 0, 100, 800, 0, -150, 200, 800};
    int crossed = 0;
    for (int trial = 0; trial < 10; trial++) {
        TestSystem whole = makeSystem(generator, 40, 6, 0, 60, 30, 10, box), images = whole;
        for (size_t i = 0; i < whole.x.size(); i += 3) {
            const double a = (int) (generator()%3)-1, b = (int) (generator()%3)-1, c = (int) (generator()%3)-1;
            const double shift[] = {a*box[0]+b*box[3]+c*box[6], b*box[4]+c*box[7], c*box[8]};
            for (int k = 0; k < 3; k++) {
                images.x[i+k] += shift[k];
                images.y[i+k] += shift[k];
            }
        }
        ContactSearch search(whole.system), nearest(images.system, true);
        vector<ContactPair> expected, found;
        search.findPairs(whole.x.data(), whole.y.data(), box, 10, expected);
        nearest.findPairs(images.x.data(), images.y.data(), box, 10, found);
        check(expected.size() == found.size() && found.size() > 50, "the same pairs");
        for (size_t i = 0; i < found.size(); i++) {
            check(expected[i].a == found[i].a && expected[i].b == found[i].b, "the same pair");
            Contact one[2], other[2];
            const int count = search.evaluate(expected[i], whole.x.data(), whole.y.data(), one);
            check(count == nearest.evaluate(found[i], images.x.data(), images.y.data(), other), "as many contacts");
            for (int k = 0; k < count; k++) {
                checkClose(one[k].gap, other[k].gap, 100, 1e-9, "gap");
                checkClose(one[k].normal[0], other[k].normal[0], 1, 1e-6, "normal");
                check(one[k].crossed == other[k].crossed, "crossed or not");
                crossed += one[k].crossed;
            }
        }
    }
    check(crossed > 3, "some crossed");
}

static void checkRefused(const function<void()>& function, const string& reason) {
    try {
        function();
    }
    catch (const invalid_argument& error) {
        check(string(error.what()).find(reason) != string::npos, string("not for this reason: ")+error.what());
        return;
    }
    throw runtime_error("not refused: "+reason);
}

static void testRefusals() {
    auto make = [] (const vector<Capsule>& capsules, const vector<pair<int, int> >& exclusions) {
        ContactSearch search({capsules, {{1, false, 1}}, exclusions});
    };
    checkRefused([&] {make({{-1, 0, 1}}, {});}, "particle");
    checkRefused([&] {make({{2, 2, 1}}, {});}, "particle");
    checkRefused([&] {make({{0, 1, -1}}, {});}, "radius");
    checkRefused([&] {make({{0, 1, NAN}}, {});}, "radius");
    checkRefused([&] {make({{0, 1, 1, 1, 0}}, {});}, "chain");
    checkRefused([&] {make({{0, 1, 1, 0, 1}}, {});}, "number in its chain");
    checkRefused([&] {make({{0, 1, 1, 0, 0}}, {{0, 1}});}, "capsule 1");
    CapsuleSystem system = {{{0, 1, 1}, {2, -1, 1}}, {}, {}};
    ContactSearch search(system);
    vector<ContactPair> pairs;
    const double x[] = {0, 0, 0, 10, 0, 0, 5, 0, 1}, box[] = {100, 0, 0, 0, 100, 0, 0, 0, 100};
    const double notReduced[] = {100, 10, 0, 0, 100, 0, 0, 0, 100};
    checkRefused([&] {search.findPairs(x, x, box, -1, pairs);}, "reach");
    checkRefused([&] {search.findPairs(x, x, notReduced, 1, pairs);}, "reduced");
    for (double bad : {(double) NAN, (double) INFINITY})
        for (const double* vectors : {box, (const double*) NULL}) {
            const double y[] = {0, 0, 0, 10, 0, 0, 5, bad, 1};
            checkRefused([&] {search.findPairs(x, y, vectors, 1, pairs);}, "particle 2");
        }
    search.findPairs(x, x, box, 1, pairs);
    check(pairs.size() == 1, "one pair");
    ContactSearch empty((CapsuleSystem()));
    empty.findPairs(x, x, box, 1, pairs);
    check(pairs.empty(), "nothing there");
}

int main() {
    const string instructionSet = candidateKernels().instructionSet;
    try {
        for (auto test : {testNearestPoints, testCrossings, testPlanarCrossings, testPlanarJoints, testSpheres,
                testPairs, testSmallBoxes, testRounding, testOutlooks, testSearchingAgain, testLoops, testSignedGap,
                testParallel, testJoints, testDivision, testCrossingChains, testNearestImages, testRefusals})
            test();
    }
    catch (const exception& error) {
        printf("FAILED (%s): %s\n", instructionSet.c_str(), error.what());
        return 1;
    }
    printf("Passed with %s\n", instructionSet.c_str());
    return 0;
}
