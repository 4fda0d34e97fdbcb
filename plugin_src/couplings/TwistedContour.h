#ifndef CYLCHAIN_TWISTED_CONTOUR_H_
#define CYLCHAIN_TWISTED_CONTOUR_H_

#include "couplings/Contours.h"
#include "mechanics/Chain.h"
#include <vector>

namespace cylchain {

/** How a hand follows the helix of chains with twist. */
struct HandOnHelix {
    /** The length of a turn of the helix, negative if it is left-handed; zero of a hand that follows none. */
    double pitch = 0;
    /** Against turning about the chain. */
    double friction = 0;
    /** If positive, the torque that stops it; and from how far along the chain that is known. */
    double stallTorque = 0, range = 0;
};

/**
 * A chain with twist, of which hands follow the helix: its number, what it is, and its twists.
 *
 * The frame of the chain at a hand is the mean of those of the two segments between whose middles it is. A hand that
 * follows the helix turns about the chain with this frame, and, as it walks, by 2 pi for each pitch and by the twist
 * beyond rest from where it was to where it is. With the frame at the end of a step, and twists at its start, no part
 * of the turns is left out, whatever the step is.
 */
struct TwistedContour {
    const Contours& contours;
    int number;
    const Chain& chain;
    const std::vector<double>& twists;
    /** The torque of a joint, by the number of the segment behind it; zero at ends that are free. */
    double torqueOf(int joint) const;
    /**
     * Find the torque of the chain on a hand, about the direction towards its plus end: the mean of joints ahead less
     * that of joints behind, so far from the two segments that it holds. There is no torque beyond an end.
     */
    double findTorque(double position, double range) const;
    /** Describe what a hand does that has walked to a position in a step. */
    TurnedPair describe(const HandOnHelix& hand, double position, double walked, double stepSize) const;
private:
    /** The segment before a position, or at it, by middles; how much of the one behind it; and how far that is. */
    struct Middle {
        int segment;
        double share, distance;
    };
    Middle findMiddle(double position) const;
    /** By how much a joint between segments is twisted beyond rest. */
    double twistOf(int joint) const;
    /** The twist beyond rest between two places of which neither is half a ring from the other. */
    double findTwist(const Middle& from, const Middle& to) const;
};

/** Add up what several hands do to the same pairs of segments. */
void addTurnedPair(std::vector<TurnedPair>& pairs, const TurnedPair& added);

} // namespace cylchain

#endif /*CYLCHAIN_TWISTED_CONTOUR_H_*/
