#ifndef OPENMM_REFERENCECALCCYLINDERCHAINLINKFORCEKERNEL_H_
#define OPENMM_REFERENCECALCCYLINDERCHAINLINKFORCEKERNEL_H_

#include "HostParticles.h"
#include "networks/LinkEquations.h"
#include "openmm/CylinderChainKernels.h"
#include <memory>
#include <vector>

namespace OpenMM {

/**
 * This kernel is invoked by CylinderChainLinkForce to calculate the forces acting on the system and the energy of the
 * system.
 */
class ReferenceCalcCylinderChainLinkForceKernel : public CalcCylinderChainLinkForceKernel {
public:
    ReferenceCalcCylinderChainLinkForceKernel(std::string name, const Platform& platform,
            std::shared_ptr<HostParticles> particles);
    void initialize(const System& system, bool periodic, bool nearestParticles);
    double execute(ContextImpl& context, const std::vector<cylchain::Link>& links, bool includeForces,
            bool includeEnergy, int& outOfRange);
    cylchain::ImplicitCouplings* getEquations(ContextImpl& context, const std::vector<cylchain::Link>& links);
private:
    void include(const std::vector<cylchain::Link>& links);
    cylchain::LinkBoxes getBoxes() const;
    std::shared_ptr<HostParticles> particles;
    bool periodic, nearestParticles;
    std::vector<cylchain::LinkPull> pulls;
    cylchain::LinkEquations equations;
};

} // namespace OpenMM

#endif /*OPENMM_REFERENCECALCCYLINDERCHAINLINKFORCEKERNEL_H_*/
