#include "networks/CapsulePlaces.h"
#include "networks/CapsuleMotion.h"

using namespace cylchain;
using namespace std;

namespace {

/** Capsules that a thread looks at together. */
const int CHUNK_OF_CAPSULE_PLACES = 256;

} // namespace

void CapsulePlaces::begin(const CoupledStart& start, const vector<Capsule>& capsules,
        const vector<CapsuleOnCurve>& onCurves, const Loop& loop) {
    places.resize(capsules.size());
    auto find = [&] (const Place& place, PlaceOnChain& found) {
        if (start.places.find(place, found) && start.taken[found.chain])
            return true;
        found = PlaceOnChain();
        return false;
    };
    runInChunks(loop, capsules.size(), CHUNK_OF_CAPSULE_PLACES, [&] (int i) {
        Place place;
        place.first = capsules[i].first;
        place.second = capsules[i].second;
        CapsulePlace& own = places[i];
        const bool moves = find(place, own.place);
        own.direction = !moves || capsules[i].second < 0 ? 0 : own.place.fraction == 0 ? 1 : -1;
    });
    for (const CapsuleOnCurve& curve : onCurves) {
        CapsulePlace& own = places[curve.capsule];
        own.direction = 0;
        if (!find(curve.first, own.place))
            continue;
        own.place.hold.pieces = curve.pieces;
        own.direction = (curve.forwards ? 1.0 : -1.0)/curve.pieces;
    }
}

void CapsulePlaces::fail(const ContactPair& pair, vector<bool>& failed) const {
    for (int capsule : {pair.a, pair.b})
        if (!isHeld(capsule))
            failed[get(capsule).chain] = true;
}

void CapsulePlaces::failAll(vector<bool>& failed) const {
    for (const CapsulePlace& own : places)
        if (own.place.pack >= 0)
            failed[own.place.chain] = true;
}

void CapsulePlaces::addNeighbours(const ContactPair& pair, vector<std::pair<int, int> >& neighbours) const {
    if (!isHeld(pair.a) && !isHeld(pair.b))
        neighbours.push_back(make_pair(get(pair.a).chain, get(pair.b).chain));
}

void CapsulePlaces::name(const ContactPair& pair, BrokenCoupling& culprit) const {
    culprit.places[0] = describePlace(get(pair.a));
    culprit.places[1] = describePlace(get(pair.b));
}

void CapsulePlaces::nameFastest(const vector<Capsule>& capsules, const double* begun, const double* moved,
        BrokenCoupling& culprit) const {
    culprit.reason = BrokenCoupling::LeavesBox;
    culprit.places[0] = describePlace(get(findFastest(capsules, begun, moved)));
}
