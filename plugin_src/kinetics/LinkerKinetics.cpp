#include "kinetics/LinkerKinetics.h"
#include "mechanics/Prefetch.h"
#include <algorithm>
#include <atomic>
#include <cmath>
#include <cstddef>
#include <functional>
#include <queue>

using namespace cylchain;
using namespace std;

namespace {

/** Of linkers of a type that come out of their concentration in a step. */
const int MOST_NEW_LINKERS = 10000000;
/** The random numbers of when linkers come out of a concentration belong to this, less the number of the type. */
const uint32_t NEW_LINKERS = 0xffffffff;

uint64_t drawNumber() {
    static atomic<uint64_t> last(0);
    return ++last;
}

} // namespace

LinkerKinetics::LinkerKinetics(const LinkerSystem& ofSystem, const ChainList& chains) : system(ofSystem),
        contours(chains), ownNumber(drawNumber()) {
    vector<double> different;
    double largestShift = 0;
    for (const Hand& hand : system.hands) {
        vector<char> own(contours.getNumChains(), 0);
        for (int chain : hand.chains)
            own[chain] = 1;
        binds.push_back(own);
        int spacing = -1;
        if (hand.siteSpacing > 0) {
            spacing = find(different.begin(), different.end(), hand.siteSpacing)-different.begin();
            if (spacing == static_cast<int>(different.size()))
                different.push_back(hand.siteSpacing);
            anySites = true;
        }
        spacings.push_back(spacing);
        largestReach = max(largestReach, hand.reach);
        largestShift = max(largestShift, max(hand.siteSpacing, hand.atEnd.bindsThere ? hand.atEnd.range : 0));
    }
    for (const LinkerType& type : system.types) {
        anyConcentration = anyConcentration || type.concentration >= 0;
        anyAnchors = anyAnchors || type.hands[0] < 0;
        // Of pairs, none looks for places around the other hand.
        if (type.loadsPairs() && !type.diffuses())
            continue;
        for (int hand : type.hands)
            anyBinding = anyBinding || (hand >= 0 && system.hands[hand].bindingRate > 0);
    }
    sort(system.barriers.begin(), system.barriers.end(), [] (const Barrier& a, const Barrier& b) {
        return a.chain != b.chain ? a.chain < b.chain : a.position < b.position;
    });
    // A place that is proposed may go to the middle of its site, or to the end, on another segment.
    largestReach += largestShift;
    anyDiffuses = system.anyDiffuses();
    sumLengths();
}

/** Find the sums of the lengths of the chains to which hands bind. */
void LinkerKinetics::sumLengths() {
    sums.clear();
    for (const Hand& hand : system.hands) {
        vector<double> sum;
        double total = 0;
        for (int chain : hand.chains) {
            total += contours.getLength(chain);
            sum.push_back(total);
        }
        sums.push_back(sum);
    }
}

bool LinkerKinetics::setChains(const ChainList& chains, const vector<ChainCut>& cuts, LinkerState& state,
        const KineticStep& step) {
    const Contours before = move(contours);
    contours = Contours(chains);
    sumLengths();
    cells.forgetSegments();
    known = nullptr;
    state.events.resize(system.types.size());
    Count count = {vector<LinkerEvents>(system.types.size()), -1};
    bool any = false;
    vector<char> isCut(contours.getNumChains(), 0);
    for (const ChainCut& cut : cuts)
        isCut[cut.chain] = 1;
    if (anyDiffuses)
        state.positions.resize(3*state.linkers.size(), NO_POSITION);
    for (size_t i = 0; i < state.linkers.size(); i++) {
        Linker& linker = state.linkers[i];
        const HandPlace held[] = {linker.hands[0], linker.hands[1]};
        for (int side = 0; side < 2; side++) {
            HandPlace& place = linker.hands[side];
            const HandPlace& old = held[side];
            if (!old.isBound() || contours.isClosed(old.chain))
                continue;
            const int tracked = findTrackedEnd(system.hands[system.types[linker.type].hands[side]], place, before);
            HandPlace followed = place;
            if (isCut[old.chain] != 0)
                for (const ChainCut& cut : cuts)
                    followCut(cut, followed);
            // What was bound to a part that is gone unbinds as others do: it is counted, and its place is forgotten.
            if (!followed.isBound() || contours.getLength(followed.chain) == 0)
                unbind(linker, side, nullptr, count);
            else {
                place = followed;
                if (tracked >= 0)
                    place.position = contours.getEnd(place.chain, tracked);
                else
                    stayOnChain(linker, side, count);
            }
            any = any || place.chain != old.chain || place.position != old.position;
        }
        releaseFromEnd(state, i, held, before, step);
    }
    for (size_t type = 0; type < system.types.size(); type++)
        state.events[type].unbindings += count.events[type].unbindings;
    return any;
}

