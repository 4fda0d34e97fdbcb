#include "growth/ChainGrowth.h"
#include <algorithm>
#include <cmath>

using namespace cylchain;
using namespace std;

namespace {

/** Random numbers of growth belong to this instead of the number of a Force, so that they are not those of linkers. */
const uint32_t GROWTH = 0x80000000;
/** After so many events of a group in a step, something is wrong with rates. */
const int MOST_EVENTS_OF_GROUP = 1000000;

} // namespace

ChainGrowth::ChainGrowth(const GrowthSystem& ofSystem, const vector<BendingModel>& bending,
        const vector<StretchingModel>& stretching, const vector<char>& planar) : system(ofSystem),
        shapes(system, bending, stretching, planar), ends(system, shapes), population(system, shapes) {
    const RandomNumbers none({}, GROWTH, 0);
    groups.assign(system.pools.size(), {{}, {}, none});
    for (size_t i = 0; i < system.chains.size(); i++) {
        const int pool = system.chains[i].pool;
        groupOf.push_back(system.pools[pool].isClosed() ? pool : static_cast<int>(groups.size()));
        if (!system.pools[pool].isClosed())
            groups.push_back({{}, {}, none});
        groups[groupOf[i]].chains.push_back(i);
    }
    for (size_t i = 0; i < system.nucleators.size(); i++) {
        const Nucleator& own = system.nucleators[i];
        const int group = own.chains.empty() ? -1 : groupOf[own.chains[0]];
        if (group >= 0 && group < static_cast<int>(system.pools.size()))
            groups[group].nucleators.push_back(i);
        else
            groups.push_back({{}, {static_cast<int>(i)}, none});
    }
}

GrowthChanges ChainGrowth::advance(GrowthState& state, const GrowthStep& step, ChainList& chains, double* positions,
        const vector<Surroundings*>& around) {
    GrowthChanges changes;
    ChainsInStep present(system, step, chains, positions, around);
    for (size_t i = 0; i < groups.size(); i++)
        groups[i].random = RandomNumbers({step.seed, 0, state.steps}, GROWTH, i);
    if (step.plane != nullptr) {
        // A part of a chain, whose new end is drawn, may be on both sides of the plane.
        vector<int> cut;
        for (int index : step.plane->chains)
            if (state.ranges[index].size() > 0)
                cut.push_back(index);
        for (int index : cut)
            population.cutByPlane(state, step, index, groups[groupOf[index]].random, present, changes);
    }
    // A chain that begins in this step takes its turn from then on.
    vector<char> isPresent(system.chains.size());
    for (size_t i = 0; i < isPresent.size(); i++)
        isPresent[i] = state.ranges[i].size() > 0;
    for (Group& group : groups) {
        const bool isThere = !group.nucleators.empty() || any_of(group.chains.begin(), group.chains.end(),
                [&] (int index) {return isPresent[index] != 0;});
        if (isThere && !takeTurns(state, step, group, 0, present, changes)) {
            changes.failed = group.chains.empty() ? system.nucleators[group.nucleators[0]].chains[0] : group.chains[0];
            return changes;
        }
    }
    present.finish(state, chains, positions, changes);
    state.steps++;
    state.time += step.stepSize;
    return changes;
}

/** Let a group do what it does from a time on, by Gillespie's method; false if it does so too often. */
bool ChainGrowth::takeTurns(GrowthState& state, const GrowthStep& step, Group& group, double time,
        ChainsInStep& chains, GrowthChanges& changes) {
    RandomNumbers& random = group.random;
    for (int count = 0; count < MOST_EVENTS_OF_GROUP; count++) {
        events.clear();
        for (int index : group.chains)
            if (state.ranges[index].size() > 0) {
                ends.listEvents(state, index, chains, events);
                population.listEvents(state, index, chains, events);
            }
        for (int nucleator : group.nucleators)
            population.listNucleation(state, nucleator, events);
        double total = 0, untilRegular = HUGE_VAL;
        size_t regular = 0;
        for (size_t i = 0; i < events.size(); i++) {
            const GrowthEvent& event = events[i];
            if (!event.isRegular) {
                total += event.rate;
                continue;
            }
            const double left = max(0.0, 1-state.phases[2*event.index+event.end])/event.rate;
            if (left < untilRegular) {
                untilRegular = left;
                regular = i;
            }
        }
        const double wait = min(untilRegular, total > 0 ? random.exponential()/total : HUGE_VAL);
        const double passed = min(wait, step.stepSize-time);
        for (const GrowthEvent& event : events)
            if (event.isRegular)
                state.phases[2*event.index+event.end] += event.rate*passed;
        time += wait;
        if (!(time < step.stepSize))
            return true;
        size_t next = 0;
        if (wait == untilRegular) {
            next = regular;
            state.phases[2*events[next].index+events[next].end] = 0;
        }
        else {
            double chosen = random.uniform()*total, seen = 0;
            for (size_t i = 0; i < events.size() && seen <= chosen; i++)
                if (!events[i].isRegular) {
                    seen += events[i].rate;
                    next = i;
                }
        }
        const GrowthEvent event = events[next];
        if (event.kind == GrowthEvent::Gain || event.kind == GrowthEvent::Lose || event.kind == GrowthEvent::Switch) {
            ends.apply(state, event, state.time+time, step.kT, random, chains);
            continue;
        }
        const int begun = population.apply(state, step, event, state.time+time, random, chains, changes);
        if (begun >= 0 && &groups[groupOf[begun]] != &group &&
                !takeTurns(state, step, groups[groupOf[begun]], time, chains, changes))
            return false;
    }
    return false;
}
