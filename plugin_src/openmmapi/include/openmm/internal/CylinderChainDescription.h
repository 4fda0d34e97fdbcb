#ifndef OPENMM_CYLINDERCHAINDESCRIPTION_H_
#define OPENMM_CYLINDERCHAINDESCRIPTION_H_

#include "mechanics/ChainList.h"
#include "openmm/CylinderChainForce.h"
#include "openmm/System.h"
#include <set>
#include <string>
#include <vector>

namespace OpenMM {

/**
 * The chains of a CylinderChainForce in a System, as the kernels of a Context know them.  Nodes that have no mass are
 * fixed.  Chains that grow have the nodes, segments and joints of their monomers.
 */
class CylinderChainDescription {
public:
    CylinderChainDescription(const System& system, const CylinderChainForce& force);
    /**
     * Copy the parameters of segments, joints and tethers, for CylinderChainForce::updateParametersInContext().
     */
    void update(const CylinderChainForce& force);
    /**
     * Get whether any chains grow.
     */
    bool anyGrow() const {
        return !growing.empty();
    }
    /**
     * Get all chains, so that those that grow may change.
     */
    cylchain::ChainList& getGrowingList() {
        return chains;
    }
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
     * Get the rigid bodies.
     */
    const std::vector<cylchain::RigidBody>& getBodies() const {
        return bodies;
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
    const std::vector<cylchain::RigidBody> bodies;
    // Those that grow are not taken from the Force any more.

    std::set<int> growing;
    // The first chain that has no modes, and why, or nothing.

    std::string withoutModes;
    int forceGroup;
    bool periodic;
};

/**
 * Find which particles of a System are no nodes before anything happens, because they belong to chains that grow.
 */
std::vector<bool> findSpareNodes(const System& system);

} // namespace OpenMM

#endif /*OPENMM_CYLINDERCHAINDESCRIPTION_H_*/
