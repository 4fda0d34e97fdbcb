#include "networks/PlaceResponses.h"
#include <algorithm>
#include <cmath>
#include <cstddef>

using namespace cylchain;
using namespace std;

/** How many of its lengths a beam is bent by an end. */
static const double LENGTHS_OF_END = 4;

void PlaceResponses::begin(const ChainPlaces& newPlaces, double newStepSize) {
    places = &newPlaces;
    stepSize = newStepSize;
    const vector<Chain>& chains = places->getChains();
    beams.assign(places->getNumFilaments(), Beam());
    for (size_t i = 0; i < chains.size(); i++) {
        const Chain& chain = chains[i];
        if (chain.segments.empty())
            continue;
        const Segment& segment = chain.segments[0];
        Beam& beam = beams[i];
        beam.length = places->getLength(i);
        beam.segments = chain.segments.size();
        beam.closed = chain.closed;
        double largest = 0;
        for (const Segment& one : chain.segments)
            largest = max(largest, one.perpendicular);
        beam.least = stepSize/(chain.nodeFriction+largest);
        describe(segment.perpendicular/segment.restLength,
                chain.joints.empty() ? 0 : chain.joints[0]*segment.restLength, beam);
    }
    for (size_t i = chains.size(); i < beams.size(); i++) {
        const BeamChain& chain = places->getBeam(i);
        beams[i].segments = chain.numElements();
        beams[i].closed = chain.closed;
        beams[i].length = beams[i].segments*chain.elementLength;
        beams[i].least = stepSize/(chain.elementLength*chain.perpendicularFriction);
        describe(chain.perpendicularFriction, chain.bendingRigidity, beams[i]);
    }
}

void PlaceResponses::describe(double friction, double rigidity, Beam& beam) const {
    if (!(friction > 0 && rigidity > 0))
        return;
    beam.wave = M_SQRT2*pow(rigidity*stepSize/friction, 0.25);
    beam.bending = 0.5*stepSize/(friction*beam.wave);
    beam.whole = stepSize/(friction*beam.length);
    beam.least = min(beam.least, max(beam.bending, beam.whole));
}

double PlaceResponses::find(const PlaceOnChain& place, const LateralFriction& friction) const {
    const double alone = stepSize/friction.at(place.fraction);
    if (place.chain >= (int) beams.size() || !(beams[place.chain].wave > 0))
        return alone;
    const Beam& beam = beams[place.chain];
    // A ring turns, too, but about axes in its plane alone: 3/2 on the average over directions.
    double bending = beam.bending, whole = 1.5*beam.whole;
    if (!beam.closed) {
        const double at = (place.node+place.fraction)*beam.length/beam.segments;
        const double x = min(at, beam.length-at)/beam.wave, off = at/beam.length-0.5;
        if (x < LENGTHS_OF_END)
            bending *= 1+exp(-2*x)*(1+2*cos(x)*(cos(x)-sin(x)));
        whole = beam.whole*(1+12*off*off);
    }
    return min(alone, cbrt(bending*bending*bending+whole*whole*whole));
}

double PlaceResponses::findLeast(int chain) const {
    if (chain < (int) beams.size())
        return beams[chain].least;
    PlaceOnChain particle;
    particle.chain = chain;
    return find(particle);
}

bool PlaceResponses::moveTogether(int chain) const {
    if (chain >= (int) beams.size())
        return false;
    if (places->isBeam(chain))
        return true;
    const Beam& beam = beams[chain];
    const double segment = beam.length/beam.segments;
    return segment < min(beam.wave, 0.25*beam.length);
}
