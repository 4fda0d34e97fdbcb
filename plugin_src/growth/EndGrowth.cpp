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

void EndGrowth::listEvents(const GrowthState& state, int index, vector<GrowthEvent>& events) const {
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
        double gains = now.onRate*concentration, losses = now.offRate;
        if (own.ends[end].timing.isRegular) {
            const double both = min(gains, losses);
            gains -= both;
            losses -= both;
        }
        if (state.ranges[index].size() > own.leastMonomers)
            add(GrowthEvent::Lose, losses, 0);
        add(GrowthEvent::Gain, gains, 0);
        for (size_t to = 0; to < now.switchRates.size(); to++)
            add(GrowthEvent::Switch, now.switchRates[to], to);
    }
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
        events.switches[event.to]++;
        setEndState(state, event, time, random);
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
    if (!chains.isTaken(chains.findChange(change)*(ofLoad > 0 ? kT/ofLoad : 1), random))
        return;
    chains.show(index, carried.nodes, alongAfter);
    chains.set(index, carried.nodes);
    state.ranges[index] = range;
    if (system.pools[own.pool].isClosed())
        state.free[own.pool] += event.kind == GrowthEvent::Gain ? -1 : 1;
    (event.kind == GrowthEvent::Gain ? events.gained : events.lost)++;
    setEndState(state, event, time, random);
}
