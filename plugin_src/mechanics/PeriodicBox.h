#ifndef CYLCHAIN_PERIODIC_BOX_H_
#define CYLCHAIN_PERIODIC_BOX_H_

#include <cmath>

namespace cylchain {

/** Take a displacement to its nearest image in a box, which is nine doubles: its three vectors. */
inline void takeToNearestImage(double* displacement, const double* box) {
    for (int k = 2; k >= 0; k--) {
        // Mostly it is the nearest one. Written so that NaN goes on.
        if (std::fabs(displacement[k]) < 0.5*box[4*k])
            continue;
        const double images = std::floor(displacement[k]/box[4*k]+0.5);
        for (int j = 0; j < 3; j++)
            displacement[j] -= images*box[3*k+j];
    }
}

} // namespace cylchain

#endif /*CYLCHAIN_PERIODIC_BOX_H_*/
