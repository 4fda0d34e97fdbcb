/**
 * Particles of the platform: what the processor sees of them and takes them to, and motion outside filaments.
 *
 * OpenMM keeps particles in an order of its own, in which slots says where each of them is. Arrays of doubles here are
 * in the order of the System, or of the particles that the processor sees.
 */

typedef double3 Vector;

/** The fixed-point numbers in which platforms add forces reach as far as 2^31. */
#define LARGEST_FORCE 2147483000.0
#define UNIT_OF_FORCES 4294967296.0

/** One that is not finite is the largest in either direction. */
inline DEVICE Vector forceAt(int slot, int paddedNumAtoms, GLOBAL const mm_long* RESTRICT forceBuffers) {
    return make_double3((double) forceBuffers[slot], (double) forceBuffers[slot+paddedNumAtoms],
            (double) forceBuffers[slot+2*paddedNumAtoms])*(1/UNIT_OF_FORCES);
}

inline DEVICE Vector positionAt(int slot, GLOBAL const real4* RESTRICT posq
#ifdef USE_MIXED_PRECISION
        , GLOBAL const real4* RESTRICT posqCorrection
#endif
        ) {
    const real4 position = posq[slot];
#ifdef USE_MIXED_PRECISION
    const real4 correction = posqCorrection[slot];
    return make_double3((double) position.x+correction.x, (double) position.y+correction.y,
            (double) position.z+correction.z);
#else
    return make_double3(position.x, position.y, position.z);
#endif
}

/** Copy positions of particles, where they would be if OpenMM had not wrapped them, and the forces on them. */
KERNEL void copyToProcessor(int count, int paddedNumAtoms, GLOBAL const real4* RESTRICT posq,
#ifdef USE_MIXED_PRECISION
        GLOBAL const real4* RESTRICT posqCorrection,
#endif
        GLOBAL const mm_long* RESTRICT forceBuffers, GLOBAL const int* RESTRICT images,
        GLOBAL const double* RESTRICT box, GLOBAL double* RESTRICT exchanged) {
    for (int i = GLOBAL_ID; i < count; i += GLOBAL_SIZE) {
        GLOBAL const int* image = images+NUM_IMAGE_NUMBERS*i;
        Vector x = positionAt(image[IMAGE_SLOT], posq
#ifdef USE_MIXED_PRECISION
                , posqCorrection
#endif
                );
        for (int k = 0; k < 3; k++)
            x = x-make_double3(box[3*k], box[3*k+1], box[3*k+2])*(double) image[IMAGE_CELLS+k];
        const Vector force = forceAt(image[IMAGE_SLOT], paddedNumAtoms, forceBuffers);
        GLOBAL double* own = exchanged+NUM_EXCHANGED*i;
        own[EXCHANGED_POSITION] = x.x;
        own[EXCHANGED_POSITION+1] = x.y;
        own[EXCHANGED_POSITION+2] = x.z;
        own[EXCHANGED_FORCE] = force.x;
        own[EXCHANGED_FORCE+1] = force.y;
        own[EXCHANGED_FORCE+2] = force.z;
    }
}

/** Add forces that the processor has computed. Too large ones are the largest, which a step takes for not finite. */
KERNEL void addForces(int count, int paddedNumAtoms, GLOBAL mm_ulong* RESTRICT forceBuffers,
        GLOBAL const int* RESTRICT images, GLOBAL const double* RESTRICT exchanged) {
    for (int i = GLOBAL_ID; i < count; i += GLOBAL_SIZE)
        for (int k = 0; k < 3; k++) {
            const double force = exchanged[NUM_EXCHANGED*i+EXCHANGED_FORCE+k];
            GLOBAL mm_ulong* sum = forceBuffers+images[NUM_IMAGE_NUMBERS*i+IMAGE_SLOT]+k*paddedNumAtoms;
            // NaN fails.
            if (fabs(force) < LARGEST_FORCE)
                ATOMIC_ADD(sum, (mm_ulong) (mm_long) (force*UNIT_OF_FORCES));
            else
                *sum = (mm_ulong) (mm_long) (LARGEST_FORCE*UNIT_OF_FORCES);
        }
}

