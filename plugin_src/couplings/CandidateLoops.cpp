#include "couplings/CandidateLoops.h"
#include "lanes/InstructionSet.h"

using namespace cylchain;

const CandidateKernels& cylchain::candidateKernels() {
    return loopsOfBest<baselineCandidateKernels, avx2CandidateKernels, avx512CandidateKernels>();
}
