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

} // namespace cylchain

#endif /*CYLCHAIN_LINKS_H_*/
