/**
 * Steps of chains, by one work-item for each chain, or by a group of them. Nodes are those of all chains, one after the
 * other; their positions are doubles, as precise as the platform keeps them.
 */

/** A coordinate as the platform stores it. */
inline DEVICE double stored(double x) {
#if defined(USE_DOUBLE_PRECISION)
    return x;
#elif defined(USE_MIXED_PRECISION)
    double high = (float) x;
    return high+(float) (x-high);
#else
    return (float) x;
#endif
}

/** A chain by its place among those of the program. */
inline DEVICE Step describeChain(int chain, int numChains, int places, int flags,
        GLOBAL const double* RESTRICT positions, GLOBAL const double* RESTRICT table,
        GLOBAL const int* RESTRICT chains, GLOBAL const double* RESTRICT properties,
        GLOBAL const double* RESTRICT shifts, GLOBAL const int* RESTRICT firstTethers,
        GLOBAL const double* RESTRICT tethers, GLOBAL const double* RESTRICT box) {
    Step step;
    GLOBAL const int* own = chains+chain*NUM_CHAIN_NUMBERS;
    int first = own[CHAIN_FIRST_NODE];
    step.own = own[CHAIN_NUM_NODES];
#ifdef CLOSED
    step.nodes = step.own+2;
    step.segments = step.own;
#else
    step.nodes = step.own;
    step.segments = step.own-1;
#endif
    step.chain = own[CHAIN_NUMBER];
    step.free = own[CHAIN_IS_FREE];
    step.hasSegmentFriction = own[CHAIN_HAS_SEGMENT_FRICTION];
    step.hasTethers = own[CHAIN_HAS_TETHERS];
    step.hasPropulsion = own[CHAIN_HAS_PROPULSION];
    step.nodeFriction = properties[chain*NUM_CHAIN_PROPERTIES+CHAIN_NODE_FRICTION];
    step.positions = positions+(size_t) 3*first;
    step.box = box;
    step.shift = make_double3(shifts[3*step.chain], shifts[3*step.chain+1], shifts[3*step.chain+2]);
    step.firstTethers = firstTethers+first;
    step.tethers = tethers;
    step.twoStages = (flags&TWO_STAGES) != 0;
    step.hasFlow = (flags&HAS_FLOW) != 0;
    step.flowVaries = (flags&FLOW_VARIES) != 0;
    step.flowIsPeriodic = (flags&FLOW_IS_PERIODIC) != 0;
    step.periodic = (flags&IS_PERIODIC) != 0;
    // Neighbours in memory are the same places of chains, which work-items of a GPU read together, or, on a processor
    // and where a group has a chain, places of one chain.
#if defined(CHAIN_BY_CHAIN) || defined(CHAIN_BY_GROUP)
    step.table = table+(size_t) chain*places*NUM_PROPERTIES;
    step.tableStride = 1;
#else
    step.table = table+chain;
    step.tableStride = numChains;
#endif
    return step;
}

#define FIRST_CHAIN (GLOBAL_ID/ITEMS_OF_CHAIN)
#define CHAINS_AT_ONCE (GLOBAL_SIZE/ITEMS_OF_CHAIN)

inline DEVICE void setMemory(Step* step, GLOBAL double* RESTRICT workspace, int places) {
#if defined(CHAIN_BY_GROUP)
    step->memory = workspace+(size_t) FIRST_CHAIN*NUM_PLACES*FIRST_LOCAL_FIELD;
#elif defined(CHAIN_BY_CHAIN)
    step->memory = workspace+(size_t) GLOBAL_ID*places*NUM_FIELDS;
    step->stride = 1;
#else
    step->memory = workspace+GLOBAL_ID;
    step->stride = GLOBAL_SIZE;
#endif
}

#ifndef CHAIN_BY_GROUP
/** Find the forces of a chain as they are after they have been added to those of the platform. */
inline DEVICE void findAddedForces(const Step* step, GLOBAL double* RESTRICT forces,
        GLOBAL double* RESTRICT energies) {
    findForces(step, forces, energies);
    for (int k = 0; k < 3*step->own; k++) {
        // NaN fails.
        forces[k] = fabs(forces[k]) < LARGEST_FORCE ?
                (mm_long) (forces[k]*0x100000000)*(1/(double) 0x100000000) : NAN;
    }
}

/** Take a step of the scheme; returns how often it was divided, or -1 if it cannot be taken. */
inline DEVICE int takeStepOfScheme(Step* step, int flags, GLOBAL double* RESTRICT forces,
        GLOBAL double* RESTRICT energies) {
    if (flags&FINDS_FORCES)
        findAddedForces(step, forces, energies);
    if (flags&(IS_EULER|IS_MIDPOINT))
        return takeExplicitStep(step, forces, (flags&IS_EULER) != 0) ? 0 : -1;
    return takeStep(step, forces);
}
#else
inline DEVICE int takeStepOfScheme(Step* step, int flags, GLOBAL double* RESTRICT forces,
        GLOBAL double* RESTRICT energies) {
    return takeStep(step, forces);
}
#endif

