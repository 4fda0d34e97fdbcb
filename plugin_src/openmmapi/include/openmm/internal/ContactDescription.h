#ifndef OPENMM_CONTACTDESCRIPTION_H_
#define OPENMM_CONTACTDESCRIPTION_H_

#include "couplings/ContactBodies.h"
#include "networks/CurveSites.h"
#include "openmm/internal/PlaceResolver.h"
#include <vector>

namespace OpenMM {

/**
 * Describe what touches.  An exception is thrown for particles that the System has not.
 *
 * @param isSpare  whether each particle is no node of its chain now
 */
cylchain::CapsuleSystem describeCapsules(const cylchain::ContactBodies& bodies, const System& system,
        const std::vector<bool>& isSpare = {});

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
