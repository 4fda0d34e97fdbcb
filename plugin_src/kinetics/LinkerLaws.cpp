#include "kinetics/LinkerKinetics.h"
#include "mechanics/SymmetricMatrices.h"
#include <algorithm>
#include <cmath>
#include <cstddef>

using namespace cylchain;
using namespace std;

namespace {

/** Exponents of rates are at most this. */
const double LARGEST_EXPONENT = 500;
/** Of lengths along a chain: the share of one. */
const double ROUNDING = 1e-9;
/** Hands do not pass where a load on chains that stand still would stop them: in at most so many parts of a step. */
const double MOST_PARTS = 100;

double boundedExp(double x) {
    return exp(min(x, LARGEST_EXPONENT));
}

} // namespace

bool LinkerKinetics::usesSites(const LinkerType& type) const {
    return (type.hands[0] >= 0 && spacings[type.hands[0]] >= 0) || spacings[type.hands[1]] >= 0;
}

Place LinkerKinetics::placeOf(const Linker& linker, int side) const {
    if (linker.hands[side].isBound())
        return contours.findPlace(linker.hands[side].chain, linker.hands[side].position);
    return system.anchors[linker.anchor];
}

double LinkerKinetics::energyOf(const LinkerType& type, double distance) const {
    const double extension = distance-type.restLength;
    return 0.5*type.stiffness*extension*extension;
}

LinkerKinetics::Spring LinkerKinetics::measure(const Linker& linker, const KineticStep& step) const {
    const LinkerType& type = system.types[linker.type];
    Spring spring;
    double first[3];
    locate(placeOf(linker, 0), step.positions, step.boxes.segments, first);
    locate(placeOf(linker, 1), step.positions, step.boxes.segments, spring.vector);
    for (int k = 0; k < 3; k++)
        spring.vector[k] -= first[k];
    if (step.boxes.distances != nullptr)
        takeToNearestImage(spring.vector, step.boxes.distances);
    spring.distance = sqrt(dot(spring.vector, spring.vector));
    spring.energy = energyOf(type, spring.distance);
    spring.force = type.stiffness*(spring.distance-type.restLength);
    return spring;
}

/** An energy over k_B T. */
double LinkerKinetics::reduced(double energy) const {
    return energy > 0 ? energy/system.kT : 0;
}

/** Whether a hand is so near to an end of its chain with which it has to do. */
bool LinkerKinetics::isAtItsEnd(const Hand& hand, const HandPlace& place) const {
    const double range = hand.atEnd.range;
    return (hand.atEnd.isAt(0) && contours.isNearEnd(place.chain, place.position, 0, range)) ||
            (hand.atEnd.isAt(1) && contours.isNearEnd(place.chain, place.position, 1, range));
}

/** The end at which a hand stays while that grows and shrinks, or -1. */
int LinkerKinetics::findTrackedEnd(const Hand& hand, const HandPlace& place, const Contours& contours) {
    const double rounding = ROUNDING*(1+fabs(place.position));
    for (int end : {0, 1})
        if (hand.atEnd.tracks && hand.atEnd.isAt(end) &&
                contours.isNearEnd(place.chain, place.position, end, rounding))
            return end;
    return -1;
}

double LinkerKinetics::unbindingRate(const Hand& hand, const HandPlace& place, double energy, double force) const {
    const bool isThere = hand.atEnd.unbindingRate >= 0 && isAtItsEnd(hand, place);
    double rate = isThere ? hand.atEnd.unbindingRate : hand.unbindingRate;
    if (hand.unbindingForce > 0)
        rate *= boundedExp(force/hand.unbindingForce);
    else if (hand.strainShare > 0)
        rate *= boundedExp(hand.strainShare*reduced(energy));
    if (hand.catchRate > 0)
        rate += hand.catchRate*(hand.catchForce > 0 ? exp(-force/hand.catchForce) : 1);
    return rate;
}

