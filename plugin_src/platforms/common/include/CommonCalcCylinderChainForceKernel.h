#ifndef OPENMM_COMMONCALCCYLINDERCHAINFORCEKERNEL_H_
#define OPENMM_COMMONCALCCYLINDERCHAINFORCEKERNEL_H_

#include "CommonCylinderChains.h"
#include "openmm/CylinderChainKernels.h"
#include "openmm/common/ComputeContext.h"
#include <memory>

namespace OpenMM {

/**
 * This kernel is invoked by CylinderChainForce to calculate the forces acting on the system and the energy of the
 * system.  It also holds the chains for the integrator.
 */
class CommonCalcCylinderChainForceKernel : public CalcCylinderChainForceKernel {
public:
    CommonCalcCylinderChainForceKernel(std::string name, const Platform& platform, ComputeContext& cc,
            const WorkItemGroups& groups);
    void initialize(const System& system, const CylinderChainDescription& chains);
    double execute(ContextImpl& context, bool includeForces, bool includeEnergy);
    void computeEnergies(ContextImpl& context, double& stretching, double& bending);
    void copyParametersToContext(ContextImpl& context);
    /**
     * Get the chains in the memory of the device.
     */
    CommonCylinderChains& getChains();
private:
    class ForceInfo;
    ComputeContext& cc;
    const WorkItemGroups groups;
    const CylinderChainDescription* description;
    std::unique_ptr<CommonCylinderChains> chains;
};

} // namespace OpenMM

#endif /*OPENMM_COMMONCALCCYLINDERCHAINFORCEKERNEL_H_*/
