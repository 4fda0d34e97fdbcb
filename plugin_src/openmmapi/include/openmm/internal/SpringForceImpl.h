#ifndef OPENMM_SPRINGFORCEIMPL_H_
#define OPENMM_SPRINGFORCEIMPL_H_

#include "couplings/Links.h"
#include "openmm/Kernel.h"
#include "openmm/internal/CouplingForceImpl.h"
#include <string>
#include <vector>

namespace OpenMM {

/**
 * This is the implementation of a coupling whose forces are those of links, each between two places.
 */
class SpringForceImpl : public CouplingForceImpl {
public:
    /**
     * Get the links of the Context, in the order of their numbers.
     */
    virtual const std::vector<cylchain::Link>& getLinks() = 0;
    bool hasForces() {
        return !getLinks().empty();
    }
    cylchain::ImplicitCouplings* getEquations(ContextImpl& context);
    std::string describeFailure(const cylchain::BrokenCoupling& coupling, const std::string& other);
    std::vector<std::string> getKernelNames();
protected:
    explicit SpringForceImpl(const Force& owner) : CouplingForceImpl(owner) {
    }
    /**
     * Create the kernel of the links.
     *
     * @param periodic  whether the places of a link are taken as their nearest images
     */
    void initializeLinks(ContextImpl& context, bool periodic);
    /**
     * Compute forces and energy of the links.
     *
     * @param[out] outOfRange  the index of the first link with a length that its potential does not allow, or -1
     */
    double computeLinks(bool includeForces, bool includeEnergy, int& outOfRange);
    /**
     * Find the length and the force of a link, by its number.
     */
    cylchain::LinkPull findPull(long long number);
    ContextImpl* context = NULL;
    // Whether the two particles of a place are taken as their nearest images.

    bool nearestParticles = false;
private:
    Kernel linkKernel;
    bool periodic = false;
};

} // namespace OpenMM

#endif /*OPENMM_SPRINGFORCEIMPL_H_*/
