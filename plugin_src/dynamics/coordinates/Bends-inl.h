// Included into the namespace of an instruction set. It does not compile alone.

/**
 * A bend is drawn as a Gaussian with rejection if the joint is stiffer than this many k_B T, or else from the sphere.
 */
const Scalar STIFF_JOINT = 2;

/**
 * What a stage makes of a bend of any kind.
 *
 * @param ofFirst   gives the part that the second stage has of the bend at the end of the first
 */
template <int W, class Function> CYLCHAIN_INLINE void prepareBend(const ImplicitState<W>& step, int s,
            Function ofFirst) {
    typedef typename Lanes<W>::Type Real;
    ImplicitSegment<Real>& segment = step.segments[s];
    switch (step.stage) {
        case Stage::Only:
            segment.jointImplicit = segment.jointTheta;
            segment.constantBend = segment.bend*(1-segment.jointTheta);
            segment.turningBend = segment.randomBend*root(2*segment.jointTheta-1);
            break;
        case Stage::First:
            segment.jointImplicit = splat<Real>(DIAGONAL);
            segment.constantBend = Vector<Real> {};
            segment.turningBend = segment.randomBend*splat<Real>(DIAGONAL*NOISE_OF_FIRST);
            break;
        case Stage::Second:
            segment.jointImplicit = splat<Real>(DIAGONAL);
            segment.constantBend = ofFirst();
            segment.turningBend = segment.randomBend*splat<Real>(2*DIAGONAL);
            break;
    }
}
