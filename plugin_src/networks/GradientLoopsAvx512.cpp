#define CYLCHAIN_LOOPS avx512
#include "networks/GradientLoops-inl.h"

const cylchain::GradientLoops& cylchain::avx512GradientLoops() {
    return avx512::LOOPS;
}
