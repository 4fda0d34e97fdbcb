#ifndef CYLCHAIN_CROSSINGS_H_
#define CYLCHAIN_CROSSINGS_H_

#include "couplings/CapsuleGeometry.h"

/**
 * Whether segments pass through each other.
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

/**
 * Find whether two segments whose ends move with constant velocities pass through each other an odd number of times,
 * and if so, the first time. Lines pass each other where the volume changes its sign; segments do if they meet there.
 * Segments that stay in one plane do not: their volume is zero all the time.
 */
inline bool findCrossing(const SegmentPair& start, const SegmentPair& end, Crossing& crossing) {
    const Cubic f = volumeInTime(start, end);
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
    int crossings = 0;
    for (int i = 0; i < last; i++) {
        double u;
        if (!findSignChange(f, times[i], times[i+1], u))
            continue;
        const SegmentPair pair = {start.p+(end.p-start.p)*u, start.q+(end.q-start.q)*u, start.w+(end.w-start.w)*u};
        const double aa = pair.p.squared(), bb = pair.p.dot(pair.q), ee = pair.q.squared();
        const double cc = pair.p.dot(pair.w), ff = pair.q.dot(pair.w), determinant = aa*ee-bb*bb;
        if (!(determinant > 1e-14*aa*ee))
            continue;
        const double s = (bb*ff-cc*ee)/determinant, t = (aa*ff-bb*cc)/determinant;
        // Nothing may slip through a joint by rounding.
        const double tolerance = 1e-9;
        if (!(s >= -tolerance && s <= 1+tolerance && t >= -tolerance && t <= 1+tolerance))
            continue;
        if (crossings++ == 0) {
            const Vec3d n = pair.p.cross(pair.q);
            crossing = {clampToUnit(s), clampToUnit(t), u, n*((f(times[i]) < 0 ? -1 : 1)/std::sqrt(n.squared()))};
        }
    }
    return crossings%2 == 1;
}

} // namespace cylchain

#endif /*CYLCHAIN_CROSSINGS_H_*/
