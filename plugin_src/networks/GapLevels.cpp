#include "networks/GapLevels.h"

using namespace cylchain;
using namespace std;

void GapLevels::sort(int count, const GapResponses& responses) {
    levelOfChain.assign(responses.getNumChains(), 0);
    levelOf.resize(count);
    firsts.assign(1, 0);
    for (int gap = 0; gap < count; gap++) {
        int level = 0;
        responses.forPorts(gap, [&] (const GapResponses::ChainPorts& chain, int) {
            level = max(level, levelOfChain[responses.numberOf(chain)]);
        });
        responses.forPorts(gap, [&] (const GapResponses::ChainPorts& chain, int) {
            levelOfChain[responses.numberOf(chain)] = level+1;
        });
        levelOf[gap] = level;
        if ((int) firsts.size() < level+2)
            firsts.resize(level+2, 0);
        firsts[level+1]++;
    }
    for (size_t level = 1; level < firsts.size(); level++)
        firsts[level] += firsts[level-1];
    gaps.resize(count);
    vector<int> next(firsts);
    for (int gap = 0; gap < count; gap++)
        gaps[next[levelOf[gap]]++] = gap;
}
