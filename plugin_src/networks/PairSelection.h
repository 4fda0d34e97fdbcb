#ifndef CYLCHAIN_PAIR_SELECTION_H_
#define CYLCHAIN_PAIR_SELECTION_H_

#include "networks/CapsulePairs.h"
#include "networks/ImplicitCouplings.h"
#include <algorithm>
#include <vector>

namespace cylchain {

/**
 * The pairs of capsules that are looked at in an iteration: all, or those of few packs. Late iterations have few, and
 * should take no time for others.
 *
 * Threads look at runs of pairs, no two of which have pairs of the same chunk.
 */
class PairSelection {
public:
    void selectAll() {
        all = true;
    }
    bool hasAll() const {
        return all;
    }
    /**
     * Select the pairs of the packs that take part, if these are few.
     *
     * @param packsOfCapsules  the pack of each capsule, or -1
     * @param active           whether each pack takes part
     */
    void select(const CapsulePairs& pairs, const std::vector<int>& packsOfCapsules, const PackFlags& active);
    /** Select the pairs from a number on, too, which have been added. */
    void addFrom(int first, const CapsulePairs& pairs);
    /** Whether all pairs of some packs are selected. */
    bool includes(const PackFlags& some) const;
    /** The number of runs of all pairs, or of those that are selected. */
    int getNumRuns(const CapsulePairs& pairs, bool ofAll) const {
        return ofAll ? pairs.getNumChunks() : runs.size()-1;
    }
    /** Call a function with the number of each pair of a run. */
    template <class Function> void forPairs(const CapsulePairs& pairs, bool ofAll, int run, Function function) const {
        if (ofAll)
            for (int i = run*CapsulePairs::CHUNK; i < std::min(pairs.getNumPairs(), (run+1)*CapsulePairs::CHUNK); i++)
                function(i);
        else
            for (int i = runs[run]; i < runs[run+1]; i++)
                function(selected[i]);
    }
private:
    void divide();
    bool all = true;
    /** The packs all pairs of which are there. */
    PackFlags packs;
    std::vector<int> selected;
    /** Where runs of them begin, and their end. */
    std::vector<int> runs;
};

} // namespace cylchain

#endif /*CYLCHAIN_PAIR_SELECTION_H_*/
