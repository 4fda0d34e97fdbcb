#define CYLCHAIN_SINGLE_PRECISION
#define CYLCHAIN_LOOPS avx2_single
#define CYLCHAIN_LANES 8
#include "dynamics/ChainLoops-inl.h"

const cylchain::WideKernels& cylchain::avx2WideKernels() {
    static const WideKernels kernels = {CYLCHAIN_LANES, avx2_single::stepOfPack, avx2_single::createStepOfPack,
            avx2_single::drawNormalsOf, avx2_single::stepOfModesOfPack, avx2_single::transformCosinesOf};
    return kernels;
}
