#ifndef CYLCHAIN_BEZIER_WEIGHTS_H_
#define CYLCHAIN_BEZIER_WEIGHTS_H_

namespace cylchain {

/**
 * The weights of a place on the curve of a beam element, at x from 0 at its first node to 1 at its second: the place is
 * the sum of these times the position P and the vector Q-P of the first node, and those of the second. See BeamChain.h.
 */
struct BezierWeights {
    double position1, control1, position2, control2;
    explicit BezierWeights(double x) {
        const double y = 1-x;
        position1 = y*y*(1+2*x);
        control1 = 3*x*y*y;
        position2 = x*x*(1+2*y);
        control2 = -3*x*x*y;
    }
};

} // namespace cylchain

#endif /*CYLCHAIN_BEZIER_WEIGHTS_H_*/
