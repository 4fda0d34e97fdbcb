#ifndef CYLCHAIN_BEAD_MODES_H_
#define CYLCHAIN_BEAD_MODES_H_

#include "mechanics/Chain.h"
#include <optional>
#include <string>

namespace cylchain {

/**
 * Chains of beads whose forces, but for a part of that which keeps contours long, are diagonal in the modes of beads
 * that are joined by ideal springs, sums over n of r_n cos(pi p (n+1/2)/N) for N beads: Panja, Barkema and van Leeuwen,
 * Phys. Rev. E 2015, 92, 032603, with the energy (1) of N-1 bonds u,
 *
 *     (lambda/2) sum (|u_n|-d)^2 - kappa sum u_n.u_(n+1)
 *
 * which is (1/2) sum [k |u_n|^2 - 2 lambda d |u_n|] + (kappa/2) sum |u_(n+1)-u_n|^2 for k = lambda-2 kappa, where the
 * last sum goes from zero before the first bond to zero behind the last one. The segments of such a chain are harmonic,
 * with k and the rest length lambda d/k, but for k+kappa and lambda d/(k+kappa) at both ends, and lambda and d if there
 * is one alone.
 */
struct BeadModes {
    /** k, lambda d and kappa. */
    double stiffness, contourForce, bendingStiffness;
    double nodeFriction;
    bool operator==(const BeadModes& other) const;
    /** The rate at which the bends of mode p of so many nodes decay, (45), and that at which its bonds do. */
    double bendingRate(int p, int nodes) const;
    double stretchingRate(int p, int nodes) const;
};

/** Get what the modes of a chain need, or nothing, and the reason, if it has none. */
std::optional<BeadModes> findModes(const Chain& chain, std::string& reason);

} // namespace cylchain

#endif /*CYLCHAIN_BEAD_MODES_H_*/
