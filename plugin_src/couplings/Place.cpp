#include "couplings/Place.h"
#include <utility>

using namespace cylchain;
using namespace std;

/** The same place with one particle if it is at one, and with the lesser index first. */
static Place simplified(Place place) {
    if (place.isOnSegment() && place.first > place.second) {
        swap(place.first, place.second);
        place.fraction = 1-place.fraction;
    }
    if (place.isOnSegment() && place.fraction == 1)
        place.first = place.second;
    if (place.fraction == 0 || place.fraction == 1 || !place.isOnSegment()) {
        place.second = -1;
        place.fraction = 0;
    }
    return place;
}

bool cylchain::areSame(const Place& a, const Place& b) {
    const Place one = simplified(a), other = simplified(b);
    if (one.isPoint() && other.isPoint())
        return one.point[0] == other.point[0] && one.point[1] == other.point[1] && one.point[2] == other.point[2];
    return one.first == other.first && one.second == other.second && one.fraction == other.fraction;
}
