/**
 * Particles of the platform: positions and forces as chains need them, motion outside chains, and new positions.
 * OpenMM keeps particles in an order of its own, in which slots says where each of them is.
 */

/**
 * Sum up the work that forces do because they are those of the start of a step: see ExplicitWork.
 *
 * @param moved   the displacement in the step before
 * @param own     the numbers of the particle
 */
inline DEVICE void addWork(int workFlags, double perEnergy, Vector force, GLOBAL const double* RESTRICT moved,
        GLOBAL double* RESTRICT own) {
    if (!(workFlags&IS_WATCHED))
        return;
    if (workFlags&FOLLOWS_ON) {
        const Vector way = make_double3(moved[0], moved[1], moved[2]);
        const Vector change = (force-make_double3(own[WORK_FORCE], own[WORK_FORCE+1], own[WORK_FORCE+2]))*perEnergy;
        const int isFirst = workFlags&BEGINS_WINDOW;
        own[WORK_DONE] = (isFirst ? 0 : own[WORK_DONE])-(change.x*way.x+change.y*way.y+change.z*way.z);
        own[WORK_CHANGE] = (isFirst ? 0 : own[WORK_CHANGE])+change.x;
        own[WORK_CHANGE+1] = (isFirst ? 0 : own[WORK_CHANGE+1])+change.y;
        own[WORK_CHANGE+2] = (isFirst ? 0 : own[WORK_CHANGE+2])+change.z;
        own[WORK_WAY] = (isFirst ? 0 : own[WORK_WAY])+way.x;
        own[WORK_WAY+1] = (isFirst ? 0 : own[WORK_WAY+1])+way.y;
        own[WORK_WAY+2] = (isFirst ? 0 : own[WORK_WAY+2])+way.z;
    }
    own[WORK_FORCE] = force.x;
    own[WORK_FORCE+1] = force.y;
    own[WORK_FORCE+2] = force.z;
}

/** Forces that are not finite, or too large to be added, are the largest in either direction. */
inline DEVICE double checkedForce(double force) {
    return fabs(force) < LARGEST_FORCE ? force : NAN;
}

/** Bring the nodes of chains, and the forces on them unless these are zero, into the order of chains. */
KERNEL void gatherNodes(int count, int paddedNumAtoms, int withForces, int workFlags, double perEnergy,
        GLOBAL const real4* RESTRICT posq,
#ifdef USE_MIXED_PRECISION
        GLOBAL const real4* RESTRICT posqCorrection,
#endif
        GLOBAL const mm_long* RESTRICT forceBuffers, GLOBAL const int* RESTRICT particles,
        GLOBAL const int* RESTRICT slots, GLOBAL double* RESTRICT positions, GLOBAL double* RESTRICT forces,
        GLOBAL const double* RESTRICT displacements, GLOBAL double* RESTRICT work) {
    const double scale = 1/(double) 0x100000000;
    for (int i = GLOBAL_ID; i < count; i += GLOBAL_SIZE) {
        const int slot = slots[particles[i]];
        const real4 position = posq[slot];
        double x = position.x, y = position.y, z = position.z;
#ifdef USE_MIXED_PRECISION
        const real4 correction = posqCorrection[slot];
        x += correction.x;
        y += correction.y;
        z += correction.z;
#endif
        positions[3*i] = x;
        positions[3*i+1] = y;
        positions[3*i+2] = z;
        for (int k = 0; k < 3; k++)
            forces[3*i+k] = withForces ? checkedForce(scale*forceBuffers[slot+k*paddedNumAtoms]) : 0;
        addWork(workFlags, perEnergy, make_double3(forces[3*i], forces[3*i+1], forces[3*i+2]), displacements+3*i,
                work+(size_t) NUM_WORK_NUMBERS*i);
    }
}

/** Add forces on nodes to those of the platform. */
KERNEL void scatterForces(int count, int paddedNumAtoms, GLOBAL mm_ulong* RESTRICT forceBuffers,
        GLOBAL const int* RESTRICT particles, GLOBAL const int* RESTRICT slots, GLOBAL const double* RESTRICT forces) {
    for (int i = GLOBAL_ID; i < count; i += GLOBAL_SIZE) {
        const int slot = slots[particles[i]];
        for (int k = 0; k < 3; k++)
            ATOMIC_ADD(&forceBuffers[slot+k*paddedNumAtoms], (mm_ulong) (mm_long) (forces[3*i+k]*0x100000000));
    }
}

/** Move particles to new positions, with the velocities that their displacements mean. */
inline DEVICE void place(int slot, double x, double y, double z, GLOBAL const double* RESTRICT moved, double perStep,
        GLOBAL real4* RESTRICT posq,
#ifdef USE_MIXED_PRECISION
        GLOBAL real4* RESTRICT posqCorrection,
#endif
        GLOBAL mixed4* RESTRICT velm) {
    posq[slot] = make_real4((real) x, (real) y, (real) z, posq[slot].w);
#ifdef USE_MIXED_PRECISION
    posqCorrection[slot] = make_real4((real) (x-(real) x), (real) (y-(real) y), (real) (z-(real) z), 0);
#endif
    velm[slot] = make_mixed4((mixed) (moved[0]*perStep), (mixed) (moved[1]*perStep), (mixed) (moved[2]*perStep),
            velm[slot].w);
}

