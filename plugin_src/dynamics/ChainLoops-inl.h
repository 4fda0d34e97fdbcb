// Included once for each instruction set and precision, by a file that names them. It does not compile alone.

/**
 * The loops over the segments of a pack. This file is compiled for each instruction set in double precision and, if
 * CYLCHAIN_SINGLE_PRECISION is defined, in single precision: into a namespace of its own, CYLCHAIN_LOOPS, so that no
 * function of one is used by another, and for up to CYLCHAIN_LANES lanes.
 */

#include "dynamics/FrameTurns.h"
#include "dynamics/LastChange.h"
#include "dynamics/ModePack.h"
#include "dynamics/PackPlaces.h"
#include "dynamics/PackStep.h"
#include "dynamics/PlannedDivision.h"
#include "lanes/Noise.h"
#include "mechanics/Inline.h"
#include "mechanics/PeriodicBox.h"
#include "mechanics/Prefetch.h"
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <memory>
#include <new>
#include <type_traits>

namespace cylchain {
namespace CYLCHAIN_LOOPS {

#include "lanes/VectorLanes-inl.h"
#include "lanes/DoubleLanes-inl.h"
#include "lanes/Transposition-inl.h"

typedef ChainPack<Scalar> Pack;

#include "dynamics/PackVectors-inl.h"
#include "mechanics/LaneFlow-inl.h"
#include "lanes/NoiseLanes-inl.h"
#include "dynamics/PackNoise-inl.h"
#include "mechanics/BendingModels-inl.h"
#include "mechanics/StretchingModels-inl.h"
#include "dynamics/TensionBand-inl.h"
#include "dynamics/ImplicitState-inl.h"
#include "dynamics/MaterialFrames-inl.h"
#include "dynamics/coordinates/Coordinates-inl.h"
#include "dynamics/ImplicitStages-inl.h"
#include "dynamics/ImplicitNoise-inl.h"
#include "dynamics/ImplicitPositions-inl.h"
#include "dynamics/SegmentEquations-inl.h"
#include "dynamics/SweptAreas-inl.h"
#include "dynamics/ImplicitTwist-inl.h"
#include "dynamics/ImplicitEquations-inl.h"
#include "dynamics/MetricForces-inl.h"
#include "dynamics/ImplicitTensions-inl.h"
#include "dynamics/ImplicitConvergence-inl.h"
#include "dynamics/ImplicitStep-inl.h"
#include "dynamics/DividedStep-inl.h"
#include "dynamics/PackStep-inl.h"
#include "lanes/CosineTransform-inl.h"
#include "dynamics/ModeStep-inl.h"

#ifdef CYLCHAIN_SINGLE_PRECISION

/** All lanes there are, and open chains alone: what is not in single precision need not be compiled for it. */
Instability stepOfPack(const Pack& pack, const double* positions, const double* forces, const double* box,
            const StepSettings& settings, double* displacements) {
    return stepPackImplicitly<CYLCHAIN_LANES>(pack, positions, forces, box, settings, displacements);
}

PackStep* createStepOfPack(const Pack& pack) {
    return newPackStep<CYLCHAIN_LANES>(pack);
}

Instability stepOfModesOfPack(const ModePack<Scalar>& modes, const double* positions, const double* forces,
            const double* box, const StepSettings& settings, double* displacements) {
    return stepPackOfModes<CYLCHAIN_LANES>(modes, positions, forces, box, settings, displacements);
}

#else

#include "dynamics/ExplicitLoops-inl.h"

/**
 * Whether packs of W chains are left to CYLCHAIN_SMALL_PACKS, with the same results to the bit: its registers have as
 * many lanes. Few packs have less chains than lanes, but their loops take as long to compile. A chain alone is not: its
 * results would be rounded in another way, and it would be slower.
 */
template <int W> constexpr bool isSmall() {
#ifdef CYLCHAIN_SMALL_PACKS
    return W > 1 && W < CYLCHAIN_LANES;
#else
    return false;
#endif
}

#ifndef CYLCHAIN_SMALL_PACKS
#define CYLCHAIN_SMALL_PACKS baselineKernels
#endif

template <int W> Instability stepPackAs(const Pack& pack, const double* positions, const double* forces,
            const double* box, const StepSettings& settings, double* displacements) {
    if constexpr (isSmall<W>())
        return CYLCHAIN_SMALL_PACKS().step(pack, positions, forces, box, settings, displacements);
    else if (isImplicit(settings.scheme))
        return stepPackImplicitly<W>(pack, positions, forces, box, settings, displacements);
    else
        return stepPack<W>(pack, positions, forces, box, settings, displacements);
}

/** Call a function with as many lanes as a pack has. Those that the instruction set has not are not compiled. */
template <int W = CYLCHAIN_LANES, class Function> auto withLanesOf(const Pack& pack, Function function) {
    if constexpr (W > 1)
        if (pack.lanes < W)
            return withLanesOf<(W > LEAST_LANES ? W/2 : 1)>(pack, function);
    return function(std::integral_constant<int, W>());
}

ChainEnergy addForcesOfPack(const Pack& pack, const double* positions, double* forces, const double* box,
            bool includeEnergy, const std::vector<std::vector<double> >* twists) {
    return withLanesOf(pack, [&] (auto lanes) {
        if constexpr (isSmall<lanes>())
            return CYLCHAIN_SMALL_PACKS().addForces(pack, positions, forces, box, includeEnergy, twists);
        else
            return addForcesTo<lanes>(pack, positions, forces, box, includeEnergy, twists);
    });
}

Instability stepOfPack(const Pack& pack, const double* positions, const double* forces, const double* box,
            const StepSettings& settings, double* displacements) {
    return withLanesOf(pack, [&] (auto lanes) {
        return stepPackAs<lanes>(pack, positions, forces, box, settings, displacements);
    });
}

PackStep* createStepOfPack(const Pack& pack) {
    return withLanesOf(pack, [&] (auto lanes) {
        if constexpr (isSmall<lanes>())
            return CYLCHAIN_SMALL_PACKS().createStep(pack);
        else
            return newPackStep<lanes>(pack);
    });
}

Instability stepOfModesOfPack(const ModePack<Scalar>& modes, const double* positions, const double* forces,
            const double* box, const StepSettings& settings, double* displacements) {
    return withLanesOf(modes.pack, [&] (auto lanes) {
        if constexpr (isSmall<lanes>())
            return CYLCHAIN_SMALL_PACKS().stepOfModes(modes, positions, forces, box, settings, displacements);
        else
            return stepPackOfModes<lanes>(modes, positions, forces, box, settings, displacements);
    });
}

double findSweptAreaOf(const double* a, const double* b, const double* newA, const double* newB) {
    auto swept = [] (const double* v) -> SweptVector<double> {
        return {{v[0], v[1], v[2]}, std::sqrt(v[0]*v[0]+v[1]*v[1]+v[2]*v[2])};
    };
    return sweptArea<double>(swept(a), swept(b), swept(newA), swept(newB));
}

#endif

} // namespace CYLCHAIN_LOOPS
} // namespace cylchain
