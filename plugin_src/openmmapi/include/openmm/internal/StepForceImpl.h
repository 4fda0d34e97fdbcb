#ifndef OPENMM_STEPFORCEIMPL_H_
#define OPENMM_STEPFORCEIMPL_H_

#include "openmm/Force.h"
#include "openmm/internal/ForceImpl.h"
#include "openmm/internal/StateColumns.h"
#include <string>

namespace OpenMM {

/**
 * This is the implementation of a Force that steps of CylinderChainIntegrator may compute themselves.
 */
class StepForceImpl : public ForceImpl {
public:
    /**
     * While an object of this class exists, the Force contributes nothing.
     */
    class Exclusion {
    public:
        explicit Exclusion(StepForceImpl& force) : force(force) {
            force.excluded = true;
        }
        ~Exclusion() {
            force.excluded = false;
        }
        Exclusion(const Exclusion&) = delete;
        Exclusion& operator=(const Exclusion&) = delete;
    private:
        StepForceImpl& force;
    };
    void updateContextState(ContextImpl&, bool&) {
        // Nothing is modified between steps.
    }
    /**
     * Get whether the Force is in one of some force groups.
     */
    bool isIn(int groups) const {
        return (groups&(1<<forceGroup)) != 0;
    }
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
    explicit StepForceImpl(const Force& owner) {
        forceGroup = owner.getForceGroup();
    }
    /**
     * Get whether the Force contributes nothing now.
     */
    bool isExcluded() const {
        return excluded;
    }
private:
    bool excluded = false;
};

} // namespace OpenMM

#endif /*OPENMM_STEPFORCEIMPL_H_*/
