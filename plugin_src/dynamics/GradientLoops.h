#ifndef CYLCHAIN_GRADIENT_LOOPS_H_
#define CYLCHAIN_GRADIENT_LOOPS_H_

namespace cylchain {

/** What a term shows its partner, in one place: its response and its last direction, and a fourth number of each. */
template <class Real> struct ShownTerm {
    Real response[4], direction[4];
};

/** The vectors of conjugate gradients, in blocks of terms: see ConjugateGradients. */
template <class Real> struct GradientVectors {
    Real *residual, *response, *force, *direction, *image, *found, *change;
    ShownTerm<Real>* shown;
    /** The matrix of each term, in blocks: (xx, xy, xz, yy, yz, zz) of all terms of a block. */
    const Real* stiffness;
    /** For each term, that of the other place of its coupling; itself, with a matrix of zeros, if there is none. */
    const int* partners;
};

/** What conjugate gradients do with the terms from first to last-1, in lanes. Both are multiples of a block's size. */
template <class Real> struct GradientKernels {
    /**
     * Find new directions from responses and the last ones, and their images.
     *
     * @return the sum of the products of directions and images
     */
    double (*turn)(const GradientVectors<Real>& vectors, int first, int last, Real ratio);
    /** Make a step along the directions. */
    void (*move)(const GradientVectors<Real>& vectors, int first, int last, Real step);
    /**
     * Show partners responses and directions.
     *
     * @return the sum of the products of residuals and responses
     */
    double (*show)(const GradientVectors<Real>& vectors, int first, int last);
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
