// Included once for each instruction set and precision, by a file that names them. It does not compile alone.

/**
 * The loops over the segments of a pack. This file is compiled for each instruction set in double precision and, if
 * CYLCHAIN_SINGLE_PRECISION is defined, in single precision: into a namespace of its own, CYLCHAIN_LOOPS, so that no
 * function of one is used by another, and for up to CYLCHAIN_LANES lanes.
 */

#include "dynamics/ChainPack.h"
#include "lanes/Noise.h"
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <new>
#include <type_traits>

namespace cylchain {
namespace CYLCHAIN_LOOPS {

#include "lanes/VectorLanes-inl.h"

typedef ChainPack<Scalar> Pack;

/** Bring an array of three doubles for each particle into lanes. */
template <int W> void gather(const Pack& pack, const double* values, Vector<typename Lanes<W>::Type>* result) {
    for (int node = 0; node < pack.nodes; node++)
        for (int i = 0; i < W; i++) {
            const int particle = pack.particles[node*W+i];
            if (particle < 0) {
                lane(result[node].x, i) = lane(result[node].y, i) = lane(result[node].z, i) = 0;
                continue;
            }
            lane(result[node].x, i) = values[3*particle];
            lane(result[node].y, i) = values[3*particle+1];
            lane(result[node].z, i) = values[3*particle+2];
        }
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
template <int W> void scatter(const Pack& pack, Vector<typename Lanes<W>::Type>* values, double factor, double* result) {
    for (int node = 0; node < pack.ownNodes(); node++)
        for (int i = 0; i < W; i++) {
            const int particle = pack.particles[node*W+i];
            if (particle >= 0) {
                result[3*particle] = factor*lane(values[node].x, i);
                result[3*particle+1] = factor*lane(values[node].y, i);
                result[3*particle+2] = factor*lane(values[node].z, i);
            }
        }
}

/** Bring positions into lanes. Each node is the image that is nearest to the one before it if there is a box. */
template <int W> void gatherPositions(const Pack& pack, const double* positions, const double* box,
            Vector<typename Lanes<W>::Type>* x) {
    gather<W>(pack, positions, x);
    for (int i = 0; i < W; i++) {
        for (int node = pack.nodesOfLane[i]; node < pack.nodes; node++) {
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

/** Bring the vectors of segments into lanes: differences of doubles, however far from the origin they are. */
template <int W> void gatherSegments(const Pack& pack, const double* positions, const double* box,
            Vector<typename Lanes<W>::Type>* result) {
    for (int s = 0; s < pack.nodes-1; s++)
        for (int i = 0; i < W; i++) {
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
            lane(result[s].x, i) = d[0];
            lane(result[s].y, i) = d[1];
            lane(result[s].z, i) = d[2];
        }
}

template <class Real> CYLCHAIN_INLINE Real property(const Pack& pack, int segment, int which) {
    return loaded<Real>(pack.properties, (std::size_t) segment*Pack::NumProperties+which);
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

/** The flow for each lane: in a periodic box, with the image of the lane's chain whose first node is nearest to the origin. */
template <int W> class LaneFlow {
    typedef typename Lanes<W>::Type Real;
public:
    LaneFlow(const BackgroundFlow& flow, const Pack& pack, const Vector<Real>* x) : planar(pack.planar) {
        std::copy(flow.gradient, flow.gradient+9, gradient);
        for (int i = 0; i < W && flow.present; i++) {
            // What a node at zero would have to be carried along with.
            Vector<Real> first = x[0];
            const double r[] = {lane(first.x, i), lane(first.y, i), lane(first.z, i)};
            double u[3];
            flow.getVelocity(r, u);
            for (int k = 0; k < 3; k++)
                for (int j = 0; j < 3; j++)
                    u[k] -= flow.gradient[3*k+j]*r[j];
            lane(velocity.x, i) = u[0];
            lane(velocity.y, i) = u[1];
            lane(velocity.z, i) = u[2];
        }
    }
    CYLCHAIN_INLINE Vector<Real> at(const Vector<Real>& x) const {
        const Scalar* g = gradient;
        return {velocity.x+x.x*g[0]+x.y*g[1]+x.z*g[2], velocity.y+x.x*g[3]+x.y*g[4]+x.z*g[5],
                planar ? Real{} : velocity.z+x.x*g[6]+x.y*g[7]+x.z*g[8]};
    }
private:
    Vector<Real> velocity = {};
    Scalar gradient[9];
    bool planar;
};

#include "lanes/NoiseLanes-inl.h"

inline NoiseKey noiseKey(const StepSettings& settings) {
    return {(std::uint32_t) settings.seed, (std::uint32_t) settings.level, settings.step};
}

/** The first part of each chain of a pack. */
template <int W> inline NoisePlaces<W> noisePlaces(const Pack& pack) {
    NoisePlaces<W> places;
    for (int i = 0; i < W; i++) {
        reinterpret_cast<Word*>(&places.chain)[i] = pack.chain[i];
        reinterpret_cast<Word*>(&places.part)[i] = 0;
    }
    return places;
}

/** The random forces of a segment: that on its middle and that on its ends, before friction colours them. */
template <class Real> CYLCHAIN_INLINE void forceNoise(const Real* normals, bool planar, Vector<Real>& a, Vector<Real>& b) {
    a = {normals[0], normals[1], planar ? Real{} : normals[2]};
    b = {normals[3], normals[4], planar ? Real{} : normals[5]};
}

#include "mechanics/ChainCoordinates-inl.h"
#include "dynamics/TensionBand-inl.h"
#include "dynamics/ImplicitLoops-inl.h"

#ifdef CYLCHAIN_SINGLE_PRECISION

/** All lanes there are, and open chains alone: what is not in single precision need not be compiled for it. */
Instability stepOfPack(const Pack& pack, const double* positions, const double* forces, const double* box,
            const StepSettings& settings, double* displacements) {
    return stepPackImplicitly<CYLCHAIN_LANES, false>(pack, positions, forces, box, settings, displacements);
}

#else

#include "dynamics/ExplicitLoops-inl.h"

template <int W> Instability stepPackAs(const Pack& pack, const double* positions, const double* forces,
            const double* box, const StepSettings& settings, double* displacements) {
    if (isImplicit(settings.scheme))
        return pack.closed ? stepPackImplicitly<W, true>(pack, positions, forces, box, settings, displacements) :
                stepPackImplicitly<W, false>(pack, positions, forces, box, settings, displacements);
    return stepPack<W>(pack, positions, forces, box, settings, displacements);
}

/** Call a function with as many lanes as a pack has. Those that the instruction set has not are not compiled. */
template <int W = CYLCHAIN_LANES, class Function> auto withLanesOf(const Pack& pack, Function function) {
    if constexpr (W > 1)
        if (pack.lanes < W)
            return withLanesOf<W/2>(pack, function);
    return function(std::integral_constant<int, W>());
}

ChainEnergy addForcesOfPack(const Pack& pack, const double* positions, double* forces, const double* box,
            bool includeEnergy) {
    return withLanesOf(pack, [&] (auto lanes) {
        return addForcesTo<lanes>(pack, positions, forces, box, includeEnergy);
    });
}

Instability stepOfPack(const Pack& pack, const double* positions, const double* forces, const double* box,
            const StepSettings& settings, double* displacements) {
    return withLanesOf(pack, [&] (auto lanes) {
        return stepPackAs<lanes>(pack, positions, forces, box, settings, displacements);
    });
}

#endif

} // namespace CYLCHAIN_LOOPS
} // namespace cylchain
