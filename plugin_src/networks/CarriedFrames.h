#ifndef CYLCHAIN_CARRIED_FRAMES_H_
#define CYLCHAIN_CARRIED_FRAMES_H_

#include "dynamics/ChainEngine.h"
#include "mechanics/Chain.h"
#include "mechanics/RigidBody.h"
#include <utility>
#include <vector>

namespace cylchain {

/**
 * Frames beyond ends of chains with twist that rigid bodies carry.
 *
 * The joint between a frame with the direction a and the segment with the direction b behind it has the twist m, which
 * changes by (w_b-w_a).(a+b)/(1+a.b) as both turn by w. So its torque T = (stiffness) m is that of the couple T
 * (a+b)/(1+a.b) on the body and the opposite one on the segment. In a step, or a part of it, the chain takes the frame
 * for one that stands still, and the body has the torque that this leads to; then the frame turns with the body. Each
 * of both keeps equilibrium, but that the torque does not change while it turns the body: with a = (stiffness)
 * h/(friction of the body against turning), the square of the twist is by a^2 of it too large. So steps are divided
 * where a is large.
 */
class CarriedFrames {
public:
    /** Both must exist as long as this object. */
    CarriedFrames(const std::vector<Chain>& chains, const std::vector<RigidBody>& bodies);
    bool isEmpty() const {
        return frames.empty();
    }
    /** Find where frames point as a step begins, and their torques on bodies; and let its settings know of them. */
    void begin(const double* positions, const double* box, StepSettings& settings);
    /** Let bodies have the torques that the last iteration has found, for these positions. */
    void update(const double* positions);
    /**
     * Let frames turn with their bodies: add that to the changes of the twists of chains that take the step.
     *
     * @param positions  those that the step has led to
     */
    void follow(const double* positions, const std::vector<bool>& taken, const StepSettings& settings) const;
    /** Find how often chains that take a step of this size must halve it, so that bodies do not turn too far. */
    int findHalvings(double stepSize, const std::vector<bool>& taken) const;
    /** Find those that must halve it. */
    void findFailures(double stepSize, const std::vector<bool>& taken, std::vector<bool>& failed) const;
    /** The body that carries a frame of a chain, or -1. */
    int findBody(int chain) const;
    /** The chain and the body of each frame. */
    std::vector<std::pair<int, int> > findPairs() const;
private:
    struct Frame {
        int chain, end, body;
        /** Of the segment at the end. */
        int nodes[2];
        /** How fast torques turn the body, in its own frame: a symmetric matrix. */
        double mobility[6];
    };
    void findTangent(const Frame& frame, const double* positions, double* tangent) const;
    void findCouple(const Frame& frame, const double* positions, double* couple) const;
    double& twistOf(const Frame& frame, std::vector<std::vector<double> >& twists) const;
    const std::vector<Chain>& chains;
    const std::vector<RigidBody>& bodies;
    std::vector<RigidFrameFinder> finders;
    std::vector<Frame> frames;
    /** Of all frames of each body: the sum of (stiffness)/(friction of the body against turning), as a step begins. */
    std::vector<double> rates;
    const double* box = nullptr;
    /** Of bodies as a step begins, and what its settings tell of them. */
    std::vector<RigidFrame> starts;
    std::vector<std::vector<double> > directions;
    std::vector<double> ofJoints, torques;
};

} // namespace cylchain

#endif /*CYLCHAIN_CARRIED_FRAMES_H_*/