/** The rate at which a hand of an unbound linker binds anywhere. */
double LinkerKinetics::captureRate(const LinkerType& type, int side, const KineticStep& step) const {
    if (!type.mayBind(side, false))
        return 0;
    const Hand& hand = system.hands[type.hands[side]];
    const double length = sums[type.hands[side]].empty() ? 0 : sums[type.hands[side]].back();
    const double volume = type.volume > 0 ? type.volume : step.volume;
    const double ofHands = 4*M_PI/3*pow(system.hands[type.hands[0]].reach*system.hands[type.hands[1]].reach, 1.5);
    return hand.bindingRate*length*(type.concentration >= 0 ? ofHands*type.concentration : ofHands/volume);
}

/**
 * How hard a bound hand is pulled along its chain, towards the plus end.
 *
 * @param[out] stiffness  how much less that becomes for each length by which it walks
 */
double LinkerKinetics::pull(const Linker& linker, int side, const Spring& spring, const KineticStep& step,
        double& stiffness) const {
    const LinkerType& type = system.types[linker.type];
    const HandPlace& place = linker.hands[side];
    double tangent[3];
    contours.findTangent(place.chain, place.position, step.positions, step.boxes.segments, tangent);
    const double square = dot(tangent, tangent);
    stiffness = type.stiffness*square;
    if (!(spring.distance > 0))
        return 0;
    const double along = dot(spring.vector, tangent)/spring.distance;
    const double across = max(0.0, spring.force/spring.distance)*(square-along*along);
    stiffness = type.stiffness*along*along+across;
    // The force does its work along the contour of segments as long as they are.
    const double pull = spring.force*along/sqrt(max(square, 1e-12));
    return side == 0 ? pull : -pull;
}

/** What the torque of the chain leaves of the speed of a hand without load: one if there is none. */
double LinkerKinetics::driveOf(const Hand& hand, const HandPlace& place, const KineticStep& step) const {
    if (!(hand.helix.stallTorque > 0) || !step.torqueOnHand)
        return 1;
    // As a hand walks, it turns the chain behind it on, and the other way if either is reversed.
    const double sign = (hand.speed > 0) == (hand.helix.pitch > 0) ? 1 : -1;
    return 1-sign*step.torqueOnHand(hand, place)/hand.helix.stallTorque;
}

/** The speed under a pull in the direction of walking, which is that of the unloaded speed if positive. */
double LinkerKinetics::speedUnder(const Hand& hand, double drive, double pull) const {
    const double size = fabs(hand.speed);
    const double ratio = hand.stallForce > 0 ? drive+pull/hand.stallForce : drive;
    return size*min(2.0, max(hand.walksBackward ? -1.0 : 0.0, ratio));
}

/**
 * Hands that are bound walk, those which bind to sites excepted, with the speed under the load at the start. Chains
 * follow in the rest of the step, so that a load stays: walking against a spring that grows would be slower than that.
 */
void LinkerKinetics::walk(Linker& linker, const KineticStep& step, RandomNumbers& random, Count& count) const {
    const LinkerType& type = system.types[linker.type];
    double rate = 0;
    int walking = 0;
    for (int side = 0; side < 2; side++)
        if (walksNow(linker, side)) {
            const Hand& hand = system.hands[type.hands[side]];
            if (hand.stallForce > 0) {
                rate = max(rate, type.stiffness*fabs(hand.speed)/hand.stallForce);
                walking++;
            }
        }
    const double needed = linker.pulls() ? ceil(walking*rate*step.stepSize) : 1;
    const int parts = static_cast<int>(min(MOST_PARTS, max(1.0, needed)));
    for (int part = 0; part < parts; part++)
        walkPart(linker, step, step.stepSize/parts, random, count);
}

/** Whether a hand walks that is bound to no site, and held by no barrier. */
bool LinkerKinetics::walksNow(const Linker& linker, int side) const {
    if (!linker.hands[side].isBound())
        return false;
    const Hand& hand = system.hands[system.types[linker.type].hands[side]];
    return hand.speed != 0 && hand.siteSpacing == 0 && heldBy(hand, linker.hands[side]) == nullptr;
}

