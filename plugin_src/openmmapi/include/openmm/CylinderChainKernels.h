#ifndef OPENMM_CYLINDERCHAINKERNELS_H_
#define OPENMM_CYLINDERCHAINKERNELS_H_

#include "couplings/ContactSearch.h"
#include "couplings/CouplingImpulses.h"
#include "couplings/Links.h"
#include "couplings/Walls.h"
#include "dynamics/ChainEngine.h"
#include "growth/ChainGrowth.h"
#include "kinetics/Linkers.h"
#include "networks/CoupledForces.h"
#include "networks/CurveSites.h"
#include "openmm/KernelImpl.h"
#include "openmm/Platform.h"
#include "openmm/System.h"
#include "openmm/Vec3.h"
#include "openmm/internal/ContextImpl.h"
#include "openmm/internal/CylinderChainDescription.h"
#include "openmm/internal/ExplicitWork.h"
#include "openmm/internal/OtherParticles.h"
#include "openmm/internal/ParallelLoop.h"
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
     * @param chains  the chains, which exist for as long as the kernel
     */
    virtual void initialize(const System& system, const CylinderChainDescription& chains) = 0;
    /**
     * Execute the kernel to calculate the forces and/or energy.
     *
     * @param context        the context in which to execute this kernel
     * @param includeForces  true if forces should be calculated
     * @param includeEnergy  true if the energy should be calculated
     * @param twists         those of each chain of straight segments
     * @return the potential energy due to the force
     */
    virtual double execute(ContextImpl& context, bool includeForces, bool includeEnergy,
            const std::vector<std::vector<double> >& twists) = 0;
    /**
     * Calculate the energies of stretching and bending separately.
     *
     * @param context          the context in which to execute this kernel
     * @param twists           those of each chain of straight segments
     * @param[out] stretching  the stretching energy of all segments
     * @param[out] bending     the bending energy of all joints
     */
    virtual void computeEnergies(ContextImpl& context, const std::vector<std::vector<double> >& twists,
            double& stretching, double& bending) = 0;
    /**
     * Take over the parameters of the chains, which have changed.
     *
     * @param context  the context to copy parameters to
     */
    virtual void copyParametersToContext(ContextImpl& context) = 0;
    /**
     * Take over chains that have grown or shrunk.
     *
     * @param changed  their numbers among the chains of straight segments
     */
    virtual void replaceChains(ContextImpl& context, const std::vector<int>& changed) = 0;
    /**
     * Describe how chains that have grown are arranged, on which the last digits of results depend.
     */
    virtual std::vector<int> getArrangement() = 0;
    /**
     * Arrange chains as they were described to be, if that can be.
     */
    virtual void setArrangement(const std::vector<int>& arrangement) = 0;
};

/**
 * This kernel is invoked by CylinderChainLinkForce to calculate the forces acting on the system and the energy of the
 * system.
 */
class CalcCylinderChainLinkForceKernel : public KernelImpl {
public:
    static std::string Name() {
        return "CalcCylinderChainLinkForce";
    }
    CalcCylinderChainLinkForceKernel(std::string name, const Platform& platform) : KernelImpl(name, platform) {
    }
    /**
     * Initialize the kernel.
     *
     * @param system            the System this kernel will be applied to
     * @param periodic          whether the places of a link are taken as their nearest images
     * @param nearestParticles  whether the two particles of a place are
     */
    virtual void initialize(const System& system, bool periodic, bool nearestParticles) = 0;
    /**
     * Execute the kernel to calculate the forces and/or energy.
     *
     * @param context          the context in which to execute this kernel
     * @param links            the links of the context
     * @param includeForces    true if forces should be calculated
     * @param includeEnergy    true if the energy should be calculated
     * @param[out] outOfRange  the index of the first link with a length that its potential does not allow, or -1.
     *                         Forces are those of the other links then.
     * @return the potential energy due to the force
     */
    virtual double execute(ContextImpl& context, const std::vector<cylchain::Link>& links, bool includeForces,
            bool includeEnergy, int& outOfRange) = 0;
    /**
     * Get the equations of links in an implicit step.
     *
     * @param context  the context in which to execute this kernel
     * @param links    the links of the context, which exist until the step has been taken
     */
    virtual cylchain::ImplicitCouplings* getEquations(ContextImpl& context,
            const std::vector<cylchain::Link>& links) = 0;
};

