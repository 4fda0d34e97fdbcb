#define CYLCHAIN_LOOPS baseline
#define CYLCHAIN_LANES 2
#include "beams/BeamLoops-inl.h"

const cylchain::BeamKernels& cylchain::baselineBeamKernels() {
    static const BeamKernels kernels = {CYLCHAIN_LANES, baseline::addForcesOfBeams, baseline::stepOfBeams,
            baseline::newStepOfBeams};
    return kernels;
}
