#include "couplings/Place.h"
#include <cmath>
#include <utility>

using namespace cylchain;
using namespace std;

/** Places whose fractions differ by less are one. */
const double SAME_PLACE = 1e-9;

/** The same place with one particle if it is at one, and with the lesser index first. */
static Place simplified(Place place) {
    if (place.isOnSegment() && place.first > place.second) {
        swap(place.first, place.second);
        place.fraction = 1-place.fraction;
    }
    const bool atSecond = (place.isOnSegment() && place.fraction > 1-SAME_PLACE);
    if (atSecond)
        place.first = place.second;
    if (atSecond || place.fraction < SAME_PLACE || !place.isOnSegment()) {
        place.second = -1;
        place.fraction = 0;
    }
    return place;
}

bool cylchain::areSame(const Place& a, const Place& b) {
    const Place one = simplified(a), other = simplified(b);
    if (one.isPoint() && other.isPoint())
        return one.point[0] == other.point[0] && one.point[1] == other.point[1] && one.point[2] == other.point[2];
    return one.first == other.first && one.second == other.second && fabs(one.fraction-other.fraction) < SAME_PLACE;
}