inline DEVICE void place(int slot, Vector x, GLOBAL real4* RESTRICT posq
#ifdef USE_MIXED_PRECISION
        , GLOBAL real4* RESTRICT posqCorrection
#endif
        ) {
    posq[slot] = make_real4((real) x.x, (real) x.y, (real) x.z, posq[slot].w);
#ifdef USE_MIXED_PRECISION
    posqCorrection[slot] = make_real4((real) (x.x-(real) x.x), (real) (x.y-(real) x.y), (real) (x.z-(real) x.z), 0);
#endif
}

/**
 * Take particles to positions that the processor has found, which are wrapped as theirs were.
 *
 * @param stepSize  of the last step, or zero if velocities stay what they are
 */
KERNEL void copyFromProcessor(int count, double stepSize, GLOBAL real4* RESTRICT posq,
#ifdef USE_MIXED_PRECISION
        GLOBAL real4* RESTRICT posqCorrection,
#endif
        GLOBAL mixed4* RESTRICT velm, GLOBAL const int* RESTRICT images, GLOBAL const int* RESTRICT particles,
        GLOBAL const double* RESTRICT exchanged, GLOBAL double* RESTRICT displacements) {
    for (int i = GLOBAL_ID; i < count; i += GLOBAL_SIZE) {
        const int slot = images[NUM_IMAGE_NUMBERS*i+IMAGE_SLOT];
        GLOBAL const double* own = exchanged+NUM_EXCHANGED*i;
        place(slot, make_double3(own[EXCHANGED_POSITION], own[EXCHANGED_POSITION+1], own[EXCHANGED_POSITION+2]), posq
#ifdef USE_MIXED_PRECISION
                , posqCorrection
#endif
                );
        if (stepSize > 0) {
            GLOBAL const double* velocity = own+EXCHANGED_VELOCITY;
            velm[slot] = make_mixed4((mixed) velocity[0], (mixed) velocity[1], (mixed) velocity[2], velm[slot].w);
            for (int k = 0; k < 3; k++)
                displacements[3*particles[i]+k] = velocity[k]*stepSize;
        }
    }
}

/** Sum up the work that forces do because they are those of the start of a step: see ExplicitWork. */
KERNEL void sumWork(int count, int paddedNumAtoms, int flags, double perEnergy,
        GLOBAL const mm_long* RESTRICT forceBuffers, GLOBAL const int* RESTRICT slots,
        GLOBAL const double* RESTRICT displacements, GLOBAL double* RESTRICT work) {
    for (int i = GLOBAL_ID; i < count; i += GLOBAL_SIZE) {
        const Vector force = forceAt(slots[i], paddedNumAtoms, forceBuffers);
        GLOBAL double* own = work+(size_t) NUM_WORK_NUMBERS*i;
        GLOBAL const double* way = displacements+3*i;
        const double components[] = {force.x, force.y, force.z};
        if (flags&BEGINS_WINDOW)
            for (int k = WORK_CHANGE; k < NUM_WORK_NUMBERS; k++)
                own[k] = 0;
        for (int k = 0; k < 3; k++) {
            if (flags&FOLLOWS_ON) {
                const double change = (components[k]-own[WORK_FORCE+k])*perEnergy;
                own[WORK_DONE] -= change*way[k];
                own[WORK_CHANGE+k] += change;
                own[WORK_WAY+k] += way[k];
            }
            own[WORK_FORCE+k] = components[k];
        }
    }
}

