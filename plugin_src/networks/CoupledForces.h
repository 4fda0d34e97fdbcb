#ifndef CYLCHAIN_COUPLED_FORCES_H_
#define CYLCHAIN_COUPLED_FORCES_H_

#include "couplings/ContactSearch.h"
#include "couplings/CouplingImpulses.h"
#include "couplings/Links.h"
#include "couplings/Walls.h"
#include "networks/CurveSites.h"
#include "networks/ParticleStep.h"
#include <vector>

namespace cylchain {

/** Forces that couple chains with each other and with particles outside of them, for implicit steps to take. */
struct CoupledForces {
    struct Links {
        const std::vector<Link>* links;
        /** Whether the ends of a link, and the two particles of a place, are taken to their nearest images. */
        bool periodic, nearestParticles;
    };
    struct Contacts {
        ContactSearch* search;
        double stiffness;
        bool periodic;
        /** Where capsules between places on curves of beam elements are. */
        const std::vector<CapsuleOnCurve>* onCurves;
        /** Receives their forces. */
        CouplingImpulses* impulses;
    };
    struct Walls {
        const WallSystem* system;
        CouplingImpulses* impulses;
    };
    std::vector<Links> links;
    std::vector<Contacts> contacts;
    std::vector<Walls> walls;
    /** The virtual sites on curves that move with them, at which capsules end. */
    std::vector<CurveSite> sites;
    /** The particles outside chains that these forces act on, in ascending order. */
    std::vector<CoupledParticle> particles;
    bool empty() const {
        return links.empty() && contacts.empty() && walls.empty();
    }
};

} // namespace cylchain

#endif /*CYLCHAIN_COUPLED_FORCES_H_*/
