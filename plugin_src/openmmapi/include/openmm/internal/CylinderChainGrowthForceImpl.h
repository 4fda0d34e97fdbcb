#ifndef OPENMM_CYLINDERCHAINGROWTHFORCEIMPL_H_
#define OPENMM_CYLINDERCHAINGROWTHFORCEIMPL_H_

#include "couplings/Surroundings.h"
#include "growth/ChainGrowth.h"
#include "openmm/CylinderChainGrowthForce.h"
#include "openmm/Kernel.h"
#include "openmm/internal/CouplingForceImpl.h"
#include "openmm/internal/CylinderChainForceImpl.h"
#include "openmm/internal/PlaceResolver.h"
#include "openmm/internal/StepForceImpl.h"
#include <cstdint>
#include <map>
#include <memory>
#include <string>
#include <utility>
#include <vector>

namespace OpenMM {

/**
 * This is the internal implementation of CylinderChainGrowthForce.  It holds how far the chains of a Context have
 * grown, lets them grow before each step, and tells all that needs to know.
 *
 * A parameter of the Context has a digest of how far they have grown: see CylinderChainBindingForceImpl.
 */
class CylinderChainGrowthForceImpl : public StepForceImpl {
public:
    explicit CylinderChainGrowthForceImpl(const CylinderChainGrowthForce& owner);
    void initialize(ContextImpl& context);
    const CylinderChainGrowthForce& getOwner() const {
        return owner;
    }
    void updateContextState(ContextImpl& context, bool& forcesInvalid);
    double calcForcesAndEnergy(ContextImpl& context, bool includeForces, bool includeEnergy, int groups);
    std::map<std::string, double> getDefaultParameters();
    std::vector<std::string> getKernelNames();
    /**
     * Get how far chains have grown.
     */
    const cylchain::GrowthState& getState() const {
        follow();
        return state;
    }
    /**
     * Tell it how far they have grown, see CylinderChainGrowthForce::setGrowthInContext().
     */
    void setEnds(const std::vector<int>& ends);
    /**
     * Cut chains by a plane, see CylinderChainGrowthForce::cutInContext().
     */
    int cut(const cylchain::CuttingPlane& plane);
    /**
     * Throw an exception if something else than what growth knows acts on nodes of chains that grow.
     *
     * @param forces  on all particles, but those of chains and of couplings that the step has in its equations
     */
    void refuseForces(const std::vector<Vec3>& forces) const;
    std::string getStateName() const {
        return "growth";
    }
    StateColumns storeState(bool inCheckpoint);
    void restoreState(const StateColumns& columns);
private:
    void follow() const;
    void accept();
    double getThermalEnergy() const;
    cylchain::GrowthChanges grow(const cylchain::GrowthStep& step);
    void setState(const cylchain::GrowthState& replaced);
    void findCouplings();
    void refusePlaces();
    void changeEnds();
    void setSpareNodes(const std::vector<int>& changed);
    const CylinderChainGrowthForce& owner;
    ContextImpl* context;
    CylinderChainForceImpl* chains;
    Kernel kernel;
    cylchain::GrowthState state;
    std::vector<int> growing;
    std::uint32_t seed;
    std::unique_ptr<PlaceResolver> places;
    // All couplings, those that ends feel, and the others with the versions of their places.

    struct Felt {
        CouplingForceImpl* coupling;
        std::unique_ptr<cylchain::Surroundings> surroundings;
        int version;
    };
    std::vector<CouplingForceImpl*> couplings;
    std::vector<Felt> around;
    std::vector<std::pair<CouplingForceImpl*, long long> > others;
    bool hasCouplings;
    // Whether other Forces than those of this plugin may act on chains, and which particles are no nodes now.

    bool hasOtherForces;
    std::vector<bool> isSpare;
};

} // namespace OpenMM

#endif /*OPENMM_CYLINDERCHAINGROWTHFORCEIMPL_H_*/
