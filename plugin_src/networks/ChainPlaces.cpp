#include "networks/ChainPlaces.h"
#include <algorithm>
#include <cmath>
#include <cstddef>

using namespace cylchain;
using namespace std;

/** The friction of a place against motion of its own, at the most: as the body turns about its easiest axis. */
static double frictionOfBody(const RigidBody& body, int place) {
    const double* const arm = &body.places[3*place];
    const double* const z = body.rotationalFriction;
    const double square = arm[0]*arm[0]+arm[1]*arm[1]+arm[2]*arm[2];
    // No less than the determinant over the largest product of the other two eigenvalues.
    const double determinant = z[0]*(z[3]*z[5]-z[4]*z[4])-z[1]*(z[1]*z[5]-z[4]*z[2])+z[2]*(z[1]*z[4]-z[3]*z[2]);
    const double trace = z[0]+z[3]+z[5];
    const double least = 4*determinant/(trace*trace);
    return 1/(1/body.friction+square/least);
}

ChainPlaces::ChainPlaces(const vector<Chain>& chains, const vector<BeamChain>& beams, const vector<RigidBody>& bodies,
        int particles) : chains(chains), beams(beams), bodies(bodies), chainOfParticle(particles, -1),
        nodeOfParticle(particles, -1), packOfChain(getNumChains(), -1), laneOfChain(getNumChains(), -1) {
    firstNodes.push_back(0);
    for (const Chain& chain : chains) {
        const int number = closed.size();
        for (size_t node = 0; node < chain.nodes.size(); node++) {
            chainOfParticle[chain.nodes[node]] = number;
            nodeOfParticle[chain.nodes[node]] = node;
        }
        particleOfNode.insert(particleOfNode.end(), chain.nodes.begin(), chain.nodes.end());
        firstNodes.push_back(particleOfNode.size());
        closed.push_back(chain.closed);
    }
    for (size_t beam = 0; beam < beams.size(); beam++)
        for (size_t i = 0; i < beams[beam].particles.size(); i++) {
            chainOfParticle[beams[beam].particles[i]] = chains.size()+beam;
            nodeOfParticle[beams[beam].particles[i]] = i%2 == 0 ? i/2 : -1;
        }
    for (size_t body = 0; body < bodies.size(); body++)
        for (size_t i = 0; i < bodies[body].particles.size(); i++) {
            chainOfParticle[bodies[body].particles[i]] = getNumFilaments()+body;
            nodeOfParticle[bodies[body].particles[i]] = i;
        }
    updateLengths();
}

void ChainPlaces::updateLengths() {
    lengths.clear();
    frictionOfNode.clear();
    for (const Chain& chain : chains) {
        double length = 0;
        for (const Segment& segment : chain.segments)
            length += segment.restLength;
        lengths.push_back(length);
        for (size_t node = 0; node < chain.nodes.size(); node++) {
            // Places at the last node are on the segment before it.
            const Segment& segment = chain.segments[min(node, chain.segments.size()-1)];
            frictionOfNode.push_back(chain.nodeFriction+0.25*min(segment.parallel, segment.perpendicular));
        }
    }
    findLeastFriction();
}

void ChainPlaces::findLeastFriction() {
    leastFriction = HUGE_VAL;
    for (int chain = 0; chain < getNumChains(); chain++) {
        PlaceOnChain place;
        place.chain = chain;
        const int segments = isStraight(chain) ? chains[chain].segments.size() :
                isBody(chain) ? bodyOf(chain).particles.size() : 1;
        for (place.node = 0; place.node < segments; place.node++)
            leastFriction = min(leastFriction, getFriction(place));
        place.hold.tangent = 1;
        if (isBeam(chain))
            leastFriction = min(leastFriction, getFriction(place));
    }
}

void ChainPlaces::setParticles(const vector<CoupledParticle>& newParticles) {
    for (const CoupledParticle& own : particles)
        chainOfParticle[own.particle] = -1;
    particles = newParticles;
    for (size_t i = 0; i < particles.size(); i++)
        chainOfParticle[particles[i].particle] = getFirstParticle()+i;
    findLeastFriction();
    packOfChain.resize(getNumChains(), -1);
    laneOfChain.resize(getNumChains(), -1);
}

