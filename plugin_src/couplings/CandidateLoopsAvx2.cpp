#define CYLCHAIN_LOOPS avx2
#define CYLCHAIN_LOOPS_NAME "avx2"
#define CYLCHAIN_LANES 8
#include "couplings/CandidateLoops-inl.h"

const cylchain::CandidateKernels& cylchain::avx2CandidateKernels() {
    return avx2::KERNELS;
}
