#ifndef OPENMM_PUSHFORCEIMPL_H_
#define OPENMM_PUSHFORCEIMPL_H_

#include "couplings/CouplingImpulses.h"
#include "openmm/internal/CouplingForceImpl.h"
#include <string>
#include <vector>

namespace OpenMM {

/**
 * This is the implementation of a Force of contacts or walls, whose mean over steps of CylinderChainIntegrator is
 * known.
 */
class PushForceImpl : public CouplingForceImpl {
public:
    void refuseTwoStages() const;
    void beginStep() {
        impulses.beginStep();
    }
    void finishStep(bool taken, bool acts, double stepSize) {
        if (!taken && acts)
            for (const cylchain::Push& push : present)
                impulses.add(push, stepSize);
        impulses.finishStep(stepSize);
    }
    /**
     * See CylinderChainWallForce::addForceReader() and takeMeanForces().
     */
    int addReader() {
        return impulses.addReader();
    }
    double takeMeanForces(ContextImpl& context, int reader, std::vector<double>& forces, std::vector<int>& numbers,
            std::vector<double>& sums, std::vector<double>& loads);
    int getVersionOfSurroundings() const {
        return versionOfSurroundings;
    }
    std::string getStateName() const {
        return "forces";
    }
    bool isStateOfCheckpoints() const {
        return true;
    }
    StateColumns storeState(bool inCheckpoint);
    void restoreState(const StateColumns& columns);
    void beginState() {
        impulses.clear();
    }
protected:
    /**
     * Get what receives the forces of implicit steps.
     */
    cylchain::CouplingImpulses& getImpulses() {
        return impulses;
    }
    explicit PushForceImpl(const Force& owner) : CouplingForceImpl(owner) {
    }
    void beginSums(int numParticles) {
        impulses = cylchain::CouplingImpulses(numParticles);
    }
    /**
     * Find the forces at the present positions.
     */
    virtual void findPushes(ContextImpl& context, std::vector<cylchain::Push>& pushes) const = 0;
    /**
     * The forces as the kernel has computed them last.
     */
    std::vector<cylchain::Push> present;
    // Of parameters, which updateParametersInContext() changes.

    int versionOfSurroundings = 0;
private:
    cylchain::CouplingImpulses impulses;
};

} // namespace OpenMM

#endif /*OPENMM_PUSHFORCEIMPL_H_*/
