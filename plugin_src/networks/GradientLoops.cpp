#include "networks/GradientLoops.h"
#include "lanes/InstructionSet.h"

using namespace cylchain;

const GradientLoops& cylchain::gradientLoops() {
    return loopsOfBest<baselineGradientLoops, avx2GradientLoops, avx512GradientLoops>();
}
