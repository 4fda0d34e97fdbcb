#ifndef CYLCHAIN_GAP_LEVELS_H_
#define CYLCHAIN_GAP_LEVELS_H_

#include "mechanics/Loop.h"
#include "networks/GapResponses.h"
#include <algorithm>
#include <cstddef>
#include <vector>

namespace cylchain {

/**
 * Gaps in levels, so that threads go through them and find what one thread would find that goes through them in turn.
 *
 * Gaps of one level share no chain, and all gaps before them with which they share one are in lower levels.
 */
class GapLevels {
public:
    /** Sort all gaps. */
    void sort(int count, const GapResponses& responses);
    /** Take those of other levels for which a function says so. */
    template <class Function> void select(const GapLevels& all, Function isOne) {
        gaps.clear();
        firsts.assign(1, 0);
        for (std::size_t level = 0; level+1 < all.firsts.size(); level++) {
            for (int k = all.firsts[level]; k < all.firsts[level+1]; k++)
                if (isOne(all.gaps[k]))
                    gaps.push_back(all.gaps[k]);
            if ((int) gaps.size() > firsts.back())
                firsts.push_back(gaps.size());
        }
    }
    /**
     * Call a function with each gap, in their order or against it.
     *
     * @return the largest number that it has returned, or zero
     */
    template <class Function> double visit(bool backwards, const Loop& loop, Function function) {
        double largest = 0;
        const int numLevels = firsts.size()-1;
        for (int i = 0; i < numLevels; i++) {
            const int level = backwards ? numLevels-1-i : i;
            const int first = firsts[level], last = firsts[level+1], chunks = (last-first+CHUNK-1)/CHUNK;
            auto visitChunk = [&] (int chunk) {
                double found = 0;
                for (int k = first+chunk*CHUNK; k < std::min(last, first+(chunk+1)*CHUNK); k++)
                    found = std::max(found, function(gaps[k]));
                return found;
            };
            if (chunks == 1) {
                largest = std::max(largest, visitChunk(0));
                continue;
            }
            largestOfChunks.resize(chunks);
            loop(chunks, [&] (int chunk) {
                largestOfChunks[chunk] = visitChunk(chunk);
            });
            largest = std::max(largest, *std::max_element(largestOfChunks.begin(), largestOfChunks.end()));
        }
        return largest;
    }
private:
    /** Gaps that a thread goes through, which takes about as long as to wake it up. */
    static constexpr int CHUNK = 96;
    /** Sorted by levels; where each begins, and one behind the last. */
    std::vector<int> gaps, firsts = std::vector<int>(1, 0);
    std::vector<int> levelOf, levelOfChain;
    std::vector<double> largestOfChunks;
};

} // namespace cylchain

#endif /*CYLCHAIN_GAP_LEVELS_H_*/
