#ifndef OPENMM_COMMONUPDATECYLINDERCHAINLINKERSKERNEL_H_
#define OPENMM_COMMONUPDATECYLINDERCHAINLINKERSKERNEL_H_

#include "CoupledParticles.h"
#include "kinetics/LinkerKinetics.h"
#include "openmm/CylinderChainKernels.h"
#include <memory>

namespace OpenMM {

/**
 * This kernel is invoked by CylinderChainBindingForce to take a step of linkers.  The processor does that, with one
 * thread: in each step, the positions of chains and anchors come from the device.
 */
class CommonUpdateCylinderChainLinkersKernel : public UpdateCylinderChainLinkersKernel {
public:
    CommonUpdateCylinderChainLinkersKernel(std::string name, const Platform& platform, ComputeContext& cc);
    void initialize(const cylchain::LinkerSystem& system, const cylchain::ChainList& chains, bool periodic,
            bool nearestParticles);
    long long execute(ContextImpl& context, cylchain::LinkerState& state, double kT, double stepSize,
            std::uint32_t seed, int force, std::vector<cylchain::Link>& links);
    void describe(const cylchain::LinkerState& state, std::vector<cylchain::Link>& links);
    void setWalls(const std::vector<cylchain::Wall>& walls) {
        kinetics->setWalls(walls);
    }
    bool placeFree(ContextImpl& context, cylchain::LinkerState& state, std::uint32_t seed, int force);
private:
    void refuseImplicitSteps(ContextImpl& context);
    ComputeContext& cc;
    CoupledParticles coupled;
    std::unique_ptr<cylchain::LinkerKinetics> kinetics;
    std::vector<int> particles;
    std::vector<Vec3> positions;
    bool periodic, nearestParticles;
};

} // namespace OpenMM

#endif /*OPENMM_COMMONUPDATECYLINDERCHAINLINKERSKERNEL_H_*/
