#define CYLCHAIN_LOOPS baseline
#define CYLCHAIN_LANES 2
#include "dynamics/ChainLoops-inl.h"

const cylchain::ChainKernels& cylchain::baselineKernels() {
    static const ChainKernels kernels = {"baseline", CYLCHAIN_LANES, baseline::addForcesOfPack, baseline::stepOfPack,
            baseline::createStepOfPack, baseline::drawWordsOf, baseline::drawNormalsOf, baseline::drawFeneCoordinatesOf,
            baseline::stepOfModesOfPack, baseline::transformCosinesOf, baseline::findSweptAreaOf,
            baselineWideKernels()};
    return kernels;
}
