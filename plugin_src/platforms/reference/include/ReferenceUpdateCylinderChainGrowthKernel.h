#ifndef OPENMM_REFERENCEUPDATECYLINDERCHAINGROWTHKERNEL_H_
#define OPENMM_REFERENCEUPDATECYLINDERCHAINGROWTHKERNEL_H_

#include "HostParticles.h"
#include "openmm/CylinderChainKernels.h"
#include <memory>
#include <string>
#include <vector>

namespace OpenMM {

/**
 * This kernel is invoked by CylinderChainGrowthForce to let chains grow.
 */
class ReferenceUpdateCylinderChainGrowthKernel : public UpdateCylinderChainGrowthKernel {
public:
    ReferenceUpdateCylinderChainGrowthKernel(std::string name, const Platform& platform,
            std::shared_ptr<HostParticles> particles) : UpdateCylinderChainGrowthKernel(name, platform),
            particles(particles) {
    }
    void initialize(const cylchain::GrowthSystem& system, const std::vector<cylchain::BendingModel>& bending,
            const std::vector<cylchain::StretchingModel>& stretching, const std::vector<char>& planar);
    cylchain::GrowthChanges execute(ContextImpl& context, cylchain::GrowthState& state, cylchain::GrowthStep step,
            bool periodic, cylchain::ChainList& chains, const std::vector<cylchain::Surroundings*>& around);
    void placeSpareNodes(ContextImpl& context, const std::vector<cylchain::Chain>& chains);
private:
    std::shared_ptr<HostParticles> particles;
    std::unique_ptr<cylchain::ChainGrowth> growth;
};

} // namespace OpenMM

#endif /*OPENMM_REFERENCEUPDATECYLINDERCHAINGROWTHKERNEL_H_*/
