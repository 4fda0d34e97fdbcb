/**
 * This tests where contacts come back to: discs and spheres to their distance, lines along the normal that they have in
 * the middle of the step, so that their distance comes back although they turn and slide, and what began behind the
 * wall to the wall. The responses are those of free motion, so that what comes back gets exactly to where it belongs.
 * Discs and spheres that diffuse in steps as long as their radius have no preferred distance.
 */

#include "TestChains.h"
#include "networks/ContactRest.h"
#include <algorithm>
#include <random>

static const double STIFFNESS = 3, DEPTH = 0.2, RADII = 2, LARGEST = 2;

/** Two segments that begin as in one place, and are as in the other now. */
static ContactCourse makeCourse(double softness, const SegmentPair& begun, const SegmentPair& now) {
    return {begun, now, RADII, softness};
}

/** Two that do not turn, whose places at s = t = 0 are where they touch: r0 and r*. */
static ContactCourse makeCourse(double softness, const Vec3d& begun, const Vec3d& now, const Vec3d& other,
        double length = 5) {
    const Vec3d along = {length, 0, 0};
    return makeCourse(softness, {along, other, begun}, {along, other, now});
}

static Contact makeContact(const Vec3d& normal, double gap) {
    return {0, 0, {normal.x, normal.y, normal.z}, gap, 1, false};
}

/** Move what comes back by its force, with the response that it was told: the way to the place where they balance. */
static Vec3d balance(const ContactRest& rest, double softness, const Vec3d& now) {
    double force[3], projection[6];
    rest.findForce(now, STIFFNESS, force, projection);
    const double c = softness/STIFFNESS, factor = 1/(1+ContactRest::STIFFENING*softness);
    return Vec3d {force[0], force[1], force[2]}*(c*factor);
}

static double sizeOf(const Vec3d& v) {
    return sqrt(v.squared());
}

static void testDiscs() {
    mt19937_64 generator(1);
    uniform_real_distribution<double> uniform(-1, 1);
    for (int i = 0; i < 100; i++) {
        // Along x, against each other in half of the cases, at an angle below 0.2; the normal turns in the step.
        const Vec3d other = {i%2 ? 4.0 : -4.0, 0.5*uniform(generator), 0.5*uniform(generator)};
        const double angle = M_PI*uniform(generator), turned = angle+uniform(generator);
        const double distance = RADII+1+uniform(generator), deep = RADII-0.5;
        const Vec3d begun = {uniform(generator), distance*cos(angle), distance*sin(angle)};
        const Vec3d now = {uniform(generator), deep*cos(turned), deep*sin(turned)};
        ContactRest rest(10, -0.5);
        check(rest.isKnown() && !rest.isResolved(), "a long step");
        Contact contact = makeContact({0, cos(turned), sin(turned)}, -0.5);
        rest.look(makeCourse(10, begun, now, other), contact, DEPTH, LARGEST);
        check(rest.isBack(), "it comes back");
        const Vec3d moved = balance(rest, 10, now);
        // Across the mean of both directions.
        const Vec3d axis = Vec3d {1, 0, 0}+other*((i%2 ? 1 : -1)/sizeOf(other));
        auto across = [&] (const Vec3d& v) {
            return v-axis*(v.dot(axis)/axis.squared());
        };
        const Vec3d first = across(begun), last = across(now+moved), sum = first+last;
        checkClose(sizeOf(first), sizeOf(last), RADII, 1e-12, "discs have their distance back");
        checkClose(sum.squared()*moved.squared(), pow(sum.dot(moved), 2), pow(RADII, 4), 1e-12,
                "the way back is along the mean of both");
    }
}

static void testLines() {
    const Vec3d other = {0, 5, 0}, begun = {-0.4, 0.3, 2.5}, now = {-0.1, 0.2, -1};
    ContactRest rest(4, -3);
    Contact contact = makeContact({0, 0, 1}, -3);
    rest.look(makeCourse(4, begun, now, other), contact, DEPTH, LARGEST);
    const Vec3d moved = balance(rest, 4, now);
    check(moved.x == 0 && moved.y == 0, "lines slide");
    checkClose(2.5, now.z+moved.z, RADII, 1e-12, "lines come back along the normal");
}

/** The distance of two lines which cross. */
static double distanceOf(const SegmentPair& pair) {
    return fabs(pair.volume())/sizeOf(pair.p.cross(pair.q));
}

/**
 * Two lines that turn and slide in the step have their distance back to the third order of what they move, and where
 * they come back is found again when an iteration has led them elsewhere.
 */
