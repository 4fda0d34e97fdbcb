#ifndef CYLCHAIN_GRADIENT_LOOPS_H_
#define CYLCHAIN_GRADIENT_LOOPS_H_

namespace cylchain {

/** The vectors of conjugate gradients, in blocks of terms: see ConjugateGradients. */
template <class Real> struct GradientVectors {
    Real *residual, *response, *image, *force, *imageOfDirection, *found;
    /** The matrix of each term, in blocks: (xx, xy, xz, yy, yz, zz) of all terms of a block. */
    const Real* stiffness;
    /**
     * For each term, where the vectors of the other place of its coupling begin; its own, with a matrix of zeros, if
     * there is none.
     */
    const int* partners;
};

/** What conjugate gradients do with the terms from first to last-1, in lanes. Both are multiples of a block's size. */
template <class Real> struct GradientKernels {
    /** Find the sum of the products of residuals and responses. */
    double (*findEnergy)(const GradientVectors<Real>& vectors, int first, int last);
    /**
     * Find the images of responses.
     *
     * @return the sum of the products of responses and images
     */
    double (*findImages)(const GradientVectors<Real>& vectors, int first, int last);
    /** Take residuals for the forces of the first directions, and make a step along them. */
    void (*moveFirst)(const GradientVectors<Real>& vectors, int first, int last, Real step);
    /** Turn the directions, with a part of the last ones, and make a step along them. */
    void (*move)(const GradientVectors<Real>& vectors, int first, int last, Real step, Real ratio);
};

/** The loops of an instruction set, in both precisions. */
struct GradientLoops {
    GradientKernels<float> single;
    GradientKernels<double> twice;
};

/** Get the loops for the best instruction set that there is. */
const GradientLoops& gradientLoops();

const GradientLoops& baselineGradientLoops();
const GradientLoops& avx2GradientLoops();
const GradientLoops& avx512GradientLoops();

} // namespace cylchain

#endif /*CYLCHAIN_GRADIENT_LOOPS_H_*/
