// Included into the namespace of an instruction set. It does not compile alone.

/**
 * Positions and forces of a pack of beam chains in lanes: what steps read of them, and what they write.
 */

/** The vector between two particles, or the shortest image of it. */
inline void vectorBetween(const double* positions, int first, int second, const double* box, bool planar, double* d) {
    for (int k = 0; k < 3; k++)
        d[k] = positions[3*second+k]-positions[3*first+k];
    if (box != NULL)
        takeToNearestImage(d, box);
    if (planar)
        d[2] = 0;
}

template <class Real> CYLCHAIN_INLINE void setLane(Vector<Real>& vector, int i, const double* values) {
    lane(vector.x, i) = values[0];
    lane(vector.y, i) = values[1];
    lane(vector.z, i) = values[2];
}

/** The vector from the point of a tether to its node, or the shortest image of it. */
inline void vectorOf(const BeamTether& tether, const BeamPack& pack, const double* positions, const double* box,
            double* d) {
    const double* const node = positions+3*pack.particles[2*tether.node*pack.lanes+tether.lane];
    for (int k = 0; k < 3; k++)
        d[k] = node[k]-tether.point[k];
    if (box != NULL)
        takeToNearestImage(d, box);
}

/** Bring what a step begins with into lanes. Elements that only fill up are straight. */
template <int W> void gatherBeams(const BeamPack& pack, const double* positions, const double* box,
            const BeamStart<W>& start) {
    for (int node = 0; node < pack.nodes; node++)
        for (int i = 0; i < W; i++) {
            const int* const particles = &pack.particles[2*node*W+i];
            const double length = pack.properties[BeamPack::Length*W+i];
            double control[] = {length/3, 0, 0}, chord[] = {length, 0, 0};
            if (node < pack.nodesOfLane[i])
                vectorBetween(positions, particles[0], particles[W], box, pack.planar, control);
            if (node < pack.nodesOfLane[i]-1)
                vectorBetween(positions, particles[0], particles[2*W], box, pack.planar, chord);
            setLane(start.control[node], i, control);
            setLane(start.chord[node], i, chord);
        }
    for (int i = 0; i < W; i++) {
        const int first = pack.particles[i];
        const double nowhere[3] = {};
        setLane(*start.first, i, first < 0 ? nowhere : positions+3*first);
    }
    for (std::size_t number = 0; number < pack.tethers.size(); number++)
        vectorOf(pack.tethers[number], pack, positions, box, start.tethers+3*number);
}

/** Bring the forces that do work on positions and control vectors into lanes. */
template <int W> void gatherBeamForces(const BeamPack& pack, const double* forces,
            SixVector<typename Lanes<W>::Type>* f) {
    for (int node = 0; node < pack.nodes; node++)
        for (int i = 0; i < W; i++) {
            double position[3] = {}, control[3] = {};
            for (int k = 0; k < 3 && node < pack.ownNodes(i); k++) {
                control[k] = forces[3*pack.particles[(2*node+1)*W+i]+k];
                position[k] = forces[3*pack.particles[2*node*W+i]+k]+control[k];
            }
            if (pack.planar)
                position[2] = control[2] = 0;
            setLane(f[node].position, i, position);
            setLane(f[node].control, i, control);
        }
}

/** Add forces that do work on positions and control vectors to those on particles. */
template <int W> void addToParticles(const BeamPack& pack, SixVector<typename Lanes<W>::Type>* f, double* forces) {
    for (int node = 0; node < pack.nodes; node++)
        for (int i = 0; i < W; i++) {
            if (node >= pack.nodesOfLane[i])
                continue;
            double* const position = forces+3*pack.particles[2*node*W+i];
            double* const control = forces+3*pack.particles[(2*node+1)*W+i];
            Vector<typename Lanes<W>::Type> onPosition = f[node].position-f[node].control, own = f[node].control;
            position[0] += lane(onPosition.x, i);
            position[1] += lane(onPosition.y, i);
            position[2] += lane(onPosition.z, i);
            control[0] += lane(own.x, i);
            control[1] += lane(own.y, i);
            control[2] += lane(own.z, i);
        }
}

/** Write how far particles move. */
template <int W> void scatterBeams(const BeamPack& pack, const SixVector<typename Lanes<W>::Type>* y,
            double* displacements) {
    for (int node = 0; node < pack.nodes; node++)
        for (int i = 0; i < W; i++) {
            if (node >= pack.ownNodes(i))
                continue;
            double* const position = displacements+3*pack.particles[2*node*W+i];
            double* const control = displacements+3*pack.particles[(2*node+1)*W+i];
            Vector<typename Lanes<W>::Type> moved = y[node].position, both = y[node].position+y[node].control;
            position[0] = lane(moved.x, i);
            position[1] = lane(moved.y, i);
            position[2] = lane(moved.z, i);
            control[0] = lane(both.x, i);
            control[1] = lane(both.y, i);
            control[2] = lane(both.z, i);
        }
}
