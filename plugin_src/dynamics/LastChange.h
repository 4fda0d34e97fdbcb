#ifndef CYLCHAIN_LAST_CHANGE_H_
#define CYLCHAIN_LAST_CHANGE_H_

#include "mechanics/Inline.h"

namespace cylchain {

/** The largest last change of Newton's method with which it may end, over the tolerance. */
const double LARGEST_LAST_CHANGE = 3;
/** The largest that the next change may be expected to be then, over the same. */
const double LARGEST_NEXT_CHANGE = 0.5;

/**
 * Whether Newton's method may end: its last change is small enough, or what is left is. Changes become smaller at least
 * as fast as they did from the one before to the last one, so that the next one is less than last^2/before. See Hairer
 * and Wanner, Solving Ordinary Differential Equations II, section IV.8. NaN is too large.
 *
 * @param last    the square of the last change
 * @param before  that of the one before, or 0 if that is not known
 * @param limit   the square of the tolerance
 */
CYLCHAIN_INLINE bool isLastChange(double last, double before, double limit) {
    return last <= limit || (last <= LARGEST_LAST_CHANGE*LARGEST_LAST_CHANGE*limit &&
            last*last <= LARGEST_NEXT_CHANGE*LARGEST_NEXT_CHANGE*limit*before);
}

} // namespace cylchain

#endif /*CYLCHAIN_LAST_CHANGE_H_*/
