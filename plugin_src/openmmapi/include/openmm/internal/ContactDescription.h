#ifndef OPENMM_CONTACTDESCRIPTION_H_
#define OPENMM_CONTACTDESCRIPTION_H_

#include "couplings/ContactSearch.h"
#include "networks/CurveSites.h"
#include "openmm/CylinderChainContactForce.h"
#include "openmm/internal/PlaceResolver.h"
#include <vector>

namespace OpenMM {

/**
 * Count the segments of a chain of a CylinderChainContactForce.
 */
int countSegments(const CylinderChainContactForce& owner, int chain);

/**
 * Describe what touches: the segments of all chains, in their order, then the spheres.
 *
 * @param numParticles  of the System; an exception is thrown for particles that it has not
 */
cylchain::CapsuleSystem describeCapsules(const CylinderChainContactForce& owner, int numParticles);

/**
 * Find capsules that are straight pieces of beam elements: between virtual sites at neighbouring ones of places at
 * equal distances along the curve of an element, its nodes among them.
 *
 * @param[out] onCurves  these capsules
 * @param[out] sites     all virtual sites at which capsules end that lie on curves
 */
void findCurves(const std::vector<cylchain::Capsule>& capsules, const PlaceResolver& places,
        std::vector<cylchain::CapsuleOnCurve>& onCurves, std::vector<cylchain::CurveSite>& sites);

} // namespace OpenMM

#endif /*OPENMM_CONTACTDESCRIPTION_H_*/
