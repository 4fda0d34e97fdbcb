#ifndef CYLCHAIN_CHAIN_PACK_H_
#define CYLCHAIN_CHAIN_PACK_H_

#include "ChainEngine.h"
#include <vector>

namespace cylchain {

/** A tether of the chain in a lane. */
struct LaneTether : Tether {
    int lane;
};

/**
 * Chains side by side: the numbers of all chains for one segment lie next to each other, one in each lane. Chains that
 * are shorter than the longest one are filled up with segments without friction whose nodes are fixed.
 */
struct ChainPack {
    /** The properties of a segment, each of them for all lanes. Drift is 2-gamma_def/gamma_rot of (15). */
    enum Property {RestLength, Stiffness, InverseExtension, Parallel, Perpendicular, Rotational, Extensional,
            RootParallel, RootPerpendicular, RootRotational, RootExtensional, Drift, NumProperties};
    int lanes, nodes;
    BendingModel bending;
    StretchingModel stretching;
    /** Number of each lane's chain and of its nodes. */
    std::vector<int> chain, nodesOfLane;
    /** Particle of each node and lane, [node][lane]; -1 for a node that only fills up. */
    std::vector<int> particles;
    /** Properties of segments, [segment][property][lane]. */
    std::vector<double> properties;
    /** Stiffness of the joint at each node, [node][lane]; zero at ends. */
    std::vector<double> joints;
    /** One for each node that moves, [node][lane]; zero for others. */
    std::vector<double> mobile;
    /** The tethers of all lanes, by their nodes. */
    std::vector<LaneTether> tethers;
};

/** The loops over a pack, compiled for one instruction set. */
struct ChainKernels {
    const char* instructionSet;
    /** The largest number of lanes that fits a register. */
    int lanes;
    ChainEnergy (*addForces)(const ChainPack& pack, const double* positions, double* forces, const double* box,
            bool includeEnergy);
    Instability (*step)(const ChainPack& pack, const double* positions, const double* forces, const double* box,
            const StepSettings& settings, double* displacements);
};

const ChainKernels& baselineKernels();
#ifdef CYLCHAIN_X86_64
const ChainKernels& avx2Kernels();
const ChainKernels& avx512Kernels();
#endif

} // namespace cylchain

#endif /*CYLCHAIN_CHAIN_PACK_H_*/