/**
 * This kernel is invoked by CylinderChainContactForce to calculate the forces acting on the system and the energy of
 * the system.
 */
class CalcCylinderChainContactForceKernel : public KernelImpl {
public:
    static std::string Name() {
        return "CalcCylinderChainContactForce";
    }
    CalcCylinderChainContactForceKernel(std::string name, const Platform& platform) : KernelImpl(name, platform) {
    }
    /**
     * Initialize the kernel.
     *
     * @param system     the System this kernel will be applied to
     * @param search     what finds contacts, which exists for as long as the kernel
     * @param stiffness  the stiffness of contacts
     * @param periodic   whether distances are those of nearest periodic images
     */
    virtual void initialize(const System& system, cylchain::ContactSearch& search, double stiffness,
            bool periodic) = 0;
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
     * Have execute() take note of the forces that it computes: it replaces what stands here.
     */
    virtual void notePushes(std::vector<cylchain::Push>& pushes) = 0;
    /**
     * Take over another stiffness, and other radii, which the search has already.
     *
     * @param context    the context to copy parameters to
     * @param stiffness  the stiffness of contacts
     */
    virtual void copyParametersToContext(ContextImpl& context, double stiffness) = 0;
    /**
     * Get the equations of contacts in an implicit step.
     *
     * @param context   the context in which to execute this kernel
     * @param onCurves  the capsules between places on the curve of a beam element; they exist for as long as the kernel
     * @param sites     the virtual sites there
     * @param impulses  receives the forces of the step
     */
    virtual cylchain::ImplicitCouplings* getEquations(ContextImpl& context,
            const std::vector<cylchain::CapsuleOnCurve>& onCurves, const std::vector<cylchain::CurveSite>& sites,
            cylchain::CouplingImpulses& impulses) = 0;
};

/**
 * This kernel is invoked by CylinderChainWallForce to calculate the forces acting on the system and the energy of the
 * system.
 */
class CalcCylinderChainWallForceKernel : public KernelImpl {
public:
    static std::string Name() {
        return "CalcCylinderChainWallForce";
    }
    CalcCylinderChainWallForceKernel(std::string name, const Platform& platform) : KernelImpl(name, platform) {
    }
    /**
     * Initialize the kernel.
     *
     * @param system  the System this kernel will be applied to
     * @param walls   the wall and its particles
     */
    virtual void initialize(const System& system, const cylchain::WallSystem& walls) = 0;
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
     * Have execute() take note of the forces that it computes: it replaces what stands here.
     */
    virtual void notePushes(std::vector<cylchain::Push>& pushes) = 0;
    /**
     * Take over another region, stiffness and radii.
     *
     * @param context  the context to copy parameters to
     * @param walls    the wall and its particles
     */
    virtual void copyParametersToContext(ContextImpl& context, const cylchain::WallSystem& walls) = 0;
    /**
     * Get the equations of walls in an implicit step.
     *
     * @param impulses  receives the forces of the step
     */
    virtual cylchain::ImplicitCouplings* getEquations(cylchain::CouplingImpulses& impulses) = 0;
};

/**
 * This kernel is invoked by CylinderChainBindingForce to let linkers walk, bind and unbind.
 */
