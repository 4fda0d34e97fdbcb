#ifndef CYLCHAIN_LINKS_H_
#define CYLCHAIN_LINKS_H_

#include "couplings/Place.h"
#include "mechanics/StretchingModels.h"
#include <cstdint>

namespace cylchain {

/**
 * A spring between two places, with the energy of their distance d: (k/2) (d-d0)^2, or that of FENE with the maximum
 * extension D.
 */
struct Link {
    Place first, second;
    StretchingModel model = StretchingModel::Harmonic;
    double stiffness = 0, restLength = 0, maximumExtension = 0;
    /** Its number among all links there have ever been: its noise belongs to it. */
    std::uint32_t number = 0;
};

/** How distances are measured: boxes are nine numbers, or NULL where positions are taken as they are. */
struct LinkBoxes {
    /** The box in which the ends of a link are taken to their nearest images. */
    const double* distances = nullptr;
    /** The box in which the two particles of a place are. */
    const double* segments = nullptr;
};

/** What a link does in a configuration. */
struct LinkPull {
    /** The distance d. */
    double length;
    double energy;
    /** On the second place; the opposite acts on the first. */
    double force[3];
    /** Whether d is one that the potential allows: if not, energy and force are zero. NaN is not allowed to FENE. */
    bool inRange;
};

/** Compute what a link does. Where its places coincide, the force has no direction and is zero. */
LinkPull computePull(const Link& link, const double* positions, const LinkBoxes& boxes);

} // namespace cylchain

#endif /*CYLCHAIN_LINKS_H_*/
