#ifndef CYLCHAIN_BEAM_CHAIN_H_
#define CYLCHAIN_BEAM_CHAIN_H_

#include "mechanics/Chain.h"
#include <vector>

namespace cylchain {

/** How far a force at the end of an element moves it that is alone, over how far it moves all of the element. */
const double MOBILITY_OF_BEAM_END = 16;
/** How far a moment turns the tangent at the end of an element that is alone, times the cube of its length. */
const double MOBILITY_OF_BEAM_TANGENT = 1200;

/**
 * A filament made of beam elements of the same length h that are continuous in position and tangent, with nothing of
 * OpenMM in it. Any consistent set of units will do.
 *
 * Node i has a position P and a control point Q. Element i is the cubic curve r(x), x from 0 to 1, with the Bezier
 * points P_i, Q_i, 2 P_(i+1)-Q_(i+1) and P_(i+1), so that r' = dr/ds = 3 (Q-P)/h at a node, s being the arc length at
 * rest. With the vectors t_i, u and t_(i+1) of r' at the ends and in the middle of an element, the angles alpha from
 * t_i to u and beta from u to t_(i+1), as vectors along the axes of these rotations, their sum s = alpha+beta and
 *
 *     d = (beta-alpha) (1+|v|^2/40+|v|^4/560+|beta-alpha|^2/84),    v = t_(i+1)-t_i,
 *
 * the energy of an element is
 *
 *     (EI/2h) (s^2+(4/3) d^2) + (K h/2) (e_i^2/6 + 2 e^2/3 + e_(i+1)^2/6).
 *
 * The first part is (EI/2) int theta'^2 ds of an angle theta that is quadratic along the element, as long as it bends
 * little; the factor in d makes it, to its orders, that of the curve in a plane that has the least energy with these
 * ends, without a force along its chord. The second part is (K/2) int (|r'|-1)^2 ds by Simpson's rule, which does not
 * lock: e_i = |t_i|-1 at the nodes and, in the middle, e = |u|-1-|w|^2/40+|v|^4/480 with w = t_i-2u+t_(i+1). What is
 * taken away there is the error that Simpson's rule makes in the chord of an element with such an angle.
 *
 * Friction is distributed along the curve, along and across it, and so is its noise.
 */
struct BeamChain {
    /** Two for each node: its position and its control point. */
    std::vector<int> particles;
    /** The length h of an element, the modulus K = EA, a force, and the bending rigidity EI. */
    double elementLength, stretchingModulus, bendingRigidity;
    /**
     * The part by which the chord of an element is shorter, because bends inside of it for which it has no coordinates
     * take it up: where these fluctuate, k_B T h/15 EI in space and k_B T h/30 EI in a plane. The strain e becomes
     * e+(3/2) times this.
     */
    double shortening = 0;
    /** Friction per length against motion along and across the curve. */
    double parallelFriction, perpendicularFriction;
    /**
     * A force F0 on each element along its curve, towards its second node, that belongs to no energy: F0 t dx on each
     * part dx, with the unit tangent t there.
     */
    double propulsion = 0;
    /** Particles that do not move: a position alone is a hinge, both particles of a node are a clamp. */
    std::vector<bool> fixed;
    /** Whether particles keep their z, which must be the same for all of them. */
    bool planar = false;
    /** Springs between the positions of nodes and points. */
    std::vector<Tether> tethers;
    /** Whether one more element, the last one, leads from the last node to the first: a ring. */
    bool closed = false;
    const std::vector<int>& getParticles() const {
        return particles;
    }
    int numNodes() const {
        return particles.size()/2;
    }
    /** The first node whose control point is fixed while its position is not, which no chain may have, or -1. */
    int findLoneControlPoint() const {
        for (int node = 0; node < numNodes(); node++)
            if (fixed[2*node+1] && !fixed[2*node])
                return node;
        return -1;
    }
    int numElements() const {
        return numNodes()-(closed ? 0 : 1);
    }
};

} // namespace cylchain

#endif /*CYLCHAIN_BEAM_CHAIN_H_*/
