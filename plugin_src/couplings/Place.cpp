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

static BezierWeights weightsOf(const Place& place) {
    return place.isTangent() ? BezierWeights::ofTangent(place.fraction, place.tangent) : BezierWeights(place.fraction);
}

void cylchain::locateOnCurve(const Place& place, const double* positions, const double* box, double* result) {
    const BezierWeights weights = weightsOf(place);
    double chord[3], controls[2][3];
    const int nodes[] = {place.first, place.second};
    auto vectorBetween = [&] (int from, int to, double* vector) {
        for (int k = 0; k < 3; k++)
            vector[k] = positions[3*to+k]-positions[3*from+k];
        if (box != nullptr)
            takeToNearestImage(vector, box);
    };
    vectorBetween(place.first, place.second, chord);
    for (int side = 0; side < 2; side++)
        vectorBetween(nodes[side], place.controls[side], controls[side]);
    for (int k = 0; k < 3; k++)
        result[k] = (place.isTangent() ? 0 : positions[3*place.first+k])+weights.control1*controls[0][k]+
                weights.position2*chord[k]+weights.control2*controls[1][k];
}

void cylchain::addForceOnCurve(const Place& place, const double* force, double factor, double* forces) {
    const BezierWeights weights = weightsOf(place);
    for (int k = 0; k < 3; k++) {
        const double own = factor*force[k];
        forces[3*place.first+k] += (weights.position1-weights.control1)*own;
        forces[3*place.controls[0]+k] += weights.control1*own;
        forces[3*place.second+k] += (weights.position2-weights.control2)*own;
        forces[3*place.controls[1]+k] += weights.control2*own;
    }
}
