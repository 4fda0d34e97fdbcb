#ifndef OPENMM_CYLINDERCHAINCONTACTFORCEIMPL_H_
#define OPENMM_CYLINDERCHAINCONTACTFORCEIMPL_H_

#include "couplings/ContactSearch.h"
#include "networks/CurveSites.h"
#include "openmm/CylinderChainContactForce.h"
#include "openmm/Kernel.h"
#include "openmm/internal/PushForceImpl.h"
#include <map>
#include <memory>
#include <string>
#include <vector>

namespace OpenMM {

/**
 * This is the internal implementation of CylinderChainContactForce.
 */
class CylinderChainContactForceImpl : public PushForceImpl {
public:
    explicit CylinderChainContactForceImpl(const CylinderChainContactForce& owner);
    void initialize(ContextImpl& context);
    const CylinderChainContactForce& getOwner() const {
        return owner;
    }
    double calcForcesAndEnergy(ContextImpl& context, bool includeForces, bool includeEnergy, int groups);
    std::map<std::string, double> getDefaultParameters() {
        return std::map<std::string, double>();
    }
    std::vector<std::string> getKernelNames();
    void updateParametersInContext(ContextImpl& context);
    /**
     * Find the contacts at the present positions: see CylinderChainContactForce::getContacts().
     */
    void getContacts(ContextImpl& context, std::vector<int>& ends, std::vector<double>& fractions,
            std::vector<double>& gaps, std::vector<double>& forces, std::vector<Vec3>& directions) const;
    int getOrder() const {
        return 2;
    }
    bool hasForces() {
        return !search->getSystem().capsules.empty() && stiffness != 0;
    }
    cylchain::ImplicitCouplings* getEquations(ContextImpl& context);
    void refuseChains(const CylinderChainDescription& chains) const;
    void refuseBox(ContextImpl& context, const CylinderChainDescription& chains) const;
    void setSpareNodes(ContextImpl& context, const std::vector<bool>& isSpare);
    std::unique_ptr<cylchain::Surroundings> describeSurroundings(const cylchain::ChainList& chains,
            const std::vector<int>& growing);
    std::string describeFailure(const cylchain::BrokenCoupling& coupling, const std::string& other);
protected:
    void findPushes(ContextImpl& context, std::vector<cylchain::Push>& pushes) const;
private:
    template <class Function> void forContacts(ContextImpl& context, Function function) const;
    const CylinderChainContactForce& owner;
    std::unique_ptr<cylchain::ContactSearch> search;
    std::vector<cylchain::CapsuleOnCurve> onCurves;
    std::vector<cylchain::CurveSite> sites;
    double stiffness;
    bool periodic;
    std::vector<bool> isSpare;
    Kernel kernel;
};

} // namespace OpenMM

#endif /*OPENMM_CYLINDERCHAINCONTACTFORCEIMPL_H_*/
