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
    /** Those of the derivative of the place by x, times a factor: the tangent's, with one over the element's length. */
    static BezierWeights ofTangent(double x, double factor) {
        const double y = 1-x;
        BezierWeights result(x);
        result.position2 = 6*x*y*factor;
        result.position1 = -result.position2;
        result.control1 = 3*y*(1-3*x)*factor;
        result.control2 = 3*x*(3*x-2)*factor;
        return result;
    }
    /** Those of the place at a fraction of the way from one place to another. */
    static BezierWeights between(const BezierWeights& one, const BezierWeights& other, double fraction) {
        const double rest = 1-fraction;
        BezierWeights result = one;
        result.position1 = rest*one.position1+fraction*other.position1;
        result.control1 = rest*one.control1+fraction*other.control1;
        result.position2 = rest*one.position2+fraction*other.position2;
        result.control2 = rest*one.control2+fraction*other.control2;
        return result;
    }
};

} // namespace cylchain

#endif /*CYLCHAIN_BEZIER_WEIGHTS_H_*/
