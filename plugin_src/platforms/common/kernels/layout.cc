/**
 * The numbers that the host and the kernels exchange, in their order. Both include this file.
 */

/**
 * The equations that are left between the two ends of a chain, the numbers from one row of their matrix to the next, and
 * all numbers of both ends: see solverOfGroup.cc. Rows are an odd number apart, so that work-items read columns from
 * different banks.
 */
enum {NUMBERS_LEFT_OF_OPEN_CHAIN = 9, ROW_LENGTH_OF_OPEN_CHAIN = 9,
        SIZE_OF_MIDDLE_OF_OPEN_CHAIN = 2*NUMBERS_LEFT_OF_OPEN_CHAIN*(ROW_LENGTH_OF_OPEN_CHAIN+2),
        NUMBERS_LEFT_OF_RING = 16, ROW_LENGTH_OF_RING = 17,
        SIZE_OF_MIDDLE_OF_RING = 2*NUMBERS_LEFT_OF_RING*(ROW_LENGTH_OF_RING+2)};
/** Numbers that each work-item of a chain has for the others. */
enum {NUM_EXCHANGED = 6};

/** Numbers that describe places of chains: the node, the segment behind it, and the joint at it. */
enum {REST_LENGTH, STIFFNESS, INVERSE_EXTENSION, PARALLEL, PERPENDICULAR, ROTATIONAL, EXTENSIONAL, DRIFT, PROPULSION,
        JOINT, MOBILE, NUM_PROPERTIES};

/** Numbers that a step keeps of places. Vectors take three of them, symmetric matrices six and others nine. */
enum {
    // At the start: the vector, its length, the coordinate of the length, and the bend.
    DIFFERENCE = 0, LENGTH = 3, INVERSE_LENGTH, COORDINATE, THETA, JOINT_THETA, BEND, BISECTOR = BEND+3,
    // The noise.
    RANDOM_BEND = BISECTOR+3, RANDOM_PAIR = RANDOM_BEND+3, RANDOM_COORDINATE = RANDOM_PAIR+3, RANDOM_TENSION,
    // What a stage makes of these.
    IMPLICIT, CONSTANT_COORDINATE, CONSTANT_TENSION, JOINT_IMPLICIT, CONSTANT_BEND, TURNING_BEND = CONSTANT_BEND+3,
    // Of the last iteration or stage.
    NEW_TANGENT = TURNING_BEND+3, TURNED = NEW_TANGENT+3, RESPONSE = TURNED+3, MULTIPLIER, MULTIPLIER_BEFORE, SHIFT,
    EXTRA,
    // Forces from outside, of noise, and metric ones; nodes, their changes, and where parts of a step have taken them.
    EXTERNAL, RANDOM = EXTERNAL+3, METRIC = RANDOM+3, NODE = METRIC+3, CHANGE = NODE+3, REST = CHANGE+3,
    MOVED = REST+3, WHOLE = MOVED+3,
    // Where a node is at the start, if a flow is there.
    PLACE = WHOLE+3,
    // What elimination leaves: see dynamics/TensionBand-inl.h.
    INVERSE = PLACE+3, NEXT = INVERSE+6, SECOND = NEXT+9, SOLUTION = SECOND+9, PULL = SOLUTION+3, FIRST = PULL+3,
    LAST = FIRST+3, GIVE = LAST+3, TENSION_FOUND = GIVE+3, SHARE, RECIPROCAL, COMPLIANCE, TENSION_START, TENSION,
    NUM_FIELDS_OF_OPEN_CHAIN,
    // The same of rings: matrices and vectors for each of the first two nodes.
    BORDER = NUM_FIELDS_OF_OPEN_CHAIN, TENSION_BORDER = BORDER+18, NUM_FIELDS_OF_RING = TENSION_BORDER+6
};

