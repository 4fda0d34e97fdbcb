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
 * Find the axis that two capsules have together which lie along each other.
 *
 * @param axis  receives it; zero for spheres
 * @return false if they cross at an angle
 */
bool findAxis(const ContactCourse& course, double* axis) {
    double e[2][3];
    bool hasLength[2];
    for (int i = 0; i < 2; i++) {
        copy_n(course.along[i], 3, e[i]);
        hasLength[i] = normalize(e[i]);
    }
    fill(axis, axis+3, 0.0);
    if (!hasLength[0] && !hasLength[1])
        return true;
    copy_n(hasLength[0] ? e[0] : e[1], 3, axis);
    if (hasLength[0] && hasLength[1]) {
        const double cosine = dot(e[0], e[1]);
        if (1-cosine*cosine > LARGEST_SINE*LARGEST_SINE)
            return false;
        for (int k = 0; k < 3; k++)
            axis[k] += (cosine < 0 ? -1 : 1)*e[1][k];
        normalize(axis);
    }
    return fabs(dot(axis, course.normal)) <= LARGEST_SINE;
}

/** Find what of a vector is across an axis of length 1. */
void findAcross(const double* v, const double* axis, double* result) {
    const double along = dot(v, axis);
    for (int k = 0; k < 3; k++)
        result[k] = v[k]-along*axis[k];
}

} // namespace

ContactRest::ContactRest(double softness, double predicted) : softness(softness) {
    if (isResolved())
        gap = RestGap(predicted, 0, softness, 0).get();
}

void ContactRest::look(const ContactCourse& course, double gap, double depth, double largest) {
    if (!(gap < 0))
        return;
    copy_n(course.normal, 3, normal);
    double axis[3], begun[3], now[3];
    copy_n(course.begun, 3, begun);
    copy_n(course.now, 3, now);
    // Lines have a side, which they may have left: discs have none.
    double distance = dot(begun, normal);
    if (!course.passed && findAxis(course, axis)) {
        findAcross(course.begun, axis, begun);
        findAcross(course.now, axis, now);
        distance = sqrt(dot(begun, begun));
        double middle[3];
        for (int k = 0; k < 3; k++)
            middle[k] = begun[k]+now[k];
        if (normalize(middle))
            copy_n(middle, 3, normal);
    }
    const double before = distance-course.radii;
    const bool beginsBehind = !(before > -depth);
    if (!(gap < (beginsBehind ? 0 : -depth)))
        return;
    back = true;
    double wanted = dot(begun, normal);
    if (beginsBehind)
        wanted = course.radii;
    else if (before > largest)
        wanted = min(wanted, course.radii+largest);
    target = wanted+(wanted-dot(now, normal))/(STIFFENING*course.softness);
}

void ContactRest::findForce(const double* now, double stiffness, double* force, double* projection) const {
    const double size = STIFFENING*stiffness*(target-dot(normal, now));
    for (int k = 0; k < 3; k++)
        force[k] = size*normal[k];
    setOuter(STIFFENING*stiffness, normal, projection);
}