void LinkerKinetics::walkPart(Linker& linker, const KineticStep& step, double duration, RandomNumbers& random,
        Count& count) const {
    const LinkerType& type = system.types[linker.type];
    double moves[2] = {0, 0};
    const bool walks[] = {walksNow(linker, 0), walksNow(linker, 1)};
    const int walking = walks[0]+walks[1];
    if (walking == 0)
        return;
    const bool pulls = linker.pulls();
    const Spring spring = pulls ? measure(linker, step) : Spring();
    for (int side = 0; side < 2; side++) {
        if (!walks[side])
            continue;
        const Hand& hand = system.hands[type.hands[side]];
        const double direction = hand.speed > 0 ? 1 : -1;
        double stiffness = 0;
        const double along = pulls ? direction*pull(linker, side, spring, step, stiffness) : 0;
        const double drive = driveOf(hand, linker.hands[side], step);
        double move = speedUnder(hand, drive, along)*duration;
        // However long it is, it ends where the spring stops it.
        if (pulls && hand.stallForce > 0 && stiffness > 0) {
            const double toStall = (along+hand.stallForce*drive)/(stiffness*walking);
            move = move > 0 ? min(move, max(0.0, toStall)) : max(move, min(0.0, toStall));
        }
        moves[side] = direction*move;
    }
    for (int side = 0; side < 2; side++)
        // The first one may have taken the second one off.
        if (moves[side] != 0 && linker.hands[side].isBound()) {
            if (isCaptured(system.hands[type.hands[side]], linker.hands[side], moves[side], random))
                continue;
            linker.hands[side].position += moves[side];
            // One that has passed a barrier may be at its very place.
            if (heldBy(system.hands[type.hands[side]], linker.hands[side]) != nullptr)
                letGo(system.hands[type.hands[side]], linker.hands[side]);
            stayOnChain(linker, side, count);
        }
}

/** A hand that has walked beyond an end stays there, or lets go. */
void LinkerKinetics::stayOnChain(Linker& linker, int side, Count& count) const {
    HandPlace& place = linker.hands[side];
    const double length = contours.getLength(place.chain);
    if (contours.isClosed(place.chain)) {
        const double rounds = floor(place.position/length);
        // Written so that NaN fails, too.
        if (!(fabs(rounds) <= MOST_EVENTS))
            count.failed = linker.number;
        else
            place.position = max(0.0, place.position-length*rounds);
        return;
    }
    if (contours.isWithin(place.chain, place.position))
        return;
    if (staysBeyond(system.hands[system.types[linker.type].hands[side]], place))
        place.position = min(contours.getEnd(place.chain, 1), max(contours.getBegin(place.chain), place.position));
    else
        unbind(linker, side, nullptr, count);
}

/** Whether a hand that would move to a place beyond an end stays on the chain. */
bool LinkerKinetics::staysBeyond(const Hand& hand, const HandPlace& place) const {
    return hand.holdsAtEnds || (hand.atEnd.tracks &&
            hand.atEnd.isAt(place.position > contours.getEnd(place.chain, 1) ? 1 : 0));
}

uint64_t LinkerKinetics::siteOf(const Hand& hand, const HandPlace& place) const {
    const uint64_t spacing = spacings[&hand-system.hands.data()];
    return (static_cast<uint64_t>(place.chain)<<36)^(spacing<<32)^
            static_cast<uint32_t>(static_cast<int64_t>(floor(place.position/hand.siteSpacing)));
}

/** Whether a chain has a site of a number: all of it. */
bool LinkerKinetics::hasSite(const Hand& hand, int chain, double site) const {
    // A length that is a whole number of spacings has as many sites, however it was rounded.
    const double begin = contours.getBegin(chain), end = contours.getEnd(chain, 1);
    return site >= ceil(begin/hand.siteSpacing-1e-9) && site < floor(end/hand.siteSpacing+1e-9);
}

