#ifndef OPENMM_REFERENCEINTEGRATECYLINDERCHAINSTEPKERNEL_H_
#define OPENMM_REFERENCEINTEGRATECYLINDERCHAINSTEPKERNEL_H_

#include "ReferenceCalcCylinderChainForceKernel.h"
#include "ReferenceParallelLoop.h"
#include "openmm/CylinderChainKernels.h"
#include <vector>

namespace OpenMM {

/**
 * This kernel is invoked by CylinderChainIntegrator to move particles.
 */
class ReferenceIntegrateCylinderChainStepKernel : public IntegrateCylinderChainStepKernel {
public:
    ReferenceIntegrateCylinderChainStepKernel(std::string name, const Platform& platform, ContextImpl& context);
    void initialize(const System& system, const CylinderChainDescription& chains, const OtherParticles& others,
            CalcCylinderChainForceKernel& forceKernel);
    ParallelLoop& getLoop() {
        return loop;
    }
    const std::vector<Vec3>& getForces(ContextImpl& context);
    const std::vector<Vec3>& getDisplacements() {
        return displacements;
    }
    cylchain::Instability displaceChains(ContextImpl& context, const cylchain::StepSettings& settings);
    int displaceOthers(ContextImpl& context, const cylchain::StepSettings& settings, double friction);
    void move(ContextImpl& context, const cylchain::StepSettings& settings);
    int advanceChains(ContextImpl& context, const cylchain::StepSettings& settings, int count, long long& divided);
    void moveAdvanced(ContextImpl& context, const cylchain::StepSettings& settings, int count);
    int getNumMixedPrecisionChains() const {
        return mixedChains;
    }
private:
    int advancePack(ContextImpl& context, int pack, cylchain::StepSettings settings, int count, long long& divided);
    void displaceBlock(int block, const std::vector<Vec3>& positions, const std::vector<Vec3>& forces,
            const cylchain::StepSettings& settings, double friction);
    void exchangePositions(ContextImpl& context, double time, int steps);
    ReferenceParallelLoop loop;
    ReferenceCalcCylinderChainForceKernel* chainKernel;
    const OtherParticles* others;
    int mixedChains;
    std::vector<Vec3> displacements, newPositions;
};

} // namespace OpenMM

#endif /*OPENMM_REFERENCEINTEGRATECYLINDERCHAINSTEPKERNEL_H_*/
