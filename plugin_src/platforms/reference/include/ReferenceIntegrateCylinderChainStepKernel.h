#ifndef OPENMM_REFERENCEINTEGRATECYLINDERCHAINSTEPKERNEL_H_
#define OPENMM_REFERENCEINTEGRATECYLINDERCHAINSTEPKERNEL_H_

#include "ReferenceCalcCylinderChainForceKernel.h"
#include "ReferenceParallelLoop.h"
#include "networks/NetworkStep.h"
#include "openmm/CylinderChainKernels.h"
#include <memory>
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
    cylchain::Instability displaceCoupledChains(ContextImpl& context, const cylchain::StepSettings& settings,
            const cylchain::CoupledForces& coupled);
    void displaceOthers(ContextImpl& context, const cylchain::StepSettings& settings, double friction);
    int findUnstableParticle() {
        return unstableParticle;
    }
    void move(ContextImpl& context, const cylchain::StepSettings& settings);
    int advanceChains(ContextImpl& context, const cylchain::StepSettings& settings, int count, long long& divided);
    void moveAdvanced(ContextImpl& context, const cylchain::StepSettings& settings, int count);
    int getNumMixedPrecisionChains() const {
        return mixedChains;
    }
private:
    template <class Engine> int advancePack(ContextImpl& context, const Engine& engine, int pack,
            cylchain::StepSettings settings, int count, long long& divided);
    void displaceBlock(int block, const std::vector<Vec3>& positions, const std::vector<Vec3>& forces,
            const cylchain::StepSettings& settings, double friction);
    void findNewPosition(ContextImpl& context, int particle, double stepSize);
    void exchangePositions(ContextImpl& context, double time, int steps);
    ReferenceParallelLoop loop;
    ReferenceCalcCylinderChainForceKernel* chainKernel;
    const OtherParticles* others;
    // Takes the steps of coupled chains, once there have been some, with the version of the engine that it knows.

    std::unique_ptr<cylchain::NetworkStep> network;
    int versionOfNetwork, versionOfLengths;
    int mixedChains, unstableParticle = -1;
    std::vector<Vec3> displacements, newPositions;
};

} // namespace OpenMM

#endif /*OPENMM_REFERENCEINTEGRATECYLINDERCHAINSTEPKERNEL_H_*/
