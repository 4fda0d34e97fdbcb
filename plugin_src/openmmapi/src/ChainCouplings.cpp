#include "openmm/internal/ChainCouplings.h"
#include "openmm/OpenMMException.h"
#include "openmm/System.h"
#include <algorithm>
#include <cmath>
#include <sstream>

using namespace OpenMM;
using namespace cylchain;
using namespace std;

static string asText(double number) {
    stringstream text;
    text << number;
    return text.str();
}

ChainCouplings::ChainCouplings(ContextImpl& context, const CylinderChainDescription& chains,
        const OtherParticles& others) : context(context), system(context.getSystem()), others(others) {
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
    isOfBeam.assign(system.getNumParticles(), false);
    isControlPoint.assign(system.getNumParticles(), false);
    for (const BeamChain& beam : chains.getBeams())
        for (size_t i = 0; i < beam.particles.size(); i++) {
            const int particle = beam.particles[i];
            isNode[particle] = isOfBeam[particle] = true;
            isControlPoint[particle] = (i%2 == 1);
            if (i%2 == 0 && (i > 0 || beam.closed)) {
                const int last = beam.particles[i > 0 ? i-2 : beam.particles.size()-2];
                before[particle] = last;
                behind[last] = particle;
            }
        }
    for (ForceImpl* impl : context.getForceImpls()) {
        PushForceImpl* pushes = dynamic_cast<PushForceImpl*>(impl);
        if (pushes != NULL)
            pushForces.push_back(pushes);
        CylinderChainLinkForceImpl* ofLinks = dynamic_cast<CylinderChainLinkForceImpl*>(impl);
        if (ofLinks != NULL)
            links.push_back({{ofLinks, false}, -1});
        CylinderChainBindingForceImpl* ofLinkers = dynamic_cast<CylinderChainBindingForceImpl*>(impl);
        if (ofLinkers != NULL) {
            const vector<Place>& anchors = ofLinkers->getAnchors();
            linkers.push_back({ofLinkers, all_of(anchors.begin(), anchors.end(), [&] (const Place& anchor) {
                return canTake(anchor);
            })});
        }
        CylinderChainWallForceImpl* ofWalls = dynamic_cast<CylinderChainWallForceImpl*>(impl);
        if (ofWalls != NULL) {
            const vector<WallParticle>& particles = ofWalls->getWalls().particles;
            const bool taken = all_of(particles.begin(), particles.end(), [&] (const WallParticle& own) {
                return own.onCurve.isOnCurve() || !(system.isVirtualSite(own.particle) || isControlPoint[own.particle]);
            });
            walls.push_back({ofWalls, taken});
        }
        CylinderChainContactForceImpl* ofContacts = dynamic_cast<CylinderChainContactForceImpl*>(impl);
        if (ofContacts == NULL)
            continue;
        const vector<Capsule>& capsules = ofContacts->getSearch().getSystem().capsules;
        vector<bool> isOnCurve(capsules.size(), false);
        for (const CapsuleOnCurve& own : ofContacts->getOnCurves())
            isOnCurve[own.capsule] = true;
        bool taken = true;
        for (size_t i = 0; i < capsules.size(); i++) {
            Place place;
            place.first = capsules[i].first;
            place.second = capsules[i].second;
            taken = taken && (isOnCurve[i] || canTake(place));
        }
        contacts.push_back({ofContacts, taken});
    }
}

void ChainCouplings::refuseBeams() const {
    bool any = false;
    for (const Contacts& own : contacts)
        for (const Capsule& capsule : own.force->getSearch().getSystem().capsules)
            any |= isOfBeam[capsule.first] || (capsule.second >= 0 && isOfBeam[capsule.second]);
    if (any)
        throw OpenMMException("CylinderChainIntegrator: Chains of beam elements cannot have contacts of this plugin "
                "between their nodes, but between virtual sites on their curves: take such sites, or segments");
}

