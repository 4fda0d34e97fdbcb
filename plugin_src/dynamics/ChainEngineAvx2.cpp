#define CYLCHAIN_LOOPS avx2
#define CYLCHAIN_LANES 4
#include "dynamics/ChainLoops-inl.h"

const cylchain::ChainKernels& cylchain::avx2Kernels() {
    static const ChainKernels kernels = {"avx2", CYLCHAIN_LANES, avx2::addForcesOfPack, avx2::stepOfPack,
            avx2::createStepOfPack, avx2::drawWordsOf, avx2::drawNormalsOf, avx2::drawFeneCoordinatesOf,
            avx2::stepOfModesOfPack, avx2::transformCosinesOf, avx2::findSweptAreaOf,
            avx2WideKernels()};
    return kernels;
}
