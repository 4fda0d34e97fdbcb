#ifndef CYLCHAIN_INSTRUCTION_SET_H_
#define CYLCHAIN_INSTRUCTION_SET_H_

// CMake writes it: see InstructionSets.cmake.
#include "lanes/CompiledInstructionSets.h"
#include "mechanics/Enumerators.h"

namespace cylchain {

/** The instruction sets that loops over lanes are compiled for. Processors other than x86-64 have the first alone. */
enum class InstructionSet {Baseline, Avx2, Avx512};

/** Which of them have been compiled. The functions of others must not be called. */
constexpr bool HAS_BASELINE = CYLCHAIN_HAS_BASELINE, HAS_AVX2 = CYLCHAIN_HAS_AVX2, HAS_AVX512 = CYLCHAIN_HAS_AVX512;

/**
 * Get the best one that this processor has, of those that have been compiled.
 *
 * The variable CYLCHAIN_INSTRUCTION_SET of the environment, "avx512", "avx2" or "baseline", names the best one to use,
 * for tests and comparisons.
 *
 * @throws std::runtime_error if there is none
 */
InstructionSet instructionSet();

/**
 * Get the loops for that instruction set.
 *
 * @param BASELINE, AVX2, AVX512  the functions that return them for each set; those of sets that have not been compiled
 *                                need not exist
 */
template <auto BASELINE, auto AVX2, auto AVX512> decltype(BASELINE()) loopsOfBest() {
    const InstructionSet best = instructionSet();
    if constexpr (HAS_AVX512)
        if (best == InstructionSet::Avx512)
            return AVX512();
    if constexpr (HAS_AVX2)
        if (best == InstructionSet::Avx2)
            return AVX2();
    if constexpr (HAS_BASELINE)
        if (best == InstructionSet::Baseline)
            return BASELINE();
    noOtherEntry();
}

} // namespace cylchain

#endif /*CYLCHAIN_INSTRUCTION_SET_H_*/
