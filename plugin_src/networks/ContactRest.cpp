#include "networks/ContactRest.h"
#include "couplings/Crossings.h"
#include "mechanics/SymmetricMatrices.h"
#include "networks/RestGap.h"
#include <algorithm>
#include <cmath>

using namespace cylchain;
using namespace std;

namespace {

/** Up to this sine of the angle between them, and of that between the normal and the plane across, two are discs. */
const double LARGEST_SINE = 0.3;
/** The least cosine of the angle by which the normal turns in half of a step. */
const double LEAST_COSINE = 0.2;

/** Get a vector of length 1; zero if it has no length. */
Vec3d normalized(const Vec3d& v) {
    const double length = sqrt(v.squared());
    return length > 0 ? v*(1/length) : Vec3d {0, 0, 0};
}

/**
 * Find the axis that two capsules have together which lie along each other.
 *
 * @param axis  receives it; zero for spheres
 * @return false if they cross at an angle
 */
bool findAxis(const SegmentPair& pair, const Vec3d& normal, Vec3d& axis) {
    const Vec3d p = normalized(pair.p), q = normalized(pair.q);
    const double cosine = p.dot(q);
    if (p.squared() > 0 && q.squared() > 0 && 1-cosine*cosine > LARGEST_SINE*LARGEST_SINE)
        return false;
    axis = normalized(p+q*(cosine < 0 ? -1 : 1));
    return fabs(axis.dot(normal)) <= LARGEST_SINE;
}

/** Find what of a vector is across an axis of length 1. */
Vec3d across(const Vec3d& v, const Vec3d& axis) {
    return v-axis*axis.dot(v);
}

Vec3d normalOf(const Contact& contact) {
    return {contact.normal[0], contact.normal[1], contact.normal[2]};
}

/**
 * Place a contact where two lines are nearest in the middle of the step.
 *
 * @return false if the normal is another one there: then the contact stays where it is
 */
bool placeInMiddle(const SegmentPair& begun, const SegmentPair& now, bool passed, Contact& contact) {
    const SegmentPair middle = interpolate(begun, now, 0.5);
    const NearestPoints nearest = findNearestPoints(middle);
    Vec3d normal = middle.p.cross(middle.q);
    const bool cross = normal.squared() > LARGEST_SINE*LARGEST_SINE*middle.p.squared()*middle.q.squared() &&
            nearest.s > 0 && nearest.s < 1 && nearest.t > 0 && nearest.t < 1;
    // What has passed is on neither side there.
    if (!cross && passed)
        return false;
    normal = normalized(cross ? normal : middle.between(nearest.s, nearest.t));
    const double cosine = normal.dot(normalOf(contact));
    if (!(fabs(cosine) > LEAST_COSINE))
        return false;
    const double sign = cosine < 0 ? -1 : 1;
    contact.s = nearest.s;
    contact.t = nearest.t;
    contact.normal[0] = sign*normal.x;
    contact.normal[1] = sign*normal.y;
    contact.normal[2] = sign*normal.z;
    return true;
}

} // namespace

ContactRest::ContactRest(double softness, double predicted) : softness(softness) {
    if (isResolved())
        gap = RestGap(predicted, 0, softness, 0).get();
}

void ContactRest::look(const ContactCourse& course, Contact& contact, double depth, double largest) {
    if (!(contact.gap < -depth))
        return;
    back = true;
    Vec3d axis, begun, now;
    double distance;
    if (!course.passed && findAxis(course.begun, normalOf(contact), axis)) {
        begun = across(course.begun.between(contact.s, contact.t), axis);
        now = across(course.now.between(contact.s, contact.t), axis);
        distance = sqrt(begun.squared());
        normal = normalized(begun+now);
        if (!(normal.squared() > 0))
            normal = normalOf(contact);
    }
    else {
        inMiddle = placeInMiddle(course.begun, course.now, course.passed, contact);
        normal = normalOf(contact);
        begun = course.begun.between(contact.s, contact.t);
        now = course.now.between(contact.s, contact.t);
        distance = inMiddle ? sqrt(findNearestPoints(course.begun).squared) : normal.dot(begun);
    }
    const double before = distance-course.radii;
    double wanted = normal.dot(begun);
    if (!(before > -depth)) {
        wanted = course.radii-depth;
        inMiddle = false;
    }
    else if (before > largest) {
        wanted = min(wanted, course.radii+largest);
        inMiddle = false;
    }
    beyond = (wanted-normal.dot(now))/(STIFFENING*course.softness);
    target = wanted+beyond;
}

void ContactRest::follow(const SegmentPair& begun, const SegmentPair& now, Contact& contact) {
    if (placeInMiddle(begun, now, false, contact)) {
        normal = normalOf(contact);
        target = normal.dot(begun.between(contact.s, contact.t))+beyond;
    }
}

void ContactRest::findForce(const Vec3d& now, double stiffness, double* force, double* projection) const {
    const double n[3] = {normal.x, normal.y, normal.z}, size = STIFFENING*stiffness*(target-normal.dot(now));
    for (int k = 0; k < 3; k++)
        force[k] = size*n[k];
    setOuter(STIFFENING*stiffness, n, projection);
}
