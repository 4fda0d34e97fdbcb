#ifndef OPENMM_COMMONCOUPLINGKERNELS_H_
#define OPENMM_COMMONCOUPLINGKERNELS_H_

#include "HostForces.h"
#include "couplings/ContactSearch.h"
#include "couplings/Links.h"
#include "couplings/Walls.h"
#include "openmm/CylinderChainKernels.h"

namespace OpenMM {

/**
 * This kernel is invoked by CylinderChainLinkForce to calculate the forces acting on the system and the energy of the
 * system.  The processor computes them.
 */
class CommonCalcCylinderChainLinkForceKernel : public CalcCylinderChainLinkForceKernel {
public:
    CommonCalcCylinderChainLinkForceKernel(std::string name, const Platform& platform, ComputeContext& cc);
    void initialize(const System& system, bool periodic, bool nearestParticles);
    double execute(ContextImpl& context, const std::vector<cylchain::Link>& links, bool includeForces,
            bool includeEnergy, int& outOfRange);
private:
    HostForces host;
    bool periodic, nearestParticles;
};

/**
 * This kernel is invoked by CylinderChainWallForce to calculate the forces acting on the system and the energy of the
 * system.  The processor computes them.
 */
class CommonCalcCylinderChainWallForceKernel : public CalcCylinderChainWallForceKernel {
public:
    CommonCalcCylinderChainWallForceKernel(std::string name, const Platform& platform, ComputeContext& cc);
    void initialize(const System& system, const cylchain::WallSystem& walls);
    double execute(ContextImpl& context, bool includeForces, bool includeEnergy);
    void copyParametersToContext(ContextImpl& context, const cylchain::WallSystem& walls);
private:
    HostForces host;
    cylchain::WallSystem walls;
};

/**
 * This kernel is invoked by CylinderChainContactForce to calculate the forces acting on the system and the energy of
 * the system.  The processor computes them, and searches for pairs each time.
 */
class CommonCalcCylinderChainContactForceKernel : public CalcCylinderChainContactForceKernel {
public:
    CommonCalcCylinderChainContactForceKernel(std::string name, const Platform& platform, ComputeContext& cc);
    void initialize(const System& system, cylchain::ContactSearch& search, double stiffness, bool periodic);
    double execute(ContextImpl& context, bool includeForces, bool includeEnergy);
    void copyParametersToContext(ContextImpl& context, double stiffness);
private:
    HostForces host;
    cylchain::ContactSearch* search;
    double stiffness;
    bool periodic;
    std::vector<cylchain::ContactPair> pairs;
};

} // namespace OpenMM

#endif /*OPENMM_COMMONCOUPLINGKERNELS_H_*/
