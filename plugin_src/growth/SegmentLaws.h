#ifndef CYLCHAIN_SEGMENT_LAWS_H_
#define CYLCHAIN_SEGMENT_LAWS_H_

#include "kinetics/RandomNumbers.h"
#include "mechanics/Chain.h"
#include <cmath>

namespace cylchain {

/**
 * The equilibrium of the length of a free segment in d dimensions: the density of its extension e = l-l0 is l^(d-1)
 * exp(-V(e)/k_B T), normalised.
 */
class LengthLaw {
public:
    LengthLaw(const Segment& segment, StretchingModel model, double kT, int dimensions);
    double findLogarithm(double extension) const;
    double draw(RandomNumbers& random) const;
private:
    /** The logarithm of the density but for its norm. */
    double findExponent(double extension) const;
    StretchingModel model;
    double restLength, stiffness, inverse, kT;
    int dimensions;
    double deviation, norm = 0;
};

/**
 * The equilibrium of the bend of a free joint, normalised: in space the density of the cosine c is exp(-V/k_B T), and
 * in a plane so is that of the angle, from -pi to pi.
 */
class BendLaw {
public:
    BendLaw(double stiffness, BendingModel model, double kT, bool planar);
    double findLogarithm(double bend) const;
    double draw(RandomNumbers& random) const;
private:
    /** -V/k_B T for a cosine. */
    double findExponent(double cosine, double sineSquared) const;
    double findExponentOf(double bend) const;
    BendingModel model;
    /** The stiffness over k_B T. */
    double stiffness;
    bool planar;
    double norm = 0;
};

/**
 * Carry a value that is distributed by one law to another, so that the pair is distributed as the one that goes the
 * other way: by the maximal coupling of both, which leaves the value as it is as often as that can be.
 */
template <class Law> double carry(const Law& from, const Law& to, double value, RandomNumbers& random) {
    // Rounding may leave what the laws do not differ by.
    const int most = 100000;
    if (std::log(random.uniform()) <= to.findLogarithm(value)-from.findLogarithm(value))
        return value;
    for (int i = 0; ; i++) {
        const double other = to.draw(random);
        if (i == most || std::log(random.uniform()) > from.findLogarithm(other)-to.findLogarithm(other))
            return other;
    }
}

} // namespace cylchain

#endif /*CYLCHAIN_SEGMENT_LAWS_H_*/
