#define CYLCHAIN_LOOPS baseline
#define CYLCHAIN_LOOPS_NAME "baseline"
#define CYLCHAIN_LANES 4
#include "couplings/CandidateLoops-inl.h"

const cylchain::CandidateKernels& cylchain::baselineCandidateKernels() {
    return baseline::KERNELS;
}