/** What may happen to a linker. */
struct LinkerKinetics::Event {
    enum Kind {Capture, Unbind, Propose, Hop, LetGo};
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
bool LinkerKinetics::draw(LinkerState& state, const KineticStep& step, Pending& next) const {
    const Linker& linker = state.linkers[next.index];
    double& clock = state.clocks[next.index];
    const LinkerType& type = system.types[linker.type];
    Event possible[4] = {};
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
    const bool staysByAngle = pulls && type.reversible && type.hasAngles() &&
            !isAligned(linker.hands[0], linker.hands[1], type, step);
    for (int side = 0; side < 2; side++) {
        const int number = type.hands[side];
        if (number < 0)
            continue;
        const Hand& hand = system.hands[number];
        if (linker.hands[side].isBound()) {
            if (!pulls || (!type.mustStay(side) && !staysByAngle))
                add(Event::Unbind, side, 0, unbindingRate(hand, linker.hands[side], spring.energy,
                        fabs(spring.force)));
            const Barrier* const barrier = heldBy(hand, linker.hands[side]);
            if (barrier != nullptr)
                add(Event::LetGo, side, 0, barrier->releaseRate);
            else if (hand.siteSpacing > 0 && hand.speed != 0) {
                const int direction = hand.speed > 0 ? 1 : -1;
                double stiffness;
                const double along = pulls ? direction*pull(linker, side, spring, step, stiffness) : 0;
                const double speed = speedUnder(hand, 1, along);
                add(Event::Hop, side, speed > 0 ? direction : -direction, fabs(speed)/hand.siteSpacing);
            }
        }
        else if (linker.isHeld(1-side)) {
            if (hand.bindingRate > 0 && type.mayBind(side, true))
                add(Event::Propose, side, 0, proposalRate(hand)*countAround(watches[next.index], step));
        }
        else if (type.diffuses()) {
            if (hand.bindingRate > 0)
                add(Event::Propose, side, 0, freeRate(type, side)*cells.getLongest()*
                        countAroundFree(linker.type, &state.positions[3*next.index]));
        }
        else if (type.concentration < 0)
            add(Event::Capture, side, 0, captureRate(type, side, step));
    }
    if (total <= 0)
        return false;
    if (!(clock > 0))
        clock = next.random.exponential();
    const double left = total*(step.stepSize-next.time);
    if (!(clock < left)) {
        clock -= left;
        return false;
    }
    next.time += clock/total;
    clock = 0;
    double chosen = next.random.uniform()*total;
    int which = 0;
    while (which+1 < numPossible && chosen >= possible[which].rate)
        chosen -= possible[which++].rate;
    next.event = possible[which];
    next.events++;
    return true;
}

/** Let the event that was drawn happen, unless it is a proposal that comes to nothing. */
void LinkerKinetics::apply(LinkerState& state, const KineticStep& step, Pending& next, Sites* sites,
        Count& count) const {
    Linker& linker = state.linkers[next.index];
    const int side = next.event.side;
    double* const position = system.types[linker.type].diffuses() ? &state.positions[3*next.index] : nullptr;
    const bool wasFree = system.isFree(linker), lastHand = position != nullptr &&
            (!linker.pulls() || system.types[linker.type].loadsPairs());
    const HandPlace before = linker.hands[side];
    HandPlace place;
    switch (next.event.kind) {
    case Event::Unbind:
        if (!lastHand || findRelease(linker, side, step, next.random, position))
            unbind(linker, side, sites, count);
        break;
    case Event::Hop:
        hop(linker, side, next.event.direction, next.random, sites, count);
        if (system.isFree(linker))
            release(state, next.index, side, before, contours, step, next.random);
        break;
    case Event::LetGo:
        letGo(system.hands[system.types[linker.type].hands[side]], linker.hands[side]);
        break;
    case Event::Capture:
        if (captureAnywhere(linker, side, next.random, sites, place))
            bind(linker, side, place, sites, count);
        break;
    case Event::Propose:
        if (wasFree ? proposeToFree(linker, position, side, step, next.random, sites, place) :
                proposePlace(linker, side, step, next.random, sites, place))
            bind(linker, side, place, sites, count);
        break;
    }
    if (position != nullptr && !system.isFree(linker))
        fill(position, position+3, NO_POSITION);
}

/**
 * The events of all linkers that need sites, and of those that come out of a concentration, in the order of time: what
 * is proposed to a hand does not depend on others, but whether a site is free does.
 */
void LinkerKinetics::takeTogether(LinkerState& state, const KineticStep& step, Count& count) {
    vector<Linker>& linkers = state.linkers;
    const size_t before = linkers.size();
    const NoiseKey key = {step.seed, 0, state.steps};
    priority_queue<Pending, vector<Pending>, greater<Pending> > queue;
    auto add = [&] (size_t i, double time) {
        Pending next = {time, RandomNumbers(key, step.force, linkers[i].number), static_cast<long long>(i),
                linkers[i].type, {}, 0};
        if (draw(state, step, next))
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
    for (const vector<int>& own : competing)
        for (int i : own)
            add(i, 0);
    for (size_t type = 0; type < system.types.size(); type++)
        if (system.types[type].concentration >= 0)
            addSource({0, RandomNumbers(key, step.force, NEW_LINKERS-type), -1, static_cast<int>(type), {}, 0});
    while (!queue.empty()) {
        Pending next = queue.top();
        queue.pop();
        if (next.events > (next.index >= 0 ? MOST_EVENTS : MOST_NEW_LINKERS)) {
            count.failed = next.index >= 0 ? static_cast<long long>(linkers[next.index].number) : -2-next.type;
            return;
        }
        if (next.index >= 0) {
            apply(state, step, next, &taken, count);
            watches[next.index] = watch(linkers[next.index]);
            if (draw(state, step, next))
                queue.push(next);
            continue;
        }
        Linker linker;
        linker.type = next.type;
        HandPlace place;
        if (captureAnywhere(linker, next.event.side, next.random, &taken, place)) {
            linker.number = state.nextNumber++;
            bind(linker, next.event.side, place, &taken, count);
            linkers.push_back(linker);
            state.clocks.push_back(0);
            if (anyDiffuses)
                state.positions.insert(state.positions.end(), 3, NO_POSITION);
            watches.push_back(watch(linker));
            add(linkers.size()-1, next.time);
        }
        addSource(next);
    }
    auto walkAny = [&] (size_t i) {
        if (kinds[watches[i].kind].walks)
            walkOne(state, i, step, count);
    };
    for (const vector<int>& own : competing)
        for (int i : own)
            walkAny(i);
    for (size_t i = before; i < linkers.size(); i++)
        walkAny(i);
}

/** The sum of the rates of a linker; -1 if that depends on its spring. */
double LinkerKinetics::findRate(const LinkerState& state, int index, const KineticStep& step) const {
    const Watch& watch = watches[index];
    const Kind& kind = kinds[watch.kind];
    if (kind.isFree)
        return kind.perPiece > 0 ? kind.perPiece*countAroundFree(watch.kind/4, &state.positions[3*index]) : 0;
    if (kind.rate < 0 || !(kind.perPiece > 0))
        return kind.rate;
    return kind.rate+kind.perPiece*countAround(watch, step);
}

/** Whether it is known that a step passes without an event: then the clock of the linker is taken down. */
bool LinkerKinetics::passes(double& clock, double rate, double stepSize) const {
    const double spent = rate*stepSize;
    if (!(spent >= 0) || (spent > 0 && !(clock > spent)))
        return false;
    clock -= spent;
    return true;
}

/** The piece that a linker holds. */
int LinkerKinetics::pieceOf(const Watch& watch) const {
    return watch.where < cells.getNumPieces() ? watch.where : watch.where-cells.getNumPieces();
}

/** Whether a step asks if the only hand of a linker that is bound has walked beyond its piece. */
bool LinkerKinetics::looksAtPiece(const Watch& watch) const {
    return anyBinding && kinds[watch.kind].walks && !kinds[watch.kind].pulls;
}

/** Hands of a linker walk that do not bind to sites. */
void LinkerKinetics::walkAll(Linker& linker, const KineticStep& step, Watch& own, RandomNumbers& random,
        Count& count) const {
    const Kind& kind = kinds[own.kind];
    if (kind.pulls || kind.isStoppedByTorque || !system.barriers.empty())
        walk(linker, step, random, count);
    else {
        const int side = own.kind%4-1;
        HandPlace& place = linker.hands[side];
        place.position += kind.velocity*step.stepSize;
        // Mostly it stays on its piece.
        if (anyBinding) {
            const SegmentPiece& piece = cells.getPiece(pieceOf(own));
            if (place.position >= piece.alongChain && place.position < piece.alongChain+piece.length)
                return;
        }
        stayOnChain(linker, side, count);
    }
    own = watch(linker);
}

void LinkerKinetics::advanceChunk(LinkerState& state, const KineticStep& step, int chunk) {
    const NoiseKey key = {step.seed, 0, state.steps};
    const int first = chunk*CHUNK, last = min<int>(state.linkers.size(), first+CHUNK);
    Count& count = counts[chunk];
    count.events.assign(system.types.size(), LinkerEvents());
    count.failed = -1;
    pulling[chunk].clear();
    competing[chunk].clear();
    const int* const around = cells.getNumbersAround();
    if (anyDiffuses)
        diffuse(state, step, first, last);
    for (int i = first; i < last; i++) {
        if (i+AHEAD < last && looksAtPiece(watches[i+AHEAD]))
            prefetch(&cells.getPiece(pieceOf(watches[i+AHEAD])));
        Watch& own = watches[i];
        // Of most linkers, nothing else is looked at.
        const Kind& kind = kinds[own.kind];
        if (kind.rests && passes(state.clocks[i], kind.rate+kind.perPiece*around[own.where], step.stepSize))
            continue;
        if (kind.rests || !passes(state.clocks[i], findRate(state, i, step), step.stepSize)) {
            Linker& linker = state.linkers[i];
            if (kind.needsSites) {
                competing[chunk].push_back(i);
                continue;
            }
            Pending next = {0, RandomNumbers(key, step.force, linker.number), i, linker.type, {}, 0};
            while (next.events <= MOST_EVENTS && draw(state, step, next)) {
                apply(state, step, next, nullptr, count);
                own = watch(linker);
            }
            if (next.events > MOST_EVENTS)
                count.failed = linker.number;
        }
        if (kinds[own.kind].walks)
            walkOne(state, i, step, count);
        if (kinds[own.kind].pulls)
            pulling[chunk].push_back(i);
    }
}

/** Those that have gone back to a concentration are no more. */
void LinkerKinetics::removeUnbound(LinkerState& state) {
    size_t kept = 0;
    for (size_t i = 0; i < state.linkers.size(); i++) {
        if (system.types[state.linkers[i].type].concentration >= 0 && watches[i].kind%4 == 0)
            continue;
        state.linkers[kept] = state.linkers[i];
        state.clocks[kept] = state.clocks[i];
        if (anyDiffuses)
            copy(&state.positions[3*i], &state.positions[3*i]+3, &state.positions[3*kept]);
        watches[kept++] = watches[i];
    }
    state.linkers.resize(kept);
    state.clocks.resize(kept);
    state.positions.resize(anyDiffuses ? 3*kept : 0);
    watches.resize(kept);
}

long long LinkerKinetics::advance(LinkerState& state, const KineticStep& step, const Loop& loop, vector<Link>* links) {
    if (anyBinding)
        cells.build(contours, step.positions, largestReach, step.boxes.distances, step.boxes.segments, anyAnchors,
                anyDiffuses);
    if (anyBinding && anyAnchors)
        findMarks(step);
    findKinds(step);
    know(state);
    const int chunks = (state.linkers.size()+CHUNK-1)/CHUNK;
    counts.resize(chunks+1);
    counts[chunks] = {vector<LinkerEvents>(system.types.size()), -1};
    pulling.resize(chunks);
    competing.resize(chunks);
    loop(chunks, [&] (int chunk) {
        advanceChunk(state, step, chunk);
    });
    if (anySites || anyConcentration)
        takeTogether(state, step, counts[chunks]);
    if (anyConcentration)
        removeUnbound(state);
    state.steps++;
    if (links != nullptr && (anySites || anyConcentration))
        describe(state, *links);
    else if (links != nullptr) {
        links->clear();
        for (const vector<int>& own : pulling)
            for (size_t k = 0; k < own.size(); k++) {
                if (k+AHEAD < own.size())
                    prefetch(&state.linkers[own[k+AHEAD]]);
                addLink(state.linkers[own[k]], *links);
            }
    }
    long long failed = -1;
    for (const Count& one : counts) {
        for (size_t type = 0; type < one.events.size(); type++) {
            state.events[type].bindings += one.events[type].bindings;
            state.events[type].unbindings += one.events[type].unbindings;
        }
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
