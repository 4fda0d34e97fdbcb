#ifndef CYLCHAIN_CHAIN_PLACES_H_
#define CYLCHAIN_CHAIN_PLACES_H_

#include "couplings/Place.h"
#include "mechanics/Chain.h"
#include <vector>

namespace cylchain {

class ChainEngine;

/** A place on a segment of a chain, and where that is among packs. */
struct PlaceOnChain {
    /** The number of the pack among those of the step, or -1 for a place that is not on a chain. */
    int pack = -1;
    /** The segment is the one between this node and the next. */
    int node = 0, lane = 0;
    int chain = -1;
    double fraction = 0;
};

/** Finds places on chains. */
class ChainPlaces {
public:
    /**
     * @param chains     they must exist as long as this object
     * @param particles  the number of particles of the System
     */
    ChainPlaces(const std::vector<Chain>& chains, int particles);
    /** Take note of the packs of a step. */
    void setPacks(const ChainEngine& engine, const std::vector<int>& packs);
    /**
     * Find a place on a chain.
     *
     * @return whether it is on one; a point is not, nor is one between particles that are no segment
     */
    bool find(const Place& place, PlaceOnChain& result) const;
    /** The least friction that a place has against any motion of its own. */
    double getFriction(const PlaceOnChain& place) const;
    /** The chain of a particle, or -1. */
    int getChain(int particle) const {
        return chainOfParticle[particle];
    }
    const std::vector<Chain>& getChains() const {
        return chains;
    }
private:
    const std::vector<Chain>& chains;
    std::vector<int> chainOfParticle, nodeOfParticle, packOfChain, laneOfChain;
};

} // namespace cylchain

#endif /*CYLCHAIN_CHAIN_PLACES_H_*/
