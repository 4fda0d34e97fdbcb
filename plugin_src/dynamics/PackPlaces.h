#ifndef CYLCHAIN_PACK_PLACES_H_
#define CYLCHAIN_PACK_PLACES_H_

#include "dynamics/ChainPack.h"
#include <algorithm>
#include <cstddef>
#include <vector>

namespace cylchain {

/** The largest power of two that is not above a number of chains: lanes for some of them. */
inline int lanesFor(int chains) {
    int lanes = 1;
    while (2*lanes <= chains)
        lanes *= 2;
    return lanes;
}

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

/** A pack of the given chains, the longest of which comes first, with all but the properties of nodes and segments. */
template <class Scalar> ChainPack<Scalar> placed(const std::vector<Chain>& chains, const std::vector<int>& members,
            int lanes) {
    ChainPack<Scalar> pack;
    const Chain& longest = chains[members[0]];
    pack.lanes = lanes;
    pack.nodes = longest.nodes.size()+(longest.closed ? 2 : 0);
    pack.segments = longest.segments.size();
    pack.bending = longest.bending;
    pack.stretching = longest.stretching;
    pack.closed = longest.closed;
    pack.planar = longest.planar;
    pack.chain.resize(lanes, -1);
    pack.nodesOfLane.resize(lanes);
    pack.segmentsOfLane.resize(lanes);
    pack.particles.resize((std::size_t) pack.nodes*lanes, -1);
    for (std::size_t lane = 0; lane < members.size(); lane++)
        placeChain(pack, lane, chains[members[lane]], members[lane]);
    std::stable_sort(pack.tethers.begin(), pack.tethers.end(), [] (const LaneTether& a, const LaneTether& b) {
        return a.node < b.node;
    });
    return pack;
}

} // namespace cylchain

#endif /*CYLCHAIN_PACK_PLACES_H_*/
