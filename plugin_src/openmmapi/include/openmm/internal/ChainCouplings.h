#ifndef OPENMM_CHAINCOUPLINGS_H_
#define OPENMM_CHAINCOUPLINGS_H_

#include "networks/CoupledForces.h"
#include "openmm/internal/ContextImpl.h"
#include "openmm/internal/CouplingForceImpl.h"
#include "openmm/internal/CylinderChainDescription.h"
#include "openmm/internal/OtherParticles.h"
#include "openmm/internal/PlaceResolver.h"
#include <iosfwd>
#include <map>
#include <memory>
#include <string>
#include <vector>

namespace OpenMM {

class SerializationNode;

/**
 * The couplings of a Context, and which of them implicit steps have in their equations: see CylinderChainCoupling.
 */
class ChainCouplings {
public:
    ChainCouplings(ContextImpl& context, const OtherParticles& others);
    /**
     * Throw an exception if there are chains that cannot have one of the couplings.
     */
    void refuseChains(const CylinderChainDescription& chains) const;
    /**
     * Throw an exception if implicit steps with these couplings cannot have the periodic box of the Context.
     */
    void refuseBox(const CylinderChainDescription& chains) const;
    /**
     * Throw an exception if implicit steps with these couplings cannot have the scheme of second order.
     *
     * @param groups  the force groups of the integrator
     */
    void refuseTwoStages(int groups) const;
    /**
     * While an object of this class exists, the Forces that implicit steps take contribute nothing.
     */
    class Exclusion {
    public:
        /**
         * @param groups  the force groups of the integrator, or 0 to exclude nothing
         */
        Exclusion(ChainCouplings& couplings, int groups);
    private:
        std::vector<std::unique_ptr<StepForceImpl::Exclusion> > exclusions;
    };
    /**
     * Describe the forces that an implicit step takes.
     *
     * @param groups    the force groups of the integrator
     * @param friction  the friction of particles outside chains that have none of their own, divided by their mass
     */
    const cylchain::CoupledForces& describe(int groups, double friction);
    /**
     * Take note of a step that has moved particles.
     *
     * @param groups       those of describe()
     * @param integration  the force groups of the integrator
     * @param stepSize     how long the step was
     */
    void finishStep(int groups, int integration, double stepSize);
    /**
     * Write what Forces have in the Context beside positions to a checkpoint, or to a State.
     */
    void writeStates(std::ostream& stream) const;
    void writeStates(SerializationNode& node) const;
    /**
     * Read what writeStates() has written.  A State that has nothing of the kind leaves Forces as they are.
     */
    void readStates(std::istream& stream) const;
    void readStates(const SerializationNode& node) const;
    /**
     * Get the Force that a coupling of the last forces described belongs to.
     */
    CouplingForceImpl& getForce(const cylchain::BrokenCoupling& coupling) const {
        return *owners[coupling.force];
    }
private:
    struct Coupling {
        CouplingForceImpl* force;
        // Whether implicit steps can take it, and the particles outside chains that it acts on, both of a version.

        bool taken;
        std::vector<int> particles;
        long long version;
        bool isTaken(int groups) const {
            return taken && force->isIn(groups);
        }
    };
    void update();
    std::map<std::string, std::vector<StepForceImpl*> > findStates() const;
    ContextImpl& context;
    const OtherParticles& others;
    const PlaceResolver resolver;
    std::vector<Coupling> couplings;
    cylchain::CoupledForces forces;
    // The Forces of the forces above.

    std::vector<CouplingForceImpl*> owners;
};

} // namespace OpenMM

#endif /*OPENMM_CHAINCOUPLINGS_H_*/
