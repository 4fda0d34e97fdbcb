#ifndef CYLCHAIN_CROSSINGS_H_
#define CYLCHAIN_CROSSINGS_H_

#include "couplings/CapsuleGeometry.h"
#include "couplings/Capsules.h"

/**
 * Whether segments pass through each other, and spheres through segments.
 */
namespace cylchain {

/** How two segments pass through each other. */
struct Crossing {
    /** Fractions along both, and of the time. */
    double s, t, time;
    /** A unit vector that points from b to a before they cross. */
    Vec3d normal;
};

/** The polynomial c0+c1 u+c2 u^2+c3 u^3. */
struct Cubic {
    double c[4];
    double operator()(double u) const {
        return c[0]+u*(c[1]+u*(c[2]+u*c[3]));
    }
};

/** The volume of two segments whose ends move with constant velocities, as a function of time. */
inline Cubic volumeInTime(const SegmentPair& start, const SegmentPair& end) {
    const Vec3d dp = end.p-start.p, dq = end.q-start.q, dw = end.w-start.w;
    const Vec3d n0 = start.p.cross(start.q), n1 = start.p.cross(dq)+dp.cross(start.q), n2 = dp.cross(dq);
    return {{start.w.dot(n0), start.w.dot(n1)+dw.dot(n0), start.w.dot(n2)+dw.dot(n1), dw.dot(n2)}};
}

/** Find where a cubic that is monotonic between two times changes its sign; false if it does not. */
inline bool findSignChange(const Cubic& f, double lower, double upper, double& root) {
    double fLower = f(lower), fUpper = f(upper);
    if (!((fLower < 0) != (fUpper < 0)))
        return false;
    // Halving alone takes 50 turns; the Illinois rule takes about 8, and halving helps where it is slow.
    int side = 0;
    for (int turn = 0; turn < 200 && upper-lower > 1e-15; turn++) {
        double middle = turn%4 == 3 ? 0.5*(lower+upper) : (lower*fUpper-upper*fLower)/(fUpper-fLower);
        if (!(middle > lower && middle < upper))
            middle = 0.5*(lower+upper);
        if (!(middle > lower && middle < upper))
            break;
        const double fMiddle = f(middle);
        if (fMiddle == 0) {
            lower = upper = middle;
        }
        else if ((fMiddle < 0) == (fLower < 0)) {
            lower = middle;
            fLower = fMiddle;
            if (side == -1)
                fUpper *= 0.5;
            side = -1;
        }
        else {
            upper = middle;
            fUpper = fMiddle;
            if (side == 1)
                fLower *= 0.5;
            side = 1;
        }
    }
    root = 0.5*(lower+upper);
    return true;
}

/** Call a function for each change of the sign of a polynomial between 0 and 1: when, and whether it was negative. */
template <class Function> void forEachSignChange(const Cubic& f, Function function) {
    // Between the times where its slope vanishes, it is monotonic.
    double times[4] = {0, 1, 1, 1};
    int last = 1;
    const double a = 3*f.c[3], b = f.c[2], c = f.c[1], discriminant = b*b-a*c;
    if (discriminant > 0) {
        const double k = -(b+std::copysign(std::sqrt(discriminant), b));
        double first = k/a, second = c/k;
        if (!(first < second))
            std::swap(first, second);
        last = 0;
        for (double time : {first, second})
            if (time > 0 && time < 1)
                times[++last] = time;
        times[++last] = 1;
    }
    for (int i = 0; i < last; i++) {
        double u;
        if (findSignChange(f, times[i], times[i+1], u))
            function(u, f(times[i]) < 0);
    }
}

/**
 * Get whether a cubic surely has one sign between 0 and 1: whether its Bernstein coefficients have, by more than what
 * rounding does to its values.
 */
inline bool hasOneSign(const Cubic& f) {
    const double f0 = f.c[0], f1 = f0+f.c[1]/3, f2 = f1+(f.c[1]+f.c[2])/3, f3 = f0+f.c[1]+f.c[2]+f.c[3];
    const double rounding = 1e-13*(std::fabs(f.c[0])+std::fabs(f.c[1])+std::fabs(f.c[2])+std::fabs(f.c[3]));
    return std::min(std::min(f0, f1), std::min(f2, f3)) > rounding ||
            std::max(std::max(f0, f1), std::max(f2, f3)) < -rounding;
}

/** Nothing may slip through a joint by rounding: so far beyond their ends, segments still meet. */
const double BEYOND_END = 1e-9;

inline bool isWithin(double fraction) {
    return fraction >= -BEYOND_END && fraction <= 1+BEYOND_END;
}

inline SegmentPair interpolate(const SegmentPair& start, const SegmentPair& end, double u) {
    return {start.p+(end.p-start.p)*u, start.q+(end.q-start.q)*u, start.w+(end.w-start.w)*u};
}

/** Vectors stay in one plane if their components across it are less than this, over the longest of them. */
const double PLANAR = 1e-9;

/**
 * Get whether two segments stay in one plane on their way, but for rounding, and find its normal. They do not if all is
 * on one line.
 *
 * @param volume  as a function of time
 */
inline bool areInOnePlane(const SegmentPair& start, const SegmentPair& end, const Cubic& volume, Vec3d& normal) {
    const Vec3d vectors[] = {start.p, start.q, start.w, end.p, end.q, end.w};
    Vec3d longest = vectors[0];
    for (const Vec3d& vector : vectors)
        if (vector.squared() > longest.squared())
            longest = vector;
    const double length = std::sqrt(longest.squared());
    // Then no coefficient is more than this. Most pairs are done with here.
    const double largest = 40*PLANAR*length*length*length;
    for (double coefficient : volume.c)
        if (!(std::fabs(coefficient) <= largest))
            return false;
    normal = {0, 0, 0};
    for (const Vec3d& vector : vectors) {
        const Vec3d across = longest.cross(vector);
        if (across.squared() > normal.squared())
            normal = across;
    }
    if (!(std::sqrt(normal.squared()) > PLANAR*length*length))
        return false;
    normal = normal*(1/std::sqrt(normal.squared()));
    for (const Vec3d& vector : vectors)
        if (!(std::fabs(normal.dot(vector)) <= PLANAR*length))
            return false;
    return true;
}

/** Get whether two segments in a plane with a normal lie across each other. */
inline bool lieAcross(const SegmentPair& pair, const Vec3d& normal) {
    const Vec3d acrossA = normal.cross(pair.p), acrossB = normal.cross(pair.q);
    return acrossB.dot(pair.w)*acrossB.dot(pair.w+pair.p) < 0 && acrossA.dot(pair.w)*acrossA.dot(pair.w-pair.q) < 0;
}

/** The side of a line on which a point is, which is at r from a point of the line, as a function of time. */
inline Cubic sideInTime(const Vec3d& alongStart, const Vec3d& rStart, const Vec3d& alongEnd, const Vec3d& rEnd,
        const Vec3d& normal) {
    const Vec3d dAlong = alongEnd-alongStart, dr = rEnd-rStart;
    return {{normal.dot(alongStart.cross(rStart)), normal.dot(alongStart.cross(dr)+dAlong.cross(rStart)),
            normal.dot(dAlong.cross(dr)), 0}};
}

/**
 * Find how segments that stay in a plane with a normal pass through each other: an end of one goes through the inside
 * of the other, an odd number of times. Of such ends, the first two. Segments that lie across each other at the start
 * are free to come apart.
 */
inline int findPlanarCrossings(const SegmentPair& start, const SegmentPair& end, const Vec3d& normal,
        Crossing* crossings) {
    if (lieAcross(start, normal))
        return 0;
    Crossing found[4];
    int count = 0;
    for (bool ofA : {true, false})
        for (int which = 0; which < 2; which++) {
            // The end, from the first end of the other segment.
            const Vec3d &alongStart = ofA ? start.q : start.p, &alongEnd = ofA ? end.q : end.p;
            const Vec3d rStart = ofA ? start.w+start.p*which : start.q*which-start.w;
            const Vec3d rEnd = ofA ? end.w+end.p*which : end.q*which-end.w;
            int passages = 0;
            forEachSignChange(sideInTime(alongStart, rStart, alongEnd, rEnd, normal), [&] (double u, bool negative) {
                const Vec3d along = alongStart+(alongEnd-alongStart)*u, r = rStart+(rEnd-rStart)*u;
                const double fraction = along.dot(r)/along.squared();
                if (!isWithin(fraction))
                    return;
                if (passages++ > 0)
                    return;
                const Vec3d across = normal.cross(along)*((negative == ofA ? -1 : 1)/std::sqrt(along.squared()));
                const double other = clampToUnit(fraction), own = which;
                found[count] = {ofA ? own : other, ofA ? other : own, u, across};
            });
            count += passages%2;
        }
    std::stable_sort(found, found+count, [] (const Crossing& one, const Crossing& other) {
        return one.time < other.time;
    });
    count = std::min(count, 2);
    std::copy(found, found+count, crossings);
    return count;
}

/**
 * Find whether two segments whose ends move with constant velocities pass through each other, and if so, where first.
 *
 * Lines pass each other where the volume changes its sign; segments do if they meet there, and have passed through each
 * other if they do so an odd number of times. For segments that stay in one plane, see findPlanarCrossings(). Those on
 * one line do not cross.
 *
 * @param crossings  room for two
 * @return the number of crossings that go on to hold: none, one, or two where both ends of an overlap have crossed in a
 *         plane
 */
inline int findCrossings(const SegmentPair& start, const SegmentPair& end, Crossing* crossings) {
    const Cubic f = volumeInTime(start, end);
    Vec3d planeNormal;
    if (areInOnePlane(start, end, f, planeNormal))
        return findPlanarCrossings(start, end, planeNormal, crossings);
    // Most pairs are done with here.
    if (hasOneSign(f))
        return 0;
    int count = 0;
    forEachSignChange(f, [&] (double u, bool negative) {
        const SegmentPair pair = interpolate(start, end, u);
        const double aa = pair.p.squared(), bb = pair.p.dot(pair.q), ee = pair.q.squared();
        const double cc = pair.p.dot(pair.w), ff = pair.q.dot(pair.w), determinant = aa*ee-bb*bb;
        if (!(determinant > 1e-14*aa*ee))
            return;
        const double s = (bb*ff-cc*ee)/determinant, t = (aa*ff-bb*cc)/determinant;
        if (!(isWithin(s) && isWithin(t)))
            return;
        if (count++ == 0) {
            const Vec3d n = pair.p.cross(pair.q);
            crossings[0] = {clampToUnit(s), clampToUnit(t), u, n*((negative ? -1 : 1)/std::sqrt(n.squared()))};
        }
    });
    return count%2;
}

/** How a sphere goes deep into a segment or another sphere. */
struct Passage {
    /** Fractions along both where they are nearest to each other on the way. */
    double s, t;
    /** A unit vector that points from b to a where they begin. */
    Vec3d normal;
    /** The distance along it in the end, from the place on the one to that on the other. */
    double distance;
    /** Whether they have passed through each other: that distance is negative. */
    bool through;
};

/** Get whether one of two segments is a sphere: it has no length. */
inline bool hasSphere(const SegmentPair& pair) {
    return !(pair.p.squared() > 0 && pair.q.squared() > 0);
}

/**
 * Find whether a sphere goes deep into a segment or another sphere on its way.
 *
 * A path that does so has met a surface that is nearly across it: what counts is the distance along the normal of the
 * start. If it has become negative, the sphere is behind the axis and has gone through, since it has passed near it.
 * Where the centers begin on an axis there is no normal, and nothing is found.
 *
 * @param sum  of the radii
 */
inline bool findPassage(const SegmentPair& start, const SegmentPair& end, double sum, Passage& passage) {
    const bool ofA = !(start.p.squared() > 0);
    // The way of the sphere is a segment, too; the other one turns a little meanwhile.
    const Vec3d way = end.w-start.w;
    double time = 1;
    NearestPoints nearest = {0, 0, 0};
    for (int turn = 0; turn < 3; turn++) {
        const SegmentPair pair = interpolate(start, end, time);
        nearest = findNearestPoints(ofA ? SegmentPair{way, pair.q, start.w} : SegmentPair{pair.p, way*-1, start.w});
        time = ofA ? nearest.s : nearest.t;
    }
    if (!(nearest.squared < DEEP*DEEP*sum*sum))
        return false;
    const NearestPoints first = findNearestPoints(start);
    if (!(first.squared > 0))
        return false;
    passage.s = ofA ? 0 : nearest.s;
    passage.t = ofA ? nearest.t : 0;
    passage.normal = start.between(first.s, first.t)*(1/std::sqrt(first.squared));
    passage.distance = end.between(passage.s, passage.t).dot(passage.normal);
    passage.through = passage.distance < 0;
    // Two spheres have no axis: as long as the one stays on its side of the other, their distance is what counts.
    return passage.through || start.p.squared() > 0 || start.q.squared() > 0;
}

/** By how much a point of one segment moves against one of the other, at most. */
inline double largestMotion(const SegmentPair& start, const SegmentPair& end) {
    const Vec3d dw = end.w-start.w, dp = end.p-start.p, dq = end.q-start.q;
    return std::sqrt(std::max({dw.squared(), (dw+dp).squared(), (dw-dq).squared(), (dw+dp-dq).squared()}));
}

/**
 * Whether capsules may pass through each other: from the distance of their axes at the end, or that and how much they
 * are apart at the start at least, and the sum of radii.
 */
inline bool mayPass(const SegmentPair& start, const SegmentPair& end, double distance, double radii) {
    return distance <= largestMotion(start, end)+(hasSphere(start) ? DEEP*radii : 0);
}

/** The gap of two capsules at the end, signed if they have crossed. */
inline double findGap(const SegmentPair& start, const SegmentPair& end, double radii) {
    const double distance = std::sqrt(findNearestPoints(end).squared);
    if (!mayPass(start, end, distance, radii))
        return distance-radii;
    Passage passage;
    if (hasSphere(start))
        return (findPassage(start, end, radii, passage) ? passage.distance : distance)-radii;
    Crossing crossings[2];
    if (findCrossings(start, end, crossings) > 0)
        return end.between(crossings[0].s, crossings[0].t).dot(crossings[0].normal)-radii;
    return distance-radii;
}

} // namespace cylchain

#endif /*CYLCHAIN_CROSSINGS_H_*/
