#include "kinetics/LinkerKinetics.h"
#include <algorithm>
#include <cmath>

using namespace cylchain;
using namespace std;

namespace {

/** Where a hand is on its site that a barrier there has captured; others are in the middle. */
const double CAPTURED = 0.625;

bool isBefore(const Barrier& barrier, const HandPlace& place) {
    return barrier.chain != place.chain ? barrier.chain < place.chain : barrier.position < place.position;
}

} // namespace

/** Find the barrier that holds a hand, or NULL. */
const Barrier* LinkerKinetics::heldBy(const Hand& hand, const HandPlace& place) const {
    if (system.barriers.empty() || hand.speed == 0)
        return nullptr;
    HandPlace first = place;
    double last = place.position;
    if (hand.siteSpacing > 0) {
        const double site = floor(place.position/hand.siteSpacing);
        if (place.position != (site+CAPTURED)*hand.siteSpacing)
            return nullptr;
        first.position = site*hand.siteSpacing;
        last = nextafter((site+1)*hand.siteSpacing, first.position);
    }
    auto barrier = lower_bound(system.barriers.begin(), system.barriers.end(), first, isBefore);
    for (; barrier != system.barriers.end() && barrier->chain == place.chain && barrier->position <= last; ++barrier)
        if (barrier->captures(hand.speed))
            return &*barrier;
    return nullptr;
}

/** Find the first barrier that captures a hand on its way along a chain, the start of which is not a part; or NULL. */
const Barrier* LinkerKinetics::findBarrier(const Hand& hand, int chain, double from, double to,
        RandomNumbers& random) const {
    auto first = lower_bound(system.barriers.begin(), system.barriers.end(), HandPlace{chain, min(from, to)}, isBefore);
    auto last = first;
    while (last != system.barriers.end() && last->chain == chain && last->position <= max(from, to))
        ++last;
    const int count = last-first;
    for (int i = 0; i < count; i++) {
        const Barrier& barrier = first[to > from ? i : count-1-i];
        if (barrier.position != from && barrier.captures(hand.speed) &&
                (barrier.captureProbability >= 1 || random.uniform() < barrier.captureProbability))
            return &barrier;
    }
    return nullptr;
}

/** Whether a barrier captures a hand that would make a move, and is its place then. */
bool LinkerKinetics::isCaptured(const Hand& hand, HandPlace& place, double move, RandomNumbers& random) const {
    if (system.barriers.empty() || (move > 0) != (hand.speed > 0))
        return false;
    const double from = place.position, to = from+move;
    const Barrier* barrier = findBarrier(hand, place.chain, from, to, random);
    // On a ring it may come around.
    if (barrier == nullptr && contours.isClosed(place.chain)) {
        const double length = move > 0 ? contours.getLength(place.chain) : -contours.getLength(place.chain);
        if (fabs(move) > fabs(length))
            return false;
        barrier = findBarrier(hand, place.chain, from-length, to-length, random);
    }
    if (barrier == nullptr)
        return false;
    place.position = barrier->position;
    return true;
}

/** Whether a barrier captures a hand that has come to the middle of a site; it is where that tells then. */
bool LinkerKinetics::isCapturedAtSite(const Hand& hand, HandPlace& place, RandomNumbers& random) const {
    if (system.barriers.empty())
        return false;
    const double site = floor(place.position/hand.siteSpacing);
    double from = site*hand.siteSpacing, to = nextafter((site+1)*hand.siteSpacing, from);
    if (hand.speed < 0)
        swap(from, to);
    // The start is a part of the way here.
    from = nextafter(from, hand.speed > 0 ? -HUGE_VAL : HUGE_VAL);
    if (findBarrier(hand, place.chain, from, to, random) == nullptr)
        return false;
    place.position = (site+CAPTURED)*hand.siteSpacing;
    return true;
}

/** Let a hand go on from the barrier that holds it. */
void LinkerKinetics::letGo(const Hand& hand, HandPlace& place) const {
    if (hand.siteSpacing > 0)
        place.position = (floor(place.position/hand.siteSpacing)+0.5)*hand.siteSpacing;
    else
        place.position = nextafter(place.position, hand.speed > 0 ? HUGE_VAL : -HUGE_VAL);
}