/**
 * Advance chains by some steps. The displacements are those of the last one. Groups take implicit steps alone.
 *
 * @param forces    those on nodes; explicit schemes find them at the start of each step if the flags say so
 * @param taken     receives the number of steps that each chain could take
 * @param summary   increased by the number of chains that could not take all steps, and of steps that were divided
 */
KERNEL void advanceChains(int numChains, int places, int count, int flags, double h, double kT, unsigned int seed,
        unsigned int level, mm_ulong firstStep, GLOBAL double* RESTRICT positions,
        GLOBAL double* RESTRICT forces, GLOBAL double* RESTRICT energies, GLOBAL double* RESTRICT displacements,
        GLOBAL double* RESTRICT workspace, GLOBAL const double* RESTRICT table, GLOBAL const int* RESTRICT chains,
        GLOBAL const double* RESTRICT properties, GLOBAL const double* RESTRICT shifts,
        GLOBAL const int* RESTRICT firstTethers, GLOBAL const double* RESTRICT tethers,
        GLOBAL double* RESTRICT tetherMemory, GLOBAL const double* RESTRICT flow, GLOBAL const double* RESTRICT box,
        GLOBAL int* RESTRICT taken, GLOBAL mm_ulong* RESTRICT summary) {
#ifdef CHAIN_BY_GROUP
    LOCAL double exchanged[CHAINS_OF_GROUP*NUM_EXCHANGED*ITEMS_OF_CHAIN], middle[CHAINS_OF_GROUP*SIZE_OF_MIDDLE];
    // There are no empty arrays.
    LOCAL double localMemory[CHAINS_OF_GROUP*NUM_LOCAL_FIELDS*NUM_PLACES+1];
#endif
    // There are no more groups than chains, and one step is taken at least.
    int chain = FIRST_CHAIN;
#if !defined(CHAIN_BY_GROUP) || CHAINS_OF_GROUP > 1
    if (chain >= numChains)
        return;
#endif
    do {
        Step step = describeChain(chain, numChains, places, flags, positions, table, chains, properties, shifts,
                firstTethers, tethers, box);
        setMemory(&step, workspace, places);
#ifdef CHAIN_BY_GROUP
        step.exchanged = exchanged+CHAIN_OF_GROUP*NUM_EXCHANGED*ITEMS_OF_CHAIN;
        step.middle = middle+CHAIN_OF_GROUP*SIZE_OF_MIDDLE;
        step.localMemory = localMemory+CHAIN_OF_GROUP*NUM_LOCAL_FIELDS*NUM_PLACES;
#endif
        step.tetherMemory = tetherMemory;
        step.flow = flow;
        step.h = h;
        step.kT = kT;
        step.key.seed = seed;
        step.key.level = level;
        const size_t first = (size_t) 3*chains[chain*NUM_CHAIN_NUMBERS+CHAIN_FIRST_NODE];
        mm_ulong divided = 0;
        int done = 0;
        bool fails = false;
        do {
            step.key.step = firstStep+done;
            const int divisions = takeStepOfScheme(&step, flags, forces+first,
                    energies+(size_t) NUM_ENERGIES*step.chain);
            EACH(node, step.own) {
                Vector moved = loadVector(&step, MOVED, node);
                const size_t place = first+3*node;
                displacements[place] = moved.x;
                displacements[place+1] = moved.y;
                displacements[place+2] = moved.z;
                if (divisions >= 0) {
                    positions[place] = stored(positions[place]+moved.x);
                    positions[place+1] = stored(positions[place+1]+moved.y);
                    positions[place+2] = stored(positions[place+2]+moved.z);
                }
            }
            WAIT_FOR_ITEMS
            fails = divisions < 0;
            done += fails ? 0 : 1;
            divided += divisions > 0 ? 1 : 0;
        } while (done < count && !fails);
        if (ITEM == 0) {
            taken[step.chain] = done;
            if (done < count)
                ATOMIC_ADD(&summary[NUM_UNSTABLE_CHAINS], (mm_ulong) 1);
            if (divided > 0)
                ATOMIC_ADD(&summary[NUM_DIVIDED_STEPS], divided);
        }
        chain += CHAINS_AT_ONCE;
    } while (chain < numChains);
}

#ifndef CHAIN_BY_GROUP
/** Find the forces and energies of chains. */
KERNEL void computeForces(int numChains, int places, int flags, GLOBAL const double* RESTRICT positions,
        GLOBAL double* RESTRICT forces, GLOBAL double* RESTRICT energies, GLOBAL const double* RESTRICT table,
        GLOBAL const int* RESTRICT chains, GLOBAL const double* RESTRICT properties,
        GLOBAL const double* RESTRICT shifts, GLOBAL const int* RESTRICT firstTethers,
        GLOBAL const double* RESTRICT tethers, GLOBAL const double* RESTRICT box) {
    for (int chain = GLOBAL_ID; chain < numChains; chain += GLOBAL_SIZE) {
        Step step = describeChain(chain, numChains, places, flags, positions, table, chains, properties, shifts,
                firstTethers, tethers, box);
        findForces(&step, forces+(size_t) 3*chains[chain*NUM_CHAIN_NUMBERS+CHAIN_FIRST_NODE],
                energies+(size_t) NUM_ENERGIES*step.chain);
    }
}
#endif
