#ifndef CYLCHAIN_PLACE_H_
#define CYLCHAIN_PLACE_H_

namespace cylchain {

/**
 * Where a coupling takes hold: on the line between two particles, at one of them, or at a point that does not move.
 */
struct Place {
    /** The particle at fraction 0, or -1 for a point. */
    int first = -1;
    /** The particle at fraction 1, or -1 if the place is the first particle itself. */
    int second = -1;
    /** From 0 to 1. */
    double fraction = 0;
    /** Where it is, if it is a point. */
    double point[3] = {};
    bool isPoint() const {
        return first < 0;
    }
    bool isOnSegment() const {
        return second >= 0;
    }
};

} // namespace cylchain

#endif /*CYLCHAIN_PLACE_H_*/
