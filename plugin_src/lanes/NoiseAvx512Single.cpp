#define CYLCHAIN_SINGLE_PRECISION
#define CYLCHAIN_LOOPS avx512_single
#define CYLCHAIN_LANES 16
#include "lanes/NoiseLoops-inl.h"
