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

class System;

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
    /**
     * Get what finds contacts in the Context: the segments of all chains, in their order, then the spheres.
     */
    cylchain::ContactSearch& getSearch() {
        return *search;
    }
    /**
     * Get the capsules that lie between two places on the curve of a beam element, and the virtual sites there.
     */
    const std::vector<cylchain::CapsuleOnCurve>& getOnCurves() const {
        return onCurves;
    }
    const std::vector<cylchain::CurveSite>& getSites() const {
        return sites;
    }
    /**
     * Get the stiffness in the Context.
     */
    double getStiffness() const {
        return stiffness;
    }
    /**
     * Get whether distances are those of nearest periodic images.
     */
    bool usesPeriodicBoundaryConditions() const {
        return periodic;
    }
protected:
    void findPushes(ContextImpl& context, std::vector<cylchain::Push>& pushes) const;
private:
    template <class Function> void forContacts(ContextImpl& context, Function function) const;
    int getNumSegments(int chain) const;
    const CylinderChainContactForce& owner;
    void findCurves(const System& system);
    std::unique_ptr<cylchain::ContactSearch> search;
    std::vector<cylchain::CapsuleOnCurve> onCurves;
    std::vector<cylchain::CurveSite> sites;
    double stiffness;
    bool periodic;
    Kernel kernel;
};

} // namespace OpenMM

#endif /*OPENMM_CYLINDERCHAINCONTACTFORCEIMPL_H_*/