static void testTurningLines() {
    mt19937_64 generator(2);
    uniform_real_distribution<double> uniform(-1, 1);
    auto random = [&] (double size) {
        return Vec3d {size*uniform(generator), size*uniform(generator), size*uniform(generator)};
    };
    double worst[2];
    for (int halved = 0; halved < 2; halved++) {
        const double size = halved ? 0.5 : 1;
        worst[halved] = 0;
        generator.seed(3);
        for (int i = 0; i < 200; i++) {
            const SegmentPair begun = {{6, 0, 0}, {3, 5, 0}, Vec3d {-3, 2, 2.5}+random(0.3)};
            // Both turn by up to 0.2, slide by 1, and pass through each other.
            const SegmentPair now = {begun.p+random(0.7*size), begun.q+random(0.7*size),
                    begun.w+random(0.6*size)+Vec3d {0, 0, -3*size}};
            const NearestPoints nearest = findNearestPoints(now);
            Contact contact = {nearest.s, nearest.t, {0, 0, 1}, -1, 1, false};
            ContactRest rest(1000, -1);
            rest.look(makeCourse(1000, begun, now), contact, 0, 10);
            check(rest.isBack(), "turning lines come back");
            SegmentPair found = now;
            for (int iteration = 0; iteration < 4; iteration++) {
                // Where they balance: a force on the first one alone, whose places all move alike.
                const Vec3d moved = balance(rest, 1000, now.between(contact.s, contact.t));
                found.w = now.w+moved;
                rest.follow(begun, found, contact);
            }
            worst[halved] = max(worst[halved], fabs(distanceOf(found)-distanceOf(begun)));
        }
    }
    check(worst[0] < 0.03 && worst[0] > 1e-4, "turning lines have their distance back");
    check(worst[1] < worst[0]/5, "to the third order");
}

/** Two that lie along each other, and that have passed through each other by turning about each other. */
static void testPassed() {
    const Vec3d other = {5, 0.5, 0}, begun = {0.4, 0.3, 2.5}, now = {0.1, -0.2, -1.5};
    ContactCourse course = makeCourse(4, begun, now, other);
    course.passed = true;
    ContactRest rest(4, -3.5);
    Contact contact = makeContact({0, 0, 1}, -3.5);
    rest.look(course, contact, DEPTH, LARGEST);
    check(rest.isBack(), "it comes back");
    const Vec3d moved = balance(rest, 4, now);
    check(moved.x == 0 && moved.y == 0, "what has passed does not turn");
    checkClose(2.5, now.z+moved.z, RADII, 1e-12, "what has passed comes back along the normal");
}

static void testSpheres() {
    const Vec3d begun = {2.1, 0.3, 0.4}, now = {0.2, 1.0, 0};
    ContactRest rest(4, -1);
    Contact contact = makeContact({0, 1, 0}, -1);
    rest.look(makeCourse(4, begun, now, {0, 0, 0}, 0), contact, DEPTH, LARGEST);
    checkClose(sizeOf(begun), sizeOf(now+balance(rest, 4, now)), RADII, 1e-12, "spheres have their distance back");
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
    Vec3d r = {0, RADII+1, 0};
    const double length = dimensions == 2 ? 5 : 0;
    double sum = 0, squares = 0;
    for (int block = 0; block < blocks; block++) {
        double near = 0;
        for (int i = 0; i < steps/blocks; i++) {
            const double along = dimensions == 3 ? r.x+normal(generator) : 0;
            const double y = r.y+normal(generator), z = r.z+normal(generator);
            const Vec3d now = {along, y, z};
            const double distance = sizeOf(now), gap = distance-RADII;
            if (gap < 0) {
                ContactRest rest(softness, gap);
                // The wall at the surface, where spheres that began outside are.
                Contact contact = makeContact(now*(1/distance), gap);
                rest.look(makeCourse(softness, r, now, {length, 0, 0}, length), contact, 0, LARGEST+2);
                r = now+balance(rest, softness, now);
            }
            else if (distance < farthest)
                r = now;
            near += sizeOf(r) < RADII+0.5;
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

static void testWall() {
    const Vec3d other = {5, 0, 0}, behind = {0, 0, 1.5}, deeper = {0, 0, 1.4}, now = {0, 0, 1.9};
    ContactRest rest(4, -0.6), open(4, -0.1), resolved(0.5, -0.1);
    Contact contact = makeContact({0, 0, 1}, -0.6);
    rest.look(makeCourse(4, behind, deeper, other), contact, DEPTH, LARGEST);
    check(rest.isBack(), "what began behind comes to the wall");
    checkClose(RADII-DEPTH, deeper.z+balance(rest, 4, deeper).z, RADII, 1e-12, "at the wall");
    contact = makeContact({0, 0, 1}, -0.1);
    open.look(makeCourse(4, behind, now, other), contact, DEPTH, LARGEST);
    check(!open.isBack(), "less than the depth behind the surface is no overlap");
    check(resolved.isResolved() && resolved.getGap() > 0 && resolved.getGap() < 0.1, "short steps resolve");
    check(!ContactRest().isKnown(), "not looked at");
    // What comes from far away comes back no farther than it is told.
    const Vec3d far = {0, 0, 50}, deep = {0, 0, 1};
    ContactRest limited(4, -1);
    contact = makeContact({0, 0, 1}, -1);
    limited.look(makeCourse(4, far, deep, other), contact, DEPTH, LARGEST);
    checkClose(RADII+LARGEST, deep.z+balance(limited, 4, deep).z, RADII, 1e-12, "not too far");
}

int main() {
    return runTests({testDiscs, testLines, testTurningLines, testPassed, testSpheres, testDiffusion, testWall});
}
