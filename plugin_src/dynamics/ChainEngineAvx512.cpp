#define CYLCHAIN_LOOPS avx512
#define CYLCHAIN_LANES 8
#include "lanes/InstructionSet.h"
#if CYLCHAIN_HAS_AVX2
#define CYLCHAIN_SMALL_PACKS avx2Kernels
#endif
#include "dynamics/ChainLoops-inl.h"

const cylchain::ChainKernels& cylchain::avx512Kernels() {
    static const ChainKernels kernels = {"avx512", CYLCHAIN_LANES, avx512::addForcesOfPack, avx512::stepOfPack,
            avx512::createStepOfPack, avx512::drawWordsOf, avx512::drawNormalsOf, avx512::drawFeneCoordinatesOf,
            avx512::stepOfModesOfPack, avx512::transformCosinesOf, avx512::findSweptAreaOf,
            avx512WideKernels()};
    return kernels;
}
