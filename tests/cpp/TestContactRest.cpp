/**
 * This tests where contacts come back to: discs with the whole vector across them, lines along their normal alone, and
 * what began behind its surface to the surface. The responses are those of free motion, so that what comes back gets
 * exactly to where it was.
 */

#include "TestChains.h"
#include "dynamics/ContactRest.h"
#include <algorithm>
#include <random>

static const double STIFFNESS = 3, DEPTH = 0.2, RADII = 2, LARGEST = 2;

static ContactCourse makeCourse(const double (&begun)[3], const double (&now)[3], const double (&other)[3],
        const double* normal) {
    ContactCourse course = {};
    copy_n(begun, 3, course.begun);
    copy_n(now, 3, course.now);
    course.along[0][0] = 5;
    copy_n(other, 3, course.along[1]);
    course.normal = normal;
    course.radii = RADII;
    return course;
}

/** Move what comes back by its force, with the response that it was told: the place where they balance. */
static void balance(const ContactRest& rest, double softness, const double* start, double* now) {
    double force[3], projection[6];
    rest.findForce(start, STIFFNESS, force, projection);
    const double c = softness/STIFFNESS, factor = 1/(1+ContactRest::STIFFENING*softness);
    for (int k = 0; k < 3; k++)
        now[k] = start[k]+c*factor*force[k];
}

static void testDiscs() {
    mt19937_64 generator(1);
    uniform_real_distribution<double> uniform(-1, 1);
    for (int i = 0; i < 100; i++) {
        // Along x, against each other in half of the cases, at an angle below 0.2; the normal turns in the step.
        const double other[3] = {i%2 ? 4.0 : -4.0, 0.5*uniform(generator), 0.5*uniform(generator)};
        const double angle = M_PI*uniform(generator), turned = angle+uniform(generator);
        const double distance = RADII+1+uniform(generator), deep = RADII-0.5;
        const double begun[3] = {uniform(generator), distance*cos(angle), distance*sin(angle)};
        const double now[3] = {uniform(generator), deep*cos(turned), deep*sin(turned)};
        const double normal[3] = {0, cos(turned), sin(turned)};
        ContactRest rest(10, -0.5);
        check(rest.isKnown() && !rest.isResolved(), "a long step");
        rest.look(makeCourse(begun, now, other, normal), -0.5, DEPTH, LARGEST);
        check(rest.isBack(), "it comes back");
        double found[3], axis[3] = {5, 0, 0};
        balance(rest, 10, now, found);
        // Across the mean of both directions.
        const double size = sqrt(other[0]*other[0]+other[1]*other[1]+other[2]*other[2]);
        for (int k = 0; k < 3; k++)
            axis[k] = axis[k]/5+(i%2 ? 1 : -1)*other[k]/size;
        const double square = axis[0]*axis[0]+axis[1]*axis[1]+axis[2]*axis[2];
        double along = 0;
        for (int k = 0; k < 3; k++)
            along += (found[k]-begun[k])*axis[k]/square;
        for (int k = 0; k < 3; k++)
            checkClose(along*axis[k], found[k]-begun[k], RADII, 1e-12, "the vector across is that of the beginning");
    }
}

static void testLines() {
    const double other[3] = {0, 5, 0}, begun[3] = {0.4, 0.3, 2.5}, now[3] = {0.1, -0.2, -1}, normal[3] = {0, 0, 1};
    ContactRest rest(4, -3);
    rest.look(makeCourse(begun, now, other, normal), -3, DEPTH, LARGEST);
    double found[3];
    balance(rest, 4, now, found);
    check(found[0] == now[0] && found[1] == now[1], "lines slide");
    checkClose(2.5, found[2], RADII, 1e-12, "lines come back along the normal");
}

static void testSpheres() {
    const double none[3] = {0, 0, 0}, begun[3] = {2.1, 0.3, 0.4}, now[3] = {0.2, 1.0, 0}, normal[3] = {0, 1, 0};
    ContactCourse course = makeCourse(begun, now, none, normal);
    course.along[0][0] = 0;
    ContactRest rest(4, -1);
    rest.look(course, -1, DEPTH, LARGEST);
    double found[3];
    balance(rest, 4, now, found);
    for (int k = 0; k < 3; k++)
        checkClose(begun[k], found[k], RADII, 1e-12, "spheres come back to where they were");
}

static void testSurface() {
    const double other[3] = {5, 0, 0}, behind[3] = {0, 0, 1.5}, now[3] = {0, 0, 1.9}, normal[3] = {0, 0, 1};
    ContactRest rest(4, -0.1), open(4, -0.1), resolved(0.5, -0.1);
    rest.look(makeCourse(behind, now, other, normal), -0.1, DEPTH, LARGEST);
    check(rest.isBack(), "what began behind comes to the surface");
    double found[3];
    balance(rest, 4, now, found);
    checkClose(RADII, found[2], RADII, 1e-12, "at the surface");
    const double before[3] = {0, 0, 2.5};
    open.look(makeCourse(before, now, other, normal), -0.1, DEPTH, LARGEST);
    check(!open.isBack(), "less than the depth behind the surface is no overlap");
    check(resolved.isResolved() && resolved.getGap() > 0 && resolved.getGap() < 0.1, "short steps resolve");
    check(!ContactRest().isKnown(), "not looked at");
    // What comes from far away comes back no farther than it is told.
    const double far[3] = {0, 0, 50};
    ContactRest limited(4, -1);
    limited.look(makeCourse(far, now, other, normal), -1, DEPTH, LARGEST);
    balance(limited, 4, now, found);
    checkClose(RADII+LARGEST, found[2], RADII, 1e-12, "not too far");
}

int main() {
    try {
        for (auto test : {testDiscs, testLines, testSpheres, testSurface})
            test();
    }
    catch (const exception& error) {
        printf("FAILED: %s\n", error.what());
        return 1;
    }
    printf("Passed\n");
    return 0;
}
