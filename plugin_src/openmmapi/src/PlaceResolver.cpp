#include "openmm/internal/PlaceResolver.h"
#include "mechanics/BezierWeights.h"
#include "openmm/CylinderChainForce.h"
#include "openmm/OpenMMException.h"
#include <algorithm>
#include <cmath>
#include <utility>

using namespace OpenMM;
using namespace cylchain;
using namespace std;

/** Weights of virtual sites that differ by less are the same. */
static const double SAME_WEIGHT = 1e-12;

PlaceResolver::PlaceResolver(const System& system) : system(system), next(system.getNumParticles(), -1),
        controls(system.getNumParticles(), -1), elementLengths(system.getNumParticles(), 0),
        isOfChain(system.getNumParticles(), false), isControl(system.getNumParticles(), false) {
    for (int i = 0; i < system.getNumForces(); i++) {
        const CylinderChainForce* force = dynamic_cast<const CylinderChainForce*>(&system.getForce(i));
        for (int chain = 0; force != NULL && chain < force->getNumChains(); chain++)
            force->getChains().visit(chain, [&] (const auto& own) {add(own);});
    }
}

void PlaceResolver::add(const Chain& chain) {
    const size_t nodes = chain.nodes.size();
    for (size_t node = 0; node < nodes; node++) {
        isOfChain[chain.nodes[node]] = true;
        if (node+1 < nodes || chain.closed)
            next[chain.nodes[node]] = chain.nodes[(node+1)%nodes];
    }
}

void PlaceResolver::add(const BeamChain& chain) {
    const vector<int>& particles = chain.particles;
    for (size_t node = 0; node+1 < particles.size(); node += 2) {
        isOfChain[particles[node]] = isOfChain[particles[node+1]] = isControl[particles[node+1]] = true;
        controls[particles[node]] = particles[node+1];
        elementLengths[particles[node]] = chain.elementLength;
        if (node+2 < particles.size() || chain.closed)
            next[particles[node]] = particles[(node+2)%particles.size()];
    }
}

bool PlaceResolver::isMovedBySteps(const Place& place) const {
    if (place.isPoint())
        return true;
    auto isFixed = [&] (int particle) {
        return system.getParticleMass(particle) == 0.0 && !isOfChain[particle] && !system.isVirtualSite(particle);
    };
    if (!place.isOnSegment())
        return !system.isVirtualSite(place.first) && !isControl[place.first];
    // The line between two nodes of a beam element is not on it.
    const bool isOfBeam = isControl[place.first] || controls[place.first] >= 0;
    const bool isOnChain = place.isOnCurve() == isOfBeam &&
            (next[place.first] == place.second || next[place.second] == place.first);
    return isOnChain || (isFixed(place.first) && isFixed(place.second));
}

string PlaceResolver::whyExplicit(const vector<Place>& places) const {
    const auto found = find_if(places.begin(), places.end(), [&] (const Place& place) {
        return !isMovedBySteps(place);
    });
    if (found == places.end())
        return "";
    if (found->isOnSegment())
        return "the place between particles "+to_string(found->first)+" and "+to_string(found->second);
    return (isControl[found->first] ? "control point " : "virtual site ")+to_string(found->first);
}

static Place placeBetween(int first, int second, double fraction) {
    Place place;
    place.first = first;
    place.second = second;
    place.fraction = fraction;
    return place;
}

void PlaceResolver::checkParticles(const Place& place) const {
    for (int particle : {place.first, place.second})
        if (particle >= system.getNumParticles())
            throw OpenMMException("Illegal particle index: "+to_string(particle));
}

Place PlaceResolver::resolve(const Place& place) const {
    checkParticles(place);
    if (place.isPoint())
        return place;
    if (place.isOnSegment()) {
        if (controls[place.first] < 0 || controls[place.second] < 0)
            return place;
        Place result = place;
        if (next[place.second] == place.first) {
            swap(result.first, result.second);
            result.fraction = 1-place.fraction;
        }
        if (next[result.first] != result.second)
            return place;
        result.controls[0] = controls[result.first];
        result.controls[1] = controls[result.second];
        return result;
    }
    if (!system.isVirtualSite(place.first))
        return place;
    const VirtualSite& any = system.getVirtualSite(place.first);
    Place onCurve;
    if (findOnCurve(any, onCurve))
        return onCurve;
    const TwoParticleAverageSite* site = dynamic_cast<const TwoParticleAverageSite*>(&any);
    if (site == NULL)
        return place;
    const int first = site->getParticle(0), second = site->getParticle(1);
    const double fraction = site->getWeight(1);
    const bool between = (fabs(site->getWeight(0)+fraction-1) < SAME_WEIGHT && fraction >= 0 && fraction <= 1);
    if (!between || first == second || system.isVirtualSite(first) || system.isVirtualSite(second))
        return place;
    return placeBetween(first, second, fraction);
}

Place PlaceResolver::resolveTangent(const Place& place) const {
    Place result = resolve(place);
    if (result.isOnCurve()) {
        const bool backwards = place.isOnSegment() && result.first != place.first;
        result.tangent = (backwards ? -1 : 1)/elementLengths[result.first];
    }
    return result;
}

/** Find where a site of two nodes and their control points is, if their weights are those of their curve. */
bool PlaceResolver::findOnCurve(const VirtualSite& any, Place& place) const {
    const LocalCoordinatesSite* site = dynamic_cast<const LocalCoordinatesSite*>(&any);
    if (site == NULL || site->getNumParticles() != 4 || site->getLocalPosition() != Vec3())
        return false;
    const int first = site->getParticle(0), second = site->getParticle(2);
    if (next[first] != second || !isControlOf(site->getParticle(1), first) ||
            !isControlOf(site->getParticle(3), second))
        return false;
    vector<double> given;
    site->getOriginWeights(given);
    // The weights of control points are 3 x (1-x)^2 and -3 x^2 (1-x).
    const double both = given[1]-given[3];
    const double fraction = both > SAME_WEIGHT ? -given[3]/both : given[2] > 0.5 ? 1 : 0;
    const BezierWeights weights(fraction);
    const double expected[] = {weights.position1-weights.control1, weights.control1,
            weights.position2-weights.control2, weights.control2};
    for (int i = 0; i < 4; i++)
        if (!(fabs(given[i]-expected[i]) < 10*SAME_WEIGHT))
            return false;
    place = placeBetween(first, second, min(1.0, max(0.0, fraction)));
    place.controls[0] = controls[first];
    place.controls[1] = controls[second];
    return true;
}
