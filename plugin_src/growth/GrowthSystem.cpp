#include "growth/GrowthSystem.h"
#include <algorithm>
#include <cmath>
#include <numeric>

using namespace cylchain;
using namespace std;

bool GrowingEnd::grows() const {
    return any_of(states.begin(), states.end(), [] (const EndState& state) {
        return state.onRate > 0 || state.offRate > 0;
    });
}

long long GrowthSystem::countAtFirst(int pool) const {
    return llround(pools[pool].concentration*pools[pool].volume);
}

GrowthState::GrowthState(const GrowthSystem& system, const vector<MonomerRange>& ranges) : ranges(ranges),
        monomers(ranges.size()), identities(ranges.size(), -1), parents(ranges.size(), -1) {
    for (size_t i = 0; i < ranges.size(); i++) {
        const GrowingChain& own = system.chains[i];
        for (const GrowingEnd& end : own.ends) {
            EndEvents none;
            none.switches.resize(end.states.size());
            events.push_back(none);
            endStates.push_back(end.initialState);
        }
        if (own.monomersHaveStates)
            monomers[i].assign(ranges[i].size(), {0, own.ends[1].initialState});
        if (ranges[i].size() > 0)
            identities[i] = nextIdentity++;
    }
    for (size_t pool = 0; pool < system.pools.size(); pool++)
        free.push_back(system.countAtFirst(pool));
}
