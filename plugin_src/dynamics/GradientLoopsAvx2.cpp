#define CYLCHAIN_LOOPS avx2
#include "dynamics/GradientLoops-inl.h"

const cylchain::GradientLoops& cylchain::avx2GradientLoops() {
    return avx2::LOOPS;
}
