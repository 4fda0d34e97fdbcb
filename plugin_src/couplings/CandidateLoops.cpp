#include "couplings/CandidateLoops.h"
#include "lanes/InstructionSet.h"
#include "mechanics/Enumerators.h"

using namespace cylchain;

const CandidateKernels& cylchain::candidateKernels() {
    const InstructionSet best = instructionSet();
    if constexpr (HAS_AVX512)
        if (best == InstructionSet::Avx512)
            return avx512CandidateKernels();
    if constexpr (HAS_AVX2)
        if (best == InstructionSet::Avx2)
            return avx2CandidateKernels();
    if constexpr (HAS_BASELINE)
        if (best == InstructionSet::Baseline)
            return baselineCandidateKernels();
    noOtherEntry();
}
