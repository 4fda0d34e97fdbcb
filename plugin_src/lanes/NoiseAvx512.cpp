#ifdef CYLCHAIN_X86_64
#define CYLCHAIN_LOOPS avx512
#define CYLCHAIN_LANES 8
#include "lanes/NoiseLoops-inl.h"
#endif
