#include "dynamics/EnginePacks.h"
#include "dynamics/PackPlaces.h"
#include <algorithm>
#include <cstddef>
#include <set>
#include <utility>

/**
 * Chains that come and go, and the packs in which they are.
 */

using namespace cylchain;
using namespace std;

namespace {

/** Packs of chains that come and go have at most so many times the lanes of these, and so many packs besides. */
const int MOST_LANES_OF_GROWN = 3, MOST_LANES_BESIDE = 16;

} // namespace

Replacement ChainEngine::replaceChains(const vector<Chain>& chains, const vector<int>& changed) {
    vector<vector<int> >& members = implementation->members;
    const vector<int> packs = implementation->placeChains(chains, changed);
    size_t lanes = 0, taken = 0;
    for (size_t pack = 0; pack < members.size(); pack++) {
        lanes += bestKernels().lanes;
        taken += members[pack].size();
    }
    if (lanes > MOST_LANES_OF_GROWN*taken+MOST_LANES_BESIDE*bestKernels().lanes)
        return Replacement::Impossible;
    // Tables of what has changed are its own, and those before are gone with it.
    implementation->tables = PropertyTables<double>();
    implementation->wideTables = PropertyTables<float>();
    Replacement result = Replacement::SameNodes;
    for (int pack : packs) {
        ChainPack<double>& own = implementation->packs[pack];
        const vector<int> chainsBefore = own.chain, particlesBefore = own.particles;
        implementation->fill(pack, chains, max(own.lanes, lanesFor(members[pack].size(), bestKernels().lanes)));
        if (own.chain != chainsBefore || own.particles != particlesBefore)
            result = Replacement::OtherNodes;
    }
    for (WidePack& wide : implementation->wide) {
        if (none_of(packs.begin(), packs.end(), [&] (int pack) {return pack >= wide.first && pack < wide.last;}))
            continue;
        wide = implementation->widePackOf(chains, wide.first, wide.last);
    }
    implementation->findLimits(chains);
    return result;
}

void ChainEngine::Implementation::findLimits(const vector<Chain>& chains) {
    vector<int> all;
    for (size_t i = 0; i < chains.size(); i++)
        if (!chains[i].nodes.empty() && !chains[i].closed && !hasRange(chains[i].stretching))
            all.push_back(i);
    limits = make_unique<WidePack>(chains, all, 0, packs.size());
}

vector<int> ChainEngine::getArrangement() const {
    vector<int> result = {getNumPacks()};
    for (size_t pack = 0; pack < implementation->members.size(); pack++) {
        const vector<int>& own = implementation->members[pack];
        result.insert(result.end(), {implementation->packs[pack].lanes, static_cast<int>(own.size())});
        result.insert(result.end(), own.begin(), own.end());
    }
    for (const WidePack& wide : implementation->wide)
        result.insert(result.end(), {wide.first, wide.last});
    return result;
}

void ChainEngine::setArrangement(const vector<Chain>& chains, const vector<int>& arrangement) {
    size_t next = 0;
    auto take = [&] {
        return next < arrangement.size() ? arrangement[next++] : -1;
    };
    vector<vector<int> > members(max(0, take()));
    vector<int> lanes, seen(chains.size(), 0);
    bool isRight = true;
    for (vector<int>& own : members) {
        lanes.push_back(take());
        for (int count = take(); count > 0; count--)
            own.push_back(take());
        isRight = isRight && lanes.back() >= 1 && lanes.back() <= bestKernels().lanes &&
                static_cast<int>(own.size()) <= lanes.back();
        for (int chain : own)
            if (chain < 0 || chain >= static_cast<int>(chains.size()) || chains[chain].nodes.empty())
                isRight = false;
            else
                seen[chain]++;
        isRight = isRight && (own.empty() || mayShareLanes(chains[own.front()], chains[own.back()],
                LARGEST_FILLING_OF_GROWN));
    }
    for (size_t i = 0; i < chains.size(); i++)
        isRight = isRight && seen[i] == (chains[i].nodes.empty() ? 0 : 1);
    vector<pair<int, int> > wide;
    while (next < arrangement.size()) {
        const int first = take(), last = take();
        int ofBoth = 0;
        for (int pack = first; pack < last && pack >= 0 && pack < static_cast<int>(lanes.size()); pack++)
            ofBoth += lanes[pack];
        isRight = isRight && first >= (wide.empty() ? 0 : wide.back().second) && first < last &&
                last <= static_cast<int>(members.size()) && ofBoth <= bestKernels().wide.lanes;
        wide.push_back({first, last});
    }
    // That of another processor, which has other lanes, has other digits anyway.
    if (!isRight)
        return;
    implementation->tables = PropertyTables<double>();
    implementation->wideTables = PropertyTables<float>();
    implementation->members.clear();
    implementation->packs.clear();
    implementation->pieces.clear();
    implementation->wide.clear();
    for (size_t pack = 0; pack < members.size(); pack++)
        implementation->add(chains, members[pack], lanes[pack]);
    for (const pair<int, int>& own : wide)
        implementation->wide.push_back(implementation->widePackOf(chains, own.first, own.second));
    implementation->findLimits(chains);
}

vector<int> ChainEngine::Implementation::placeChains(const vector<Chain>& chains, const vector<int>& changed) {
    auto isLonger = [&] (int a, int b) {
        return chains[a].nodes.size() > chains[b].nodes.size();
    };
    auto areSimilar = [&] (const vector<int>& own) {
        return own.empty() || mayShareLanes(chains[own.front()], chains[own.back()], LARGEST_FILLING_OF_GROWN);
    };
    vector<char> isChanged(chains.size(), 0);
    vector<int> homeless(changed);
    for (int chain : changed)
        isChanged[chain] = 1;
    set<int> result;
    for (size_t pack = 0; pack < members.size(); pack++) {
        vector<int>& own = members[pack];
        const auto others = stable_partition(own.begin(), own.end(), [&] (int chain) {return isChanged[chain] == 0;});
        if (others == own.end())
            continue;
        result.insert(pack);
        // Those that have changed stay, unless they are too different from those that have not.
        const vector<int> back(others, own.end());
        own.erase(others, own.end());
        for (int chain : back) {
            vector<int> with = own;
            with.insert(upper_bound(with.begin(), with.end(), chain, isLonger), chain);
            if (chains[chain].nodes.empty() || !areSimilar(with))
                continue;
            own.swap(with);
            homeless.erase(find(homeless.begin(), homeless.end(), chain));
        }
    }
    for (int chain : homeless) {
        if (chains[chain].nodes.empty())
            continue;
        size_t pack = 0;
        for (; pack < members.size(); pack++) {
            vector<int> with = members[pack];
            with.insert(upper_bound(with.begin(), with.end(), chain, isLonger), chain);
            if (static_cast<int>(with.size()) <= bestKernels().lanes && areSimilar(with)) {
                members[pack].swap(with);
                break;
            }
        }
        if (pack == members.size()) {
            members.push_back({chain});
            packs.emplace_back();
            pieces.emplace_back();
            if (!hasRange(chains[chain].stretching)) {
                const int last = packs.size();
                if (!wide.empty() && wide.back().last == last-1 && wide.back().first == last-2)
                    wide.back().last = last;
                else
                    wide.emplace_back(chains, vector<int>(), last-1, last);
            }
        }
        result.insert(pack);
    }
    return {result.begin(), result.end()};
}
