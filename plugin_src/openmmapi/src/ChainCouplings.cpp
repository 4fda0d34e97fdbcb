#include "openmm/internal/ChainCouplings.h"
#include "openmm/System.h"
#include <algorithm>

using namespace OpenMM;
using namespace cylchain;
using namespace std;

ChainCouplings::ChainCouplings(ContextImpl& context, const CylinderChainDescription& chains,
        const OtherParticles& others) : system(context.getSystem()), others(others) {
    before.assign(system.getNumParticles(), -1);
    behind.assign(system.getNumParticles(), -1);
    isNode.assign(system.getNumParticles(), false);
    for (const Chain& chain : chains.getChains()) {
        const size_t nodes = chain.nodes.size();
        for (size_t node = 0; node < nodes; node++) {
            isNode[chain.nodes[node]] = true;
            if (node+1 < nodes || chain.closed) {
                behind[chain.nodes[node]] = chain.nodes[(node+1)%nodes];
                before[chain.nodes[(node+1)%nodes]] = chain.nodes[node];
            }
        }
    }
    for (ForceImpl* impl : context.getForceImpls()) {
        CylinderChainLinkForceImpl* ofLinks = dynamic_cast<CylinderChainLinkForceImpl*>(impl);
        if (ofLinks != NULL)
            links.push_back({ofLinks, -1, false});
        CylinderChainWallForceImpl* ofWalls = dynamic_cast<CylinderChainWallForceImpl*>(impl);
        if (ofWalls != NULL) {
            const vector<WallParticle>& particles = ofWalls->getWalls().particles;
            const bool taken = all_of(particles.begin(), particles.end(), [&] (const WallParticle& own) {
                return !system.isVirtualSite(own.particle);
            });
            walls.push_back({ofWalls, taken});
        }
        CylinderChainContactForceImpl* ofContacts = dynamic_cast<CylinderChainContactForceImpl*>(impl);
        if (ofContacts == NULL)
            continue;
        const vector<Capsule>& capsules = ofContacts->getSearch().getSystem().capsules;
        const bool taken = all_of(capsules.begin(), capsules.end(), [&] (const Capsule& capsule) {
            Place place;
            place.first = capsule.first;
            place.second = capsule.second;
            return canTake(place);
        });
        contacts.push_back({ofContacts, taken});
    }
}

bool ChainCouplings::canTake(const Place& place) const {
    if (place.isPoint())
        return true;
    auto isFixed = [&] (int particle) {
        return system.getParticleMass(particle) == 0.0 && !isNode[particle] && !system.isVirtualSite(particle);
    };
    if (!place.isOnSegment())
        return !system.isVirtualSite(place.first);
    return behind[place.first] == place.second || before[place.first] == place.second ||
            (isFixed(place.first) && isFixed(place.second));
}

void ChainCouplings::update() {
    for (Links& own : links) {
        const long long version = own.force->getVersion();
        if (version == own.version)
            continue;
        const vector<Link>& present = own.force->getLinks();
        own.taken = all_of(present.begin(), present.end(), [&] (const Link& link) {
            return canTake(link.first) && canTake(link.second);
        });
        own.version = own.force->getVersion();
    }
}

bool ChainCouplings::isTaken(const Links& own, int groups) const {
    return own.taken && (groups&(1<<own.force->getOwner().getForceGroup())) != 0;
}

bool ChainCouplings::isTaken(const Contacts& own, int groups) const {
    return own.taken && (groups&(1<<own.force->getOwner().getForceGroup())) != 0;
}

bool ChainCouplings::isTaken(const Walls& own, int groups) const {
    return own.taken && (groups&(1<<own.force->getOwner().getForceGroup())) != 0;
}

ChainCouplings::Exclusion::Exclusion(ChainCouplings& couplings, int groups) {
    if (groups == 0)
        return;
    couplings.update();
    for (const Links& own : couplings.links)
        if (couplings.isTaken(own, groups))
            links.emplace_back(new CylinderChainLinkForceImpl::Exclusion(*own.force, true));
    for (const Contacts& own : couplings.contacts)
        if (couplings.isTaken(own, groups))
            contacts.emplace_back(new CylinderChainContactForceImpl::Exclusion(*own.force, true));
    for (const Walls& own : couplings.walls)
        if (couplings.isTaken(own, groups))
            walls.emplace_back(new CylinderChainWallForceImpl::Exclusion(*own.force, true));
}

void ChainCouplings::addParticle(const Place& place, vector<int>& particles) const {
    if (!place.isPoint() && !place.isOnSegment() && !isNode[place.first] &&
            system.getParticleMass(place.first) != 0.0)
        particles.push_back(place.first);
}

const CoupledForces& ChainCouplings::describe(int groups, double friction) {
    update();
    forces.links.clear();
    forces.contacts.clear();
    forces.walls.clear();
    forces.particles.clear();
    vector<int> particles;
    for (const Links& own : links) {
        const vector<Link>& present = own.force->getLinks();
        if (!isTaken(own, groups) || present.empty())
            continue;
        forces.links.push_back({&present, own.force->getOwner().usesPeriodicBoundaryConditions(),
                own.force->takesNearestParticles()});
        for (const Link& link : present) {
            addParticle(link.first, particles);
            addParticle(link.second, particles);
        }
    }
    for (const Contacts& own : contacts) {
        const vector<Capsule>& capsules = own.force->getSearch().getSystem().capsules;
        if (!isTaken(own, groups) || capsules.empty() || own.force->getStiffness() == 0)
            continue;
        forces.contacts.push_back({&own.force->getSearch(), own.force->getStiffness(),
                own.force->usesPeriodicBoundaryConditions()});
        for (const Capsule& capsule : capsules) {
            Place place;
            place.first = capsule.first;
            place.second = capsule.second;
            addParticle(place, particles);
        }
    }
    for (const Walls& own : walls) {
        const WallSystem& present = own.force->getWalls();
        if (!isTaken(own, groups) || present.particles.empty() || present.stiffness == 0)
            continue;
        forces.walls.push_back(&present);
        for (const WallParticle& wallParticle : present.particles) {
            Place place;
            place.first = wallParticle.particle;
            addParticle(place, particles);
        }
    }
    sort(particles.begin(), particles.end());
    particles.erase(unique(particles.begin(), particles.end()), particles.end());
    for (int particle : particles)
        forces.particles.push_back({particle, 1/others.getMobility(particle, friction)});
    return forces;
}
