#include "dynamics/ContactRest.h"
#include "dynamics/RestGap.h"
#include "dynamics/SymmetricMatrices.h"
#include <algorithm>
#include <cmath>

using namespace cylchain;
using namespace std;

namespace {

/** Up to this sine of the angle between them, and of that between the normal and the plane across, two are discs. */
const double LARGEST_SINE = 0.3;

double dot(const double* a, const double* b) {
    return a[0]*b[0]+a[1]*b[1]+a[2]*b[2];
}

/** Make a vector one of length 1; false if it has no length. */
bool normalize(double* v) {
    const double length = sqrt(dot(v, v));
    if (!(length > 0))
        return false;
    for (int k = 0; k < 3; k++)
        v[k] /= length;
    return true;
}

/**
 * Find P.
 *
 * @return false if it is n nT
 */
bool findAcross(const ContactCourse& course, double* across) {
    double e[2][3];
    bool hasLength[2];
    for (int i = 0; i < 2; i++) {
        copy_n(course.along[i], 3, e[i]);
        hasLength[i] = normalize(e[i]);
    }
    double* axis = hasLength[0] ? e[0] : e[1];
    if (hasLength[0] && hasLength[1]) {
        const double cosine = dot(e[0], e[1]);
        if (1-cosine*cosine > LARGEST_SINE*LARGEST_SINE)
            axis = NULL;
        else
            for (int k = 0; k < 3; k++)
                axis[k] += (cosine < 0 ? -1 : 1)*e[1][k];
    }
    if (axis != NULL && (hasLength[0] || hasLength[1])) {
        normalize(axis);
        if (fabs(dot(axis, course.normal)) > LARGEST_SINE)
            axis = NULL;
    }
    if (axis == NULL) {
        setOuter(1, course.normal, across);
        return false;
    }
    setOuter(hasLength[0] || hasLength[1] ? -1 : 0, axis, across);
    for (int k : {0, 3, 5})
        across[k] += 1;
    return true;
}

} // namespace

ContactRest::ContactRest(double softness, double predicted) : softness(softness) {
    if (isResolved())
        gap = RestGap(predicted, 0, softness, 0).get();
}

void ContactRest::look(const ContactCourse& course, double gap, double depth, double largest) {
    if (!(gap < 0))
        return;
    const bool isDisc = findAcross(course, across);
    double begun[3], now[3];
    multiply(across, course.begun, begun);
    multiply(across, course.now, now);
    // Lines have a side, which they may have left: discs have none.
    const double distance = isDisc ? sqrt(dot(begun, begun)) : dot(begun, course.normal);
    const double before = distance-course.radii;
    const bool beginsBehind = !(before > -depth);
    if (!(gap < (beginsBehind ? 0 : -depth)))
        return;
    back = true;
    const double wanted = course.radii+(beginsBehind ? 0 : min(before, largest));
    if (isDisc && distance > 0)
        for (int k = 0; k < 3; k++)
            begun[k] *= wanted/distance;
    else
        for (int k = 0; k < 3; k++)
            begun[k] = wanted*course.normal[k];
    for (int k = 0; k < 3; k++)
        rest[k] = begun[k]+(begun[k]-now[k])/(STIFFENING*softness);
}

void ContactRest::findForce(const double* now, double stiffness, double* force, double* projection) const {
    double difference[3];
    for (int k = 0; k < 3; k++)
        difference[k] = rest[k]-now[k];
    multiply(across, difference, force);
    for (int k = 0; k < 3; k++)
        force[k] *= STIFFENING*stiffness;
    for (int k = 0; k < 6; k++)
        projection[k] = STIFFENING*stiffness*across[k];
}
