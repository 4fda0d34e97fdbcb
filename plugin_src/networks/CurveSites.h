#ifndef CYLCHAIN_CURVE_SITES_H_
#define CYLCHAIN_CURVE_SITES_H_

#include "couplings/Place.h"

namespace cylchain {

/** A particle that is a place on the curve of a beam element. */
struct CurveSite {
    int particle;
    Place place;
};

/** A capsule between two places on the curve of one beam element, one of several alike straight pieces of it. */
struct CapsuleOnCurve {
    /** The number of the capsule. */
    int capsule;
    /** Where the first of its particles is. */
    Place first;
    /** The number of pieces of the element, and whether the second particle is towards the element's second node. */
    int pieces;
    bool forwards;
};

} // namespace cylchain

#endif /*CYLCHAIN_CURVE_SITES_H_*/
