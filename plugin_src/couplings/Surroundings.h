#ifndef CYLCHAIN_SURROUNDINGS_H_
#define CYLCHAIN_SURROUNDINGS_H_

#include "couplings/CapsuleGeometry.h"
#include "mechanics/ChainList.h"
#include <vector>

namespace cylchain {

/** How a chain would change at one of its ends. */
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
};

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
    /** Take note of a change that was made. */
    virtual void accept(const EndChange& change) = 0;
};

} // namespace cylchain

#endif /*CYLCHAIN_SURROUNDINGS_H_*/
