#ifndef CYLCHAIN_PACK_PLACES_H_
#define CYLCHAIN_PACK_PLACES_H_

#include "dynamics/ChainPack.h"
#include <algorithm>
#include <cstddef>
#include <vector>

namespace cylchain {

/** Packs of more than one chain have at least so many lanes, where there are as many: others need not be compiled. */
const int LEAST_LANES = 4;

/**
 * Lanes for some chains, of which there are no more than lanes. A chain alone has one, in which steps are faster; what
 * is left of the lanes of others is filled up.
 */
inline int lanesFor(int chains, int allLanes) {
    int lanes = chains == 1 ? 1 : std::min(LEAST_LANES, allLanes);
    while (lanes < chains)
        lanes *= 2;
    return lanes;
}

/** Put a chain into a lane, but for the properties of its nodes and segments. */
template <class Scalar> void placeChain(ChainPack<Scalar>& pack, int lane, const Chain& chain, int index) {
    const std::size_t own = chain.nodes.size(), unrolled = own+(chain.closed ? 2 : 0);
    pack.chain[lane] = index;
    pack.nodesOfLane[lane] = unrolled;
    pack.segmentsOfLane[lane] = chain.segments.size();
    for (std::size_t node = 0; node < unrolled; node++)
        pack.particles[node*pack.lanes+lane] = chain.nodes[node%own];
    pack.particlesOfChains.insert(pack.particlesOfChains.end(), chain.nodes.begin(), chain.nodes.end());
    for (std::size_t number = 0; number < chain.tethers.size(); number++)
        pack.tethers.push_back({chain.tethers[number], lane, (int) number});
    for (std::size_t s = 0; s < unrolled-1; s++) {
        const double propulsion = chain.segments[s%chain.segments.size()].propulsion;
        if (propulsion != 0) {
            pack.propulsions.resize((std::size_t) (pack.nodes-1)*pack.lanes);
            pack.propulsions[s*pack.lanes+lane] = 0.5*propulsion;
        }
    }
}

/** A pack that has lanes, but no chains and no properties. */
template <class Scalar> ChainPack<Scalar> emptyPack(const PackShape& shape, int lanes) {
    ChainPack<Scalar> pack;
    static_cast<PackShape&>(pack) = shape;
    pack.lanes = lanes;
    pack.chain.resize(lanes, -1);
    pack.firstNode.resize(lanes, 0);
    pack.nodesOfLane.resize(lanes);
    pack.segmentsOfLane.resize(lanes);
    pack.particles.resize((std::size_t) pack.nodes*lanes, -1);
    return pack;
}

/** Bring the tethers of a pack, which are all there, into the order of their nodes. */
template <class Scalar> void sortTethers(ChainPack<Scalar>& pack) {
    std::stable_sort(pack.tethers.begin(), pack.tethers.end(), [] (const LaneTether& a, const LaneTether& b) {
        return a.node < b.node;
    });
    pack.firstTethers.assign(pack.nodes+1, 0);
    for (const LaneTether& tether : pack.tethers)
        for (int node = tether.node+1; node <= pack.nodes; node++)
            pack.firstTethers[node]++;
}

} // namespace cylchain

#endif /*CYLCHAIN_PACK_PLACES_H_*/
