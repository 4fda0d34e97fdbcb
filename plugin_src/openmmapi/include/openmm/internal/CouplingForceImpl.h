#ifndef OPENMM_COUPLINGFORCEIMPL_H_
#define OPENMM_COUPLINGFORCEIMPL_H_

#include "dynamics/BrokenCoupling.h"
#include "couplings/Surroundings.h"
#include "growth/GrowthSystem.h"
#include "kinetics/Linkers.h"
#include "networks/CoupledForces.h"
#include "openmm/CylinderChainCoupling.h"
#include "openmm/Vec3.h"
#include "openmm/internal/ContextImpl.h"
#include "openmm/internal/CylinderChainDescription.h"
#include "openmm/internal/PlaceResolver.h"
#include "openmm/internal/StepForceImpl.h"
#include <memory>
#include <string>
#include <vector>

namespace OpenMM {

/**
 * This is the implementation of a CylinderChainCoupling: what implicit steps of CylinderChainIntegrator ask of it.
 */
class CouplingForceImpl : public StepForceImpl {
public:
    virtual const CylinderChainCoupling& getOwner() const = 0;
    /**
     * Find the places on which it acts now.
     */
    virtual std::vector<cylchain::Place> findPlaces(const PlaceResolver& resolver) {
        return getOwner().findPlaces(resolver);
    }
    /**
     * Get a number that increases whenever these places change.
     */
    virtual long long getVersion() {
        return 0;
    }
    /**
     * Get a number by which the couplings of a Context are sorted: steps have those of lower ones first.
     */
    virtual int getOrder() const = 0;
    /**
     * Get whether there is a force at all.
     */
    virtual bool hasForces() = 0;
    /**
     * Get the equations that it has in an implicit step.
     */
    virtual cylchain::ImplicitCouplings* getEquations(ContextImpl& context) = 0;
    /**
     * Throw an exception if there are chains that cannot have it.
     */
    virtual void refuseChains(const CylinderChainDescription&) const {
    }
    /**
     * Throw an exception if implicit steps that have it in their equations cannot have the scheme of second order.
     */
    virtual void refuseTwoStages() const {
    }
    /**
     * Throw an exception if implicit steps that have it in their equations cannot have the periodic box of a Context.
     */
    virtual void refuseBox(ContextImpl&, const CylinderChainDescription&) const {
    }
    /**
     * Begin a step.
     */
    virtual void beginStep() {
    }
    /**
     * Take note that particles have moved by a step.
     *
     * @param taken     whether the Force was in its equations
     * @param acts      whether it acts in steps at all
     * @param stepSize  how long it was
     */
    virtual void finishStep(bool, bool, double) {
    }
    /**
     * Describe how a step has gone wrong by one of its couplings: "its contact with ... cannot be solved".
     *
     * @param other  the other place of the coupling, in words
     */
    virtual std::string describeFailure(const cylchain::BrokenCoupling& coupling, const std::string& other) = 0;
    /**
     * Take note of which particles are no nodes of their chains, because these have grown or shrunk.
     */
    virtual void setSpareNodes(ContextImpl&, const std::vector<bool>&) {
    }
    /**
     * Take note that chains have grown or shrunk, whether they have other nodes or not, have begun, or were cut.
     */
    virtual void chainsHaveGrown(ContextImpl&, const cylchain::ChainList&, const cylchain::GrowthChanges&) {
    }
    /**
     * Add the ends of chains the states of which it changes now.
     */
    virtual void findHeldEnds(std::vector<cylchain::HeldEnd>&) {
    }
    /**
     * Add what it may change ends of chains from and to.
     */
    virtual void findChangesOfEnds(std::vector<cylchain::HeldEnd>&) const {
    }
    /**
     * Add its hands that cut chains, or take monomers off their ends.
     */
    virtual void findActingHands(std::vector<cylchain::ActingHand>&) {
    }
    /**
     * Describe it as the ends of chains feel it that grow; NULL if it cannot act on them.
     *
     * @param chains   the chains of the Context
     * @param growing  the numbers of those that grow
     */
    virtual std::unique_ptr<cylchain::Surroundings> describeSurroundings(const cylchain::ChainList&,
            const std::vector<int>&) {
        return nullptr;
    }
    /**
     * Get a number that increases whenever what describeSurroundings() says changes.
     */
    virtual int getVersionOfSurroundings() const {
        return 0;
    }
protected:
    explicit CouplingForceImpl(const Force& owner) : StepForceImpl(owner) {
    }
};

} // namespace OpenMM

#endif /*OPENMM_COUPLINGFORCEIMPL_H_*/
