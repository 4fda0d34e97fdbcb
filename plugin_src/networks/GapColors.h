#ifndef CYLCHAIN_GAP_COLORS_H_
#define CYLCHAIN_GAP_COLORS_H_

#include "mechanics/Loop.h"
#include "networks/GapResponses.h"
#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace cylchain {

/**
 * An order of gaps in which threads can go through them together and find what one thread would find: gaps of a color
 * share no chain, and colors follow each other.
 */
class GapColors {
public:
    /** Begin a step without gaps. */
    void begin();
    /**
     * Give each new gap the first color that none of those before it on its chains has, and sort all by these.
     */
    void sort(int count, const GapResponses& responses);
    /** Take those of another order for which a function says so. */
    template <class Function> void select(const GapColors& all, const Loop& loop, Function isOne) {
        gaps.resize(all.gaps.size());
        firsts = all.firsts;
        ends.resize(all.ends.size());
        loop(ends.size(), [&] (int color) {
            int next = firsts[color];
            for (int k = firsts[color]; k < all.ends[color]; k++)
                if (isOne(all.gaps[k]))
                    gaps[next++] = all.gaps[k];
            ends[color] = next;
        });
    }
    /**
     * Call a function with each gap, in their order or against it.
     *
     * @return the largest number that it has returned, or zero
     */
    template <class Function> double visit(bool backwards, const Loop& loop, Function function) {
        double largest = 0;
        const int numColors = ends.size();
        for (int i = 0; i < numColors; i++) {
            const int color = backwards ? numColors-1-i : i;
            const int first = firsts[color], last = ends[color], chunks = (last-first+CHUNK-1)/CHUNK;
            auto visitChunk = [&] (int chunk) {
                double found = 0;
                for (int k = first+chunk*CHUNK; k < std::min(last, first+(chunk+1)*CHUNK); k++)
                    found = std::max(found, function(gaps[k]));
                return found;
            };
            if (chunks < 2) {
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
    int findColor(int gap, const GapResponses& responses);
    /** Gaps that a thread goes through, which takes longer than to take them. */
    static constexpr int CHUNK = 16;
    /** Sorted by their colors; where each of these begins and ends. */
    std::vector<int> gaps, firsts, ends;
    std::vector<int> colorOf;
    /** For each chain, which colors gaps on it have, 64 to a word. */
    std::vector<std::uint64_t> used;
    std::vector<double> largestOfChunks;
};

} // namespace cylchain

#endif /*CYLCHAIN_GAP_COLORS_H_*/