void ChainCouplings::refuseNarrowBox(const CylinderChainDescription& chains) const {
    double longest = 0;
    for (const Chain& chain : chains.getChains())
        for (const Segment& segment : chain.segments)
            longest = max(longest, segment.restLength);
    double longestElement = 0;
    for (const BeamChain& beam : chains.getBeams())
        longestElement = max(longestElement, beam.elementLength);
    for (const Contacts& own : contacts)
        for (const CapsuleOnCurve& capsule : own.force->getOnCurves())
            longest = max(longest, longestElement/capsule.pieces);
    Vec3 a, b, c;
    context.getPeriodicBoxVectors(a, b, c);
    const Vec3 faces[] = {b.cross(c), c.cross(a), a.cross(b)};
    double narrowest = INFINITY;
    for (const Vec3& face : faces)
        narrowest = min(narrowest, a[0]*b[1]*c[2]/sqrt(face.dot(face)));
    for (const Contacts& own : contacts) {
        if (!own.taken || !own.force->usesPeriodicBoundaryConditions())
            continue;
        double diameter = 0;
        for (const Capsule& capsule : own.force->getSearch().getSystem().capsules)
            diameter = max(diameter, 2*capsule.radius);
        const double needed = 2*(longest+DIAMETERS_OF_BOX*diameter);
        if (narrowest < needed)
            throw OpenMMException("The periodic box is too small for contacts in implicit steps: it is "+
                    asText(narrowest)+" nm wide between two of its faces, but segments of "+asText(longest)+
                    " nm with contacts of "+asText(diameter)+" nm need twice their length and "+
                    asText(DIAMETERS_OF_BOX)+" diameters, "+asText(needed)+
                    " nm. Take a larger box or shorter segments");
    }
}

bool ChainCouplings::canTake(const Place& place) const {
    if (place.isPoint())
        return true;
    auto isFixed = [&] (int particle) {
        return system.getParticleMass(particle) == 0.0 && !isNode[particle] && !system.isVirtualSite(particle);
    };
    if (!place.isOnSegment())
        return !system.isVirtualSite(place.first) && !isControlPoint[place.first];
    // The line between two nodes of a beam element is not on it.
    const bool isOnChain = place.isOnCurve() == isOfBeam[place.first] &&
            (behind[place.first] == place.second || before[place.first] == place.second);
    return isOnChain || (isFixed(place.first) && isFixed(place.second));
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

ChainCouplings::Exclusion::Exclusion(ChainCouplings& couplings, int groups) {
    if (groups == 0)
        return;
    couplings.update();
    auto exclude = [&] (const auto& all) {
        for (const auto& own : all)
            if (own.isTaken(groups))
                exclusions.emplace_back(new StepForceImpl::Exclusion(*own.force));
    };
    exclude(couplings.links);
    exclude(couplings.linkers);
    exclude(couplings.contacts);
    exclude(couplings.walls);
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
    forces.sites.clear();
    forces.particles.clear();
    owners.clear();
    vector<int> particles;
    for (const Links& own : links) {
        const vector<Link>& present = own.force->getLinks();
        if (!own.isTaken(groups) || present.empty())
            continue;
        forces.links.push_back({&present, own.force->getOwner().usesPeriodicBoundaryConditions(),
                own.force->takesNearestParticles()});
        owners.push_back(&own.force->getOwner());
        for (const Link& link : present) {
            addParticle(link.first, particles);
            addParticle(link.second, particles);
        }
    }
    for (const Linkers& own : linkers) {
        if (!own.isTaken(groups) || own.force->getLinks().empty())
            continue;
        forces.links.push_back({&own.force->getLinks(), own.force->getOwner().usesPeriodicBoundaryConditions(),
                own.force->takesNearestParticles()});
        owners.push_back(&own.force->getOwner());
        for (const Place& anchor : own.force->getAnchors())
            addParticle(anchor, particles);
    }
    for (PushForceImpl* own : pushForces)
        own->beginStep();
    for (const Contacts& own : contacts) {
        const vector<Capsule>& capsules = own.force->getSearch().getSystem().capsules;
        if (!own.isTaken(groups) || capsules.empty() || own.force->getStiffness() == 0)
            continue;
        forces.contacts.push_back({&own.force->getSearch(), own.force->getStiffness(),
                own.force->usesPeriodicBoundaryConditions(), &own.force->getOnCurves(), &own.force->getImpulses()});
        forces.sites.insert(forces.sites.end(), own.force->getSites().begin(), own.force->getSites().end());
        owners.push_back(&own.force->getOwner());
        for (const Capsule& capsule : capsules) {
            Place place;
            place.first = capsule.first;
            place.second = capsule.second;
            addParticle(place, particles);
        }
    }
    for (const Walls& own : walls) {
        const WallSystem& present = own.force->getWalls();
        if (!own.isTaken(groups) || present.particles.empty() || present.stiffness == 0)
            continue;
        forces.walls.push_back({&present, &own.force->getImpulses()});
        owners.push_back(&own.force->getOwner());
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

void ChainCouplings::finishStep(int groups, int integration, double stepSize) {
    auto finish = [&] (const auto& all) {
        for (const auto& own : all)
            own.force->finishStep(own.isTaken(groups), own.force->isIn(integration), stepSize);
    };
    finish(contacts);
    finish(walls);
}

const Force& ChainCouplings::getForce(const BrokenCoupling& coupling) const {
    return *owners[coupling.force];
}