/** Take a place to the middle of the site where it is; false if it is on none, at the plus end of a chain. */
bool LinkerKinetics::toSite(const Hand& hand, HandPlace& place) const {
    const double site = floor(place.position/hand.siteSpacing);
    place.position = (site+0.5)*hand.siteSpacing;
    return hasSite(hand, place.chain, site);
}

/** Bring a hand to the end of its chain; false if it is not near to it. */
bool LinkerKinetics::toEnd(const Hand& hand, HandPlace& place) const {
    if (!isAtItsEnd(hand, place))
        return false;
    const double begin = contours.getBegin(place.chain), middle = begin+0.5*contours.getLength(place.chain);
    const int either = place.position > middle ? 1 : 0;
    place.position = contours.getEnd(place.chain, hand.atEnd.end == 2 ? either : hand.atEnd.end);
    return true;
}

void LinkerKinetics::bind(Linker& linker, int side, const HandPlace& place, Sites* sites, Count& count) const {
    const LinkerType& type = system.types[linker.type];
    HandPlace places[] = {place, place};
    if (type.loadsPairs() && !findPartner(type, place, sites, places[1]))
        return;
    for (int own = 0; own < 2; own++) {
        if (own != side && !type.loadsPairs())
            continue;
        const Hand& hand = system.hands[type.hands[own]];
        linker.hands[own] = places[own];
        if (hand.siteSpacing > 0 && sites != nullptr)
            sites->insert(siteOf(hand, places[own]));
        count.events[linker.type].bindings++;
    }
}

void LinkerKinetics::unbind(Linker& linker, int side, Sites* sites, Count& count) const {
    const LinkerType& type = system.types[linker.type];
    for (int own = 0; own < 2; own++) {
        if (!linker.hands[own].isBound() || (own != side && !type.loadsPairs()))
            continue;
        const Hand& hand = system.hands[type.hands[own]];
        if (hand.siteSpacing > 0 && sites != nullptr)
            sites->erase(siteOf(hand, linker.hands[own]));
        linker.hands[own] = HandPlace();
        count.events[linker.type].unbindings++;
    }
}

/** The rate of proposals for each piece around. */
double LinkerKinetics::proposalRate(const Hand& hand) const {
    return hand.bindingRate*cells.getLongest();
}

/** Look around what a side of a linker holds. What is around an anchor is written to the last argument. */
const SegmentCells::Around& LinkerKinetics::lookAround(const Linker& linker, int side, const KineticStep& step,
        SegmentCells::Around& ofAnchor) const {
    const HandPlace& hand = linker.hands[side];
    if (!hand.isBound()) {
        double place[3];
        locate(placeOf(linker, side), step.positions, step.boxes.segments, place);
        ofAnchor = cells.lookAround(place);
        return ofAnchor;
    }
    const int segment = contours.findSegment(hand.chain, hand.position);
    return cells.lookAround(cells.findPiece(contours, segment, hand.position-contours.getStart(segment)));
}

/** Find the place of a hand on a piece, at a share of the longest one; false if there is none, or none that is free. */
bool LinkerKinetics::toProposed(int number, const SegmentPiece& piece, double where, const Sites* sites,
        HandPlace& found) const {
    const Hand& hand = system.hands[number];
    const double along = where*cells.getLongest();
    found.chain = contours.getChain(piece.segment);
    found.position = contours.getStart(piece.segment)+piece.start+along;
    if (along > piece.length || binds[number][found.chain] == 0)
        return false;
    if (hand.siteSpacing > 0 && (!toSite(hand, found) || sites->count(siteOf(hand, found)) > 0))
        return false;
    if (hand.bindingRange.end >= 0 && !isInRange(hand, found))
        return false;
    return !hand.atEnd.bindsThere || toEnd(hand, found);
}

