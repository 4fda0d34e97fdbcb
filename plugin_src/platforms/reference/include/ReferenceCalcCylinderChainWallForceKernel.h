#ifndef OPENMM_REFERENCECALCCYLINDERCHAINWALLFORCEKERNEL_H_
#define OPENMM_REFERENCECALCCYLINDERCHAINWALLFORCEKERNEL_H_

#include "networks/SurfaceEquations.h"
#include "networks/WallGaps.h"
#include "openmm/CylinderChainKernels.h"
#include <vector>

namespace OpenMM {

/**
 * This kernel is invoked by CylinderChainWallForce to calculate the forces acting on the system and the energy of the
 * system.
 */
class ReferenceCalcCylinderChainWallForceKernel : public CalcCylinderChainWallForceKernel {
public:
    ReferenceCalcCylinderChainWallForceKernel(std::string name, const Platform& platform);
    void initialize(const System& system, const cylchain::WallSystem& walls);
    double execute(ContextImpl& context, bool includeForces, bool includeEnergy);
    bool notePushes(std::vector<cylchain::Push>& pushes);
    void copyParametersToContext(ContextImpl& context, const cylchain::WallSystem& walls);
    cylchain::ImplicitCouplings* getEquations(cylchain::CouplingImpulses& impulses);
private:
    cylchain::WallSystem walls;
    std::vector<cylchain::Push>* noted;
    cylchain::WallGaps equations;
    cylchain::SurfaceEquations surface;
};

} // namespace OpenMM

#endif /*OPENMM_REFERENCECALCCYLINDERCHAINWALLFORCEKERNEL_H_*/
