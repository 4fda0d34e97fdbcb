#ifndef OPENMM_CYLINDERCHAINDESCRIPTION_H_
#define OPENMM_CYLINDERCHAINDESCRIPTION_H_

#include "mechanics/ChainList.h"
#include "openmm/CylinderChainForce.h"
#include "openmm/System.h"
#include <string>
#include <vector>

namespace OpenMM {

/**
 * The chains of a CylinderChainForce in a System, as the kernels of a Context know them.  Nodes that have no mass are
 * fixed.
 */
class CylinderChainDescription {
public:
    CylinderChainDescription(const System& system, const CylinderChainForce& force);
    /**
     * Copy the parameters of segments, joints and tethers, for CylinderChainForce::updateParametersInContext().
     */
    void update(const CylinderChainForce& force);
    /**
     * Get all chains, in the order of the Force.
     */
    const cylchain::ChainList& getList() const {
        return chains;
    }
    /**
     * Get the chains of straight segments.
     */
    const std::vector<cylchain::Chain>& getChains() const {
        return chains.getChains();
    }
    /**
     * Get the chains of beam elements.
     */
    const std::vector<cylchain::BeamChain>& getBeams() const {
        return chains.getBeams();
    }
    /**
     * Throw an exception if a chain has no modes, see Scheme::Modes.
     */
    void requireModes() const;
    /**
     * Get the force group of the chains.
     */
    int getForceGroup() const {
        return forceGroup;
    }
    /**
     * Get whether segments are taken as their shortest images.
     */
    bool usesPeriodicBoundaryConditions() const {
        return periodic;
    }
private:
    void lookForModes();
    cylchain::ChainList chains;
    // The first chain that has no modes, and why, or nothing.

    std::string withoutModes;
    int forceGroup;
    bool periodic;
};

} // namespace OpenMM

#endif /*OPENMM_CYLINDERCHAINDESCRIPTION_H_*/
