#ifndef CYLCHAIN_CHAIN_H_
#define CYLCHAIN_CHAIN_H_

#include "mechanics/BendingModels.h"
#include "mechanics/ChainTwist.h"
#include "mechanics/StretchingModels.h"
#include <vector>

/**
 * The mechanics of extensible cylinder chains, with nothing of OpenMM in it.
 *
 * Equation numbers refer to Pesek et al., Soft Matter 2016, 12, 3360. Any consistent set of units will do; the
 * plugin uses nm, ps and kJ/mol.
 */
namespace cylchain {

/** One segment: its potential and its friction (3), kept at the values of the rest length. */
struct Segment {
    double restLength, stiffness, maximumExtension;
    double parallel, perpendicular, rotational, extensional;
    /** A force along the segment, from its minus end to its plus end, that belongs to no energy. */
    double propulsion = 0;
};

/** A spring between a node and a point: its energy is (stiffness/2) d^2 for their distance d. */
struct Tether {
    int node;
    double point[3], stiffness;
};

/**
 * A chain of segments that share nodes: segment s joins the nodes s (its minus end) and s+1 (its plus end). The last
 * segment of a closed chain, a ring, joins the last node and the first.
 */
struct Chain {
    /** Particle of each node. */
    std::vector<int> nodes;
    /** Particles of a chain that grows which are no nodes now, but may become some: they are where the last node is. */
    std::vector<int> spareNodes;
    /** One less than nodes; as many as nodes if the chain is closed. */
    std::vector<Segment> segments;
    /**
     * Stiffness a/l0 of each joint: joint j is at node j+1, and at node j if the chain is closed, where every node has
     * one.
     */
    std::vector<double> joints;
    BendingModel bending;
    StretchingModel stretching;
    /**
     * Friction of each node against its motion, the same in all directions, besides that of segments: a chain of beads
     * has this one alone.
     */
    double nodeFriction = 0;
    /** Nodes that do not move. */
    std::vector<bool> fixed;
    std::vector<Tether> tethers;
    /** Whether the last node is joined to the first; there must be at least four nodes then. */
    bool closed = false;
    /** Whether nodes keep their z, which must be the same for all of them. */
    bool planar = false;
    /** The length along the chain at which its first node is: not zero where a chain has grown there. */
    double start = 0;
    ChainTwist twist;
    int numTwists() const {
        return twist.isPresent() ? segments.size()+(closed && !twist.isBentAtRest() ? 0 : 1) : 0;
    }
    int numNodes() const {
        return nodes.size();
    }
    const std::vector<int>& getParticles() const {
        return nodes;
    }
};

} // namespace cylchain

#endif /*CYLCHAIN_CHAIN_H_*/