void ChainPlaces::setPacks(const vector<vector<int> >& chainsOfLanes) {
    for (size_t pack = 0; pack < chainsOfLanes.size(); pack++)
        for (size_t lane = 0; lane < chainsOfLanes[pack].size(); lane++) {
            const int chain = chainsOfLanes[pack][lane];
            if (chain >= 0) {
                packOfChain[chain] = pack;
                laneOfChain[chain] = lane;
            }
        }
}

bool ChainPlaces::find(const Place& place, PlaceOnChain& result) const {
    result = PlaceOnChain();
    if (place.isPoint())
        return false;
    const int chain = chainOfParticle[place.first];
    if (chain < 0)
        return false;
    result.pack = packOfChain[chain];
    result.lane = laneOfChain[chain];
    result.chain = chain;
    if (isParticle(chain) || isBody(chain)) {
        result.node = isBody(chain) ? nodeOfParticle[place.first] : 0;
        if (place.isOnSegment())
            result = PlaceOnChain();
        return !place.isOnSegment();
    }
    const bool isRing = isClosed(chain);
    const int nodes = getNumNodes(chain);
    const int first = nodeOfParticle[place.first];
    int node = first;
    double fraction = 0;
    // The line between two nodes of beam elements is no place of theirs, nor is a control point.
    if (first < 0 || (place.isOnSegment() && isBeam(chain) != place.isOnCurve())) {
        result = PlaceOnChain();
        return false;
    }
    if (place.isOnSegment()) {
        if (chainOfParticle[place.second] != chain) {
            result = PlaceOnChain();
            return false;
        }
        const int second = nodeOfParticle[place.second];
        const bool forwards = second == first+1 || (isRing && second == (first+1)%nodes);
        const bool backwards = first == second+1 || (isRing && first == (second+1)%nodes);
        if (!forwards && !backwards) {
            result = PlaceOnChain();
            return false;
        }
        node = forwards ? first : second;
        fraction = forwards ? place.fraction : 1-place.fraction;
    }
    else if (!isRing && first == nodes-1) {
        node = first-1;
        fraction = 1;
    }
    result.node = node;
    result.fraction = fraction;
    result.hold = ElementHold();
    if (place.isTangent())
        result.hold.tangent = place.tangent > 0 ? 1 : -1;
    return true;
}

double ChainPlaces::getFriction(const PlaceOnChain& place) const {
    if (isStraight(place.chain))
        return frictionOfNode[firstNodes[place.chain]+place.node];
    if (isParticle(place.chain))
        return particleOf(place.chain).friction;
    if (isBody(place.chain))
        return frictionOfBody(bodyOf(place.chain), place.node);
    const BeamChain& beam = getBeam(place.chain);
    const double friction = beam.elementLength*min(beam.parallelFriction, beam.perpendicularFriction);
    if (place.hold.tangent != 0)
        return friction*beam.elementLength*beam.elementLength/MOBILITY_OF_BEAM_TANGENT;
    return friction/MOBILITY_OF_BEAM_END;
}

int ChainPlaces::getParticle(const PlaceOnChain& place) const {
    if (isStraight(place.chain))
        return particleOfNode[firstNodes[place.chain]+place.node];
    if (isParticle(place.chain))
        return particleOf(place.chain).particle;
    if (isBody(place.chain))
        return bodyOf(place.chain).particles[0];
    return getBeam(place.chain).particles[2*place.node];
}

LateralFriction ChainPlaces::findLateralFriction(const PlaceOnChain& place) const {
    if (isParticle(place.chain))
        return {particleOf(place.chain).friction, 0, 0, 0};
    if (isBody(place.chain))
        return {frictionOfBody(bodyOf(place.chain), place.node), 0, 0, 0};
    if (isBeam(place.chain)) {
        // An element is moved as four Legendre polynomials of the place, of which the second turns it.
        const BeamChain& beam = getBeam(place.chain);
        const double whole = beam.elementLength*beam.perpendicularFriction;
        return {0, whole, whole/12, 1};
    }
    const Chain& chain = chains[place.chain];
    const Segment& segment = chain.segments[place.node];
    return {chain.nodeFriction, segment.perpendicular, segment.rotational, segment.restLength};
}

vector<int> ChainPlaces::getNodes(int chain) const {
    if (isParticle(chain))
        return {particleOf(chain).particle};
    if (isBody(chain))
        return bodyOf(chain).particles;
    if (isBeam(chain))
        return getBeam(chain).particles;
    return chains[chain].nodes;
}
