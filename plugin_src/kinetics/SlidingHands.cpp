#include "kinetics/LinkerKinetics.h"
#include "mechanics/SymmetricMatrices.h"
#include <algorithm>
#include <cmath>

using namespace cylchain;
using namespace std;

namespace {

/** Steps which would relax a spring by more than all of it have parts that relax by so much, or so many parts. */
const double LARGEST_PART = 0.25, MOST_SLIDING_PARTS = 100;

double drawNormal(RandomNumbers& random) {
    const double radius = sqrt(2*random.exponential());
    return radius*cos(2*M_PI*random.uniform());
}

} // namespace

/**
 * The hands of a linker that slide do so as long as a step takes, in turn.
 *
 * In a step that relaxes the spring by less than all of it, they move together as far as the load at the start takes
 * them: chains follow in the rest of the step, so that it stays. In longer steps they relax as on chains that stand
 * still.
 */
void LinkerKinetics::slide(Linker& linker, const KineticStep& step, RandomNumbers& random, Count& count) const {
    const LinkerType& type = system.types[linker.type];
    auto frictionOf = [&] (int side) {
        return linker.hands[side].isBound() ? system.hands[type.hands[side]].slidingFriction : 0;
    };
    double relaxed[] = {0, 0};
    for (int side = 0; side < 2; side++)
        if (linker.pulls() && frictionOf(side) > 0)
            relaxed[side] = type.stiffness*step.stepSize/frictionOf(side);
    const double all = relaxed[0]+relaxed[1];
    if (all <= 1) {
        // What the first hand leaves of a load is less.
        for (int side = 0; side < 2; side++)
            if (frictionOf(side) > 0)
                slideHand(linker, side, step, side == 0 ? step.stepSize : step.stepSize/(1-relaxed[0]), true, random,
                        count);
        return;
    }
    const int parts = static_cast<int>(min(MOST_SLIDING_PARTS, ceil(all/LARGEST_PART)));
    for (int part = 0; part < parts; part++)
        for (int side = 0; side < 2; side++)
            if (frictionOf(side) > 0)
                slideHand(linker, side, step, step.stepSize/parts, false, random, count);
}

/**
 * A hand slides along its chain at random, without a load. It stays at an end that it tracks, and comes back from
 * others, or lets go there.
 *
 * @param noise  a normal variate
 * @param level  an exponential variate
 */
void LinkerKinetics::slideFreely(const Hand& hand, HandPlace& place, double variance, double noise,
        double level) const {
    const double before = place.position;
    place.position += sqrt(variance)*noise;
    if (contours.isClosed(place.chain))
        return;
    for (int end : {0, 1}) {
        const double at = contours.getEnd(place.chain, end);
        // A Brownian bridge from a to b has been at zero with the probability exp(-2ab/variance).
        if (hand.atEnd.tracks && hand.atEnd.isAt(end) && 2*(at-before)*(at-place.position) < level*variance) {
            place.position = at;
            return;
        }
    }
    if (!hand.holdsAtEnds)
        return;
    const double length = contours.getLength(place.chain), begin = contours.getBegin(place.chain);
    double along = place.position-begin;
    along -= 2*length*floor(along/(2*length));
    place.position = begin+min(length, max(0.0, along > length ? 2*length-along : along));
}

/** What the spring does to a hand that slides for some time. */
LinkerKinetics::Slope LinkerKinetics::slopeAt(const Linker& linker, int side, const KineticStep& step,
        double duration, bool isShort) const {
    const LinkerType& type = system.types[linker.type];
    const HandPlace& place = linker.hands[side];
    const Spring spring = measure(linker, step);
    double tangent[3];
    contours.findTangent(place.chain, place.position, step.positions, step.boxes.segments, tangent);
    const double along = spring.distance > 0 ? spring.force*dot(spring.vector, tangent)/spring.distance : 0;
    const double force = side == 0 ? along : -along, stiffness = type.stiffness*dot(tangent, tangent);
    const double mobility = 1/system.hands[type.hands[side]].slidingFriction;
    const double exponent = stiffness*mobility*duration;
    // A move to 1-share of a coordinate with the variance kT/stiffness has the variance share (2-share) of that.
    const double share = isShort ? min(1.0, exponent) : -expm1(-exponent);
    const double over = mobility*duration*(exponent > 0 ? share/exponent : 1);
    Slope slope = {spring.energy, force*over, system.kT*over*(2-share)};
    // A load beyond an end holds the hand there.
    if (!contours.isClosed(place.chain))
        slope.mean = min(contours.getEnd(place.chain, 1)-place.position,
                max(contours.getBegin(place.chain)-place.position, slope.mean));
    return slope;
}

void LinkerKinetics::slideHand(Linker& linker, int side, const KineticStep& step, double duration,
        bool isShort, RandomNumbers& random, Count& count) const {
    const Hand& hand = system.hands[system.types[linker.type].hands[side]];
    const double noise = drawNormal(random), accepted = random.exponential();
    if (findTrackedEnd(hand, linker.hands[side], contours) >= 0)
        return;
    if (!linker.isHeld(1-side)) {
        slideFreely(hand, linker.hands[side], 2*system.kT*duration/hand.slidingFriction, noise, accepted);
        stayOnChain(linker, side, count);
        return;
    }
    const Slope here = slopeAt(linker, side, step, duration, isShort);
    const double move = here.mean+sqrt(here.variance)*noise;
    Linker moved = linker;
    HandPlace& place = moved.hands[side];
    place.position += move;
    if (!contours.isClosed(place.chain) && !contours.isWithin(place.chain, place.position)) {
        // Beyond an end there is nothing.
        const int end = place.position > contours.getEnd(place.chain, 1) ? 1 : 0;
        if (hand.atEnd.tracks && hand.atEnd.isAt(end))
            linker.hands[side].position = contours.getEnd(place.chain, end);
        else if (!hand.holdsAtEnds)
            unbind(linker, side, nullptr, count);
        return;
    }
    stayOnChain(moved, side, count);
    if (here.variance > 0) {
        const Slope there = slopeAt(moved, side, step, duration, isShort);
        const double back = -move-there.mean;
        const double difference = (there.energy-here.energy)/system.kT+0.5*back*back/there.variance-0.5*noise*noise+
                0.5*log(there.variance/here.variance);
        if (difference > accepted)
            return;
    }
    linker = moved;
}