class UpdateCylinderChainLinkersKernel : public KernelImpl {
public:
    static std::string Name() {
        return "UpdateCylinderChainLinkers";
    }
    UpdateCylinderChainLinkersKernel(std::string name, const Platform& platform) : KernelImpl(name, platform) {
    }
    /**
     * Initialize the kernel.
     *
     * @param system            the kinds of hands and linkers
     * @param chains            the chains of the System
     * @param periodic          whether distances are those of nearest periodic images
     * @param nearestParticles  whether the particles of a place are taken as their nearest images
     */
    virtual void initialize(const cylchain::LinkerSystem& system, const cylchain::ChainList& chains, bool periodic,
            bool nearestParticles) = 0;
    /**
     * Take note that chains have grown or shrunk: see cylchain::LinkerKinetics::setChains().  Random numbers are those
     * of execute().
     */
    virtual bool setChains(ContextImpl& context, const cylchain::ChainList& chains,
            const std::vector<cylchain::ChainCut>& cuts, cylchain::LinkerState& state, std::uint32_t seed,
            int force) = 0;
    /**
     * Set within which walls linkers are that diffuse.
     */
    virtual void setWalls(const std::vector<cylchain::Wall>& walls) = 0;
    /**
     * Give positions to linkers that diffuse and have none.
     *
     * @return false if there is no room within the walls
     */
    virtual bool placeFree(ContextImpl& context, cylchain::LinkerState& state, std::uint32_t seed, int force) = 0;
    /**
     * Take a step of the linkers, in which particles do not move.
     *
     * @param context     the context in which to execute this kernel
     * @param state       the linkers of the context
     * @param kT          the thermal energy
     * @param stepSize    how long the step is
     * @param seed        the seed of the random numbers
     * @param force       the number of the Force among those of the System
     * @param torque      the torque on hands that a torque stops
     * @param[out] links  the springs of linkers that join two places then
     * @return the number of a linker the rates of which are too large for the step, or -1; or -2 less the number of a
     *         type, if too many of its linkers come out of their concentration
     */
    virtual long long execute(ContextImpl& context, cylchain::LinkerState& state, double kT, double stepSize,
            std::uint32_t seed, int force, const cylchain::TorqueOnHand& torque,
            std::vector<cylchain::Link>& links) = 0;
    /**
     * Describe the springs of linkers that join two places.
     */
    virtual void describe(const cylchain::LinkerState& state, std::vector<cylchain::Link>& links) = 0;
};

/**
 * This kernel is invoked by CylinderChainGrowthForce to let chains grow.
 */
class UpdateCylinderChainGrowthKernel : public KernelImpl {
public:
    static std::string Name() {
        return "UpdateCylinderChainGrowth";
    }
    UpdateCylinderChainGrowthKernel(std::string name, const Platform& platform) : KernelImpl(name, platform) {
    }
    /**
     * Initialize the kernel.
     *
     * @param system      what grows
     * @param bending     the bending model of each chain that grows
     * @param stretching  its stretching model
     * @param planar      whether it is planar
     */
    virtual void initialize(const cylchain::GrowthSystem& system, const std::vector<cylchain::BendingModel>& bending,
            const std::vector<cylchain::StretchingModel>& stretching, const std::vector<char>& planar) = 0;
    /**
     * Take a step of chains that grow, in which all else does not move: see cylchain::ChainGrowth::advance().
     *
     * @param periodic  whether segments are taken as their shortest images
     */
    virtual cylchain::GrowthChanges execute(ContextImpl& context, cylchain::GrowthState& state,
            cylchain::GrowthStep step, bool periodic, cylchain::ChainList& chains,
            const std::vector<cylchain::Surroundings*>& around) = 0;
    /**
     * Put spare nodes where the last nodes of their chains are.
     */
    virtual void placeSpareNodes(ContextImpl& context, const std::vector<cylchain::Chain>& chains) = 0;
};

