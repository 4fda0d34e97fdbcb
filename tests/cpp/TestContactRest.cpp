/**
 * This tests where contacts come back to: discs and spheres to their distance, lines along their normal, and what began
 * behind its surface to the surface. The responses are those of free motion, so that what comes back gets exactly to
 * where it belongs. Discs and spheres that diffuse in steps as long as their radius have no preferred distance.
 */

#include "TestChains.h"
#include "dynamics/ContactRest.h"
#include <algorithm>
#include <random>

static const double STIFFNESS = 3, DEPTH = 0.2, RADII = 2, LARGEST = 2;

struct Vector {
    double v[3];
};

static double dot(const double* a, const double* b) {
    return a[0]*b[0]+a[1]*b[1]+a[2]*b[2];
}

static ContactCourse makeCourse(double softness, const double (&begun)[3], const double (&now)[3],
        const double (&other)[3], const double* normal) {
    ContactCourse course = {};
    copy_n(begun, 3, course.begun);
    copy_n(now, 3, course.now);
    course.along[0][0] = 5;
    copy_n(other, 3, course.along[1]);
    course.normal = normal;
    course.radii = RADII;
    course.softness = softness;
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
        rest.look(makeCourse(10, begun, now, other, normal), -0.5, DEPTH, LARGEST);
        check(rest.isBack(), "it comes back");
        double found[3], axis[3] = {5, 0, 0};
        balance(rest, 10, now, found);
        // Across the mean of both directions.
        const double size = sqrt(dot(other, other));
        for (int k = 0; k < 3; k++)
            axis[k] = axis[k]/5+(i%2 ? 1 : -1)*other[k]/size;
        auto across = [&] (const double* v) {
            const double along = dot(v, axis)/dot(axis, axis);
            return Vector {v[0]-along*axis[0], v[1]-along*axis[1], v[2]-along*axis[2]};
        };
        const Vector first = across(begun), last = across(found), moved = {found[0]-now[0], found[1]-now[1],
                found[2]-now[2]};
        checkClose(sqrt(dot(first.v, first.v)), sqrt(dot(last.v, last.v)), RADII, 1e-12,
                "discs have their distance back");
        const double with = (first.v[0]+last.v[0])*moved.v[0]+(first.v[1]+last.v[1])*moved.v[1]+
                (first.v[2]+last.v[2])*moved.v[2];
        const Vector sum = {first.v[0]+last.v[0], first.v[1]+last.v[1], first.v[2]+last.v[2]};
        checkClose(dot(sum.v, sum.v)*dot(moved.v, moved.v), with*with, pow(RADII, 4), 1e-12,
                "the way back is along the mean of both");
    }
}

static void testLines() {
    const double other[3] = {0, 5, 0}, begun[3] = {0.4, 0.3, 2.5}, now[3] = {0.1, -0.2, -1}, normal[3] = {0, 0, 1};
    ContactRest rest(4, -3);
    rest.look(makeCourse(4, begun, now, other, normal), -3, DEPTH, LARGEST);
    double found[3];
    balance(rest, 4, now, found);
    check(found[0] == now[0] && found[1] == now[1], "lines slide");
    checkClose(2.5, found[2], RADII, 1e-12, "lines come back along the normal");
}

/** Two that lie along each other, and that have passed through each other by turning about each other. */
static void testPassed() {
    const double other[3] = {5, 0.5, 0}, begun[3] = {0.4, 0.3, 2.5}, now[3] = {0.1, -0.2, -1.5}, normal[3] = {0, 0, 1};
    ContactCourse course = makeCourse(4, begun, now, other, normal);
    course.passed = true;
    ContactRest rest(4, -3.5);
    rest.look(course, -3.5, DEPTH, LARGEST);
    check(rest.isBack(), "it comes back");
    double found[3];
    balance(rest, 4, now, found);
    check(found[0] == now[0] && found[1] == now[1], "what has passed does not turn");
    checkClose(2.5, found[2], RADII, 1e-12, "what has passed comes back along the normal");
}

