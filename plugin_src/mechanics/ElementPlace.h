#ifndef CYLCHAIN_ELEMENT_PLACE_H_
#define CYLCHAIN_ELEMENT_PLACE_H_

#include "mechanics/BezierWeights.h"
#include "mechanics/Inline.h"
#include <algorithm>
#include <cmath>

namespace cylchain {

/**
 * What of a beam element a coupling holds, as the one number that couplings have for a place on a segment:
 *
 *     x              the place on its curve at the parameter x, from 0 to 1
 *     2+x, -(2+x)    its tangent dr/ds there, and the opposite of it
 *     4 n+1+x        the place at the parameter x of n straight pieces between places on its curve
 *
 * Loops for each instruction set call these.
 */
namespace ElementPlace {

CYLCHAIN_INLINE double ofTangent(double x, bool forwards) {
    return forwards ? 2+x : -2-x;
}

CYLCHAIN_INLINE double onPieces(double x, int pieces) {
    return 4*pieces+1+x;
}

CYLCHAIN_INLINE bool isTangent(double number) {
    return number < -1.5 || (number > 1.5 && number < 3.5);
}

CYLCHAIN_INLINE int piecesOf(double number) {
    return number > 3.5 ? (int) (number/4) : 0;
}

/** The parameter x. */
CYLCHAIN_INLINE double parameterOf(double number) {
    if (isTangent(number))
        return std::fabs(number)-2;
    const int pieces = piecesOf(number);
    return pieces > 0 ? number-4*pieces-1 : number;
}

CYLCHAIN_INLINE BezierWeights weightsOf(double number, double elementLength) {
    const double x = parameterOf(number);
    if (isTangent(number))
        return BezierWeights::ofTangent(x, (number > 0 ? 1 : -1)/elementLength);
    const int pieces = piecesOf(number);
    if (pieces == 0)
        return BezierWeights(x);
    const double piece = std::min(pieces-1.0, std::max(0.0, std::floor(x*pieces)));
    return BezierWeights::between(BezierWeights(piece/pieces), BezierWeights((piece+1)/pieces), x*pieces-piece);
}

} // namespace ElementPlace

} // namespace cylchain

#endif /*CYLCHAIN_ELEMENT_PLACE_H_*/
