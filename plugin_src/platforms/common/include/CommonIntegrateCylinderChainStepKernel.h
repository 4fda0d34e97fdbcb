#ifndef OPENMM_COMMONINTEGRATECYLINDERCHAINSTEPKERNEL_H_
#define OPENMM_COMMONINTEGRATECYLINDERCHAINSTEPKERNEL_H_

#include "CommonCalcCylinderChainForceKernel.h"
#include "openmm/CylinderChainKernels.h"
#include "openmm/common/ComputeArray.h"
#include "openmm/common/ComputeContext.h"
#include <vector>

namespace OpenMM {

/**
 * This kernel is invoked by CylinderChainIntegrator to move particles.
 */
class CommonIntegrateCylinderChainStepKernel : public IntegrateCylinderChainStepKernel {
public:
    CommonIntegrateCylinderChainStepKernel(std::string name, const Platform& platform, ComputeContext& cc);
    void initialize(const System& system, const CylinderChainDescription& chains, const OtherParticles& others,
            CalcCylinderChainForceKernel& forceKernel);
    void refuseScheme(cylchain::Scheme scheme);
    ParallelLoop& getLoop() {
        return loop;
    }
    const std::vector<Vec3>& getForces(ContextImpl& context);
    const std::vector<Vec3>& getDisplacements();
    cylchain::Instability displaceChains(ContextImpl& context, const cylchain::StepSettings& settings);
    cylchain::Instability displaceCoupledChains(ContextImpl& context, const cylchain::StepSettings& settings,
            const cylchain::CoupledForces& coupled);
    void displaceOthers(ContextImpl& context, const cylchain::StepSettings& settings, double friction);
    int findUnstableParticle();
    bool sumsWork() const {
        return true;
    }
    void beginWork(const StepWork& work) {
        this->work = work;
    }
    void getWork(std::vector<WorkSums>& sums);
    void move(ContextImpl& context, const cylchain::StepSettings& settings);
    int advanceChains(ContextImpl& context, const cylchain::StepSettings& settings, int count, long long& divided);
    void moveAdvanced(ContextImpl& context, const cylchain::StepSettings& settings, int count);
    int getNumMixedPrecisionChains() const {
        return 0;
    }
private:
    class HostLoop : public ParallelLoop {
    public:
        void run(int count, const std::function<void(int)>& iteration);
    };
    void refuse(const cylchain::StepSettings& settings);
    void makeArrays();
    void moveOthers(double stepSize);
    void finishSteps(double time, int steps);
    ComputeContext& cc;
    HostLoop loop;
    CommonCalcCylinderChainForceKernel* chainKernel;
    const OtherParticles* others;
    bool hasArguments;
    std::vector<Vec3> forces, displacements;
    double frictionOfMobilities;
    StepWork work;
    ComputeArray particles, mobilities, displacementsOfOthers, unstable, workOnOthers;
    ComputeKernel displaceKernel, moveKernel;
};

} // namespace OpenMM

#endif /*OPENMM_COMMONINTEGRATECYLINDERCHAINSTEPKERNEL_H_*/
