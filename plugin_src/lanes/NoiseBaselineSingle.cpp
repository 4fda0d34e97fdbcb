#define CYLCHAIN_SINGLE_PRECISION
#define CYLCHAIN_LOOPS baseline_single
#define CYLCHAIN_LANES 4
#include "lanes/NoiseLoops-inl.h"
