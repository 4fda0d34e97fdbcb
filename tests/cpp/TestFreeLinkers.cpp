/**
 * This tests linkers that diffuse while they are not bound: numbers and places in equilibrium against partition
 * functions, which know nothing of positions; where those are that are not bound; and how diffusion limits binding.
 */

#include "TestLinkerSystems.h"
#include "kinetics/LinkerRegion.h"

static LinkerState placed(LinkerState state, const LinkerSystem& system, const KineticStep& step) {
    check(placeFreeLinkers(state, system, step.boxes.distances, step.seed, step.force), "no room");
    return state;
}

static LinkerSystem diffusing(LinkerSystem system, double diffusion, const vector<Wall>& walls = {},
        double affinity = 0.1) {
    system.types[0].diffusion = diffusion;
    system.walls = walls;
    // In small regions, most would be bound.
    for (Hand& hand : system.hands)
        hand.bindingRate *= affinity;
    return system;
}

static Wall wallOf(WallShape shape, const double* point, const double* vector, double length) {
    Wall wall;
    wall.shape = shape;
    copy(point, point+3, wall.point);
    copy(vector, vector+3, wall.vector);
    wall.length = length;
    return wall;
}

/** Let all hands bind to all rods that there are, and to no others. */
static void bindToAll(const Rods& rods, LinkerSystem& system) {
    for (Hand& hand : system.hands) {
        hand.chains.clear();
        for (int chain = 0; chain < rods.chains.size(); chain++)
            hand.chains.push_back(chain);
    }
}

static void checkDiffusing(const Rods& rods, LinkerSystem system, double stepSize, const double* box,
        double volume) {
    const KineticStep step = stepOf(rods.x, stepSize, box);
    bindToAll(rods, system);
    LinkerKinetics kinetics(system, rods.chains);
    LinkerState state = placed(freeLinkers(2000), system, step);
    // They have to come there.
    for (int i = 0; i < 100/stepSize; i++)
        kinetics.advance(state, step, SERIAL);
    checkEquilibrium(kinetics, state, step, expectedOn(rods, system, volume));
}

static const double SKEWED_BOX[] = {400, 0, 0, 100, 400, 0, -150, 50, 400};

static const double LEFT[] = {-50, 0, 0};

static void checkCrossedRods(double stepSize) {
    Rods crossed;
    const double b[] = {0, -30, 20}, y[] = {0.6, 0.8, 0};
    crossed.add(LEFT, ALONG_X, 2, 50);
    crossed.add(b, y, 1, 100);
    checkDiffusing(crossed, diffusing(twoHands(0.02, 0, 120, 120, 0), 2e4), stepSize, SKEWED_BOX, 6.4e7);
}

static Rods parallelRods() {
    Rods parallel;
    const double c[] = {-45, 0, 20};
    parallel.add(LEFT, ALONG_X, 1, 100);
    parallel.add(c, ALONG_X, 4, 25);
    return parallel;
}

/** In a periodic box and within walls. */
static void testEquilibrium() {
    checkCrossedRods(10);
    // The rods touch the faces of a box, so that linkers cannot be all around them.
    const double lower[] = {-60, -10, -60}, upper[] = {180, 190, 140};
    const Wall faces = wallOf(WallShape::Box, lower, upper, 0);
    checkDiffusing(parallelRods(), diffusing(twoHands(0.02, 0, 100, 100, 0), 1e4, {faces}, 0.02), 0.3, NULL, 9.6e6);
}

static void testEquilibriumInSphere() {
    const double center[] = {0, -230, 0}, zero[] = {0, 0, 1};
    const Wall sphere = wallOf(WallShape::Sphere, center, zero, 250);
    checkDiffusing(parallelRods(), diffusing(twoHands(0.02, 0, 100, 100, 0), 1e4, {sphere}), 0.3, NULL,
            4*M_PI/3*pow(250, 3));
}

/** Steps a hundred times as short, and hands that differ, in a box so small that it has two cells along an axis. */
static void testEquilibriumInShortSteps() {
    checkCrossedRods(0.1);
    checkDiffusing(parallelRods(), diffusing(twoHands(0.05, 30, 80, 110, 0.6), 5e3), 0.2, SKEWED_BOX, 6.4e7);
}

