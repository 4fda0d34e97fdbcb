#ifndef OPENMM_COMMONCOUPLINGKERNELS_H_
#define OPENMM_COMMONCOUPLINGKERNELS_H_

#include "CoupledParticles.h"
#include "couplings/Links.h"
#include "couplings/Walls.h"
#include "openmm/CylinderChainKernels.h"

namespace OpenMM {

/**
 * This kernel is invoked by CylinderChainLinkForce to calculate the forces acting on the system and the energy of the
 * system.
 */
class CommonCalcCylinderChainLinkForceKernel : public CalcCylinderChainLinkForceKernel {
public:
    CommonCalcCylinderChainLinkForceKernel(std::string name, const Platform& platform, ComputeContext& cc);
    void initialize(const System& system, bool periodic, bool nearestParticles);
    double execute(ContextImpl& context, const std::vector<cylchain::Link>& links, bool includeForces,
            bool includeEnergy, int& outOfRange);
private:
    void upload(const std::vector<cylchain::Link>& present);
    ComputeContext& cc;
    CoupledParticles coupled;
    int flags;
    bool anyRange;
    std::vector<cylchain::Link> links;
    ComputeArray ends, numbers, energies, outOfRange, summary;
    ComputeKernel kernel;
};

/**
 * This kernel is invoked by CylinderChainWallForce to calculate the forces acting on the system and the energy of the
 * system.
 */
class CommonCalcCylinderChainWallForceKernel : public CalcCylinderChainWallForceKernel {
public:
    CommonCalcCylinderChainWallForceKernel(std::string name, const Platform& platform, ComputeContext& cc);
    void initialize(const System& system, const cylchain::WallSystem& walls);
    double execute(ContextImpl& context, bool includeForces, bool includeEnergy);
    void copyParametersToContext(ContextImpl& context, const cylchain::WallSystem& walls);
private:
    void upload();
    ComputeContext& cc;
    CoupledParticles coupled;
    cylchain::WallSystem walls;
    bool upToDate;
    ComputeArray particles, radii, numbers, energies;
    ComputeKernel kernel;
};

} // namespace OpenMM

#endif /*OPENMM_COMMONCOUPLINGKERNELS_H_*/
