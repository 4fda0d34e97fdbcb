#ifndef OPENMM_REFERENCEUPDATECYLINDERCHAINLINKERSKERNEL_H_
#define OPENMM_REFERENCEUPDATECYLINDERCHAINLINKERSKERNEL_H_

#include "HostParticles.h"
#include "kinetics/LinkerKinetics.h"
#include "openmm/CylinderChainKernels.h"
#include <memory>

namespace OpenMM {

/**
 * This kernel lets the linkers of a CylinderChainBindingForce walk, bind and unbind.
 */
class ReferenceUpdateCylinderChainLinkersKernel : public UpdateCylinderChainLinkersKernel {
public:
    ReferenceUpdateCylinderChainLinkersKernel(std::string name, const Platform& platform,
            std::shared_ptr<HostParticles> particles);
    void initialize(const cylchain::LinkerSystem& system, const cylchain::ChainList& chains, bool periodic,
            bool nearestParticles);
    bool setChains(ContextImpl&, const cylchain::ChainList& chains,
            const std::vector<cylchain::ChainCut>& cuts, cylchain::LinkerState& state, std::uint32_t seed, int force) {
        return kinetics->setChains(chains, cuts, state, describeStep(0, seed, force));
    }
    void setWalls(const std::vector<cylchain::Wall>& walls) {
        kinetics->setWalls(walls);
    }
    bool placeFree(ContextImpl&, cylchain::LinkerState& state, std::uint32_t seed, int force) {
        return kinetics->placeFree(state, describeStep(0, seed, force));
    }
    long long execute(ContextImpl& context, cylchain::LinkerState& state, double kT, double stepSize,
            std::uint32_t seed, int force, const cylchain::TorqueOnHand& torque, std::vector<cylchain::Link>& links);
    void describe(const cylchain::LinkerState& state, std::vector<cylchain::Link>& links);
private:
    cylchain::KineticStep describeStep(double stepSize, std::uint32_t seed, int force) const;
    std::shared_ptr<HostParticles> particles;
    std::unique_ptr<cylchain::LinkerKinetics> kinetics;
    bool periodic, nearestParticles;
};

} // namespace OpenMM

#endif /*OPENMM_REFERENCEUPDATECYLINDERCHAINLINKERSKERNEL_H_*/