inline DEVICE Vector nearestImage(Vector d, GLOBAL const double* RESTRICT box) {
    double images = floor(d.z/box[8]+0.5);
    d = d-make_double3(box[6], box[7], box[8])*images;
    images = floor(d.y/box[4]+0.5);
    d = d-make_double3(box[3], box[4], box[5])*images;
    images = floor(d.x/box[0]+0.5);
    return d-make_double3(box[0], box[1], box[2])*images;
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
 * Find the displacements of particles that the processor does not see.
 *
 * @param unstable  counts those whose force or displacement is not finite
 */
KERNEL void displaceParticles(int count, int paddedNumAtoms, int flags, double h, double kT, unsigned int seed,
        unsigned int level, mm_ulong step, GLOBAL const real4* RESTRICT posq,
#ifdef USE_MIXED_PRECISION
        GLOBAL const real4* RESTRICT posqCorrection,
#endif
        GLOBAL const mm_long* RESTRICT forceBuffers, GLOBAL const int* RESTRICT particles,
        GLOBAL const int* RESTRICT slots, GLOBAL const double* RESTRICT mobilities, GLOBAL const double* RESTRICT flow,
        GLOBAL const double* RESTRICT box, GLOBAL double* RESTRICT displacements, GLOBAL mm_ulong* RESTRICT unstable) {
    NoiseKey key;
    key.seed = seed;
    key.level = level;
    key.step = step;
    for (int i = GLOBAL_ID; i < count; i += GLOBAL_SIZE) {
        const int slot = slots[particles[i]];
        const double mobility = mobilities[i], noise = sqrt(2*kT*h*mobility);
        const double4 n = drawNormals(key, NOISE_PARTICLE, 0, particles[i], 0);
        const Vector force = forceAt(slot, paddedNumAtoms, forceBuffers);
        Vector moved = force*(h*mobility)+make_double3(n.x, n.y, n.z)*noise;
        if (flags&HAS_FLOW) {
            // The velocity half-way, so that particles keep to closed streamlines.
            const Vector x = positionAt(slot, posq
#ifdef USE_MIXED_PRECISION
                    , posqCorrection
#endif
                    );
            const int isPeriodic = flags&FLOW_IS_PERIODIC;
            const Vector halfway = x+velocityOfFlow(flow, box, isPeriodic, x)*(0.5*h);
            moved = moved+velocityOfFlow(flow, box, isPeriodic, halfway)*h;
        }
        GLOBAL double* own = displacements+3*particles[i];
        own[0] = moved.x;
        own[1] = moved.y;
        own[2] = moved.z;
        const double largest = fmax(fabs(force.x), fmax(fabs(force.y), fabs(force.z)));
        if (!(largest < LARGEST_FORCE && fabs(moved.x)+fabs(moved.y)+fabs(moved.z) < 1e300))
            ATOMIC_ADD(unstable, (mm_ulong) 1);
    }
}

/** Move the particles that the processor does not see. */
KERNEL void moveParticles(int count, double perStep, GLOBAL real4* RESTRICT posq,
#ifdef USE_MIXED_PRECISION
        GLOBAL real4* RESTRICT posqCorrection,
#endif
        GLOBAL mixed4* RESTRICT velm, GLOBAL const int* RESTRICT particles, GLOBAL const int* RESTRICT slots,
        GLOBAL const double* RESTRICT displacements) {
    for (int i = GLOBAL_ID; i < count; i += GLOBAL_SIZE) {
        const int slot = slots[particles[i]];
        GLOBAL const double* moved = displacements+3*particles[i];
        const Vector x = positionAt(slot, posq
#ifdef USE_MIXED_PRECISION
                , posqCorrection
#endif
                );
        place(slot, x+make_double3(moved[0], moved[1], moved[2]), posq
#ifdef USE_MIXED_PRECISION
                , posqCorrection
#endif
                );
        velm[slot] = make_mixed4((mixed) (moved[0]*perStep), (mixed) (moved[1]*perStep), (mixed) (moved[2]*perStep),
                velm[slot].w);
    }
}
