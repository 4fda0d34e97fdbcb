#define CYLCHAIN_LOOPS baseline
#include "networks/GradientLoops-inl.h"

const cylchain::GradientLoops& cylchain::baselineGradientLoops() {
    return baseline::LOOPS;
}
