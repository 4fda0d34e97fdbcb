#include "dynamics/ChainPlaces.h"
#include "dynamics/ChainEngine.h"
#include <algorithm>
#include <cstddef>

using namespace cylchain;
using namespace std;

ChainPlaces::ChainPlaces(const vector<Chain>& chains, int particles) : chains(chains), chainOfParticle(particles, -1),
        nodeOfParticle(particles, -1), packOfChain(chains.size(), -1), laneOfChain(chains.size(), -1) {
    for (size_t chain = 0; chain < chains.size(); chain++)
        for (size_t node = 0; node < chains[chain].nodes.size(); node++) {
            chainOfParticle[chains[chain].nodes[node]] = chain;
            nodeOfParticle[chains[chain].nodes[node]] = node;
        }
}

void ChainPlaces::setPacks(const ChainEngine& engine, const vector<int>& packs) {
    for (size_t pack = 0; pack < packs.size(); pack++) {
        const vector<int>& ofLanes = engine.getChainsOfLanes(packs[pack]);
        for (size_t lane = 0; lane < ofLanes.size(); lane++)
            if (ofLanes[lane] >= 0) {
                packOfChain[ofLanes[lane]] = pack;
                laneOfChain[ofLanes[lane]] = lane;
            }
    }
}

bool ChainPlaces::find(const Place& place, PlaceOnChain& result) const {
    result = PlaceOnChain();
    if (place.isPoint())
        return false;
    const int chain = chainOfParticle[place.first];
    if (chain < 0)
        return false;
    const Chain& own = chains[chain];
    const int nodes = own.nodes.size(), first = nodeOfParticle[place.first];
    int node = first;
    double fraction = 0;
    if (place.isOnSegment()) {
        if (chainOfParticle[place.second] != chain)
            return false;
        const int second = nodeOfParticle[place.second];
        const bool forwards = second == first+1 || (own.closed && second == (first+1)%nodes);
        const bool backwards = first == second+1 || (own.closed && first == (second+1)%nodes);
        if (!forwards && !backwards)
            return false;
        node = forwards ? first : second;
        fraction = forwards ? place.fraction : 1-place.fraction;
    }
    else if (!own.closed && first == nodes-1) {
        node = first-1;
        fraction = 1;
    }
    result.pack = packOfChain[chain];
    result.lane = laneOfChain[chain];
    result.chain = chain;
    result.node = node;
    result.fraction = fraction;
    return true;
}

double ChainPlaces::getFriction(const PlaceOnChain& place) const {
    const Chain& chain = chains[place.chain];
    const Segment& segment = chain.segments[place.node];
    return chain.nodeFriction+0.25*min(segment.parallel, segment.perpendicular)+
            segment.extensional/(segment.restLength*segment.restLength);
}
