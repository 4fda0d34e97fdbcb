#define CYLCHAIN_SINGLE_PRECISION
#define CYLCHAIN_LOOPS avx2_single
#define CYLCHAIN_LANES 8
#include "lanes/NoiseLoops-inl.h"