/** Move the nodes of chains to new positions. */
KERNEL void moveNodes(int count, double perStep, GLOBAL real4* RESTRICT posq,
#ifdef USE_MIXED_PRECISION
        GLOBAL real4* RESTRICT posqCorrection,
#endif
        GLOBAL mixed4* RESTRICT velm, GLOBAL const int* RESTRICT particles, GLOBAL const int* RESTRICT slots,
        GLOBAL const double* RESTRICT positions, GLOBAL const double* RESTRICT displacements) {
    for (int i = GLOBAL_ID; i < count; i += GLOBAL_SIZE)
        place(slots[particles[i]], positions[3*i], positions[3*i+1], positions[3*i+2], displacements+3*i, perStep,
                posq,
#ifdef USE_MIXED_PRECISION
                posqCorrection,
#endif
                velm);
}

/** The velocity of the flow at a place. */
inline DEVICE Vector velocityOfFlow(GLOBAL const double* RESTRICT flow, GLOBAL const double* RESTRICT box,
        int isPeriodic, Vector x) {
    GLOBAL const double* g = flow+FLOW_GRADIENT;
    Vector r = x-make_double3(flow[FLOW_ORIGIN], flow[FLOW_ORIGIN+1], flow[FLOW_ORIGIN+2]);
    if (isPeriodic)
        r = nearestImage(r, box);
    return make_double3(flow[0]+g[0]*r.x+g[1]*r.y+g[2]*r.z, flow[1]+g[3]*r.x+g[4]*r.y+g[5]*r.z,
            flow[2]+g[6]*r.x+g[7]*r.y+g[8]*r.z);
}

/**
 * Find the displacements of particles outside chains.
 *
 * @param unstable   receives one for each particle whose displacement is not finite, or zero
 */
KERNEL void displaceOthers(int count, int paddedNumAtoms, int flags, double h, double kT, unsigned int seed,
        unsigned int level, mm_ulong step, int workFlags, double perEnergy, GLOBAL const real4* RESTRICT posq,
#ifdef USE_MIXED_PRECISION
        GLOBAL const real4* RESTRICT posqCorrection,
#endif
        GLOBAL const mm_long* RESTRICT forceBuffers, GLOBAL const int* RESTRICT particles,
        GLOBAL const int* RESTRICT slots, GLOBAL const double* RESTRICT mobilities, GLOBAL const double* RESTRICT flow,
        GLOBAL const double* RESTRICT box, GLOBAL double* RESTRICT displacements, GLOBAL int* RESTRICT unstable,
        GLOBAL mm_ulong* RESTRICT summary, GLOBAL double* RESTRICT work) {
    const double scale = 1/(double) 0x100000000;
    NoiseKey key;
    key.seed = seed;
    key.level = level;
    key.step = step;
    for (int i = GLOBAL_ID; i < count; i += GLOBAL_SIZE) {
        const int slot = slots[particles[i]];
        const double mobility = mobilities[i], noise = sqrt(2*kT*h*mobility);
        const double4 n = drawNormals(key, NOISE_PARTICLE, 0, particles[i], 0);
        Vector force = make_double3((double) forceBuffers[slot], (double) forceBuffers[slot+paddedNumAtoms],
                (double) forceBuffers[slot+2*paddedNumAtoms])*scale;
        addWork(workFlags, perEnergy, make_double3(checkedForce(force.x), checkedForce(force.y),
                checkedForce(force.z)), displacements+3*i, work+(size_t) NUM_WORK_NUMBERS*i);
        Vector moved = force*(h*mobility)+make_double3(n.x, n.y, n.z)*noise;
        if (flags&HAS_FLOW) {
            // The velocity half-way, so that particles keep to closed streamlines.
            const real4 position = posq[slot];
            Vector x = make_double3(position.x, position.y, position.z);
#ifdef USE_MIXED_PRECISION
            const real4 correction = posqCorrection[slot];
            x = x+make_double3(correction.x, correction.y, correction.z);
#endif
            const int isPeriodic = flags&FLOW_IS_PERIODIC;
            Vector halfway = x+velocityOfFlow(flow, box, isPeriodic, x)*(0.5*h);
            moved = moved+velocityOfFlow(flow, box, isPeriodic, halfway)*h;
        }
        displacements[3*i] = moved.x;
        displacements[3*i+1] = moved.y;
        displacements[3*i+2] = moved.z;
        const double largest = fmax(fabs(force.x), fmax(fabs(force.y), fabs(force.z)));
        unstable[i] = largest < LARGEST_FORCE && fabs(moved.x)+fabs(moved.y)+fabs(moved.z) < 1e300 ? 0 : 1;
        if (unstable[i])
            ATOMIC_ADD(&summary[NUM_UNSTABLE_PARTICLES], (mm_ulong) 1);
    }
}

/** Move particles outside chains. */
KERNEL void moveOthers(int count, double perStep, GLOBAL real4* RESTRICT posq,
#ifdef USE_MIXED_PRECISION
        GLOBAL real4* RESTRICT posqCorrection,
#endif
        GLOBAL mixed4* RESTRICT velm, GLOBAL const int* RESTRICT particles, GLOBAL const int* RESTRICT slots,
        GLOBAL const double* RESTRICT displacements) {
    for (int i = GLOBAL_ID; i < count; i += GLOBAL_SIZE) {
        const int slot = slots[particles[i]];
        double x = posq[slot].x, y = posq[slot].y, z = posq[slot].z;
#ifdef USE_MIXED_PRECISION
        x += posqCorrection[slot].x;
        y += posqCorrection[slot].y;
        z += posqCorrection[slot].z;
#endif
        place(slot, x+displacements[3*i], y+displacements[3*i+1], z+displacements[3*i+2], displacements+3*i, perStep,
                posq,
#ifdef USE_MIXED_PRECISION
                posqCorrection,
#endif
                velm);
    }
}
