#define CYLCHAIN_LOOPS avx2
#define CYLCHAIN_LANES 4
#include "lanes/NoiseLoops-inl.h"
