#include "networks/PairList.h"
#include <algorithm>

using namespace cylchain;
using namespace std;

void PairList::clear() {
    pairs.clear();
    lastAdded.clear();
    addedBefore.clear();
}

void PairList::begin(vector<ContactPair>& found, int numCapsules) {
    pairs.swap(found);
    firstPairs.assign(numCapsules+1, 0);
    seconds.clear();
    for (const ContactPair& pair : pairs) {
        firstPairs[pair.a+1]++;
        seconds.push_back(pair.b);
    }
    for (int i = 0; i < numCapsules; i++)
        firstPairs[i+1] += firstPairs[i];
    lastAdded.assign(numCapsules, -1);
    addedBefore.clear();
}

bool PairList::isKnown(int a, int b) const {
    if (binary_search(seconds.begin()+firstPairs[a], seconds.begin()+firstPairs[a+1], b))
        return true;
    const int numFirst = firstPairs.back();
    for (int i = lastAdded[a]; i >= 0; i = addedBefore[i-numFirst])
        if (pairs[i].b == b)
            return true;
    return false;
}

void PairList::add(const ContactPair& pair) {
    if (isKnown(pair.a, pair.b))
        return;
    addedBefore.push_back(lastAdded[pair.a]);
    lastAdded[pair.a] = pairs.size();
    pairs.push_back(pair);
}
