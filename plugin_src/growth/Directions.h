#ifndef CYLCHAIN_DIRECTIONS_H_
#define CYLCHAIN_DIRECTIONS_H_

#include "couplings/CapsuleGeometry.h"
#include <algorithm>
#include <cmath>

/**
 * Unit vectors.
 */
namespace cylchain {

inline Vec3d unit(const Vec3d& v) {
    return v*(1/std::sqrt(v.squared()));
}

/** A unit vector across another one. */
inline Vec3d findAcross(const Vec3d& along) {
    const Vec3d axis = std::fabs(along.x) < 0.6 ? Vec3d {1, 0, 0} : Vec3d {0, 1, 0};
    return unit(along.cross(axis));
}

/** A unit vector across another one, turned by an angle. */
inline Vec3d findAcross(const Vec3d& along, double azimuth) {
    const Vec3d first = findAcross(along);
    return first*std::cos(azimuth)+along.cross(first)*std::sin(azimuth);
}

/** A unit vector from its z and its azimuth. */
inline Vec3d findDirection(double z, double azimuth) {
    const double across = std::sqrt(std::max(0.0, 1-z*z));
    return {across*std::cos(azimuth), across*std::sin(azimuth), z};
}

} // namespace cylchain

#endif /*CYLCHAIN_DIRECTIONS_H_*/
