#define CYLCHAIN_LOOPS baseline
#define CYLCHAIN_LANES 2
#include "lanes/NoiseLoops-inl.h"
