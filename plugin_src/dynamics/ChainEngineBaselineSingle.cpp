#define CYLCHAIN_SINGLE_PRECISION
#define CYLCHAIN_LOOPS baseline_single
#define CYLCHAIN_LANES 4
#include "dynamics/ChainLoops-inl.h"

const cylchain::WideKernels& cylchain::baselineWideKernels() {
    static const WideKernels kernels = {CYLCHAIN_LANES, baseline_single::stepOfPack, baseline_single::createStepOfPack,
            baseline_single::drawNormalsOf, baseline_single::stepOfModesOfPack, baseline_single::transformCosinesOf};
    return kernels;
}
