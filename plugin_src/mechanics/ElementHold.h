#ifndef CYLCHAIN_ELEMENT_HOLD_H_
#define CYLCHAIN_ELEMENT_HOLD_H_

#include "mechanics/BezierWeights.h"
#include "mechanics/Inline.h"
#include <algorithm>
#include <cmath>

namespace cylchain {

/** What of a beam element a coupling holds at a fraction x of it: the place on its curve, or one of these. */
struct ElementHold {
    /** 1 for the tangent dr/ds there, -1 for the opposite of it. */
    signed char tangent = 0;
    /** The number of straight pieces between places on the curve, for the place at the fraction x of these; or 0. */
    short pieces = 0;
};

/** The weights of the particles of an element. Loops for each instruction set call this. */
CYLCHAIN_INLINE BezierWeights weightsOf(const ElementHold& hold, double x, double elementLength) {
    if (hold.tangent != 0)
        return BezierWeights::ofTangent(x, hold.tangent/elementLength);
    if (hold.pieces == 0)
        return BezierWeights(x);
    const double pieces = hold.pieces, piece = std::min(pieces-1.0, std::max(0.0, std::floor(x*pieces)));
    return BezierWeights::between(BezierWeights(piece/pieces), BezierWeights((piece+1)/pieces), x*pieces-piece);
}

} // namespace cylchain

#endif /*CYLCHAIN_ELEMENT_HOLD_H_*/
