#include "growth/EndGrowth.h"
#include "growth/MonomerStates.h"
#include <algorithm>

using namespace cylchain;
using namespace std;

namespace {

/** Find the monomers of a chain after an event. */
MonomerRange findRange(const MonomerRange& before, const GrowthEvent& event) {
    MonomerRange range = before;
    const int change = event.kind == GrowthEvent::Gain ? 1 : -1;
    if (event.end == 1)
        range.last += change;
    else
        range.first -= change;
    return range;
}

} // namespace

void EndGrowth::listEvents(const GrowthState& state, int index, const ChainsInStep& chains,
        vector<GrowthEvent>& events) const {
    const GrowingChain& own = system.chains[index];
    const MonomerPool& pool = system.pools[own.pool];
    const double concentration = pool.isClosed() ? state.free[own.pool]/pool.volume : pool.concentration;
    for (int end : {0, 1}) {
        const EndState& now = own.ends[end].states[state.endStates[2*index+end]];
        auto add = [&] (GrowthEvent::Kind kind, double rate, int to) {
            if (rate > 0)
                events.push_back({kind, index, rate, end, to, own.ends[end].timing.isRegular &&
                        kind != GrowthEvent::Switch});
        };
        double gains = now.onRate*concentration, losses = now.offRate+chains.findOffRate(index, end);
        if (own.ends[end].timing.isRegular) {
            const double both = min(gains, losses);
            gains -= both;
            losses -= both;
        }
        const bool isShortest = state.ranges[index].size() <= own.leastMonomers;
        if (!isShortest)
            add(GrowthEvent::Lose, losses, 0);
        add(GrowthEvent::Gain, gains, 0);
        for (size_t to = 0; to < now.switchRates.size(); to++) {
            const double more = isShortest && !now.ratesOfShortest.empty() ? now.ratesOfShortest[to] : 0;
            add(GrowthEvent::Switch, now.switchRates[to]*shareOfRates(state, index, now)+more, to);
        }
    }
}

/** Find by what rates at which an end changes are to be multiplied. */
double EndGrowth::shareOfRates(const GrowthState& state, int index, const EndState& now) const {
    if (now.lengthOfRates == 0)
        return 1;
    return state.ranges[index].size()*shapes.getMonomerLength(index)/now.lengthOfRates;
}

/** Let an end change because a monomer did not come: as often as rates say when none does. */
void EndGrowth::block(GrowthState& state, const GrowthEvent& event, double time, RandomNumbers& random) const {
    const EndState& now = system.chains[event.index].ends[event.end].states[state.endStates[2*event.index+event.end]];
    if (event.kind != GrowthEvent::Gain || now.blockedRates.empty())
        return;
    const double share = shareOfRates(state, event.index, now)/event.rate;
    double chosen = random.uniform();
    for (size_t to = 0; to < now.blockedRates.size(); to++) {
        const double own = now.blockedRates[to]*share;
        if (chosen < own) {
            GrowthEvent change = event;
            change.kind = GrowthEvent::Switch;
            change.to = to;
            changeState(state, change, time, random);
            return;
        }
        chosen -= own;
    }
}

void EndGrowth::changeState(GrowthState& state, const GrowthEvent& event, double time, RandomNumbers& random) const {
    state.events[2*event.index+event.end].switches[event.to]++;
    setEndState(state, event, time, random);
}

/** Let the state of an end be what it is after an event. */
void EndGrowth::setEndState(GrowthState& state, const GrowthEvent& event, double time, RandomNumbers& random) const {
    const GrowingChain& own = system.chains[event.index];
    const EndState& before = own.ends[event.end].states[state.endStates[2*event.index+event.end]];
    int& now = state.endStates[2*event.index+event.end];
    MonomersOfChain monomers(state.monomers[event.index], own.ends[1].states);
    if (own.monomersHaveStates)
        monomers.set(event.end, {time, now});
    if (event.kind == GrowthEvent::Switch)
        now = event.to;
    else
        now = event.kind == GrowthEvent::Gain ? before.afterGain : before.afterLoss;
    if (!own.monomersHaveStates)
        return;
    if (event.kind == GrowthEvent::Gain)
        monomers.add(event.end);
    if (event.kind == GrowthEvent::Lose) {
        monomers.remove(event.end);
        now = monomers.reveal(event.end, time, random);
    }
    monomers.set(event.end, {time, now});
}

void EndGrowth::apply(GrowthState& state, const GrowthEvent& event, double time, double kT, RandomNumbers& random,
        ChainsInStep& chains) {
    const int index = event.index, end = event.end;
    const GrowingChain& own = system.chains[index];
    EndEvents& events = state.events[2*index+end];
    if (event.kind == GrowthEvent::Switch) {
        changeState(state, event, time, random);
        return;
    }
    const vector<Vec3d>& nodes = chains.getNodes(index);
    const MonomerRange before = state.ranges[index], range = findRange(before, event);
    const CarriedEnd carried = shapes.carryEnd(index, before, range, end, nodes, kT, random);
    if (carried.nodes.size() > chains.getMostNodes(index)) {
        events.waited++;
        return;
    }
    // Nodes that are fixed neither move nor come or go. They are at the minus end, or the chain is as it was added.
    const int moved = carried.segmentsBefore;
    if (chains.isAnyFixed(index, end == 1 ? static_cast<int>(nodes.size())-moved : 0, moved))
        return;
    vector<double> alongBefore, alongAfter;
    if (chains.hasSurroundings()) {
        alongBefore = shapes.findLengths(index, before);
        alongAfter = shapes.findLengths(index, range);
    }
    const EndChange change = {own.chain, end, nodes, carried.nodes, carried.segmentsBefore, carried.segmentsAfter,
            alongBefore, alongAfter, carried.joint};
    const double ofLoad = event.kind == GrowthEvent::Gain ? own.ends[end].timing.energyOfLoad : 0;
    if (!chains.isTaken(chains.findChange(change)*(ofLoad > 0 ? kT/ofLoad : 1), random)) {
        block(state, event, time, random);
        return;
    }
    chains.show(index, carried.nodes, alongAfter);
    chains.set(index, carried.nodes);
    state.ranges[index] = range;
    if (system.pools[own.pool].isClosed())
        state.free[own.pool] += event.kind == GrowthEvent::Gain ? -1 : 1;
    (event.kind == GrowthEvent::Gain ? events.gained : events.lost)++;
    setEndState(state, event, time, random);
}
