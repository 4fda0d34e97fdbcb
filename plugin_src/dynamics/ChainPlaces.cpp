#include "dynamics/ChainPlaces.h"
#include <algorithm>
#include <cstddef>

using namespace cylchain;
using namespace std;

ChainPlaces::ChainPlaces(const vector<Chain>& chains, int particles) : chains(chains), chainOfParticle(particles, -1),
        nodeOfParticle(particles, -1), packOfChain(chains.size(), -1), laneOfChain(chains.size(), -1) {
    for (size_t chain = 0; chain < chains.size(); chain++) {
        for (size_t node = 0; node < chains[chain].nodes.size(); node++) {
            chainOfParticle[chains[chain].nodes[node]] = chain;
            nodeOfParticle[chains[chain].nodes[node]] = node;
        }
        double length = 0;
        for (const Segment& segment : chains[chain].segments)
            length += segment.restLength;
        lengths.push_back(length);
    }
}

void ChainPlaces::setParticles(const vector<CoupledParticle>& newParticles) {
    for (const CoupledParticle& own : particles)
        chainOfParticle[own.particle] = -1;
    particles = newParticles;
    for (size_t i = 0; i < particles.size(); i++)
        chainOfParticle[particles[i].particle] = chains.size()+i;
    packOfChain.resize(getNumChains(), -1);
    laneOfChain.resize(getNumChains(), -1);
}

void ChainPlaces::setPacks(const vector<vector<int> >& chainsOfLanes) {
    for (size_t pack = 0; pack < chainsOfLanes.size(); pack++)
        for (size_t lane = 0; lane < chainsOfLanes[pack].size(); lane++) {
            const int chain = chainsOfLanes[pack][lane];
            if (chain >= 0) {
                packOfChain[chain] = pack;
                laneOfChain[chain] = lane;
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
    result.pack = packOfChain[chain];
    result.lane = laneOfChain[chain];
    result.chain = chain;
    if (chain >= (int) chains.size()) {
        if (place.isOnSegment())
            result = PlaceOnChain();
        return !place.isOnSegment();
    }
    const Chain& own = chains[chain];
    const int nodes = own.nodes.size(), first = nodeOfParticle[place.first];
    int node = first;
    double fraction = 0;
    if (place.isOnSegment()) {
        if (chainOfParticle[place.second] != chain) {
            result = PlaceOnChain();
            return false;
        }
        const int second = nodeOfParticle[place.second];
        const bool forwards = second == first+1 || (own.closed && second == (first+1)%nodes);
        const bool backwards = first == second+1 || (own.closed && first == (second+1)%nodes);
        if (!forwards && !backwards) {
            result = PlaceOnChain();
            return false;
        }
        node = forwards ? first : second;
        fraction = forwards ? place.fraction : 1-place.fraction;
    }
    else if (!own.closed && first == nodes-1) {
        node = first-1;
        fraction = 1;
    }
    result.node = node;
    result.fraction = fraction;
    return true;
}

double ChainPlaces::getFriction(const PlaceOnChain& place) const {
    if (place.chain >= (int) chains.size())
        return particles[place.chain-chains.size()].friction;
    const Chain& chain = chains[place.chain];
    const Segment& segment = chain.segments[place.node];
    return chain.nodeFriction+0.25*min(segment.parallel, segment.perpendicular);
}

int ChainPlaces::getParticle(const PlaceOnChain& place) const {
    if (place.chain >= (int) chains.size())
        return particles[place.chain-chains.size()].particle;
    return chains[place.chain].nodes[place.node];
}

double ChainPlaces::getLateralFriction(const PlaceOnChain& place) const {
    if (place.chain >= (int) chains.size())
        return particles[place.chain-chains.size()].friction;
    const Chain& chain = chains[place.chain];
    const Segment& segment = chain.segments[place.node];
    if (!(segment.perpendicular > 0 && segment.rotational > 0))
        return chain.nodeFriction;
    const double arm = (place.fraction-0.5)*segment.restLength;
    return chain.nodeFriction+1/(1/segment.perpendicular+arm*arm/segment.rotational);
}

vector<int> ChainPlaces::getNodes(int chain) const {
    if (chain >= (int) chains.size())
        return {particles[chain-chains.size()].particle};
    return chains[chain].nodes;
}
