/**
 * This tests where segments are nearest, against other formulas, and what crosses on its way, against many short parts
 * of the time.
 */

#include "TestCapsuleSystems.h"
#include "couplings/Crossings.h"

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

int main() {
    return runTests({testNearestPoints, testCrossings, testPlanarCrossings});
}
