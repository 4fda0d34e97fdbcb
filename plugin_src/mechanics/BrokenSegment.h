#ifndef CYLCHAIN_BROKEN_SEGMENT_H_
#define CYLCHAIN_BROKEN_SEGMENT_H_

#include "mechanics/Chain.h"

namespace cylchain {

/** The segment of a chain by which a step has gone wrong, and how. */
struct BrokenSegment {
    enum Reason {
        /** The force on it, or its position, is not finite. */
        NotFinite,
        /** Its ends would move against each other by more than its rest length: by the value. */
        MovesTooFar,
        /** It would have a length, the value, that is not in the range of its potential. */
        LeavesRange,
        /** The equations of an implicit scheme were not solved. */
        NotSolved
    };
    int segment;
    Reason reason;
    double value;
};

/**
 * Find the segment of a chain by which a step has gone wrong. Positions, forces and displacements are three doubles for
 * each particle: those of the start of the step, and what it would have moved particles by.
 *
 * @param box       the three vectors of a periodic box (nine doubles), to take each segment as its shortest image, or
 *                  NULL
 * @param implicit  whether the scheme is implicit
 */
BrokenSegment findBrokenSegment(const Chain& chain, const double* positions, const double* forces,
        const double* displacements, const double* box, bool implicit);

} // namespace cylchain

#endif /*CYLCHAIN_BROKEN_SEGMENT_H_*/
