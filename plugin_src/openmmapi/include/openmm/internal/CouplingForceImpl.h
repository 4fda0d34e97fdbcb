#ifndef OPENMM_COUPLINGFORCEIMPL_H_
#define OPENMM_COUPLINGFORCEIMPL_H_

#include "dynamics/BrokenCoupling.h"
#include "networks/CoupledForces.h"
#include "openmm/CylinderChainCoupling.h"
#include "openmm/Vec3.h"
#include "openmm/internal/ContextImpl.h"
#include "openmm/internal/CylinderChainDescription.h"
#include "openmm/internal/PlaceResolver.h"
#include "openmm/internal/StateColumns.h"
#include "openmm/internal/StepForceImpl.h"
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
     * Get the equations that it has in an implicit step; NULL if the platform has none.
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
     * Get what it calls the state that it has in a Context beside positions; nothing if it has none.
     */
    virtual std::string getStateName() const {
        return "";
    }
    /**
     * Get whether States do not hold it, but checkpoints alone, and a Context may begin a new one.
     */
    virtual bool isStateOfCheckpoints() const {
        return false;
    }
    /**
     * Store the state; an exception is thrown if it is not known.
     *
     * @param inCheckpoint  whether random numbers are to go on as well
     */
    virtual StateColumns storeState(bool) {
        return StateColumns();
    }
    /**
     * Go on from a state that was stored.
     */
    virtual void restoreState(const StateColumns&) {
    }
    /**
     * Begin a new state.
     */
    virtual void beginState() {
    }
protected:
    explicit CouplingForceImpl(const Force& owner) : StepForceImpl(owner) {
    }
};

} // namespace OpenMM

#endif /*OPENMM_COUPLINGFORCEIMPL_H_*/
