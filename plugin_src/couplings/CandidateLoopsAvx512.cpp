#define CYLCHAIN_LOOPS avx512
#define CYLCHAIN_LOOPS_NAME "avx512"
#define CYLCHAIN_LANES 16
#include "couplings/CandidateLoops-inl.h"

const cylchain::CandidateKernels& cylchain::avx512CandidateKernels() {
    return avx512::KERNELS;
}