/**
 * This kernel is invoked by CylinderChainIntegrator to move particles.  When to do so, and what to say if it goes
 * wrong, is the matter of CylinderChainStepper.
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
     * @param chains       the chains, which exist for as long as the kernel
     * @param others       the particles outside chains, which exist for as long as the kernel
     * @param forceKernel  the kernel of the same platform that computes the forces of the chains
     */
    virtual void initialize(const System& system, const CylinderChainDescription& chains, const OtherParticles& others,
            CalcCylinderChainForceKernel& forceKernel) = 0;
    /**
     * Get the loop over particles of the processor.
     */
    virtual ParallelLoop& getLoop() = 0;
    /**
     * Get the forces on all particles, as they were last computed.
     *
     * @param context  the context in which to execute this kernel
     */
    virtual const std::vector<Vec3>& getForces(ContextImpl& context) = 0;
    /**
     * Get the displacements of all particles in the last step, whether they have been moved by them or not.
     */
    virtual const std::vector<Vec3>& getDisplacements() = 0;
    /**
     * Compute the displacements of chains in one step.  Positions do not change.
     *
     * @param context   the context in which to execute this kernel
     * @param settings  the settings of the step
     * @return the first chain by which the step has gone wrong, or the number of chains whose step was divided
     */
    virtual cylchain::Instability displaceChains(ContextImpl& context, const cylchain::StepSettings& settings) = 0;
    /**
     * Compute the displacements of chains that are coupled, and of the particles that are coupled to them, in one step
     * of an implicit scheme.  Positions do not change.  displaceOthers() has been called before, after the equations
     * of what couples them.
     *
     * @param context   the context in which to execute this kernel
     * @param settings  the settings of the step
     * @param coupled   the forces that couple them
     * @return the first chain by which the step has gone wrong, or the number of chains whose step was divided.
     *         Particles count as further chains, in their order.
     */
    virtual cylchain::Instability displaceCoupledChains(ContextImpl& context, const cylchain::StepSettings& settings,
            const cylchain::CoupledForces& coupled) = 0;
    /**
     * Compute the displacements of the particles outside chains in one step.  Positions do not change.
     *
     * @param context   the context in which to execute this kernel
     * @param settings  the settings of the step
     * @param friction  the friction of particles that have none of their own, divided by their mass
     */
    virtual void displaceOthers(ContextImpl& context, const cylchain::StepSettings& settings, double friction) = 0;
    /**
     * Get the first particle outside chains whose displacement is not finite, or -1, once chains have been displaced.
     */
    virtual int findUnstableParticle() = 0;
    /**
     * Whether displaceOthers() and displaceChains() sum up the work of forces where they are, see ExplicitWork.
     */
    virtual bool sumsWork() const {
        return false;
    }
    /**
     * Say what they sum up in the step that begins.
     */
    virtual void beginWork(const StepWork&) {
    }
    /**
     * Get the sums of all particles.
     */
    virtual void getWork(std::vector<WorkSums>&) {
    }
    /**
     * Move all particles by their displacements, and advance the time by one step.
     *
     * @param context   the context in which to execute this kernel
     * @param settings  the settings of the step
     */
    virtual void move(ContextImpl& context, const cylchain::StepSettings& settings) = 0;
    /**
     * Compute where several steps take chains if there are no other forces than their own.  Positions do not change.
     *
     * @param context       the context in which to execute this kernel
     * @param settings      the settings of the first step.  Only the last one records forces of segments.
     * @param count         the number of steps
     * @param[out] divided  the number of steps of a chain that were taken in parts
     * @return the number of steps that could be taken: fewer than count if a chain blows up in the one after them
     */
    virtual int advanceChains(ContextImpl& context, const cylchain::StepSettings& settings, int count,
            long long& divided) = 0;
    /**
     * Move chains to where advanceChains() has taken them, and advance the time.
     *
     * @param context   the context in which to execute this kernel
     * @param settings  the settings of the first step
     * @param count     the number of steps
     */
    virtual void moveAdvanced(ContextImpl& context, const cylchain::StepSettings& settings, int count) = 0;
    /**
     * Get the number of chains that the last step has computed in mixed precision.
     */
    virtual int getNumMixedPrecisionChains() const = 0;
};

} // namespace OpenMM

#endif /*OPENMM_CYLINDERCHAINKERNELS_H_*/
