/**
 * Forces between filaments: the particles that they act on, links, and walls. See couplings/Links.h and Walls.h.
 *
 * Particles are numbered among those of a force; images has for each of them where it is in the arrays of OpenMM.
 */

/** Find where particles would be if OpenMM had not wrapped molecules into the periodic box. */
KERNEL void gatherParticles(int count, GLOBAL const real4* RESTRICT posq,
#ifdef USE_MIXED_PRECISION
        GLOBAL const real4* RESTRICT posqCorrection,
#endif
        GLOBAL const int* RESTRICT images, GLOBAL const double* RESTRICT box, GLOBAL double* RESTRICT positions) {
    for (int i = GLOBAL_ID; i < count; i += GLOBAL_SIZE) {
        GLOBAL const int* own = images+i*NUM_PARTICLE_NUMBERS;
        const real4 position = posq[own[PARTICLE_SLOT]];
        Vector x = make_double3(position.x, position.y, position.z);
#ifdef USE_MIXED_PRECISION
        const real4 correction = posqCorrection[own[PARTICLE_SLOT]];
        x = x+make_double3(correction.x, correction.y, correction.z);
#endif
        for (int k = 0; k < 3; k++)
            x = x-make_double3(box[3*k], box[3*k+1], box[3*k+2])*(double) own[PARTICLE_CELLS+k];
        positions[3*i] = x.x;
        positions[3*i+1] = x.y;
        positions[3*i+2] = x.z;
    }
}

inline DEVICE Vector positionOfParticle(GLOBAL const double* RESTRICT positions, int particle) {
    return make_double3(positions[3*particle], positions[3*particle+1], positions[3*particle+2]);
}

/** Add a force on a particle. Sums do not depend on their order. Where a force is too large for them, it is marked. */
inline DEVICE void addToParticle(int particle, Vector force, int paddedNumAtoms,
        GLOBAL mm_ulong* RESTRICT forceBuffers, GLOBAL const int* RESTRICT images, GLOBAL int* RESTRICT marks) {
    // NaN fails.
    if (fabs(force.x) < LARGEST_FORCE && fabs(force.y) < LARGEST_FORCE && fabs(force.z) < LARGEST_FORCE) {
        const int slot = images[particle*NUM_PARTICLE_NUMBERS+PARTICLE_SLOT];
        ATOMIC_ADD(&forceBuffers[slot], (mm_ulong) (mm_long) (force.x*0x100000000));
        ATOMIC_ADD(&forceBuffers[slot+paddedNumAtoms], (mm_ulong) (mm_long) (force.y*0x100000000));
        ATOMIC_ADD(&forceBuffers[slot+2*paddedNumAtoms], (mm_ulong) (mm_long) (force.z*0x100000000));
    }
    else
        marks[particle] = 1;
}

/** Give particles that are marked the largest force, which a step takes for one that is not finite. */
KERNEL void finishForces(int count, int paddedNumAtoms, GLOBAL mm_ulong* RESTRICT forceBuffers,
        GLOBAL const int* RESTRICT images, GLOBAL int* RESTRICT marks) {
    for (int i = GLOBAL_ID; i < count; i += GLOBAL_SIZE)
        if (marks[i]) {
            marks[i] = 0;
            for (int k = 0; k < 3; k++)
                forceBuffers[images[i*NUM_PARTICLE_NUMBERS+PARTICLE_SLOT]+k*paddedNumAtoms] =
                        (mm_ulong) (mm_long) (LARGEST_FORCE*0x100000000);
        }
}

/** Find where a place is. */
inline DEVICE Vector locatePlace(int first, int second, double fraction, GLOBAL const double* RESTRICT point,
        GLOBAL const double* RESTRICT positions, GLOBAL const double* RESTRICT box, int isPeriodic) {
    if (first < 0)
        return make_double3(point[0], point[1], point[2]);
    Vector start = positionOfParticle(positions, first);
    if (second < 0)
        return start;
    Vector end = positionOfParticle(positions, second);
    if (isPeriodic)
        return start+nearestImage(end-start, box)*fraction;
    return start*(1-fraction)+end*fraction;
}

