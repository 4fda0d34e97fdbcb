#ifndef OPENMM_REFERENCEINTEGRATECYLINDERCHAINSTEPKERNEL_H_
#define OPENMM_REFERENCEINTEGRATECYLINDERCHAINSTEPKERNEL_H_

#include "ExplicitWork.h"
#include "ParallelLoop.h"
#include "ReferenceCalcCylinderChainForceKernel.h"
#include "openmm/CylinderChainKernels.h"
#include <vector>

namespace OpenMM {

/**
 * This kernel is invoked by CylinderChainIntegrator to take one time step.
 */
class ReferenceIntegrateCylinderChainStepKernel : public IntegrateCylinderChainStepKernel {
public:
    ReferenceIntegrateCylinderChainStepKernel(std::string name, const Platform& platform, ContextImpl& context);
    void initialize(const System& system, const CylinderChainIntegrator& integrator,
            CalcCylinderChainForceKernel& forceKernel);
    void execute(ContextImpl& context, const CylinderChainIntegrator& integrator, std::uint64_t seed, int level,
            std::uint64_t step, bool followsOn, bool records, long long& divided);
    void takeExplicitWork(double& work, int& particle, int& steps, int& particles);
    void refuseTornChains(ContextImpl& context) const;
    void refuseInfiniteEnergies(ContextImpl& context) const;
    int executeTogether(ContextImpl& context, const CylinderChainIntegrator& integrator, std::uint64_t seed, int level,
            std::uint64_t step, int count, bool records, long long& divided);
    int getNumMixedPrecisionChains() const {
        return mixedChains;
    }
    void getMeanTensions(int chain, std::vector<double>& tensions, std::vector<Vec3>& jointForces,
            std::vector<Vec3>& directions) const;
private:
    cylchain::BackgroundFlow flowOf(ContextImpl& context, const CylinderChainIntegrator& integrator) const;
    cylchain::StepSettings settingsOf(ContextImpl& context, const CylinderChainIntegrator& integrator,
            std::uint64_t seed, int level, std::uint64_t step) const;
    void recordForces(cylchain::StepSettings& settings, bool records);
    void displaceChains(ContextImpl& context, const cylchain::StepSettings& settings, long long& divided);
    int advancePack(ContextImpl& context, int pack, cylchain::StepSettings settings, int count, long long& divided);
    void displaceOthers(ContextImpl& context, const cylchain::StepSettings& settings, double friction);
    void displaceBlock(int block, const std::vector<Vec3>& positions, const std::vector<Vec3>& forces,
            const cylchain::StepSettings& settings, double friction);
    void reportInstability(ContextImpl& context, const cylchain::Instability& found,
            const cylchain::StepSettings& settings) const;
    void checkOthers(std::uint64_t step) const;
    ParallelLoop loop;
    ExplicitWork explicitWork;
    ReferenceCalcCylinderChainForceKernel* chainKernel;
    bool periodic;
    int mixedChains;
    // Particles outside chains, and those of them that can move.

    std::vector<int> outside, others;
    std::vector<double> masses, particleFrictions;
    std::vector<Vec3> displacements, newPositions;
    // The forces of all segments in the last step, if it was recorded.

    std::vector<std::vector<cylchain::SegmentForces> > segmentForces;
    bool recorded;
};

} // namespace OpenMM

#endif /*OPENMM_REFERENCEINTEGRATECYLINDERCHAINSTEPKERNEL_H_*/
