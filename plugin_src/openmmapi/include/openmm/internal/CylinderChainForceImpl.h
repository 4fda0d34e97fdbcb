#ifndef OPENMM_CYLINDERCHAINFORCEIMPL_H_
#define OPENMM_CYLINDERCHAINFORCEIMPL_H_

#include "openmm/CylinderChainForce.h"
#include "openmm/Kernel.h"
#include "openmm/internal/CylinderChainDescription.h"
#include "openmm/internal/StepForceImpl.h"
#include <map>
#include <memory>
#include <string>
#include <utility>
#include <vector>

namespace OpenMM {

/**
 * This is the internal implementation of CylinderChainForce.
 */
class CylinderChainForceImpl : public StepForceImpl {
public:
    explicit CylinderChainForceImpl(const CylinderChainForce& owner);
    void initialize(ContextImpl& context);
    const CylinderChainForce& getOwner() const {
        return owner;
    }
    /**
     * Throw an exception if an Integrator that knows nothing of planes would take a planar chain out of its own.
     */
    void updateContextState(ContextImpl& context, bool& forcesInvalid);
    double calcForcesAndEnergy(ContextImpl& context, bool includeForces, bool includeEnergy, int groups);
    std::map<std::string, double> getDefaultParameters() {
        return std::map<std::string, double>();
    }
    std::vector<std::string> getKernelNames();
    std::vector<std::pair<int, int> > getBondedParticles() const;
    void updateParametersInContext(ContextImpl& context);
    void computeEnergies(ContextImpl& context, double& stretching, double& bending);
    /**
     * Get the chains of the Context.
     */
    const CylinderChainDescription& getDescription() const {
        return *description;
    }
    /**
     * Get the chains, so that those that grow may change; call haveGrown() with their numbers then.
     */
    cylchain::ChainList& getGrowingList() {
        return description->getGrowingList();
    }
    void haveGrown(ContextImpl& context, const std::vector<int>& numbers);
    /**
     * Get whether any chain has twist.
     */
    bool hasTwist() const {
        return twisted != -1;
    }
    /**
     * Get the twists of each chain of straight segments, see CylinderChainForce::getTwists().
     */
    std::vector<std::vector<double> >& getTwists() {
        return twists;
    }
    /**
     * Set the twists of a chain of straight segments, by its number among these.
     */
    void setTwists(int index, const std::vector<double>& values);
    std::string getStateName() const {
        return hasTwist() ? "twists" : "";
    }
    StateColumns storeState(bool inCheckpoint);
    void restoreState(const StateColumns& columns);
    void beginState();
    /**
     * Get the Kernel that computes their forces.
     */
    Kernel& getKernel() {
        return kernel;
    }
private:
    const CylinderChainForce& owner;
    std::unique_ptr<CylinderChainDescription> description;
    Kernel kernel;
    // The first chain that is planar, or -1.

    int planar = -1;
    // The first chain that has twist, or -1; and the twists of each chain of straight segments.

    int twisted = -1;
    std::vector<std::vector<double> > twists;
};

} // namespace OpenMM

#endif /*OPENMM_CYLINDERCHAINFORCEIMPL_H_*/
