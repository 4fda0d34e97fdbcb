// Included once for each instruction set, by a file that names it. It does not compile alone.

/**
 * The loops over the elements of a pack of beam chains, in double precision. This file is compiled for each instruction
 * set into a namespace of its own, CYLCHAIN_LOOPS, for up to CYLCHAIN_LANES lanes.
 */

#include "beams/BeamPack.h"
#include "dynamics/PackStep.h"
#include "lanes/Noise.h"
#include "mechanics/BackgroundFlow.h"
#include "mechanics/ElementHold.h"
#include "mechanics/Inline.h"
#include "mechanics/PeriodicBox.h"
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <memory>
#include <new>
#include <type_traits>
#include <utility>

namespace cylchain {
namespace CYLCHAIN_LOOPS {

#include "lanes/VectorLanes-inl.h"
#include "lanes/NoiseLanes-inl.h"
#include "mechanics/LaneFlow-inl.h"
#include "beams/BeamShape-inl.h"
#include "beams/BeamEquations-inl.h"
#include "beams/BeamElements-inl.h"
#include "beams/BeamNoise-inl.h"
#include "beams/BeamMetricForces-inl.h"
#include "beams/BeamTerms-inl.h"
#include "beams/BeamStep-inl.h"
#include "beams/BeamPlaces-inl.h"
#include "beams/DividedBeamStep-inl.h"
#include "beams/BeamPackStep-inl.h"

template <int W> ChainEnergy addForcesTo(const BeamPack& pack, const double* positions, double* forces,
            const double* box, bool includeEnergy) {
    typedef typename Lanes<W>::Type Real;
    static thread_local Scratch memory;
    static thread_local BeamStartMemory<W> startMemory;
    const int n = pack.nodes;
    SixVector<Real>* f = memory.reserve<SixVector<Real> >(n);
    const BeamStart<W> start = startMemory.reserve(pack);
    gatherBeams<W>(pack, positions, box, start);
    std::fill(f, f+n, SixVector<Real> {});
    ChainEnergy energy;
    const Real length = loaded<Real>(pack.properties, BeamPack::Length), perLength = 1/length;
    const Real modulus = loaded<Real>(pack.properties, BeamPack::Stretching)*length;
    const Real bending = loaded<Real>(pack.properties, BeamPack::Bending)*perLength;
    for (int e = 0; e < n-1; e++) {
        const BeamVectors<Real> v = BeamVectors<Real>::of(start.control[e], start.chord[e], start.control[e+1],
                perLength);
        const BeamShape<Real> shape(v);
        const Real middleStrain = shape.middleStrain+1.5*loaded<Real>(pack.properties, BeamPack::Shortening);
        const Real present = loaded<Real>(pack.present, e), end = modulus*present*Scalar(1.0/6);
        const Real last = root(v.last.dot(v.last))-1, sum = bending*present, difference = sum*Scalar(4.0/3);
        BeamGradient<Real> force = shape.forcesOf(shape.sum*sum, shape.difference*difference)-
                shape.middleGradient()*(4*end*middleStrain);
        force.first = force.first-shape.first*(end*shape.strain);
        force.last = force.last-shape.last*(end*last);
        const Vector<Real> chord = force.middle*(perLength*Scalar(1.5));
        const Vector<Real> control = force.middle*(perLength*Scalar(0.75));
        f[e].position = f[e].position-chord;
        f[e].control = f[e].control+force.first*(3*perLength)-control;
        f[e+1].position = f[e+1].position+chord;
        f[e+1].control = f[e+1].control+force.last*(3*perLength)-control;
        if (pack.propelled)
            addPropulsionOf(loaded<Real>(pack.properties, BeamPack::Propulsion)*present, start.control[e],
                    start.chord[e], start.control[e+1], f[e], f[e+1]);
        Real stretched = 0.5*end*(shape.strain*shape.strain+4*middleStrain*middleStrain+last*last);
        Real bent = 0.5*(sum*shape.sum.dot(shape.sum)+difference*shape.difference.dot(shape.difference));
        for (int i = 0; i < W && includeEnergy; i++)
            if (e < pack.nodesOfLane[i]-1) {
                energy.stretching += lane(stretched, i);
                energy.bending += lane(bent, i);
            }
    }
    for (std::size_t number = 0; number < pack.tethers.size(); number++) {
        const BeamTether& tether = pack.tethers[number];
        const double *d = start.tethers+3*number, stiffness = tether.stiffness;
        Vector<Real>& force = f[tether.node].position;
        lane(force.x, tether.lane) -= stiffness*d[0];
        lane(force.y, tether.lane) -= stiffness*d[1];
        lane(force.z, tether.lane) -= stiffness*d[2];
        energy.tethers += 0.5*stiffness*(d[0]*d[0]+d[1]*d[1]+d[2]*d[2]);
    }
    addToParticles<W>(pack, f, forces);
    return energy;
}

/** Call a function with as many lanes as a pack has. Those that the instruction set has not are not compiled. */
template <int W = CYLCHAIN_LANES, class Function> auto withLanesOf(const BeamPack& pack, Function function) {
    if constexpr (W > 1)
        if (pack.lanes < W)
            return withLanesOf<W/2>(pack, function);
    return function(std::integral_constant<int, W>());
}

ChainEnergy addForcesOfBeams(const BeamPack& pack, const double* positions, double* forces, const double* box,
            bool includeEnergy) {
    return withLanesOf(pack, [&] (auto lanes) {
        return addForcesTo<lanes>(pack, positions, forces, box, includeEnergy);
    });
}

Instability stepOfBeams(const BeamPack& pack, const double* positions, const double* forces, const double* box,
            const StepSettings& settings, double* displacements) {
    return withLanesOf(pack, [&] (auto lanes) {
        return stepBeams<lanes>(pack, positions, forces, box, settings, displacements);
    });
}

PackStep* newStepOfBeams(const BeamPack& pack) {
    return withLanesOf(pack, [&] (auto lanes) -> PackStep* {
        return new BeamPackStep<lanes>(pack);
    });
}

} // namespace CYLCHAIN_LOOPS
} // namespace cylchain
