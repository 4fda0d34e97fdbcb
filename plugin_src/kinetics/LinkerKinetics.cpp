#include "kinetics/LinkerKinetics.h"
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <functional>
#include <queue>

using namespace cylchain;
using namespace std;

namespace {

/** Linkers that a thread looks at together. */
const int CHUNK = 256;
/** After so many events in a step, something is wrong with rates. */
const int MOST_EVENTS = 100000;
/** Exponents of rates are at most this. */
const double LARGEST_EXPONENT = 500;
/** The random numbers of when linkers come out of a concentration belong to this, less the number of the type. */
const uint32_t NEW_LINKERS = 0xffffffff;

double boundedExp(double x) {
    return exp(min(x, LARGEST_EXPONENT));
}

double dot(const double* a, const double* b) {
    return a[0]*b[0]+a[1]*b[1]+a[2]*b[2];
}

} // namespace

LinkerKinetics::LinkerKinetics(const LinkerSystem& ofSystem, const vector<Chain>& chains) : system(ofSystem),
        contours(chains) {
    vector<double> different;
    double largestSpacing = 0;
    for (const Hand& hand : system.hands) {
        vector<char> own(chains.size(), 0);
        vector<double> sum;
        double total = 0;
        for (int chain : hand.chains) {
            own[chain] = 1;
            total += contours.getLength(chain);
            sum.push_back(total);
        }
        binds.push_back(own);
        sums.push_back(sum);
        int spacing = -1;
        if (hand.siteSpacing > 0) {
            spacing = find(different.begin(), different.end(), hand.siteSpacing)-different.begin();
            if (spacing == static_cast<int>(different.size()))
                different.push_back(hand.siteSpacing);
            anySites = true;
        }
        spacings.push_back(spacing);
        largestReach = max(largestReach, hand.reach);
        largestSpacing = max(largestSpacing, hand.siteSpacing);
    }
    for (const LinkerType& type : system.types) {
        needsSites.push_back(usesSites(type));
        anyConcentration = anyConcentration || type.concentration >= 0;
        bool any = false;
        for (int hand : type.hands)
            any = any || (hand >= 0 && system.hands[hand].speed != 0);
        walks.push_back(any);
    }
    // A place that is proposed may go to the middle of its site, on another segment.
    largestReach += largestSpacing;
}

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

