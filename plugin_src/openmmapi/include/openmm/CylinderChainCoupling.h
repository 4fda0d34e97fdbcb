#ifndef OPENMM_CYLINDERCHAINCOUPLING_H_
#define OPENMM_CYLINDERCHAINCOUPLING_H_

#include "couplings/Place.h"
#include "openmm/Force.h"
#include <string>
#include <vector>

namespace OpenMM {

class PlaceResolver;
class System;

/**
 * A Force that couples chains with each other, with other particles, or with what does not move.
 *
 * The implicit schemes of CylinderChainIntegrator have it in their equations if all of its places are on segments of
 * chains, at particles, or do not move.  If not, it is a Force like any other for them.
 */
class CylinderChainCoupling : public Force {
public:
    /**
     * Find what keeps this Force out of the equations of implicit schemes, in words; nothing is returned if it is in
     * them.
     *
     * @param system  the System, which is complete
     */
    std::string whyExplicit(const System& system) const;
    /**
     * Find the places on which this Force acts.
     *
     * @param resolver  what moves the places of the System
     */
    virtual std::vector<cylchain::Place> findPlaces(const PlaceResolver& resolver) const = 0;
};

} // namespace OpenMM

#endif /*OPENMM_CYLINDERCHAINCOUPLING_H_*/
