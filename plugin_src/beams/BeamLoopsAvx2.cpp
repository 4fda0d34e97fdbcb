#define CYLCHAIN_LOOPS avx2
#define CYLCHAIN_LANES 4
#include "beams/BeamLoops-inl.h"

const cylchain::BeamKernels& cylchain::avx2BeamKernels() {
    static const BeamKernels kernels = {CYLCHAIN_LANES, avx2::addForcesOfBeams, avx2::stepOfBeams,
            avx2::newStepOfBeams};
    return kernels;
}