double LinkerKinetics::unbindingRate(const Hand& hand, double energy, double force) const {
    double rate = hand.unbindingRate;
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
    const int segment = contours.findSegment(place.chain, place.position);
    double tangent[3];
    for (int k = 0; k < 3; k++)
        tangent[k] = step.positions[3*contours.getSecond(segment)+k]-step.positions[3*contours.getFirst(segment)+k];
    if (step.boxes.segments != nullptr)
        takeToNearestImage(tangent, step.boxes.segments);
    // How far it gets for each length of the segment at rest.
    for (double& component : tangent)
        component /= contours.getSegmentLength(segment);
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

/** The speed under a pull in the direction of walking, which is that of the unloaded speed if positive. */
double LinkerKinetics::speedUnder(const Hand& hand, double pull) const {
    const double size = fabs(hand.speed);
    const double ratio = hand.stallForce > 0 ? 1+pull/hand.stallForce : 1;
    return size*min(2.0, max(hand.walksBackward ? -1.0 : 0.0, ratio));
}

/** Hands that are bound walk, those which bind to sites excepted. */
void LinkerKinetics::walk(Linker& linker, const KineticStep& step, Count& count) const {
    if (!walks[linker.type])
        return;
    const LinkerType& type = system.types[linker.type];
    double moves[2] = {0, 0};
    int walking = 0;
    for (int side = 0; side < 2; side++)
        if (linker.hands[side].isBound()) {
            const Hand& hand = system.hands[type.hands[side]];
            walking += hand.speed != 0 && hand.siteSpacing == 0;
        }
    if (walking == 0)
        return;
    const bool pulls = linker.pulls();
    const Spring spring = pulls ? measure(linker, step) : Spring();
    for (int side = 0; side < 2; side++) {
        if (!linker.hands[side].isBound())
            continue;
        const Hand& hand = system.hands[type.hands[side]];
        if (hand.speed == 0 || hand.siteSpacing > 0)
            continue;
        const double direction = hand.speed > 0 ? 1 : -1;
        double stiffness = 0;
        const double along = pulls ? direction*pull(linker, side, spring, step, stiffness) : 0;
        double move = speedUnder(hand, along)*step.stepSize;
        // However long the step is, it ends where the spring stops it.
        if (pulls && hand.stallForce > 0 && stiffness > 0) {
            const double toStall = (along+hand.stallForce)/(stiffness*walking);
            move = move > 0 ? min(move, max(0.0, toStall)) : max(move, min(0.0, toStall));
        }
        moves[side] = direction*move;
    }
    for (int side = 0; side < 2; side++) {
        if (moves[side] == 0)
            continue;
        HandPlace& place = linker.hands[side];
        const double length = contours.getLength(place.chain);
        place.position += moves[side];
        if (contours.isClosed(place.chain)) {
            place.position -= length*floor(place.position/length);
            continue;
        }
        if (place.position >= 0 && place.position <= length)
            continue;
        if (system.hands[type.hands[side]].holdsAtEnds)
            place.position = min(length, max(0.0, place.position));
        else
            unbind(linker, side, nullptr, count);
    }
}

uint64_t LinkerKinetics::siteOf(const Hand& hand, const HandPlace& place) const {
    const uint64_t spacing = spacings[&hand-system.hands.data()];
    return (static_cast<uint64_t>(place.chain)<<36)^(spacing<<32)^
            static_cast<uint64_t>(place.position/hand.siteSpacing);
}

/** How many sites a chain has. */
double LinkerKinetics::countSites(const Hand& hand, int chain) const {
    // A length that is a whole number of spacings has as many sites, however it was rounded.
    return floor(contours.getLength(chain)/hand.siteSpacing+1e-9);
}

/** Take a place to the middle of the site where it is; false if it is on none, at the plus end of a chain. */
bool LinkerKinetics::toSite(const Hand& hand, HandPlace& place) const {
    const double site = floor(place.position/hand.siteSpacing);
    place.position = (site+0.5)*hand.siteSpacing;
    return site >= 0 && site < countSites(hand, place.chain);
}

void LinkerKinetics::bind(Linker& linker, int side, const HandPlace& place, Sites* sites, Count& count) const {
    const Hand& hand = system.hands[system.types[linker.type].hands[side]];
    linker.hands[side] = place;
    if (hand.siteSpacing > 0 && sites != nullptr)
        sites->insert(siteOf(hand, place));
    count.bindings++;
}

void LinkerKinetics::unbind(Linker& linker, int side, Sites* sites, Count& count) const {
    const Hand& hand = system.hands[system.types[linker.type].hands[side]];
    if (hand.siteSpacing > 0 && sites != nullptr)
        sites->erase(siteOf(hand, linker.hands[side]));
    linker.hands[side] = HandPlace();
    count.unbindings++;
}

/** The rate of proposals where there is most around: it needs no look at where a linker is. */
double LinkerKinetics::proposalRate(const Hand& hand) const {
    return hand.bindingRate*cells.getLargestNumber()*cells.getLongest();
}

/** Propose a place where a hand could bind; true if it binds there. */
bool LinkerKinetics::proposePlace(const Linker& linker, int side, const KineticStep& step, RandomNumbers& random,
        const Sites* sites, HandPlace& found) const {
    const LinkerType& type = system.types[linker.type];
    const int number = type.hands[side];
    const Hand& hand = system.hands[number];
    const double which = random.uniform(), where = random.uniform(), accepted = random.uniform();
    double from[3];
    locate(placeOf(linker, 1-side), step.positions, step.boxes.segments, from);
    const int cell = cells.findCell(from), chosen = static_cast<int>(which*cells.getLargestNumber());
    if (chosen >= cells.countAround(cell))
        return false;
    const SegmentPiece& piece = cells.getAround(cell, chosen);
    const double along = where*cells.getLongest();
    found.chain = contours.getChain(piece.segment);
    found.position = contours.getStart(piece.segment)+piece.start+along;
    if (along > piece.length || binds[number][found.chain] == 0 ||
            (!type.sameChain && linker.hands[1-side].chain == found.chain))
        return false;
    if (hand.siteSpacing > 0 && (!toSite(hand, found) || sites->count(siteOf(hand, found)) > 0))
        return false;
    double vector[3];
    locate(contours.findPlace(found.chain, found.position), step.positions, step.boxes.segments, vector);
    for (int k = 0; k < 3; k++)
        vector[k] -= from[k];
    if (step.boxes.distances != nullptr)
        takeToNearestImage(vector, step.boxes.distances);
    const double distance = sqrt(dot(vector, vector));
    return distance <= hand.reach &&
            accepted < exp(-(1-hand.strainShare)*reduced(energyOf(type, distance)));
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
    found.position = min(contours.getLength(found.chain), along-(index == 0 ? 0 : sum[index-1]));
    return hand.siteSpacing == 0 || (toSite(hand, found) && sites->count(siteOf(hand, found)) == 0);
}

/** A hand on a site walks to the next one, if that is not taken. */
void LinkerKinetics::hop(Linker& linker, int side, int direction, Sites* sites, Count& count) const {
    const Hand& hand = system.hands[system.types[linker.type].hands[side]];
    HandPlace next = linker.hands[side];
    const double number = countSites(hand, next.chain);
    double site = floor(next.position/hand.siteSpacing)+direction;
    if (contours.isClosed(next.chain))
        site -= number*floor(site/number);
    if (site < 0 || site >= number) {
        if (!hand.holdsAtEnds)
            unbind(linker, side, sites, count);
        return;
    }
    next.position = (site+0.5)*hand.siteSpacing;
    if (sites->count(siteOf(hand, next)) > 0)
        return;
    sites->erase(siteOf(hand, linker.hands[side]));
    sites->insert(siteOf(hand, next));
    linker.hands[side] = next;
}

/** What may happen to a linker. */
struct LinkerKinetics::Event {
    enum Kind {Capture, Unbind, Propose, Hop};
    Kind kind;
    int side, direction;
    double rate;
};

/** The next event of a linker, or of those that come out of a concentration. */
struct LinkerKinetics::Pending {
    double time;
    RandomNumbers random;
    /** The number of the linker among all, or -1 for those of a type that come out of its concentration. */
    long long index;
    int type;
    Event event;
    int events;
    bool operator>(const Pending& other) const {
        return time > other.time;
    }
};

/** Draw the next event of a linker that is part of a step; false if the step ends before. */
bool LinkerKinetics::draw(Linker& linker, const KineticStep& step, Pending& next) const {
    const LinkerType& type = system.types[linker.type];
    Event possible[4];
    int numPossible = 0;
    double total = 0;
    auto add = [&] (Event::Kind kind, int side, int direction, double rate) {
        if (rate > 0) {
            possible[numPossible++] = {kind, side, direction, rate};
            total += rate;
        }
    };
    const bool pulls = linker.pulls();
    const Spring spring = pulls ? measure(linker, step) : Spring();
    for (int side = 0; side < 2; side++) {
        const int number = type.hands[side];
        if (number < 0)
            continue;
        const Hand& hand = system.hands[number];
        if (linker.hands[side].isBound()) {
            add(Event::Unbind, side, 0, unbindingRate(hand, spring.energy, fabs(spring.force)));
            if (hand.siteSpacing > 0 && hand.speed != 0) {
                const int direction = hand.speed > 0 ? 1 : -1;
                double stiffness;
                const double along = pulls ? direction*pull(linker, side, spring, step, stiffness) : 0;
                const double speed = speedUnder(hand, along);
                add(Event::Hop, side, speed > 0 ? direction : -direction, fabs(speed)/hand.siteSpacing);
            }
        }
        else if (linker.isHeld(1-side))
            add(Event::Propose, side, 0, proposalRate(hand));
        else if (type.concentration < 0)
            add(Event::Capture, side, 0, captureRate(type, side, step));
    }
    if (total <= 0)
        return false;
    if (!(linker.clock > 0))
        linker.clock = next.random.exponential();
    const double left = total*(step.stepSize-next.time);
    if (!(linker.clock < left)) {
        linker.clock -= left;
        return false;
    }
    next.time += linker.clock/total;
    linker.clock = 0;
    double chosen = next.random.uniform()*total;
    int which = 0;
    while (which+1 < numPossible && chosen >= possible[which].rate)
        chosen -= possible[which++].rate;
    next.event = possible[which];
    next.events++;
    return true;
}

/** Let the event that was drawn happen, unless it is a proposal that comes to nothing. */
void LinkerKinetics::apply(Linker& linker, const KineticStep& step, Pending& next, Sites* sites, Count& count) const {
    const int side = next.event.side;
    HandPlace place;
    switch (next.event.kind) {
    case Event::Unbind:
        unbind(linker, side, sites, count);
        break;
    case Event::Hop:
        hop(linker, side, next.event.direction, sites, count);
        break;
    case Event::Capture:
        if (captureAnywhere(linker, side, next.random, sites, place))
            bind(linker, side, place, sites, count);
        break;
    case Event::Propose:
        if (proposePlace(linker, side, step, next.random, sites, place))
            bind(linker, side, place, sites, count);
        break;
    }
}

/**
 * The events of all linkers that need sites, and of those that come out of a concentration, in the order of time: what
 * is proposed to a hand does not depend on others, but whether a site is free does.
 */
void LinkerKinetics::takeTogether(LinkerState& state, const KineticStep& step, Count& count) {
    vector<Linker>& linkers = state.linkers;
    const NoiseKey key = {step.seed, 0, state.steps};
    Sites sites;
    priority_queue<Pending, vector<Pending>, greater<Pending> > queue;
    auto add = [&] (size_t i, double time) {
        Pending next = {time, RandomNumbers(key, step.force, linkers[i].number), static_cast<long long>(i),
                linkers[i].type, {}, 0};
        if (draw(linkers[i], step, next))
            queue.push(next);
    };
    auto addSource = [&] (Pending next) {
        const LinkerType& type = system.types[next.type];
        const double first = captureRate(type, 0, step), total = first+captureRate(type, 1, step);
        next.time += next.random.exponential()/total;
        next.event.side = next.random.uniform()*total < first ? 0 : 1;
        next.events++;
        if (total > 0 && next.time < step.stepSize)
            queue.push(next);
    };
    for (size_t i = 0; i < linkers.size() && anySites; i++) {
        const LinkerType& type = system.types[linkers[i].type];
        if (!needsSites[linkers[i].type])
            continue;
        for (int side = 0; side < 2; side++)
            if (linkers[i].hands[side].isBound() && spacings[type.hands[side]] >= 0)
                sites.insert(siteOf(system.hands[type.hands[side]], linkers[i].hands[side]));
    }
    for (size_t i = 0; i < linkers.size() && anySites; i++)
        if (needsSites[linkers[i].type] && !passes(linkers[i], step.stepSize))
            add(i, 0);
    for (size_t type = 0; type < system.types.size(); type++)
        if (system.types[type].concentration >= 0)
            addSource({0, RandomNumbers(key, step.force, NEW_LINKERS-type), -1, static_cast<int>(type), {}, 0});
    while (!queue.empty()) {
        Pending next = queue.top();
        queue.pop();
        if (next.events > MOST_EVENTS) {
            count.failed = next.index >= 0 ? linkers[next.index].number : state.nextNumber;
            return;
        }
        if (next.index >= 0) {
            apply(linkers[next.index], step, next, &sites, count);
            if (draw(linkers[next.index], step, next))
                queue.push(next);
            continue;
        }
        Linker linker;
        linker.type = next.type;
        HandPlace place;
        if (captureAnywhere(linker, next.event.side, next.random, &sites, place)) {
            linker.number = state.nextNumber++;
            bind(linker, next.event.side, place, &sites, count);
            linkers.push_back(linker);
            add(linkers.size()-1, next.time);
        }
        addSource(next);
    }
}

/** The rates of most linkers need no look at where they are: they depend on their type and what they hold. */
void LinkerKinetics::findKnownRates(const KineticStep& step) {
    knownRates.assign(4*system.types.size(), -1.0);
    for (size_t number = 0; number < system.types.size(); number++) {
        const LinkerType& type = system.types[number];
        for (int held = 0; held < 4; held++) {
            // An anchor always holds its side.
            if (type.hands[0] < 0 && (held&1) == 0)
                continue;
            double rate = 0;
            bool known = true;
            for (int side = 0; side < 2; side++) {
                if (type.hands[side] < 0)
                    continue;
                const Hand& hand = system.hands[type.hands[side]];
                const bool hops = hand.siteSpacing > 0 && hand.speed != 0;
                if ((held&(1<<side)) != 0) {
                    rate += unbindingRate(hand, 0, 0)+(hops ? fabs(hand.speed)/hand.siteSpacing : 0);
                    known = known && (held != 3 || !(hand.isLoaded() || hops));
                }
                else if (held != 0)
                    rate += proposalRate(hand);
                else if (type.concentration < 0)
                    rate += captureRate(type, side, step);
            }
            if (known)
                knownRates[4*number+held] = rate;
        }
    }
}

/** Whether it is known that a step passes without an event: then the clock of the linker is taken down. */
bool LinkerKinetics::passes(Linker& linker, double stepSize) const {
    const int held = (linker.isHeld(0) ? 1 : 0)+(linker.isHeld(1) ? 2 : 0);
    const double spent = knownRates[4*linker.type+held]*stepSize;
    if (spent < 0 || (spent > 0 && !(linker.clock > spent)))
        return false;
    linker.clock -= spent;
    return true;
}

long long LinkerKinetics::advance(LinkerState& state, const KineticStep& step, const Loop& loop, vector<Link>* links) {
    vector<Linker>& linkers = state.linkers;
    cells.build(contours, step.positions, largestReach, step.boxes.distances, step.boxes.segments);
    const NoiseKey key = {step.seed, 0, state.steps};
    const int count = linkers.size(), chunks = (count+CHUNK-1)/CHUNK;
    counts.assign(chunks+1, Count());
    pulling.resize(chunks);
    findKnownRates(step);
    loop(chunks, [&] (int chunk) {
        const int first = chunk*CHUNK, last = min(count, first+CHUNK);
        pulling[chunk].clear();
        for (int i = first; i < last; i++) {
            Linker& linker = linkers[i];
            walk(linker, step, counts[chunk]);
            if (!needsSites[linker.type] && !passes(linker, step.stepSize)) {
                Pending next = {0, RandomNumbers(key, step.force, linker.number), i, linker.type, {}, 0};
                while (next.events <= MOST_EVENTS && draw(linker, step, next))
                    apply(linker, step, next, nullptr, counts[chunk]);
                if (next.events > MOST_EVENTS)
                    counts[chunk].failed = linker.number;
            }
            if (linker.pulls())
                pulling[chunk].push_back(i);
        }
    });
    takeTogether(state, step, counts[chunks]);

    // Those that have gone back to a concentration are no more.

    if (anyConcentration)
        linkers.erase(remove_if(linkers.begin(), linkers.end(), [&] (const Linker& linker) {
            return system.types[linker.type].concentration >= 0 && !linker.isHeld(0) && !linker.isHeld(1);
        }), linkers.end());
    state.steps++;
    if (links != nullptr && (anySites || anyConcentration))
        describe(state, *links);
    else if (links != nullptr) {
        links->clear();
        for (const vector<int>& own : pulling)
            for (int i : own)
                addLink(linkers[i], *links);
    }
    long long failed = -1;
    for (const Count& one : counts) {
        state.bindings += one.bindings;
        state.unbindings += one.unbindings;
        if (failed == -1)
            failed = one.failed;
    }
    return failed;
}

void LinkerKinetics::addLink(const Linker& linker, vector<Link>& links) const {
    const LinkerType& type = system.types[linker.type];
    Link link;
    // A link to a point has that as its second place.
    link.first = placeOf(linker, 1);
    link.second = placeOf(linker, 0);
    link.stiffness = type.stiffness;
    link.restLength = type.restLength;
    link.number = linker.number;
    links.push_back(link);
}

void LinkerKinetics::describe(const LinkerState& state, vector<Link>& links) const {
    links.clear();
    for (const Linker& linker : state.linkers)
        if (linker.pulls())
            addLink(linker, links);
}