/** Numbers of a tether, and what a step keeps of it. */
enum {TETHER_POINT = 0, TETHER_STIFFNESS = 3, TETHER_NUMBER, NUM_TETHER_PROPERTIES};
enum {TETHER_START = 0, TETHER_RANDOM = 3, TETHER_CONSTANT = 6, TETHER_THETA = 9, TETHER_IMPLICIT, NUM_TETHER_FIELDS};

/** Numbers of the flow: its velocity, its gradient row by row, and the origin. */
enum {FLOW_VELOCITY = 0, FLOW_GRADIENT = 3, FLOW_ORIGIN = 12, NUM_FLOW_NUMBERS = 15};

/** The stages that steps are made of: the one of scheme "implicit", and the two of second order. */
enum {ONLY_STAGE, FIRST_STAGE, SECOND_STAGE};

/** Numbers of a chain, and what is true of it. */
enum {CHAIN_NUMBER = 0, CHAIN_FIRST_NODE, CHAIN_NUM_NODES, CHAIN_IS_FREE, CHAIN_HAS_SEGMENT_FRICTION,
        CHAIN_HAS_TETHERS, CHAIN_HAS_PROPULSION, NUM_CHAIN_NUMBERS};
enum {CHAIN_NODE_FRICTION = 0, NUM_CHAIN_PROPERTIES};

/** What is true of a step. */
enum {TWO_STAGES = 1, HAS_FLOW = 2, FLOW_VARIES = 4, FLOW_IS_PERIODIC = 8, IS_PERIODIC = 16,
        IS_EULER = 32, IS_MIDPOINT = 64, FINDS_FORCES = 128};

/** The energies of a chain. */
enum {STRETCHING_ENERGY, BENDING_ENERGY, TETHER_ENERGY, NUM_ENERGIES};

/** The work that is summed up for a particle: see ExplicitWork. What is true of a step of it. */
enum {WORK_FORCE = 0, WORK_CHANGE = 3, WORK_WAY = 6, WORK_DONE = 9, NUM_WORK_NUMBERS = 10};
enum {IS_WATCHED = 1, FOLLOWS_ON = 2, BEGINS_WINDOW = 4};

/** What went wrong in a step, and what was divided. */
enum {NUM_UNSTABLE_CHAINS, NUM_DIVIDED_STEPS, NUM_UNSTABLE_PARTICLES, NUM_SUMMARY_NUMBERS};

/** Where a particle of couplings is in the arrays of OpenMM, and by how many vectors of the box it is wrapped. */
enum {PARTICLE_SLOT = 0, PARTICLE_CELLS = 1, NUM_PARTICLE_NUMBERS = 4};

/** A link: the particles of its two places, or -1, and its numbers. */
enum {NUM_LINK_ENDS = 4};
enum {LINK_FRACTION = 0, LINK_POINT = 2, LINK_STIFFNESS = 8, LINK_REST_LENGTH, LINK_INVERSE_EXTENSION,
        NUM_LINK_NUMBERS};

/** What is true of links: where nearest images are taken in a periodic box. */
enum {LINKS_ARE_PERIODIC = 1, PLACES_ARE_PERIODIC = 2};

/** The shapes of walls and their sides, in the order of Walls.h, and the numbers of a wall. */
enum {WALL_PLANE, WALL_SLAB, WALL_SPHERE, WALL_CYLINDER, WALL_BOX, WALL_ELLIPSOID, WALL_CAPSULE};
enum {WALL_INSIDE, WALL_OUTSIDE, WALL_SURFACE};
enum {WALL_POINT = 0, WALL_VECTOR = 3, WALL_LENGTH = 6, WALL_STIFFNESS, NUM_WALL_NUMBERS};

/**
 * A pair of capsules: the particles of the first and of the second, of either the ones before and behind it in its
 * chain (-1 where that neighbor cannot have the contact), and its side; and its numbers.
 */
enum {CONTACT_SIDE = 8, NUM_CONTACT_ENDS};
enum {CONTACT_SHIFT = 0, CONTACT_RADII = 3, NUM_CONTACT_NUMBERS};
