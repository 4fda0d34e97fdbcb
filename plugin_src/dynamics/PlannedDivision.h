#ifndef CYLCHAIN_PLANNED_DIVISION_H_
#define CYLCHAIN_PLANNED_DIVISION_H_

#include "dynamics/ChainEngine.h"
#include "dynamics/ChainPack.h"
#include "mechanics/Inline.h"

namespace cylchain {

/** An implicit step of a chain is cut into at most two to this power. */
const int LARGEST_DIVISION_OF_CHAIN = 16;
/** The largest variance of an angle by which a chain may turn as a whole in a part of a step. */
const double LARGEST_TURN_OF_CHAIN = 0.2;

/**
 * Find into how many parts, two to this power, the step of a chain is cut from the start, because it turns too far in
 * it. Where equations that are not solved alone decided, what is random would.
 */
template <class Scalar> CYLCHAIN_INLINE int plannedDivision(const ChainPack<Scalar>& pack,
        const StepSettings& settings, int lane) {
    double turn = settings.mayDivide ? 2*settings.kT*settings.stepSize*pack.turning[lane] : 0;
    const int most = settings.level+LARGEST_DIVISION_OF_CHAIN < LARGEST_LEVEL ? LARGEST_DIVISION_OF_CHAIN :
            LARGEST_LEVEL-settings.level;
    int division = 0;
    for (; turn > LARGEST_TURN_OF_CHAIN && division < most; division++)
        turn *= 0.5;
    return division;
}

} // namespace cylchain

#endif /*CYLCHAIN_PLANNED_DIVISION_H_*/
