#define CYLCHAIN_LOOPS avx512
#define CYLCHAIN_LANES 8
#include "lanes/NoiseLoops-inl.h"
