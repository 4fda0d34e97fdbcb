#ifndef CYLCHAIN_PLACE_H_
#define CYLCHAIN_PLACE_H_

#include "mechanics/PeriodicBox.h"

namespace cylchain {

/**
 * Where a coupling takes hold: on the line between two particles, at one of them, or at a point that does not move.
 */
struct Place {
    /** The particle at fraction 0, or -1 for a point. */
    int first = -1;
    /** The particle at fraction 1, or -1 if the place is the first particle itself. */
    int second = -1;
    /** From 0 to 1. */
    double fraction = 0;
    /** Where it is, if it is a point. */
    double point[3] = {};
    bool isPoint() const {
        return first < 0;
    }
    bool isOnSegment() const {
        return second >= 0;
    }
};

/** Whether two places are one, wherever particles are, but for rounding of their fractions. */
bool areSame(const Place& a, const Place& b);

/**
 * Find where a place is: (1-f) x1+f x2 between two particles.
 *
 * @param positions    those of all particles
 * @param box          nine numbers if the second particle is the image nearest to the first one, or NULL
 * @param[out] result  three numbers
 */
inline void locate(const Place& place, const double* positions, const double* box, double* result) {
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

/** Add a force on a place, times a factor, to the forces on the particles that hold it. */
inline void addForce(const Place& place, const double* force, double factor, double* forces) {
    if (place.isPoint())
        return;
    const double first = place.isOnSegment() ? factor*(1-place.fraction) : factor;
    for (int k = 0; k < 3; k++)
        forces[3*place.first+k] += first*force[k];
    if (place.isOnSegment())
        for (int k = 0; k < 3; k++)
            forces[3*place.second+k] += factor*place.fraction*force[k];
}

} // namespace cylchain

#endif /*CYLCHAIN_PLACE_H_*/
