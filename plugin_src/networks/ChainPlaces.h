#ifndef CYLCHAIN_CHAIN_PLACES_H_
#define CYLCHAIN_CHAIN_PLACES_H_

#include "couplings/Place.h"
#include "mechanics/BeamChain.h"
#include "mechanics/Chain.h"
#include "mechanics/ElementHold.h"
#include "mechanics/RigidBody.h"
#include "networks/ParticleStep.h"
#include <vector>

namespace cylchain {

/** A place on a segment or an element of a chain, or at a particle outside chains, and where that is among packs. */
struct PlaceOnChain {
    /** The number of the pack among those of the step, or -1 for a place that does not move. */
    int pack = -1;
    /** The segment or element is the one between this node and the next; of a body, the particle has this number. */
    int node = 0, lane = 0;
    /**
     * The chain; of beam elements, its number behind those of segments; for a rigid body, behind those of all chains,
     * and for a particle, behind those of bodies.
     */
    int chain = -1;
    /** Of the segment or element, and what is held of an element there. */
    double fraction = 0;
    ElementHold hold;
};

/** The friction that a segment or an element has against motion of a place across it, as if it were alone. */
struct LateralFriction {
    /** That of a node or a particle; that of all of the segment against motion, and against turning; its length. */
    double ofNode = 0, perpendicular = 0, rotational = 0, length = 0;
    double at(double fraction) const {
        if (!(perpendicular > 0 && rotational > 0))
            return ofNode;
        const double arm = (fraction-0.5)*length;
        return ofNode+1/(1/perpendicular+arm*arm/rotational);
    }
};

/**
 * Finds places on chains, and at particles outside chains that are coupled to them. Chains of beam elements count as
 * further chains, rigid bodies as further ones behind them, and then these particles.
 */
class ChainPlaces {
public:
    /**
     * @param chains     they must exist as long as this object
     * @param beams      so must they
     * @param bodies     and they
     * @param particles  the number of particles of the System
     */
    ChainPlaces(const std::vector<Chain>& chains, const std::vector<BeamChain>& beams,
            const std::vector<RigidBody>& bodies, int particles);
    /** Set the particles outside chains and bodies. */
    void setParticles(const std::vector<CoupledParticle>& particles);
    /**
     * Take note of the packs of a step.
     *
     * @param chainsOfLanes  the chain in each lane of each pack, or -1
     */
    void setPacks(const std::vector<std::vector<int> >& chainsOfLanes);
    /**
     * Find a place.
     *
     * @return whether it moves with a chain or a particle; a point does not, nor does one between particles that are no
     *         segment, or at the control point of a beam element
     */
    bool find(const Place& place, PlaceOnChain& result) const;
    /** The particle at a place, or at the beginning of its segment; of a body, its first one. */
    int getParticle(const PlaceOnChain& place) const;
    int getNumParticles() const {
        return chainOfParticle.size();
    }
    /** The least friction that a place has against any motion of its own. */
    double getFriction(const PlaceOnChain& place) const;
    /** The same of the place that has the least. */
    double getLeastFriction() const {
        return leastFriction;
    }
    /**
     * The friction that a place has against motion across its segment, which turns and moves as if it were alone: not
     * much more than the least friction against any motion.
     */
    double getLateralFriction(const PlaceOnChain& place) const {
        return findLateralFriction(place).at(place.fraction);
    }
    /** The same for all places on a segment. */
    LateralFriction findLateralFriction(const PlaceOnChain& place) const;
    /** The chains of segments, whose numbers come first. */
    const std::vector<Chain>& getChains() const {
        return chains;
    }
    /** The number of chains, those of beam elements among them, behind which bodies are counted. */
    int getNumFilaments() const {
        return chains.size()+beams.size();
    }
    /** The number of chains and bodies, behind which particles are counted. */
    int getFirstParticle() const {
        return getNumFilaments()+bodies.size();
    }
    /** Whether a chain is one of beam elements. */
    bool isBeam(int chain) const {
        return !isStraight(chain) && chain < getNumFilaments();
    }
    bool isBody(int chain) const {
        return chain >= getNumFilaments() && chain < getFirstParticle();
    }
    /** A chain of beam elements, by its number among all chains. */
    const BeamChain& getBeam(int chain) const {
        return beams[chain-chains.size()];
    }
    /** The length of a chain of segments whose segments have their rest lengths. */
    double getLength(int chain) const {
        return lengths[chain];
    }
    /** The number of chains, bodies and particles. */
    int getNumChains() const {
        return getFirstParticle()+particles.size();
    }
    /** Take note that segments have other lengths and friction, while nodes are the same. */
    void updateLengths();
    /** The particles that move with a chain or body, or the one that is counted as one. */
    std::vector<int> getNodes(int chain) const;
private:
    bool isParticle(int chain) const {
        return chain >= getFirstParticle();
    }
    const CoupledParticle& particleOf(int chain) const {
        return particles[chain-getFirstParticle()];
    }
    const RigidBody& bodyOf(int chain) const {
        return bodies[chain-getNumFilaments()];
    }
    bool isStraight(int chain) const {
        return chain < (int) chains.size();
    }
    bool isClosed(int chain) const {
        return isStraight(chain) ? closed[chain] != 0 : getBeam(chain).closed;
    }
    int getNumNodes(int chain) const {
        return isStraight(chain) ? firstNodes[chain+1]-firstNodes[chain] : getBeam(chain).numNodes();
    }
    const std::vector<Chain>& chains;
    const std::vector<BeamChain>& beams;
    const std::vector<RigidBody>& bodies;
    std::vector<CoupledParticle> particles;
    std::vector<double> lengths;
    /**
     * What is asked of chains of segments for places in any order, close together in memory: the first node of each
     * chain among those of all, and the particle of each node, with the least friction of the segment behind it.
     */
    std::vector<int> firstNodes, particleOfNode;
    std::vector<char> closed;
    std::vector<double> frictionOfNode;
    double leastFriction;
    void findLeastFriction();
    /** Of a control point, the node is -1. */
    std::vector<int> chainOfParticle, nodeOfParticle, packOfChain, laneOfChain;
};

} // namespace cylchain

#endif /*CYLCHAIN_CHAIN_PLACES_H_*/
