#define CYLCHAIN_LOOPS baseline
#include "dynamics/GradientLoops-inl.h"

const cylchain::GradientLoops& cylchain::baselineGradientLoops() {
    return baseline::LOOPS;
}
