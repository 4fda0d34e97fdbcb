/**
 * The numbers that the host and the kernels exchange, in their order. Both include this file.
 */

/** What random numbers of particles are for: see lanes/Noise.h. */
enum {NOISE_PARTICLE = 4};

/** Where a particle that the processor sees is in the arrays of OpenMM, and by how many vectors of the box. */
enum {IMAGE_SLOT = 0, IMAGE_CELLS = 1, NUM_IMAGE_NUMBERS = 4};

/** Numbers of such a particle: to the processor its position and the force on it, back a position and a velocity. */
enum {EXCHANGED_POSITION = 0, EXCHANGED_FORCE = 3, EXCHANGED_VELOCITY = 3, NUM_EXCHANGED = 6};

/** Numbers of the flow: its velocity, its gradient row by row, and the origin. */
enum {FLOW_VELOCITY = 0, FLOW_GRADIENT = 3, FLOW_ORIGIN = 12, NUM_FLOW_NUMBERS = 15};
enum {HAS_FLOW = 1, FLOW_IS_PERIODIC = 2};

/** The work that is summed up for a particle: see ExplicitWork. What is true of a step of it. */
enum {WORK_FORCE = 0, WORK_CHANGE = 3, WORK_WAY = 6, WORK_DONE = 9, NUM_WORK_NUMBERS = 10};
enum {FOLLOWS_ON = 1, BEGINS_WINDOW = 2};
