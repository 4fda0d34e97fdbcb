#ifndef CYLCHAIN_SCHEMES_H_
#define CYLCHAIN_SCHEMES_H_

#include "mechanics/Enumerators.h"

/**
 * How positions are advanced in a step, and whether the scheme computes the forces of chains itself.
 *
 * - Euler: Section 4 of the paper. The thermal torque of a free segment is sent through the constraints.
 * - Midpoint: Fixman's midpoint, which has the right drift on chains.
 * - Implicit: the chain's own forces at the end of the step, so that they do not limit it.
 * - ImplicitSecondOrder: the same in two stages, so that the motion of bends is right to second order in the step.
 * - Modes: the normal modes of chains of beads, each advanced as if it were alone: Panja, Barkema and van Leeuwen,
 *   Phys. Rev. E 2015, 92, 032603, Section IV.
 */
#define CYLCHAIN_SCHEMES(ENTRY) \
    ENTRY(Euler, "euler", false) \
    ENTRY(Midpoint, "midpoint", false) \
    ENTRY(Implicit, "implicit", true) \
    ENTRY(ImplicitSecondOrder, "implicit-second-order", true) \
    ENTRY(Modes, "modes", true)

namespace cylchain {

enum class Scheme {CYLCHAIN_SCHEMES(CYLCHAIN_ENUMERATOR)};

template <> struct Names<Scheme> {
    static constexpr const char* ALL[] = {CYLCHAIN_SCHEMES(CYLCHAIN_NAME)};
};

/** Whether a scheme is one of the implicit ones, which solve equations in each step. */
constexpr bool isImplicit(Scheme scheme) {
    return scheme == Scheme::Implicit || scheme == Scheme::ImplicitSecondOrder;
}

/** Whether a scheme computes the forces of chains itself. */
constexpr bool computesChainForces(Scheme scheme) {
    switch (scheme) {
#define CYLCHAIN_CASE(entry, name, computes) case Scheme::entry: return computes;
        CYLCHAIN_SCHEMES(CYLCHAIN_CASE)
#undef CYLCHAIN_CASE
    }
    noOtherEntry();
}

} // namespace cylchain

#endif /*CYLCHAIN_SCHEMES_H_*/
