#ifndef OPENMM_CHAINCOUPLINGS_H_
#define OPENMM_CHAINCOUPLINGS_H_

#include "networks/CoupledForces.h"
#include "openmm/internal/ContextImpl.h"
#include "openmm/internal/CylinderChainBindingForceImpl.h"
#include "openmm/internal/CylinderChainContactForceImpl.h"
#include "openmm/internal/CylinderChainDescription.h"
#include "openmm/internal/CylinderChainLinkForceImpl.h"
#include "openmm/internal/CylinderChainWallForceImpl.h"
#include "openmm/internal/OtherParticles.h"
#include <memory>
#include <vector>

namespace OpenMM {

/**
 * The links, linkers, contacts and walls of a Context that implicit steps have in their equations.
 *
 * A Force is among them if all of its places are on segments of chains, at particles, or do not move.  If not, it stays
 * an ordinary Force.
 */
class ChainCouplings {
public:
    ChainCouplings(ContextImpl& context, const CylinderChainDescription& chains, const OtherParticles& others);
    /**
     * In an implicit step, a periodic box must be wider than twice the sum of the longest segment and so many of the
     * largest diameters: contacts are looked for beyond the surfaces of segments, and on their way.
     */
    static constexpr double DIAMETERS_OF_BOX = 2;
    /**
     * Throw an exception if the periodic box of the Context is too narrow for contacts in implicit steps.
     */
    void refuseNarrowBox(const CylinderChainDescription& chains) const;
    /**
     * Throw an exception if there are couplings that chains of beam elements, which the Context has, cannot have.
     */
    void refuseBeams() const;
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
     * Take note of the forces of contacts and walls in a step that has moved particles.
     *
     * @param groups       those of describe()
     * @param integration  the force groups of the integrator
     * @param stepSize     how long the step was
     */
    void finishStep(int groups, int integration, double stepSize);
    /**
     * Get the contacts and walls, the forces of which are summed up.
     */
    const std::vector<PushForceImpl*>& getPushForces() const {
        return pushForces;
    }
    /**
     * Get the Force that a coupling of the last forces described belongs to.
     */
    const Force& getForce(const cylchain::BrokenCoupling& coupling) const;
private:
    // A force, and whether implicit steps can take it.

    template <class Impl> struct Coupling {
        Impl* force;
        bool taken;
        bool isTaken(int groups) const {
            return taken && force->isIn(groups);
        }
    };
    struct Links : Coupling<CylinderChainLinkForceImpl> {
        long long version;
    };
    typedef Coupling<CylinderChainBindingForceImpl> Linkers;
    typedef Coupling<CylinderChainContactForceImpl> Contacts;
    typedef Coupling<CylinderChainWallForceImpl> Walls;
    bool canTake(const cylchain::Place& place) const;
    void update();
    void addParticle(const cylchain::Place& place, std::vector<int>& particles) const;
    ContextImpl& context;
    const System& system;
    const OtherParticles& others;
    // The nodes before and behind a particle in its chain, or -1, and which particles are nodes or control points.

    std::vector<int> before, behind;
    std::vector<bool> isNode, isOfBeam, isControlPoint;
    std::vector<Links> links;
    std::vector<Linkers> linkers;
    std::vector<Contacts> contacts;
    std::vector<Walls> walls;
    std::vector<PushForceImpl*> pushForces;
    cylchain::CoupledForces forces;
    // The Forces of the forces above: links, contacts, walls.

    std::vector<const Force*> owners;
};

} // namespace OpenMM

#endif /*OPENMM_CHAINCOUPLINGS_H_*/
