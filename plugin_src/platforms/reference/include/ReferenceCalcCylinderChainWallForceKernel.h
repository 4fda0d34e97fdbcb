#ifndef OPENMM_REFERENCECALCCYLINDERCHAINWALLFORCEKERNEL_H_
#define OPENMM_REFERENCECALCCYLINDERCHAINWALLFORCEKERNEL_H_

#include "HostParticles.h"
#include "networks/SurfaceEquations.h"
#include "networks/WallGaps.h"
#include "openmm/CylinderChainKernels.h"
#include <memory>
#include <vector>

namespace OpenMM {

/**
 * This kernel is invoked by CylinderChainWallForce to calculate the forces acting on the system and the energy of the
 * system.
 */
class ReferenceCalcCylinderChainWallForceKernel : public CalcCylinderChainWallForceKernel {
public:
    ReferenceCalcCylinderChainWallForceKernel(std::string name, const Platform& platform,
            std::shared_ptr<HostParticles> particles);
    void initialize(const System& system, const cylchain::WallSystem& walls);
    double execute(ContextImpl& context, bool includeForces, bool includeEnergy);
    void notePushes(std::vector<cylchain::Push>& pushes);
    void copyParametersToContext(ContextImpl& context, const cylchain::WallSystem& walls);
    cylchain::ImplicitCouplings* getEquations(cylchain::CouplingImpulses& impulses);
private:
    std::shared_ptr<HostParticles> host;
    cylchain::WallSystem walls;
    std::vector<cylchain::Push>* noted;
    cylchain::WallGaps equations;
    cylchain::SurfaceEquations surface;
};

} // namespace OpenMM

#endif /*OPENMM_REFERENCECALCCYLINDERCHAINWALLFORCEKERNEL_H_*/
