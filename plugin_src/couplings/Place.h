#ifndef CYLCHAIN_PLACE_H_
#define CYLCHAIN_PLACE_H_

#include "mechanics/BezierWeights.h"
#include "mechanics/PeriodicBox.h"
#include <initializer_list>
#include <vector>

namespace cylchain {

/**
 * Where a coupling takes hold: on the line between two particles, on the curve of a beam element between its two nodes,
 * at a particle, or at a point that does not move.
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
    /** On a curve, the control points of the first and of the second particle, which are its nodes; -1 elsewhere. */
    int controls[2] = {-1, -1};
    /**
     * On a curve, zero, or one over the length of the element if its tangent there is meant, dr/ds, in place of the
     * place; minus that for the opposite of it.
     */
    double tangent = 0;
    bool isPoint() const {
        return first < 0;
    }
    /** Whether it is between two particles, on a line or on a curve. */
    bool isOnSegment() const {
        return second >= 0;
    }
    bool isOnCurve() const {
        return controls[0] >= 0;
    }
    bool isTangent() const {
        return tangent != 0;
    }
};

/** Add the numbers of the particles that say where a place is. */
inline void addParticles(const Place& place, std::vector<int>& particles) {
    for (int particle : {place.first, place.second, place.controls[0], place.controls[1]})
        if (particle >= 0)
            particles.push_back(particle);
}

/** Whether two places are one, wherever particles are, but for rounding of their fractions. */
bool areSame(const Place& a, const Place& b);

/** Find where a place on a curve is, or what its tangent is, see locate(). */
void locateOnCurve(const Place& place, const double* positions, const double* box, double* result);

/** Add a force on a place on a curve, times a factor, to those on its four particles. */
void addForceOnCurve(const Place& place, const double* force, double factor, double* forces);

/**
 * Find where a place is: (1-f) x1+f x2 between two particles, or on the curve between them.
 *
 * @param positions    those of all particles
 * @param box          nine numbers if the other particles are the images nearest to the first one, or NULL
 * @param[out] result  three numbers
 */
inline void locate(const Place& place, const double* positions, const double* box, double* result) {
    const double* first = place.isPoint() ? place.point : positions+3*place.first;
    if (!place.isOnSegment()) {
        for (int k = 0; k < 3; k++)
            result[k] = first[k];
        return;
    }
    if (place.isOnCurve()) {
        locateOnCurve(place, positions, box, result);
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
    if (place.isOnCurve()) {
        addForceOnCurve(place, force, factor, forces);
        return;
    }
    const double first = place.isOnSegment() ? factor*(1-place.fraction) : factor;
    for (int k = 0; k < 3; k++)
        forces[3*place.first+k] += first*force[k];
    if (place.isOnSegment())
        for (int k = 0; k < 3; k++)
            forces[3*place.second+k] += factor*place.fraction*force[k];
}

} // namespace cylchain

#endif /*CYLCHAIN_PLACE_H_*/
