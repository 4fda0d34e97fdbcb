#ifndef CYLCHAIN_PAIR_LIST_H_
#define CYLCHAIN_PAIR_LIST_H_

#include "couplings/Capsules.h"
#include <vector>

namespace cylchain {

/** The pairs of capsules that several searches of a step have found, each of them once. */
class PairList {
public:
    void clear();
    /** Take over the pairs that a search of all capsules has found, in its order. */
    void begin(std::vector<ContactPair>& found, int numCapsules);
    /** Get whether a pair is there. The number of a is less than that of b. */
    bool isKnown(int a, int b) const;
    /** Add a pair that another search has found, if it is not there. */
    void add(const ContactPair& pair);
    int size() const {
        return pairs.size();
    }
    const ContactPair& get(int number) const {
        return pairs[number];
    }
private:
    /** Those of the first search in its order, and behind them those that others have found. */
    std::vector<ContactPair> pairs;
    /** The second capsules of those of the first search, and where they begin for each first capsule. */
    std::vector<int> seconds, firstPairs;
    /** The last pair of each first capsule that another search has found, or -1, and the one before each of these. */
    std::vector<int> lastAdded, addedBefore;
};

} // namespace cylchain

#endif /*CYLCHAIN_PAIR_LIST_H_*/
