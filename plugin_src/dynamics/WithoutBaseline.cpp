#include "beams/BeamPack.h"
#include "dynamics/ChainPack.h"
#include <stdexcept>

using namespace cylchain;

/** In place of the loops for processors without AVX2, where these are not compiled. */
[[noreturn]] static void refuseProcessor() {
    throw std::runtime_error("The compiled engine of openmm_cylchain was built on a processor with AVX2 and FMA, for "
            "such processors alone, and this one is to do without them. Install it on this machine, or for all "
            "processors: pip install --config-settings=cmake.define.CYLCHAIN_FOR_THIS_PROCESSOR=OFF .");
}

const ChainKernels& cylchain::baselineKernels() {
    refuseProcessor();
}

const BeamKernels& cylchain::baselineBeamKernels() {
    refuseProcessor();
}
