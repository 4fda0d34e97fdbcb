#include "couplings/Place.h"
#include "mechanics/PeriodicBox.h"
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

void cylchain::locate(const Place& place, const double* positions, const double* box, double* result) {
    const double* first = place.isPoint() ? place.point : positions+3*place.first;
    if (!place.isOnSegment()) {
        for (int k = 0; k < 3; k++)
            result[k] = first[k];
        return;
    }
    const double* second = positions+3*place.second;
    if (box == nullptr) {
        for (int k = 0; k < 3; k++)
            result[k] = (1-place.fraction)*first[k]+place.fraction*second[k];
        return;
    }
    double between[3];
    for (int k = 0; k < 3; k++)
        between[k] = second[k]-first[k];
    takeToNearestImage(between, box);
    for (int k = 0; k < 3; k++)
        result[k] = first[k]+place.fraction*between[k];
}

void cylchain::addForce(const Place& place, const double* force, double factor, double* forces) {
    if (place.isPoint())
        return;
    const double first = place.isOnSegment() ? factor*(1-place.fraction) : factor;
    for (int k = 0; k < 3; k++)
        forces[3*place.first+k] += first*force[k];
    if (place.isOnSegment())
        for (int k = 0; k < 3; k++)
            forces[3*place.second+k] += factor*place.fraction*force[k];
}