/**
 * Find the forces and energies of links.
 *
 * @param outOfRange   receives one for each link with a length that its potential does not allow, or zero
 * @param summary      increased by the number of such links
 */
KERNEL void computeLinks(int count, int flags, int includesForces, int paddedNumAtoms,
        GLOBAL mm_ulong* RESTRICT forceBuffers, GLOBAL const int* RESTRICT images, GLOBAL int* RESTRICT marks,
        GLOBAL const double* RESTRICT positions, GLOBAL const double* RESTRICT box, GLOBAL const int* RESTRICT ends,
        GLOBAL const double* RESTRICT numbers, GLOBAL double* RESTRICT energies, GLOBAL int* RESTRICT outOfRange,
        GLOBAL mm_ulong* RESTRICT summary) {
    for (int i = GLOBAL_ID; i < count; i += GLOBAL_SIZE) {
        GLOBAL const int* end = ends+i*NUM_LINK_ENDS;
        GLOBAL const double* own = numbers+(size_t) i*NUM_LINK_NUMBERS;
        const int arePeriodic = flags&PLACES_ARE_PERIODIC;
        Vector between = locatePlace(end[2], end[3], own[LINK_FRACTION+1], own+LINK_POINT+3, positions, box,
                arePeriodic)-locatePlace(end[0], end[1], own[LINK_FRACTION], own+LINK_POINT, positions, box,
                arePeriodic);
        if (flags&LINKS_ARE_PERIODIC)
            between = nearestImage(between, box);
        const double length = sqrt(product(between, between)), extension = length-own[LINK_REST_LENGTH];
        const double stiffness = own[LINK_STIFFNESS], inverse = own[LINK_INVERSE_EXTENSION];
        double tension = stiffness*extension, energy = 0.5*stiffness*(extension*extension);
        outOfRange[i] = 0;
        if (inverse > 0) {
            const double relative = extension*inverse;
            // NaN is not allowed, either.
            if (!(fabs(relative) < 1)) {
                outOfRange[i] = 1;
                ATOMIC_ADD(&summary[0], (mm_ulong) 1);
                energies[i] = 0;
                continue;
            }
            tension /= 1-relative*relative;
            energy = -0.5*stiffness/(inverse*inverse)*log1p(-relative*relative);
        }
        energies[i] = energy;
        if (!includesForces)
            continue;
        // Where its places coincide, the force has no direction. NaN stays NaN.
        const Vector force = between*(length == 0 ? 0 : -tension/length);
        for (int k = 0; k < 2; k++) {
            const double sign = k == 0 ? -1 : 1, fraction = end[2*k+1] < 0 ? 0 : own[LINK_FRACTION+k];
            if (end[2*k] >= 0)
                addToParticle(end[2*k], force*(sign*(1-fraction)), paddedNumAtoms, forceBuffers, images, marks);
            if (end[2*k] >= 0 && end[2*k+1] >= 0)
                addToParticle(end[2*k+1], force*(sign*fraction), paddedNumAtoms, forceBuffers, images, marks);
        }
    }
}

/** The depth of a point beyond a face of a wall, negative inside, and how it changes with the point. */
typedef struct {double depth; Vector gradient;} WallDepth;

/** A direction at right angles to a vector. */
inline DEVICE Vector orthogonalTo(Vector v) {
    const double x = fabs(v.x), y = fabs(v.y), z = fabs(v.z);
    const Vector least = make_double3(x <= y && x <= z ? 1 : 0, y < x && y <= z ? 1 : 0, z < x && z < y ? 1 : 0);
    const Vector across = least-v*(product(v, least)/product(v, v));
    return across*(1/sqrt(product(across, across)));
}