/** In the plane, the volume of hands has an area in its place. */
static void testEquilibriumInPlane() {
    Rods rods;
    const double a[] = {-50, 0, 0}, c[] = {-45, 40, 0};
    rods.add(a, ALONG_X, 2, 50);
    rods.add(c, ALONG_X, 4, 25);
    const double box[] = {800, 0, 0, 100, 800, 0, 0, 0, 500};
    LinkerSystem system = diffusing(twoHands(0.01, 0, 90, 120, 0), 1e4, {}, 0.3);
    system.types[0].planar = true;
    checkDiffusing(rods, system, 0.2, box, 4.0/3*sqrt(90*120.0)*6.4e5);
}

static void testRandomWalks() {
    Rods rods;
    rods.add(ORIGIN, ALONG_X, 1, 10);
    const double box[] = {100, 0, 0, 0, 100, 0, 0, 0, 100};
    const int count = 20000, steps = 25;
    for (bool planar : {false, true}) {
        LinkerSystem system = diffusing(twoHands(0.02, 0, 5, 5, 0), 3);
        system.types[0].planar = planar;
        for (Hand& hand : system.hands)
            hand.bindingRate = 0;
        const KineticStep step = stepOf(rods.x, 2, box);
        bindToAll(rods, system);
        LinkerKinetics kinetics(system, rods.chains);
        LinkerState state = placed(freeLinkers(count), system, step);
        const vector<double> before = state.positions;
        for (int i = 0; i < steps; i++)
            kinetics.advance(state, step, SERIAL);
        const double expected = 2*3*2*steps, error = expected*sqrt(2.0/count);
        for (int k = 0; k < 3; k++) {
            double square = 0, mean = 0;
            for (int i = 0; i < count; i++) {
                const double moved = state.positions[3*i+k]-before[3*i+k];
                mean += moved/count;
                square += moved*moved/count;
            }
            const bool moves = !planar || k < 2;
            checkClose(moves ? expected : 0, square, moves ? 4*error : 1e-12, 1, "mean squared displacement");
            checkClose(0, mean, 4*sqrt(expected/count), 1, "drift");
        }
    }
}

/** All of a sphere is as likely, with bound linkers at its wall and in its middle. */
static void checkUniformDensity(double size) {
    Rods rods;
    const double a[] = {-50, 85, 0};
    rods.add(a, ALONG_X, 2, 50);
    const double center[] = {0, 0, 0}, zero[] = {0, 0, 1}, radius = 100;
    LinkerSystem system = diffusing(twoHands(0.05, 0, 30, 30, 0), 2e3,
            {wallOf(WallShape::Sphere, center, zero, radius)});
    const KineticStep step = stepOf(rods.x, size);
    bindToAll(rods, system);
    LinkerKinetics kinetics(system, rods.chains);
    LinkerState state = placed(freeLinkers(4000), system, step);
    for (int i = 0; i < 100/size; i++)
        kinetics.advance(state, step, SERIAL);
    vector<Mean> means(4);
    for (int block = 0; block < 20; block++) {
        for (int sample = 0; sample < 5; sample++) {
            for (int i = 0; i < 10/size; i++)
                kinetics.advance(state, step, SERIAL);
            for (size_t i = 0; i < state.linkers.size(); i++) {
                const double* x = &state.positions[3*i];
                const Linker& linker = state.linkers[i];
                check(std::isnan(x[0]) == (linker.isHeld(0) || linker.isHeld(1)), "who has a position");
                if (std::isnan(x[0]))
                    continue;
                const double r = sqrt(x[0]*x[0]+x[1]*x[1]+x[2]*x[2]);
                check(r <= radius, "outside");
                // Half of them in the inner shell, and where the rod is.
                means[0].add(r < radius*cbrt(0.5));
                means[1].add(x[1] > 50);
                means[2].add(r*r);
                means[3].add(x[0]*x[0] < 2500 && x[1] > 60);
            }
        }
        for (Mean& mean : means)
            mean.endBlock();
    }
    means[0].check("inner half", 0.5);
    means[1].check("cap", 5.0/32);
    means[2].check("radius of gyration", 0.6*radius*radius);
    // A cap less its parts with |x| > 50, by sums.
    double part = 0;
    const int points = 400;
    for (int i = 0; i < points; i++)
        for (int k = 0; k < points; k++) {
            const double x = -50+(i+0.5)*100/points, y = 60+(k+0.5)*40/points;
            part += 2*sqrt(max(0.0, radius*radius-x*x-y*y))*(100.0/points)*(40.0/points);
        }
    means[3].check("at the rod", part/(4*M_PI/3*pow(radius, 3)));
}

