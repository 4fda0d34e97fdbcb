#include "networks/PairSelection.h"

using namespace cylchain;
using namespace std;

/** Up to this share of packs are few: what concerns them alone is looked at. */
static const double SHARE_OF_FEW = 0.25;

void PairSelection::select(const CapsulePairs& pairs, const vector<int>& packsOfCapsules, const PackFlags& active) {
    const size_t numActive = count(active.begin(), active.end(), 1);
    if (numActive > SHARE_OF_FEW*active.size()) {
        all = true;
        return;
    }
    if (!all && includes(active))
        return;
    all = false;
    packs = active;
    selected.clear();
    auto takesPart = [&] (int capsule) {
        return packsOfCapsules[capsule] >= 0 && active[packsOfCapsules[capsule]];
    };
    for (int i = 0; i < pairs.getNumPairs(); i++)
        if (takesPart(pairs.getWatch(i).a) || takesPart(pairs.getWatch(i).b))
            selected.push_back(i);
    divide();
}

void PairSelection::addFrom(int first, const CapsulePairs& pairs) {
    if (all)
        return;
    for (int i = first; i < pairs.getNumPairs(); i++)
        selected.push_back(i);
    divide();
}

bool PairSelection::includes(const PackFlags& some) const {
    return all || equal(some.begin(), some.end(), packs.begin(), [] (char one, char known) {
        return !one || known;
    });
}

void PairSelection::divide() {
    runs.assign(1, 0);
    int chunk = -1;
    for (int i = 0; i < (int) selected.size(); i++) {
        const int own = selected[i]/CapsulePairs::CHUNK;
        if (own != chunk && i-runs.back() >= CapsulePairs::CHUNK)
            runs.push_back(i);
        chunk = own;
    }
    runs.push_back(selected.size());
}
