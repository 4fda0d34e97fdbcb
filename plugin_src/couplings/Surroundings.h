#ifndef CYLCHAIN_SURROUNDINGS_H_
#define CYLCHAIN_SURROUNDINGS_H_

#include "couplings/CapsuleGeometry.h"
#include "mechanics/ChainList.h"
#include <algorithm>
#include <vector>

namespace cylchain {

/**
 * How a chain would change at one of its ends. One that begins has one node and no segments before, and one that
 * vanishes so afterwards.
 */
struct EndChange {
    /** The number of the chain. */
    int chain;
    /** The plus end (1) or the minus end (0). */
    int end;
    /** All nodes, from the minus to the plus end. */
    const std::vector<Vec3d> &before, &after;
    /** How many segments at the end are others, or move: one, or two in the one of both that has a joint more. */
    int segmentsBefore, segmentsAfter;
    /** The lengths along the chain, at rest, at which these nodes are. */
    const std::vector<double> &alongBefore, &alongAfter;
    /** Where the new joint is on the segment that is divided, or the old one on that which both become: a fraction. */
    double joint;
    /** Whether the chain begins or vanishes. */
    bool isOfWhole() const {
        return segmentsBefore == 0 || segmentsAfter == 0;
    }
    /** How many nodes at the end are others, before or after. */
    int countNodes(int segments) const {
        return segments == 0 ? 0 : segments+(isOfWhole() ? 1 : 0);
    }
};

/** A place on a segment of a chain: its number, and a fraction of it. */
struct SegmentPlace {
    int segment;
    double fraction;
};

/** Find the place at a length along nodes that are at some lengths, of which there are two or more. */
inline SegmentPlace findAlong(const std::vector<double>& along, double length) {
    const int last = static_cast<int>(along.size())-2;
    const int after = std::upper_bound(along.begin(), along.end(), length)-along.begin();
    const int segment = std::min(last, std::max(0, after-1));
    return {segment, (length-along[segment])/(along[segment+1]-along[segment])};
}

/** What the ends of chains feel of all that is around them: their walls, or their contacts. */
class Surroundings {
public:
    virtual ~Surroundings() {
    }
    /**
     * Take note of where all particles are, in a step in which some chain may change.
     *
     * @param box  the three vectors of the periodic box, which exist as long as the step
     */
    virtual void begin(const double* positions, const ChainList& chains, const double* box) = 0;
    /** Find the change of the energy, infinite if it cannot be. */
    virtual double findChange(const EndChange& change) = 0;
    /**
     * Take note of the nodes that a chain has now, and of the lengths along it, at rest, at which they are.
     */
    virtual void show(int chain, const std::vector<Vec3d>& nodes, const std::vector<double>& along) = 0;
    /**
     * Take note that all beyond a length along a chain is on another one now, with the same lengths along it.
     */
    virtual void move(int, int, double) {
    }
};

} // namespace cylchain

#endif /*CYLCHAIN_SURROUNDINGS_H_*/
