#ifndef OPENMM_CHAINCOUPLINGS_H_
#define OPENMM_CHAINCOUPLINGS_H_

#include "dynamics/CoupledForces.h"
#include "openmm/internal/ContextImpl.h"
#include "openmm/internal/CylinderChainContactForceImpl.h"
#include "openmm/internal/CylinderChainDescription.h"
#include "openmm/internal/CylinderChainLinkForceImpl.h"
#include "openmm/internal/CylinderChainWallForceImpl.h"
#include "openmm/internal/OtherParticles.h"
#include <memory>
#include <vector>

namespace OpenMM {

/**
 * The links, contacts and walls of a Context that implicit steps have in their equations.
 *
 * A Force is among them if all of its places are on segments of chains, at particles, or do not move.  If not, it stays
 * an ordinary Force.
 */
class ChainCouplings {
public:
    ChainCouplings(ContextImpl& context, const CylinderChainDescription& chains, const OtherParticles& others);
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
        std::vector<std::unique_ptr<CylinderChainLinkForceImpl::Exclusion> > links;
        std::vector<std::unique_ptr<CylinderChainContactForceImpl::Exclusion> > contacts;
        std::vector<std::unique_ptr<CylinderChainWallForceImpl::Exclusion> > walls;
    };
    /**
     * Describe the forces that an implicit step takes.
     *
     * @param groups    the force groups of the integrator
     * @param friction  the friction of particles outside chains that have none of their own, divided by their mass
     */
    const cylchain::CoupledForces& describe(int groups, double friction);
private:
    struct Links {
        CylinderChainLinkForceImpl* force;
        long long version;
        bool taken;
    };
    struct Contacts {
        CylinderChainContactForceImpl* force;
        bool taken;
    };
    struct Walls {
        CylinderChainWallForceImpl* force;
        bool taken;
    };
    bool canTake(const cylchain::Place& place) const;
    void update();
    bool isTaken(const Links& own, int groups) const;
    bool isTaken(const Contacts& own, int groups) const;
    bool isTaken(const Walls& own, int groups) const;
    void addParticle(const cylchain::Place& place, std::vector<int>& particles) const;
    const System& system;
    const OtherParticles& others;
    // The nodes before and behind a particle in its chain, or -1.

    std::vector<int> before, behind;
    std::vector<bool> isNode;
    std::vector<Links> links;
    std::vector<Contacts> contacts;
    std::vector<Walls> walls;
    cylchain::CoupledForces forces;
};

} // namespace OpenMM

#endif /*OPENMM_CHAINCOUPLINGS_H_*/
