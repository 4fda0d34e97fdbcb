#ifndef CYLCHAIN_BEAM_PACK_H_
#define CYLCHAIN_BEAM_PACK_H_

#include "dynamics/ChainEngine.h"
#include "dynamics/PackStep.h"
#include "mechanics/BeamChain.h"
#include <vector>

namespace cylchain {

/** A tether of the chain in a lane, and its number among those of the chain. */
struct BeamTether : Tether {
    int lane, number;
};

/**
 * Chains of beam elements side by side: the numbers of all chains for one node lie next to each other, one in each
 * lane. Chains that are shorter than the longest one are filled up with elements that have neither energy nor friction,
 * with nodes that are fixed.
 *
 * Rings are unrolled: their first node comes once more behind the last one, as a node with the same particles. All
 * rings of a pack have the same number of nodes.
 */
struct BeamPack {
    /** The properties of the elements of a lane. */
    enum Property {Length, Stretching, Bending, Shortening, Parallel, Perpendicular, Propulsion, NumProperties};
    int lanes, nodes;
    bool planar, closed;
    /** Whether any chain has a propulsion. */
    bool propelled = false;
    /** The number of each lane's chain, that by which its noise is known, and that of its nodes. */
    std::vector<int> chain, noiseChain, nodesOfLane;
    /** Particle of each position and control point, [2*node, 2*node+1][lane]; -1 for one that only fills up. */
    std::vector<int> particles;
    /** The same particles, each of them once, chain by chain. */
    std::vector<int> particlesOfChains;
    /** Properties, [property][lane]. */
    std::vector<double> properties;
    /** One for each element that is there, [element][lane]; zero for others. */
    std::vector<double> present;
    /** One for each particle that moves, [particle][lane]; zero for others. */
    std::vector<double> mobile;
    /** One for each lane whose chain has no particle that is fixed; zero for others. */
    std::vector<double> free;
    /** The tethers of all lanes, by their nodes. */
    std::vector<BeamTether> tethers;
    /** The number of a lane's nodes that are not there twice. */
    int ownNodes(int lane) const {
        return nodesOfLane[lane]-(closed ? 1 : 0);
    }
};

/** The loops over a pack, compiled for one instruction set. */
struct BeamKernels {
    /** The largest number of lanes that fits a register. */
    int lanes;
    ChainEnergy (*addForces)(const BeamPack& pack, const double* positions, double* forces, const double* box,
            bool includeEnergy);
    Instability (*step)(const BeamPack& pack, const double* positions, const double* forces, const double* box,
            const StepSettings& settings, double* displacements);
    /** Create what takes steps of a pack that is coupled to others. */
    PackStep* (*newStep)(const BeamPack& pack);
};

const BeamKernels& baselineBeamKernels();
const BeamKernels& avx2BeamKernels();
const BeamKernels& avx512BeamKernels();

} // namespace cylchain

#endif /*CYLCHAIN_BEAM_PACK_H_*/
