#ifndef CYLCHAIN_CHAIN_TWIST_H_
#define CYLCHAIN_CHAIN_TWIST_H_

#include <vector>

namespace cylchain {

/** A frame beyond an end of a chain, and the joint with which the last segment there holds on to it. */
struct EndFrame {
    /** Where the filament goes on, from its first to its last node: a unit vector; zero at an end that is free. */
    double direction[3] = {};
    /** The stiffness of the joint against twist; zero if the frame turns with the last segment. */
    double stiffness = 0;
    /** A torque on a frame that turns, and how fast one that is held is turned, both about the direction. */
    double torque = 0, angularVelocity = 0;
    /** Of a frame with a stiffness that turns against the solvent, as a bead does; zero for any other. */
    double friction = 0;
    /** The rigid body that carries the frame, in whose own frame the direction is then; -1 if none does. */
    int body = -1;
};

/**
 * How a chain resists twist. Each segment has a material frame, which turns about the segment against a friction. The
 * twist m of a joint is the angle from the frame before it, carried over by parallel transport, to the one behind it;
 * its energy is (stiffness/2) (m-rest)^2.
 *
 * Twists are numbered by the node before their segment, as joints of closed chains are: that of an open chain with N
 * segments number 0 and N are those to the frames of its ends. With bends at rest, the frame of the first segment is
 * state, too: it is the vector that orthogonal() finds for the direction beyond the first end, carried over by parallel
 * transport, and turned by the twist number 0. Where there is no such direction, it is the z axis; and closed chains,
 * whose joints are N, have that twist as one more, number N.
 */
struct ChainTwist {
    /** Of each joint. */
    std::vector<double> stiffness, rest;
    /**
     * Bends at rest: for each joint, the two components of R k in the material frame half-way over the joint, where
     * its energy of bending is that of the vector b-R k in place of its bend b; none if all joints are straight at
     * rest. The frame half-way is that of the segment before, carried over to the bisector by parallel transport, and
     * turned by half of the twist m.
     */
    std::vector<double> bends;
    /** Of each segment; none if the chain has no twist. */
    std::vector<double> friction;
    EndFrame ends[2];
    bool isPresent() const {
        return !friction.empty();
    }
    bool isBentAtRest() const {
        return !bends.empty();
    }
};

/**
 * What hands that follow the helix of a chain do to the turns of a segment and the one behind it: they are turned about
 * the chain by weighted means of both, against a friction.
 */
struct TurnedPair {
    int segment;
    /** The friction as a symmetric matrix, and the torques by which hands that walk turn the segments. */
    double first = 0, mixed = 0, second = 0;
    double torque[2] = {0, 0};
};

} // namespace cylchain

#endif /*CYLCHAIN_CHAIN_TWIST_H_*/
