#define CYLCHAIN_SINGLE_PRECISION
#define CYLCHAIN_LOOPS avx512_single
#define CYLCHAIN_LANES 16
#include "dynamics/ChainLoops-inl.h"

const cylchain::WideKernels& cylchain::avx512WideKernels() {
    static const WideKernels kernels = {CYLCHAIN_LANES, avx512_single::stepOfPack, avx512_single::createStepOfPack,
            avx512_single::drawNormalsOf, avx512_single::stepOfModesOfPack, avx512_single::transformCosinesOf};
    return kernels;
}