static void testSpheres() {
    const double none[3] = {0, 0, 0}, begun[3] = {2.1, 0.3, 0.4}, now[3] = {0.2, 1.0, 0}, normal[3] = {0, 1, 0};
    ContactCourse course = makeCourse(4, begun, now, none, normal);
    course.along[0][0] = 0;
    ContactRest rest(4, -1);
    rest.look(course, -1, DEPTH, LARGEST);
    double found[3];
    balance(rest, 4, now, found);
    checkClose(sqrt(dot(begun, begun)), sqrt(dot(found, found)), RADII, 1e-12, "spheres have their distance back");
}

/**
 * Two discs, or spheres, which diffuse in long steps: within a distance, all places are as probable.
 *
 * @param dimensions  2 for discs, 3 for spheres
 */
static void checkDiffusion(int dimensions, double step) {
    mt19937_64 generator(dimensions);
    normal_distribution<double> normal(0, step);
    const double farthest = RADII+3, softness = 50;
    const int steps = 4000000, blocks = 40;
    double r[3] = {0, RADII+1, 0}, length = dimensions == 2 ? 5 : 0, sum = 0, squares = 0;
    const double along[3] = {length, 0, 0};
    for (int block = 0; block < blocks; block++) {
        double near = 0;
        for (int i = 0; i < steps/blocks; i++) {
            double now[3] = {0, 0, 0};
            for (int k = 3-dimensions; k < 3; k++)
                now[k] = r[k]+normal(generator);
            const double distance = sqrt(dot(now, now)), gap = distance-RADII;
            if (gap < 0) {
                const double outwards[3] = {now[0]/distance, now[1]/distance, now[2]/distance};
                ContactCourse course = makeCourse(softness, r, now, along, outwards);
                course.along[0][0] = length;
                ContactRest rest(softness, gap);
                // The wall at the surface, where spheres that began outside are.
                rest.look(course, gap, 0, LARGEST+2);
                double found[3];
                balance(rest, softness, now, found);
                copy_n(found, 3, r);
            }
            else if (distance < farthest)
                copy_n(now, 3, r);
            near += sqrt(dot(r, r)) < RADII+0.5;
        }
        near *= (double) blocks/steps;
        sum += near/blocks;
        squares += near*near/blocks;
    }
    auto volume = [&] (double radius) {
        return pow(radius, dimensions)-pow(RADII, dimensions);
    };
    const double exact = volume(RADII+0.5)/volume(farthest), error = sqrt((squares-sum*sum)/(blocks-1));
    check(error < 0.01*exact, "enough steps");
    checkClose(exact, sum, 4*error, 1, "discs and spheres have no preferred distance");
}

static void testDiffusion() {
    checkDiffusion(2, 0.7*RADII);
    checkDiffusion(3, 0.7*RADII);
}

static void testSurface() {
    const double other[3] = {5, 0, 0}, behind[3] = {0, 0, 1.5}, now[3] = {0, 0, 1.9}, normal[3] = {0, 0, 1};
    ContactRest rest(4, -0.1), open(4, -0.1), resolved(0.5, -0.1);
    rest.look(makeCourse(4, behind, now, other, normal), -0.1, DEPTH, LARGEST);
    check(rest.isBack(), "what began behind comes to the surface");
    double found[3];
    balance(rest, 4, now, found);
    checkClose(RADII, found[2], RADII, 1e-12, "at the surface");
    const double before[3] = {0, 0, 2.5};
    open.look(makeCourse(4, before, now, other, normal), -0.1, DEPTH, LARGEST);
    check(!open.isBack(), "less than the depth behind the surface is no overlap");
    check(resolved.isResolved() && resolved.getGap() > 0 && resolved.getGap() < 0.1, "short steps resolve");
    check(!ContactRest().isKnown(), "not looked at");
    // What comes from far away comes back no farther than it is told.
    const double far[3] = {0, 0, 50};
    ContactRest limited(4, -1);
    limited.look(makeCourse(4, far, now, other, normal), -1, DEPTH, LARGEST);
    balance(limited, 4, now, found);
    checkClose(RADII+LARGEST, found[2], RADII, 1e-12, "not too far");
}

int main() {
    try {
        for (auto test : {testDiscs, testLines, testPassed, testSpheres, testDiffusion, testSurface})
            test();
    }
    catch (const exception& error) {
        printf("FAILED: %s\n", error.what());
        return 1;
    }
    printf("Passed\n");
    return 0;
}