/** Find the vector from a point to a place, or to its nearest image. */
void LinkerKinetics::vectorTo(const HandPlace& place, const double* from, const KineticStep& step,
        double* vector) const {
    locate(contours.findPlace(place.chain, place.position), step.positions, step.boxes.segments, vector);
    for (int k = 0; k < 3; k++)
        vector[k] -= from[k];
    if (step.boxes.distances != nullptr)
        takeToNearestImage(vector, step.boxes.distances);
}

/** Propose a place where a hand could bind; true if it binds there. */
bool LinkerKinetics::proposePlace(const Linker& linker, int side, const KineticStep& step, RandomNumbers& random,
        const Sites* sites, HandPlace& found) const {
    const LinkerType& type = system.types[linker.type];
    const int number = type.hands[side];
    const Hand& hand = system.hands[number];
    const double which = random.uniform(), where = random.uniform(), accepted = random.uniform();
    SegmentCells::Around ofAnchor;
    const SegmentCells::Around& around = lookAround(linker, 1-side, step, ofAnchor);
    if (around.numPieces == 0)
        return false;
    const int chosen = min(around.numPieces-1, static_cast<int>(which*around.numPieces));
    if (!toProposed(number, cells.getAround(around, chosen), where, sites, found) ||
            (!type.sameChain && linker.hands[1-side].chain == found.chain))
        return false;
    double from[3], vector[3];
    locate(placeOf(linker, 1-side), step.positions, step.boxes.segments, from);
    vectorTo(found, from, step, vector);
    const double distance = sqrt(dot(vector, vector));
    return distance <= hand.reach &&
            accepted < exp(-(1-hand.strainShare)*reduced(energyOf(type, distance))) &&
            (!type.hasAngles() || isAligned(linker.hands[1-side], found, type, step));
}

/** Find a place anywhere on its chains for a hand of an unbound linker; false if that is taken. */
bool LinkerKinetics::captureAnywhere(const Linker& linker, int side, RandomNumbers& random, const Sites* sites,
        HandPlace& found) const {
    const int number = system.types[linker.type].hands[side];
    const Hand& hand = system.hands[number];
    const vector<double>& sum = sums[number];
    const double along = random.uniform()*sum.back();
    const size_t index = min<size_t>(sum.size()-1, upper_bound(sum.begin(), sum.end(), along)-sum.begin());
    found.chain = hand.chains[index];
    found.position = contours.getBegin(found.chain)+min(contours.getLength(found.chain),
            along-(index == 0 ? 0 : sum[index-1]));
    if (hand.siteSpacing > 0 && (!toSite(hand, found) || sites->count(siteOf(hand, found)) > 0))
        return false;
    if (hand.bindingRange.end >= 0 && !isInRange(hand, found))
        return false;
    return !hand.atEnd.bindsThere || toEnd(hand, found);
}

/** A hand on a site walks to the next one, if that is not taken. */
void LinkerKinetics::hop(Linker& linker, int side, int direction, RandomNumbers& random, Sites* sites,
        Count& count) const {
    const Hand& hand = system.hands[system.types[linker.type].hands[side]];
    HandPlace next = linker.hands[side];
    double site = floor(next.position/hand.siteSpacing)+direction;
    if (contours.isClosed(next.chain)) {
        const double number = floor(contours.getLength(next.chain)/hand.siteSpacing+1e-9);
        site -= number*floor(site/number);
    }
    if (!hasSite(hand, next.chain, site)) {
        if (!hand.holdsAtEnds)
            unbind(linker, side, sites, count);
        return;
    }
    next.position = (site+0.5)*hand.siteSpacing;
    if (sites->count(siteOf(hand, next)) > 0)
        return;
    sites->erase(siteOf(hand, linker.hands[side]));
    sites->insert(siteOf(hand, next));
    if ((direction > 0) == (hand.speed > 0))
        isCapturedAtSite(hand, next, random);
    linker.hands[side] = next;
}
