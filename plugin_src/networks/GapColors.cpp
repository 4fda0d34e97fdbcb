#include "networks/GapColors.h"

using namespace cylchain;
using namespace std;

void GapColors::sort(int count, const GapResponses& responses) {
    colorOf.resize(count);
    firsts.assign(1, 0);
    int words = 1;
    used.assign(responses.getNumChains(), 0);
    for (int gap = 0; gap < count; gap++) {
        int color = -1;
        for (int word = 0; color < 0; word++) {
            if (word == words)
                used.resize(++words*(size_t) responses.getNumChains(), 0);
            uint64_t* const ofWord = &used[word*(size_t) responses.getNumChains()];
            uint64_t taken = 0;
            responses.forPorts(gap, [&] (const GapResponses::ChainPorts& chain, int) {
                taken |= ofWord[responses.numberOf(chain)];
            });
            if (taken == ~static_cast<uint64_t>(0))
                continue;
            const uint64_t lowest = ~taken&(taken+1);
            for (color = 64*word; lowest>>(color&63) != 1; color++)
                continue;
            responses.forPorts(gap, [&] (const GapResponses::ChainPorts& chain, int) {
                ofWord[responses.numberOf(chain)] |= lowest;
            });
        }
        colorOf[gap] = color;
        if ((int) firsts.size() < color+2)
            firsts.resize(color+2, 0);
        firsts[color+1]++;
    }
    for (size_t color = 1; color < firsts.size(); color++)
        firsts[color] += firsts[color-1];
    gaps.resize(count);
    vector<int> next(firsts);
    for (int gap = 0; gap < count; gap++)
        gaps[next[colorOf[gap]]++] = gap;
}
