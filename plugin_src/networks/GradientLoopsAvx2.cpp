#define CYLCHAIN_LOOPS avx2
#include "networks/GradientLoops-inl.h"

const cylchain::GradientLoops& cylchain::avx2GradientLoops() {
    return avx2::LOOPS;
}
