// Included into the namespace of an instruction set. It does not compile alone.

/**
 * The forces of chains at given positions, and the steps of the explicit schemes.
 */

template <int W> ChainEnergy addForcesTo(const Pack& pack, const double* positions, double* forces,
            const double* box, bool includeEnergy, const std::vector<std::vector<double> >* twists) {
    typedef typename Lanes<W>::Type Real;
    static thread_local Scratch scratch, scratchOfTwists;
    Vector<Real>* x = scratch.reserve<Vector<Real>>(2*pack.nodes);
    Vector<Real>* f = x+pack.nodes;
    gatherPositions<W>(pack, positions, box, x);
    ChainEnergy energy;
    ChainEnergy* const included = includeEnergy ? &energy : NULL;
    SegmentGeometry<Real> previous = {}, current;
    f[0] = Vector<Real> {};
    for (int s = 0; s < pack.nodes-1; s++, previous = current) {
        current.difference = x[s+1]-x[s];
        current.length = root(current.difference.dot(current.difference));
        current.inverse = 1/current.length;
        current.tangent = current.difference*current.inverse;
        f[s+1] = Vector<Real> {};
        if (s > 0)
            Coordinates<W>::template addForces<OnJoints>(pack, s, previous, current, f, included);
        // The last segment of an unrolled chain is there for its joint alone.
        if (s < pack.segments)
            Coordinates<W>::template addForces<OnSegments>(pack, s, current, f, included);
    }
    if (includeEnergy && twists != NULL && pack.twist.isBentAtRest()) {
        Real* const own = scratchOfTwists.reserve<Real>(numTwists(pack));
        gatherTwists<W>(pack, *twists, own);
        energy.bending += RestBends<W>::findEnergy(pack, x, own);
    }
    if (!pack.propulsions.empty()) {
        gatherSegments<W>(pack, positions, box, x);
        addPropulsion<W>(pack, x, f);
    }
    for (int node = 0; node < pack.ownNodes(); node++)
        Coordinates<W>::template addForces<OnNodes>(pack, node, positions, box, f, included);
    for (int node = 0; node < pack.nodes; node++)
        for (int i = 0; i < W; i++) {
            const int particle = pack.particles[node*W+i];
            if (particle >= 0) {
                forces[3*particle] += lane(f[node].x, i);
                forces[3*particle+1] += lane(f[node].y, i);
                forces[3*particle+2] += lane(f[node].z, i);
            }
        }
    return energy;
}

#include "dynamics/Redistribution-inl.h"

/** Add the random forces that go with the friction of nodes. Those of a ring come once. */
template <int W> void addRandomForcesOnNodes(const Pack& pack, const StepSettings& settings,
            Vector<typename Lanes<W>::Type>* f) {
    typedef typename Lanes<W>::Type Real;
    const NoiseKey key = noiseKey(settings);
    NoisePlaces<W> places = noisePlaces<W>(pack);
    const Real amplitude = loaded<Real>(pack.rootNodeFriction, 0)*Scalar(std::sqrt(2*settings.kT/settings.stepSize));
    for (int node = 0; node < pack.ownNodes(); node++, places.part += 1) {
        Real normals[4];
        drawNormals<W, 2>(key, NoiseKind::Node, places, normals);
        f[node] = f[node]+nodeNoise<Real>(normals, pack.planar)*amplitude;
    }
}

/** Add the random forces, step (1) of Section 4, and for Euler's scheme the thermal torques (15), step (2). */
template <int W> void addRandomForces(const Pack& pack, const Vector<typename Lanes<W>::Type>* x,
            const StepSettings& settings, Vector<typename Lanes<W>::Type>* f) {
    typedef typename Lanes<W>::Type Real;
    const NoiseKey key = noiseKey(settings);
    NoisePlaces<W> places = noisePlaces<W>(pack);
    const double amplitude = std::sqrt(2*settings.kT/settings.stepSize);
    const double thermal = (settings.scheme == Scheme::Euler ? settings.kT : 0.0);
    if (pack.hasNodeFriction)
        addRandomForcesOnNodes<W>(pack, settings, f);
    for (int s = 0; s < pack.segments; s++) {
        const Vector<Real> difference = x[s+1]-x[s];
        const Real inverse = 1/root(difference.dot(difference));
        const Vector<Real> t = difference*inverse;
        Real normals[6];
        Vector<Real> a, b;
        drawNormals<W, 3>(key, NoiseKind::Segment, places, normals);
        places.part += 1;
        forceNoise<Real>(normals, pack.planar, a, b);
        const Real across = property<Real>(pack, s, Pack::RootPerpendicular);
        const Real along = property<Real>(pack, s, Pack::RootParallel);
        const Vector<Real> force = (a*across+t*((along-across)*t.dot(a)))*splat<Real>(0.5*amplitude);
        const Real turn = property<Real>(pack, s, Pack::RootRotational);
        const Real stretch = property<Real>(pack, s, Pack::RootExtensional);
        const Real drift = thermal*property<Real>(pack, s, Pack::Drift);
        const Vector<Real> pair = (b*turn+t*((stretch-turn)*t.dot(b)))*(amplitude*inverse)+t*(drift*inverse);
        f[s] = f[s]+force-pair;
        f[s+1] = f[s+1]+force+pair;
    }
}

template <int W> Instability stepPack(const Pack& pack, const double* positions, const double* forces,
            const double* box, const StepSettings& settings, double* displacements) {
    typedef typename Lanes<W>::Type Real;
    static thread_local Scratch vectors;
    const int n = pack.nodes;
    Vector<Real>* x = vectors.reserve<Vector<Real>>(3*n);
    Vector<Real>* f = x+n;
    Vector<Real>* v = f+n;
    gatherStart<W>(pack, positions, box, x);
    gatherForces<W>(pack, forces, f);
    if (settings.kT > 0)
        addRandomForces<W>(pack, x, settings, f);
    findVelocities<W>(pack, x, f, settings.flow, v);
    if (settings.scheme == Scheme::Midpoint) {
        const Real half = splat<Real>(0.5*settings.stepSize);
        for (int node = 0; node < n; node++)
            x[node] = x[node]+v[node]*half;
        findVelocities<W>(pack, x, f, settings.flow, v);
    }

    // Write displacements, and look for segments whose ends move apart, or that leave their range.
    const double h = settings.stepSize;
    scatter<W>(pack, v, h, displacements);
    const bool ranges = hasRange(pack.stretching);
    if (ranges)
        gatherStart<W>(pack, positions, box, x);
    Instability result;
    for (int s = 0; s < pack.segments; s++) {
        const Vector<Real> change = (v[s+1]-v[s])*splat<Real>(h);
        Real square = change.dot(change), rest = property<Real>(pack, s, Pack::RestLength), relative = Real{};
        if (ranges) {
            const Vector<Real> after = x[s+1]-x[s]+change;
            relative = (root(after.dot(after))-rest)*property<Real>(pack, s, Pack::InverseExtension);
        }
        for (int i = 0; i < W; i++) {
            // Written so that NaN counts as unstable.
            const bool stable = lane(square, i) < lane(rest, i)*lane(rest, i) && std::fabs(lane(relative, i)) < 1;
            if (!stable && s < pack.segmentsOfLane[i] && result.chain < 0)
                result.chain = pack.chain[i];
        }
    }
    return result;
}
