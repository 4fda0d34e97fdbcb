#include "dynamics/GradientLoops.h"
#include "lanes/InstructionSet.h"
#include "mechanics/Enumerators.h"

using namespace cylchain;

const GradientLoops& cylchain::gradientLoops() {
    const InstructionSet best = instructionSet();
    if constexpr (HAS_AVX512)
        if (best == InstructionSet::Avx512)
            return avx512GradientLoops();
    if constexpr (HAS_AVX2)
        if (best == InstructionSet::Avx2)
            return avx2GradientLoops();
    if constexpr (HAS_BASELINE)
        if (best == InstructionSet::Baseline)
            return baselineGradientLoops();
    noOtherEntry();
}
