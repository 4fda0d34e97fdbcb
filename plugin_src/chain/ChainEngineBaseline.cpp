#define CYLCHAIN_LOOPS baseline
#include "ChainLoops.h"

const cylchain::ChainKernels& cylchain::baselineKernels() {
    static const ChainKernels kernels = {"baseline", 2, baseline::addForcesOfPack, baseline::stepOfPack};
    return kernels;
}
