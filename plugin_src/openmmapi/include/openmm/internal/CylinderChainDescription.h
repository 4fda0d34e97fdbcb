#ifndef OPENMM_CYLINDERCHAINDESCRIPTION_H_
#define OPENMM_CYLINDERCHAINDESCRIPTION_H_

#include "mechanics/Chain.h"
#include "openmm/CylinderChainForce.h"
#include "openmm/System.h"
#include <vector>

namespace OpenMM {

/**
 * Describe the chains of a CylinderChainForce in a System.  Nodes that have no mass are fixed.
 */
std::vector<cylchain::Chain> describeChains(const System& system, const CylinderChainForce& force);

/**
 * Copy the parameters of segments, joints and tethers to a description that exists already, for
 * CylinderChainForce::updateParametersInContext().
 */
void updateChains(std::vector<cylchain::Chain>& chains, const CylinderChainForce& force);

} // namespace OpenMM

#endif /*OPENMM_CYLINDERCHAINDESCRIPTION_H_*/
