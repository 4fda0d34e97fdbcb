#include "couplings/CandidateLoops.h"
#include <cstdlib>
#include <string>

using namespace cylchain;
using namespace std;

static const CandidateKernels& bestKernels() {
#ifdef CYLCHAIN_X86_64
    // The same variable that chooses the instruction set of the dynamics.
    const char* chosen = getenv("CYLCHAIN_INSTRUCTION_SET");
    const string limit = (chosen == NULL ? "avx512" : chosen);
    if (limit == "avx512" && __builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512dq"))
        return avx512CandidateKernels();
    if (limit != "baseline" && __builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma"))
        return avx2CandidateKernels();
#endif
    return baselineCandidateKernels();
}

const CandidateKernels& cylchain::candidateKernels() {
    static const CandidateKernels& best = bestKernels();
    return best;
}