static void testUniformDensity() {
    checkUniformDensity(2);
}

static void testUniformDensityInShortSteps() {
    checkUniformDensity(0.1);
}

/** What is left of linkers in a cylinder around a rod that they bind to for ever, by sums over rings and times. */
static double shareLeft(double outer, double diffusion, double rate, double reach, double time) {
    const int rings = 400, times = 2000;
    const double width = outer/rings, interval = time/times;
    Array share(rings, 1), slope(rings), value(rings);
    for (int step = 0; step < times; step++) {
        // An implicit step: elimination outwards.
        for (int i = 0; i < rings; i++) {
            const double r = (i+0.5)*width, flow = diffusion*interval/(width*width);
            const double in = i == 0 ? 0 : flow*i/(i+0.5), out = i+1 == rings ? 0 : flow*(i+1)/(i+0.5);
            const double within = r < reach ? 2*sqrt(reach*reach-r*r) : 0;
            const double diagonal = 1+in+out+rate*within*interval-(i == 0 ? 0 : in*slope[i-1]);
            slope[i] = out/diagonal;
            value[i] = (share[i]+(i == 0 ? 0 : in*value[i-1]))/diagonal;
        }
        for (int i = rings-1; i >= 0; i--)
            share[i] = value[i]+(i+1 == rings ? 0 : slope[i]*share[i+1]);
    }
    double left = 0;
    for (int i = 0; i < rings; i++)
        left += share[i]*(2*i+1)/(rings*static_cast<double>(rings));
    return left;
}

/** Binding is limited by diffusion: fewer linkers are around a rod to which they bind fast. */
static void testDepletion() {
    const double reach = 50, outer = 200, diffusion = 1, rate = 1e-4, stepSize = 5;
    Rods rods;
    const double z[] = {0, 0, 1};
    rods.add(ORIGIN, z, 6, 50);
    LinkerSystem system = diffusing(twoHands(0.05, 0, reach, reach, 0), diffusion,
            {wallOf(WallShape::Cylinder, ORIGIN, z, outer)});
    for (Hand& hand : system.hands) {
        hand.bindingRate = 0.5*rate;
        hand.unbindingRate = 0;
    }
    const double box[] = {500, 0, 0, 0, 500, 0, 0, 0, 300};
    const KineticStep step = stepOf(rods.x, stepSize, box);
    bindToAll(rods, system);
    LinkerKinetics kinetics(system, rods.chains);
    const int count = 10000, steps = 1500;
    LinkerState state = placed(freeLinkers(count), system, step);
    for (int i = 0; i < steps; i++)
        kinetics.advance(state, step, SERIAL);
    const double left = count_if(state.linkers.begin(), state.linkers.end(), [] (const Linker& linker) {
        return !linker.isHeld(0) && !linker.isHeld(1);
    });
    const double share = left/count, error = sqrt(share*(1-share)/count);
    const double expected = shareLeft(outer, diffusion, rate, reach, steps*stepSize);
    // Without depletion, that of a reservoir.
    const double mixed = exp(-rate*4*M_PI/3*pow(reach, 3)/(M_PI*outer*outer)*steps*stepSize);
    check(4*error < 0.05*expected && expected > 2*mixed, "nothing is shown");
    checkClose(expected, share, 4*error, 1, "what is left");
}

int main() {
    return runTests({
        testRandomWalks,
        testEquilibrium,
        testEquilibriumInPlane,
        testUniformDensity
    }, {
        testEquilibriumInSphere,
        testEquilibriumInShortSteps,
        testUniformDensityInShortSteps,
        testDepletion
    });
}
