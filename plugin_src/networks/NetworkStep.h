#ifndef CYLCHAIN_NETWORK_STEP_H_
#define CYLCHAIN_NETWORK_STEP_H_

#include "dynamics/ChainEngine.h"
#include "dynamics/PackStepSource.h"
#include "networks/CarriedFrames.h"
#include "networks/CoupledForces.h"
#include "networks/ImplicitCouplings.h"
#include <cstddef>
#include <memory>
#include <vector>

namespace cylchain {

/**
 * Implicit steps of chains that are coupled to each other.
 *
 * Newton's method for all chains at once: each iteration linearises chains and couplings, solves the linear equations
 * (CoupledEquations) and moves the nodes, until all chains and all couplings have converged. Where that fails, or where
 * something has gone wrong that couplings must prevent, the chains that are connected with the one that failed take the
 * step again in two halves, which follow the same Brownian path, and these in halves if need be.
 */
class NetworkStep {
public:
    /**
     * @param engine      the engine of the chains
     * @param chains      they must exist as long as this object, and so must the engine
     * @param beamEngine  the engine of chains of beam elements
     * @param beams       these chains, which must exist as long
     * @param bodies      the rigid bodies, which must exist as long
     * @param particles   the number of particles of the System
     */
    NetworkStep(const ChainEngine& engine, const std::vector<Chain>& chains, const PackStepSource& beamEngine,
            const std::vector<BeamChain>& beams, const std::vector<RigidBody>& bodies, int particles);
    ~NetworkStep();
    /** Take note that segments have other lengths and friction, while nodes are the same. */
    void updateLengths() {
        places.updateLengths();
    }
    /** Set the forces that steps have in their equations. What they point to must exist while steps are taken. */
    void setForces(const CoupledForces& forces);
    /**
     * Compute the displacements of all nodes and of the coupled particles in a step, as ChainEngine::step() does. Of
     * the result, the chain by which the step has gone wrong may be one of beam elements, with a number behind those of
     * segments, or a rigid body, behind those of all chains, or a particle, behind those of bodies.
     */
    Instability step(const double* positions, const double* forces, const double* box, const StepSettings& settings,
            double* displacements, const Loop& loop);
    /** The number of substitutions along chains in the last step, beside those of its iterations. */
    int getNumSubstitutions() const {
        return substitutions;
    }
private:
    struct Attempt;
    void setParticles(const std::vector<CoupledParticle>& particles);
    bool takeStep(const Attempt& whole, double* displacements, std::vector<bool>& failed, Instability& result);
    bool attempt(const Attempt& attempt, double* displacements, std::vector<bool>& failed);
    void chooseCouplings(const CoupledStart& start);
    bool iterate(const Attempt& attempt, int stage);
    bool finishIteration(const std::vector<std::size_t>& first);
    void chooseActive();
    void placeSites(double* positions) const;
    void addImpulses(const std::vector<bool>& taken, double stepSize);
    bool divide(const Attempt& whole, int division, double* displacements, std::vector<bool>& failed);
    BrokenCoupling findCulprit() const;
    std::vector<bool> findComponents(const std::vector<bool>& failed) const;
    void choosePacks(const StepSettings& settings);
    std::vector<bool> findApart(const StepSettings& settings) const;
    int stepApart(const Attempt& attempt, const std::vector<bool>& apart);
    const ChainEngine& engine;
    const PackStepSource& beamEngine;
    const std::vector<RigidBody>& bodies;
    ChainPlaces places;
    CarriedFrames carried;
    /** Those of all forces, and what an attempt has in their place. */
    std::vector<ImplicitCouplings*> ofForces, couplings;
    /** Whether any are gaps, whether a step may resolve these, and whether this attempt does. */
    bool haveGaps = false, mayBeSoft = true, areSoft = false;
    std::vector<Push> pushes;
    /** A force of a step, or of a part of it, until the step has been taken. */
    struct Impulse {
        CouplingImpulses* receiver;
        Push push;
        double duration;
    };
    std::vector<Impulse> received;
    std::vector<CoupledParticle> particles;
    std::vector<int> packs;
    std::vector<std::vector<int> > chainsOfLanes;
    std::vector<std::unique_ptr<PackStep> > steps;
    std::vector<PackStep*> stepsOfPacks;
    CoupledEquations coupled;
    ReflectedGaps gaps;
    std::vector<CouplingEquation> equations;
    /** Where those of each force begin. */
    std::vector<std::size_t> firstEquations;
    std::vector<double> moved, compliances;
    /** Of chains that take the step by themselves. */
    std::vector<double> movesApart;
    LaneFlags unfinished, flags;
    /** The packs that take part in an iteration: the others have converged, and nothing holds them otherwise. */
    PackFlags active;
    /** The chains in them that need it. */
    std::vector<char> goingOn;
    /** The coupling by which a step that cannot be divided any more has gone wrong. */
    BrokenCoupling culprit;
    int iterations = 0, substitutions = 0;
};

} // namespace cylchain

#endif /*CYLCHAIN_NETWORK_STEP_H_*/
