#include "lanes/InstructionSet.h"
#include <cstdlib>
#include <stdexcept>
#include <string>

using namespace cylchain;
using namespace std;

namespace {

#ifdef CYLCHAIN_X86_64

/** The best one of this processor, or a lesser one that is asked for. */
InstructionSet bestOfProcessor() {
    const char* asked = getenv("CYLCHAIN_INSTRUCTION_SET");
    const string limit = (asked == NULL ? "avx512" : asked);
    if (limit == "avx512" && __builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512dq") &&
            __builtin_cpu_supports("avx512vl"))
        return InstructionSet::Avx512;
    if (limit != "baseline" && __builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma"))
        return InstructionSet::Avx2;
    return InstructionSet::Baseline;
}

#else

InstructionSet bestOfProcessor() {
    return InstructionSet::Baseline;
}

#endif

InstructionSet bestCompiled() {
    const InstructionSet best = bestOfProcessor();
    if (HAS_AVX512 && best == InstructionSet::Avx512)
        return best;
    if (HAS_AVX2 && best >= InstructionSet::Avx2)
        return InstructionSet::Avx2;
    if (HAS_BASELINE)
        return InstructionSet::Baseline;
    throw runtime_error(string("The compiled engine of openmm_cylchain was built on a processor with ")+
            (HAS_AVX2 ? "AVX2" : "AVX-512")+", for such processors alone, and this one has none or is to do without. "
            "Install it on this machine, or for all processors: "
            "pip install --config-settings=cmake.define.CYLCHAIN_FOR_THIS_PROCESSOR=OFF .");
}

} // namespace

InstructionSet cylchain::instructionSet() {
    static const InstructionSet best = bestCompiled();
    return best;
}
