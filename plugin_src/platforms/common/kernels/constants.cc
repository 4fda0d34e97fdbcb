/**
 * Numbers of the method: those of the files in dynamics and lanes that have the same names.
 */

/** What random numbers are for: see lanes/Noise.h. */
enum {NOISE_SEGMENT, NOISE_LENGTH, NOISE_BEND, NOISE_TETHER, NOISE_PARTICLE, NOISE_NODE};

#define PI 3.14159265358979323846

#define STIFF_JOINT 2.0
#define LARGEST_THETA_OF_LINEAR_BENDS 0.8
#define LEAST_COSINE (-0.9)
#define NEARLY_TAUT 0.5
#define NODE_TOLERANCE 0.1
#define TOLERANCE_OF_STAGES 0.3
#define LENGTH_TOLERANCE 0.07
#define COMPRESSION 0.9
#define UNBOUNDED 1e30
#define LARGEST_DIVISION 10

/** When the iteration of a step ends: see CoordinateKind-inl.h and LinearBends-inl.h. */
#ifdef BENDING_BondDifference
#define NEWTON_TOLERANCE 3e-2
#define NEWTON_ITERATIONS 20
#define ITERATIONS_WITH_COMPRESSION 5
#else
#define NEWTON_TOLERANCE 1e-2
#define NEWTON_ITERATIONS 14
#define ITERATIONS_WITH_COMPRESSION 0
#endif

/** The fixed-point numbers in which platforms add forces reach as far as 2^31. */
#define LARGEST_FORCE 2147483000.0

/** CUDA's compiler of kernels has no such macro. */
#ifndef NAN
#define NAN nan("")
#endif
