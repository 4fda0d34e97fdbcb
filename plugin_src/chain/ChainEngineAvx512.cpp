#ifdef CYLCHAIN_X86_64
#define CYLCHAIN_LOOPS avx512
#include "ChainLoops.h"

const cylchain::ChainKernels& cylchain::avx512Kernels() {
    static const ChainKernels kernels = {"avx512", 8, avx512::addForcesOfPack, avx512::stepOfPack};
    return kernels;
}
#endif
