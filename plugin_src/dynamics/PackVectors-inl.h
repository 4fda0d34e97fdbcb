// Included into the namespace of an instruction set. It does not compile alone.

/**
 * Positions, forces and properties of a pack in lanes: what steps read of it, and what they write.
 */

/**
 * Call a function for each of the first places and each lane, some places of a lane at a time: the particles of a chain
 * are likely to be neighbours in memory, but those of many chains may compete for the same places in a cache.
 */
template <int W, class Function> CYLCHAIN_INLINE void forPlacesOfLanes(int count, Function function) {
    const int some = 16;
    for (int first = 0; first < count; first += some)
        for (int i = 0; i < W; i++)
            for (int place = first; place < std::min(first+some, count); place++)
                function(place, i);
}

/** Bring an array of three doubles for each particle into lanes. */
template <int W> void gather(const Pack& pack, const double* values, Vector<typename Lanes<W>::Type>* result) {
    forPlacesOfLanes<W>(pack.nodes, [&] (int node, int i) {
        const int particle = pack.particles[node*W+i];
        if (particle < 0) {
            lane(result[node].x, i) = lane(result[node].y, i) = lane(result[node].z, i) = 0;
            return;
        }
        lane(result[node].x, i) = values[3*particle];
        lane(result[node].y, i) = values[3*particle+1];
        lane(result[node].z, i) = values[3*particle+2];
    });
}

/** Bring forces into lanes: once for nodes that come twice, and in the plane for chains that stay there. */
template <int W> void gatherForces(const Pack& pack, const double* forces, Vector<typename Lanes<W>::Type>* f) {
    typedef typename Lanes<W>::Type Real;
    gather<W>(pack, forces, f);
    for (int node = pack.ownNodes(); node < pack.nodes; node++)
        f[node] = Vector<Real> {};
    if (pack.planar)
        for (int node = 0; node < pack.nodes; node++)
            f[node].z = Real{};
}

/** Write vectors, times a factor, to an array of three doubles for each particle. */
template <int W> void scatter(const Pack& pack, Vector<typename Lanes<W>::Type>* values, double factor,
        double* result) {
    forPlacesOfLanes<W>(pack.ownNodes(), [&] (int node, int i) {
        const int particle = pack.particles[node*W+i];
        if (particle >= 0) {
            result[3*particle] = factor*lane(values[node].x, i);
            result[3*particle+1] = factor*lane(values[node].y, i);
            result[3*particle+2] = factor*lane(values[node].z, i);
        }
    });
}

/** Bring positions into lanes. Each node is the image that is nearest to the one before it if there is a box. */
template <int W> void gatherPositions(const Pack& pack, const double* positions, const double* box,
            Vector<typename Lanes<W>::Type>* x) {
    gather<W>(pack, positions, x);
    for (int i = 0; i < W; i++) {
        // Where there is no chain, the first node is at the origin.
        for (int node = std::max(1, pack.nodesOfLane[i]); node < pack.nodes; node++) {
            lane(x[node].x, i) = lane(x[node-1].x, i)+1;
            lane(x[node].y, i) = lane(x[node-1].y, i);
            lane(x[node].z, i) = lane(x[node-1].z, i);
        }
        if (box != NULL)
            for (int node = 1; node < pack.nodesOfLane[i]; node++) {
                double d[] = {lane(x[node].x, i)-lane(x[node-1].x, i), lane(x[node].y, i)-lane(x[node-1].y, i),
                        lane(x[node].z, i)-lane(x[node-1].z, i)};
                takeToNearestImage(d, box);
                lane(x[node].x, i) = lane(x[node-1].x, i)+d[0];
                lane(x[node].y, i) = lane(x[node-1].y, i)+d[1];
                lane(x[node].z, i) = lane(x[node-1].z, i)+d[2];
            }
    }
}

/** Bring the positions a step begins with into lanes. Chains that stay in a plane are seen in it. */
template <int W> void gatherStart(const Pack& pack, const double* positions, const double* box,
            Vector<typename Lanes<W>::Type>* x) {
    gatherPositions<W>(pack, positions, box, x);
    if (pack.planar)
        for (int node = 1; node < pack.nodes; node++)
            x[node].z = x[0].z;
}

/** Call a function with the vector of each segment and lane: differences of doubles, however far from the origin. */
template <int W, class Function> CYLCHAIN_INLINE void forSegments(const Pack& pack, const double* positions,
            const double* box, Function function) {
    forPlacesOfLanes<W>(pack.nodes-1, [&] (int s, int i) {
        const int first = pack.particles[s*W+i], second = pack.particles[(s+1)*W+i];
        double d[] = {1, 0, 0};
        if (first >= 0 && second >= 0) {
            for (int k = 0; k < 3; k++)
                d[k] = positions[3*second+k]-positions[3*first+k];
            if (box != NULL)
                takeToNearestImage(d, box);
            if (pack.planar)
                d[2] = 0;
        }
        function(s, i, d);
    });
}

/** Bring the vectors of segments into lanes. */
template <int W> void gatherSegments(const Pack& pack, const double* positions, const double* box,
            Vector<typename Lanes<W>::Type>* result) {
    forSegments<W>(pack, positions, box, [&] (int s, int i, const double* d) {
        lane(result[s].x, i) = d[0];
        lane(result[s].y, i) = d[1];
        lane(result[s].z, i) = d[2];
    });
}

/** A property of a segment, or of its first node. */
template <class Real> CYLCHAIN_INLINE Real property(const Pack& pack, int segment, int which) {
    return loaded<Real>(*pack.properties, (std::size_t) pack.rows[segment]*Pack::NumProperties+which);
}

/** The vector from a tether's point to its node, in double precision. */
inline void tetherVector(const Pack& pack, const LaneTether& tether, const double* positions, const double* box,
            double* d) {
    const double* node = positions+3*pack.particles[tether.node*pack.lanes+tether.lane];
    for (int k = 0; k < 3; k++)
        d[k] = node[k]-tether.point[k];
    if (box != NULL)
        takeToNearestImage(d, box);
}

/** Add the propulsion of segments, half of it on each end. */
template <int W> void addPropulsion(const Pack& pack, const Vector<typename Lanes<W>::Type>* vectors,
            Vector<typename Lanes<W>::Type>* f) {
    typedef typename Lanes<W>::Type Real;
    if (pack.propulsions.empty())
        return;
    for (int s = 0; s < pack.segments; s++) {
        const Vector<Real> half = vectors[s]*(loaded<Real>(pack.propulsions, s)/root(vectors[s].dot(vectors[s])));
        f[s] = f[s]+half;
        f[s+1] = f[s+1]+half;
    }
}
