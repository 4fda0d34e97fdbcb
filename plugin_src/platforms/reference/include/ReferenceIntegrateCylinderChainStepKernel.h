#ifndef OPENMM_REFERENCEINTEGRATECYLINDERCHAINSTEPKERNEL_H_
#define OPENMM_REFERENCEINTEGRATECYLINDERCHAINSTEPKERNEL_H_

#include "ReferenceCalcCylinderChainForceKernel.h"
#include "HostParticles.h"
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
    ReferenceIntegrateCylinderChainStepKernel(std::string name, const Platform& platform,
            std::shared_ptr<HostParticles> particles);
    void initialize(const System& system, const CylinderChainDescription& chains, const OtherParticles& others,
            CalcCylinderChainForceKernel& forceKernel);
    ParallelLoop& getLoop() {
        return particles->getLoop();
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
    bool sumsWork() const {
        return particles->sumsWork();
    }
    void beginWork(const StepWork& work) {
        particles->beginWork(work);
    }
    void getWork(std::vector<WorkSums>& sums) {
        particles->getWork(sums);
    }
    void move(ContextImpl& context, const cylchain::StepSettings& settings);
    int advanceChains(ContextImpl& context, const cylchain::StepSettings& settings, int count, long long& divided);
    void moveAdvanced(ContextImpl& context, const cylchain::StepSettings& settings, int count);
    int getNumMixedPrecisionChains() const {
        return mixedChains;
    }
private:
    template <class Engine> int advancePack(const Engine& engine, int pack, cylchain::StepSettings settings,
            int count, long long& divided);
    cylchain::StepSettings withTwists(cylchain::StepSettings settings);
    void displaceBlock(int block, const cylchain::StepSettings& settings, double friction);
    template <class Particles> void findNewPositions(const Particles& own, double stepSize);
    void finishSteps(double stepSize, int steps);
    std::shared_ptr<HostParticles> particles;
    ReferenceCalcCylinderChainForceKernel* chainKernel;
    const OtherParticles* others;
    // Those of them that can move by themselves, and that the processor sees; and as which version of these.

    std::vector<int> mobile;
    int versionOfMobile = -1;
    // Takes the steps of coupled chains, once there have been some, with the version of the engine that it knows.

    std::unique_ptr<cylchain::NetworkStep> network;
    int versionOfNetwork, versionOfLengths;
    int mixedChains, unstableParticle = -1;
    std::vector<Vec3> displacements, newPositions;
    // How much the twists of chains change in the step, and what they are after several of them.

    std::vector<std::vector<double> > twistChanges, newTwists;
};

} // namespace OpenMM

#endif /*OPENMM_REFERENCEINTEGRATECYLINDERCHAINSTEPKERNEL_H_*/
