#include "networks/GapColors.h"
#include <numeric>

using namespace cylchain;
using namespace std;

void GapColors::begin() {
    for (vector<int>* numbers : {&gaps, &firsts, &ends, &colorOf})
        numbers->clear();
    used.clear();
}

/** The first color that no gap before it on its chains has. */
int GapColors::findColor(int gap, const GapResponses& responses) {
    const size_t numChains = responses.getNumChains();
    for (int word = 0; ; word++) {
        if (used.size() == word*numChains)
            used.resize((word+1)*numChains, 0);
        uint64_t* const ofWord = &used[word*numChains];
        uint64_t taken = 0;
        responses.forPorts(gap, [&] (const GapResponses::ChainPorts& chain, int) {
            taken |= ofWord[responses.numberOf(chain)];
        });
        if (taken == ~static_cast<uint64_t>(0))
            continue;
        const uint64_t lowest = ~taken&(taken+1);
        responses.forPorts(gap, [&] (const GapResponses::ChainPorts& chain, int) {
            ofWord[responses.numberOf(chain)] |= lowest;
        });
        int color = 64*word;
        while (lowest>>(color&63) != 1)
            color++;
        return color;
    }
}

void GapColors::sort(int count, const GapResponses& responses) {
    if (count == (int) colorOf.size())
        return;
    for (int gap = colorOf.size(); gap < count; gap++)
        colorOf.push_back(findColor(gap, responses));
    ends.clear();
    for (int color : colorOf) {
        if ((int) ends.size() <= color)
            ends.resize(color+1, 0);
        ends[color]++;
    }
    partial_sum(ends.begin(), ends.end(), ends.begin());
    firsts.assign(ends.size(), 0);
    copy(ends.begin(), ends.end()-1, firsts.begin()+1);
    gaps.resize(count);
    vector<int> next(firsts);
    for (int gap = 0; gap < count; gap++)
        gaps[next[colorOf[gap]]++] = gap;
}
