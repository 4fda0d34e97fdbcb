#ifndef OPENMM_CYLINDERCHAINSTEPPER_H_
#define OPENMM_CYLINDERCHAINSTEPPER_H_

#include "dynamics/ChainEngine.h"
#include "openmm/CylinderChainIntegrator.h"
#include "openmm/Kernel.h"
#include "openmm/internal/ChainCouplings.h"
#include "openmm/internal/ContextImpl.h"
#include "openmm/internal/CylinderChainForceImpl.h"
#include "openmm/internal/CylinderChainGrowthForceImpl.h"
#include "openmm/internal/ExplicitWork.h"
#include "openmm/internal/OtherParticles.h"
#include <cstdint>
#include <string>
#include <vector>

namespace OpenMM {

class IntegrateCylinderChainStepKernel;

/**
 * The steps of a CylinderChainIntegrator in a Context: what is the same on all platforms.  A kernel computes them.
 */
class CylinderChainStepper {
public:
    CylinderChainStepper(ContextImpl& context, const CylinderChainIntegrator& integrator,
            CylinderChainForceImpl& force);
    /**
     * Get the force groups whose links and contacts are in the equations of steps: those of the integrator if its
     * scheme is implicit, or none.
     */
    int getCoupledGroups() const;
    /**
     * Get the links and contacts of the Context.
     */
    ChainCouplings& getCouplings() {
        return couplings;
    }
    /**
     * Throw an exception if positions were wrapped into a periodic box so that a chain is torn: a segment is longer
     * than half the box and than twice its rest length, while its ends have images that are nearer.
     */
    void refuseTornChains() const;
    /**
     * Throw an exception if positions of particles of a rigid body are not those of one.
     */
    void refuseDeformedBodies() const;
    /**
     * Throw an exception if a segment has a length at which its energy is infinite.
     */
    void refuseInfiniteEnergies() const;
    /**
     * Take one step with the forces that have been computed.  If a chain or a particle blows up, an exception is thrown
     * and nothing has moved.
     *
     * @param seed       the seed of the noise
     * @param level      the level of the noise, see CylinderChainIntegrator::setPathLevel()
     * @param step       the number of the step.  The noise depends on this, the seed and the level alone.
     * @param followsOn  whether nothing else than the step before has changed positions, forces and parameters
     * @param records    whether to record tensions, see getMeanTensions()
     * @param divided    increased by the number of chains whose step was taken in parts
     */
    void step(std::uint64_t seed, int level, std::uint64_t step, bool followsOn, bool records, long long& divided);
    /**
     * Take several steps where there are no other forces than those of the chains.  Chains do not know of each other
     * then, so each can be advanced by all steps at once.
     *
     * @param step     the number of the first step
     * @param count    the number of steps
     * @param records  whether to record tensions in the last of them, see getMeanTensions()
     * @param divided  increased by the number of steps of a chain that were taken in parts
     * @return the number of steps that were taken: fewer than count if the one after them would blow up, or 0 if there
     *         are particles outside chains that can move, or rigid bodies
     */
    int stepTogether(std::uint64_t seed, int level, std::uint64_t step, int count, bool records, long long& divided);
    /**
     * Get the work of explicit forces in the last window of steps, see CylinderChainIntegrator::takeExplicitWork().
     */
    void takeExplicitWork(double& work, int& particle, int& steps, int& particles);
    /**
     * Get the number of chains that the last step has computed in mixed precision.
     */
    int getNumMixedPrecisionChains() const;
    /**
     * Get the tensions of a chain in the last step, see CylinderChainIntegrator::getMeanTensions().
     */
    void getMeanTensions(int chain, std::vector<double>& tensions, std::vector<Vec3>& jointForces,
            std::vector<Vec3>& directions) const;
private:
    IntegrateCylinderChainStepKernel& getKernel();
    cylchain::BackgroundFlow describeFlow();
    cylchain::StepSettings describeStep(std::uint64_t seed, int level, std::uint64_t step);
    void describeTurnedPairs(cylchain::StepSettings& settings);
    void recordForces(cylchain::StepSettings& settings, bool records);
    void takeNoteOfForces(const cylchain::StepSettings& settings, bool followsOn);
    void refuseBeams(cylchain::Scheme scheme, double kT) const;
    int particleOf(int number, const cylchain::CoupledForces& coupled) const;
    bool areForcesFinite();
    void reportInstability(int chain, const cylchain::StepSettings& settings);
    void reportTwist(int chain, int body, const cylchain::StepSettings& settings);
    void reportCoupling(const cylchain::BrokenCoupling& coupling, const cylchain::CoupledForces& coupled,
            const cylchain::StepSettings& settings);
    void reportParticle(int particle, const cylchain::StepSettings& settings) const;
    std::vector<Vec3> getPositions() const;
    void getBox(double* box) const;
    ContextImpl& context;
    const CylinderChainIntegrator& integrator;
    CylinderChainForceImpl& force;
    const CylinderChainDescription& chains;
    // NULL if no chains grow.

    const CylinderChainGrowthForceImpl* growth;
    const OtherParticles others;
    ChainCouplings couplings;
    Kernel kernel;
    ExplicitWork explicitWork;
    StepWork workOfStep;
    const bool periodic;
    // The periodic box that a flow refers to.

    double box[9];
    // The forces of all segments in the last step, if it was recorded.

    std::vector<std::vector<cylchain::SegmentForces> > segmentForces;
    bool recorded;
    // What hands do to the turns of segments of chains with twist.

    std::vector<std::vector<cylchain::TurnedPair> > turnedPairs;
};

} // namespace OpenMM

#endif /*OPENMM_CYLINDERCHAINSTEPPER_H_*/
