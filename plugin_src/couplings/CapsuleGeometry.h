#ifndef CYLCHAIN_CAPSULE_GEOMETRY_H_
#define CYLCHAIN_CAPSULE_GEOMETRY_H_

#include <algorithm>
#include <cmath>

/**
 * Where two segments are nearest to each other.
 */
namespace cylchain {

struct Vec3d {
    double x, y, z;
    Vec3d operator+(const Vec3d& v) const {
        return {x+v.x, y+v.y, z+v.z};
    }
    Vec3d operator-(const Vec3d& v) const {
        return {x-v.x, y-v.y, z-v.z};
    }
    Vec3d operator*(double s) const {
        return {x*s, y*s, z*s};
    }
    double dot(const Vec3d& v) const {
        return x*v.x+y*v.y+z*v.z;
    }
    Vec3d cross(const Vec3d& v) const {
        return {y*v.z-z*v.y, z*v.x-x*v.z, x*v.y-y*v.x};
    }
    double squared() const {
        return dot(*this);
    }
};

/** Two segments: p along a, q along b, w from the first end of b to that of a. */
struct SegmentPair {
    Vec3d p, q, w;
    /** From the point at fraction t of b to that at s of a. */
    Vec3d between(double s, double t) const {
        return w+p*s-q*t;
    }
    /** Six times the signed volume of the tetrahedron of the four ends. */
    double volume() const {
        return w.dot(p.cross(q));
    }
};

/** Fractions along two segments, and the square of the distance of the points there. */
struct NearestPoints {
    double s, t, squared;
};

inline double clampToUnit(double fraction) {
    return fraction > 0 ? std::min(fraction, 1.0) : 0.0;
}

/** The fraction of a segment that is nearest to a point, which is at -w from its first end; 0 if it has no length. */
inline double nearestFraction(const Vec3d& along, const Vec3d& w) {
    const double square = along.squared();
    return square > 0 ? clampToUnit(-along.dot(w)/square) : 0.0;
}

/** Take the end s of a, and the point of b that is nearest to it. */
inline void considerEndOfA(const SegmentPair& pair, double s, NearestPoints& best) {
    const double t = nearestFraction(pair.q, (pair.w+pair.p*s)*-1);
    const double squared = pair.between(s, t).squared();
    if (squared < best.squared)
        best = {s, t, squared};
}

/** Take the end t of b, and the point of a that is nearest to it. */
inline void considerEndOfB(const SegmentPair& pair, double t, NearestPoints& best) {
    const double s = nearestFraction(pair.p, pair.w-pair.q*t);
    const double squared = pair.between(s, t).squared();
    if (squared < best.squared)
        best = {s, t, squared};
}

/** Where two segments are nearest to each other. Either of them may have no length. */
inline NearestPoints findNearestPoints(const SegmentPair& pair) {
    const double a = pair.p.squared(), b = pair.p.dot(pair.q), e = pair.q.squared();
    const double c = pair.p.dot(pair.w), f = pair.q.dot(pair.w), determinant = a*e-b*b;
    double s, t;
    if (determinant > 0) {
        s = clampToUnit((b*f-c*e)/determinant);
        t = (b*s+f)/e;
        if (!(t > 0)) {
            t = 0;
            s = clampToUnit(-c/a);
        }
        else if (t > 1) {
            t = 1;
            s = clampToUnit((b-c)/a);
        }
    }
    else {
        s = 0;
        t = nearestFraction(pair.q, pair.w*-1);
    }
    NearestPoints nearest = {s, t, pair.between(s, t).squared()};
    // Where the equations are nearly singular, rounding spoils their solution, and an end is as near.
    if (!(determinant > 1e-6*a*e)) {
        considerEndOfA(pair, 0, nearest);
        considerEndOfA(pair, 1, nearest);
        considerEndOfB(pair, 0, nearest);
        considerEndOfB(pair, 1, nearest);
    }
    return nearest;
}

} // namespace cylchain

#endif /*CYLCHAIN_CAPSULE_GEOMETRY_H_*/