inline DEVICE WallDepth depthBeyond(int shape, int face, GLOBAL const double* RESTRICT wall, Vector position) {
    const Vector v = make_double3(wall[WALL_VECTOR], wall[WALL_VECTOR+1], wall[WALL_VECTOR+2]);
    Vector r = position-make_double3(wall[WALL_POINT], wall[WALL_POINT+1], wall[WALL_POINT+2]);
    const double size = wall[WALL_LENGTH], sign = (face&1) == 0 ? 1 : -1;
    WallDepth found;
    if (shape == WALL_PLANE) {
        found.depth = -product(v, r);
        found.gradient = v*-1.0;
    }
    else if (shape == WALL_SLAB) {
        found.depth = sign*product(v, r)-0.5*size;
        found.gradient = v*sign;
    }
    else if (shape == WALL_BOX) {
        // The vector is the upper corner.
        const int axis = face/2;
        const double below = axis == 0 ? -r.x : axis == 1 ? -r.y : -r.z;
        const Vector beyond = position-v;
        const double above = axis == 0 ? beyond.x : axis == 1 ? beyond.y : beyond.z;
        found.depth = sign > 0 ? below : above;
        found.gradient = make_double3(axis == 0 ? -sign : 0, axis == 1 ? -sign : 0, axis == 2 ? -sign : 0);
    }
    else if (shape == WALL_ELLIPSOID) {
        const Vector share = make_double3(r.x/v.x, r.y/v.y, r.z/v.z);
        const Vector steep = make_double3(share.x/v.x, share.y/v.y, share.z/v.z);
        const double square = product(share, share), steepness = product(steep, steep);
        const double s = sqrt(square), q = sqrt(steepness);
        if (!(s > 1e-12)) {
            const int first = v.x <= v.y && v.x <= v.z, second = !first && v.y <= v.z;
            found.depth = -fmin(v.x, fmin(v.y, v.z));
            found.gradient = make_double3(first ? 1 : 0, second ? 1 : 0, first || second ? 0 : 1);
        }
        else {
            found.depth = (square-s)/q;
            const Vector turned = make_double3(steep.x/(v.x*v.x), steep.y/(v.y*v.y), steep.z/(v.z*v.z));
            found.gradient = steep*(2*(1-0.5/s)/q)-turned*(found.depth/steepness);
        }
    }
    else {
        if (shape == WALL_CYLINDER)
            r = r-v*product(v, r);
        else if (shape == WALL_CAPSULE)
            r = r-v*fmax(-1.0, fmin(1.0, product(v, r)/product(v, v)));
        const double distance = sqrt(product(r, r));
        found.depth = distance-size;
        if (distance > 1e-12*size)
            found.gradient = r*(1/distance);
        else
            found.gradient = shape == WALL_SPHERE ? make_double3(0, 0, 1) : orthogonalTo(v);
    }
    return found;
}

/** Find the forces and energies of a wall on particles, with a radius each. */
KERNEL void computeWalls(int count, int shape, int side, int faces, int includesForces, int paddedNumAtoms,
        GLOBAL mm_ulong* RESTRICT forceBuffers, GLOBAL const int* RESTRICT images, GLOBAL int* RESTRICT marks,
        GLOBAL const double* RESTRICT positions, GLOBAL const int* RESTRICT particles,
        GLOBAL const double* RESTRICT radii, GLOBAL const double* RESTRICT wall, GLOBAL double* RESTRICT energies) {
    for (int i = GLOBAL_ID; i < count; i += GLOBAL_SIZE) {
        const Vector position = positionOfParticle(positions, particles[i]);
        const double stiffness = wall[WALL_STIFFNESS];
        Vector force = zeroVector();
        double energy = 0;
        for (int face = 0; face < faces; face++) {
            const WallDepth found = depthBeyond(shape, face, wall, position);
            const double sign = side == WALL_OUTSIDE ? -1 : 1, depth = sign*found.depth+radii[i];
            // NaN is taken for a depth, so that forces are NaN.
            if (depth <= 0 && side != WALL_SURFACE)
                continue;
            energy += 0.5*stiffness*depth*depth;
            force = force-found.gradient*(sign*stiffness*depth);
        }
        energies[i] = energy;
        if (includesForces && energy != 0)
            addToParticle(particles[i], force, paddedNumAtoms, forceBuffers, images, marks);
    }
}
