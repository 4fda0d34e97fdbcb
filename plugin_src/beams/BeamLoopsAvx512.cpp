#define CYLCHAIN_LOOPS avx512
#define CYLCHAIN_LANES 8
#include "beams/BeamLoops-inl.h"

const cylchain::BeamKernels& cylchain::avx512BeamKernels() {
    static const BeamKernels kernels = {CYLCHAIN_LANES, avx512::addForcesOfBeams, avx512::stepOfBeams,
            avx512::newStepOfBeams};
    return kernels;
}
