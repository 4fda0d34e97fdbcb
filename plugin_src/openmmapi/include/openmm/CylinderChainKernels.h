#ifndef OPENMM_CYLINDERCHAINKERNELS_H_
#define OPENMM_CYLINDERCHAINKERNELS_H_

#include "openmm/CylinderChainForce.h"
#include "openmm/CylinderChainIntegrator.h"
#include "openmm/KernelImpl.h"
#include "openmm/Platform.h"
#include "openmm/System.h"
#include "openmm/internal/ContextImpl.h"
#include <cstdint>
#include <string>
#include <vector>

namespace OpenMM {

/**
 * This kernel is invoked by CylinderChainForce to calculate the forces acting on the system and the energy of the
 * system.
 */
class CalcCylinderChainForceKernel : public KernelImpl {
public:
    static std::string Name() {
        return "CalcCylinderChainForce";
    }
    CalcCylinderChainForceKernel(std::string name, const Platform& platform) : KernelImpl(name, platform) {
    }
    /**
     * Initialize the kernel.
     *
     * @param system  the System this kernel will be applied to
     * @param force   the CylinderChainForce this kernel will be used for
     */
    virtual void initialize(const System& system, const CylinderChainForce& force) = 0;
    /**
     * Execute the kernel to calculate the forces and/or energy.
     *
     * @param context        the context in which to execute this kernel
     * @param includeForces  true if forces should be calculated
     * @param includeEnergy  true if the energy should be calculated
     * @return the potential energy due to the force
     */
    virtual double execute(ContextImpl& context, bool includeForces, bool includeEnergy) = 0;
    /**
     * Calculate the energies of stretching and bending separately.
     *
     * @param context          the context in which to execute this kernel
     * @param[out] stretching  the stretching energy of all segments
     * @param[out] bending     the bending energy of all joints
     */
    virtual void computeEnergies(ContextImpl& context, double& stretching, double& bending) = 0;
    /**
     * Copy changed parameters over to a context.
     *
     * @param context  the context to copy parameters to
     * @param force    the CylinderChainForce to copy the parameters from
     */
    virtual void copyParametersToContext(ContextImpl& context, const CylinderChainForce& force) = 0;
};

/**
 * This kernel is invoked by CylinderChainIntegrator to take one time step.
 */
class IntegrateCylinderChainStepKernel : public KernelImpl {
public:
    static std::string Name() {
        return "IntegrateCylinderChainStep";
    }
    IntegrateCylinderChainStepKernel(std::string name, const Platform& platform) : KernelImpl(name, platform) {
    }
    /**
     * Initialize the kernel.
     *
     * @param system       the System this kernel will be applied to
     * @param integrator   the CylinderChainIntegrator this kernel will be used for
     * @param forceKernel  the kernel that holds the chains of the context
     */
    virtual void initialize(const System& system, const CylinderChainIntegrator& integrator,
            CalcCylinderChainForceKernel& forceKernel) = 0;
    /**
     * Throw an exception if positions were wrapped into a periodic box so that a chain is torn: a segment is longer
     * than half the box and than twice its rest length, while its ends have images that are nearer.
     *
     * @param context  the context whose positions to look at
     */
    virtual void refuseTornChains(ContextImpl& context) const = 0;
    /**
     * Throw an exception if a segment has a length at which its FENE potential is infinite.
     *
     * @param context  the context whose positions to look at
     */
    virtual void refuseInfiniteEnergies(ContextImpl& context) const = 0;
    /**
     * Execute the kernel.  If a chain or a particle blows up, an exception is thrown and nothing has moved.
     *
     * @param context     the context in which to execute this kernel
     * @param integrator  the CylinderChainIntegrator this kernel is being used for
     * @param seed        the seed of the noise
     * @param level       the level of the noise, see CylinderChainIntegrator::setPathLevel()
     * @param step        the number of the step.  The noise depends on this, the seed and the level alone.
     * @param followsOn   whether nothing else than the step before has changed positions, forces and parameters
     * @param records     whether to record tensions, see getMeanTensions()
     * @param divided     increased by the number of chains whose step was taken in parts
     */
    virtual void execute(ContextImpl& context, const CylinderChainIntegrator& integrator, std::uint64_t seed,
            int level, std::uint64_t step, bool followsOn, bool records, long long& divided) = 0;
    /**
     * Get the work of explicit forces in the last window of steps, see CylinderChainIntegrator::takeExplicitWork().
     */
    virtual void takeExplicitWork(double& work, int& particle, int& steps, int& particles) = 0;
    /**
     * Take several steps where there are no other forces than those of the chains, which are computed here.  Chains
     * do not know of each other then, so each can be advanced by all steps at once.
     *
     * @param step        the number of the first step
     * @param count       the number of steps
     * @param records     whether to record tensions in the last of them, see getMeanTensions()
     * @param divided     increased by the number of steps of a chain that were taken in parts
     * @return the number of steps that were taken: fewer than count if the one after them would blow up, or 0 if this
     *         cannot be done for the context
     */
    virtual int executeTogether(ContextImpl& context, const CylinderChainIntegrator& integrator, std::uint64_t seed,
            int level, std::uint64_t step, int count, bool records, long long& divided) = 0;
    /**
     * Get the number of chains that the last step has computed in mixed precision.
     */
    virtual int getNumMixedPrecisionChains() const = 0;
    /**
     * Get the tensions of a chain in the last step, see CylinderChainIntegrator::getMeanTensions().
     */
    virtual void getMeanTensions(int chain, std::vector<double>& tensions, std::vector<Vec3>& jointForces,
            std::vector<Vec3>& directions) const = 0;
};

} // namespace OpenMM

#endif /*OPENMM_CYLINDERCHAINKERNELS_H_*/
