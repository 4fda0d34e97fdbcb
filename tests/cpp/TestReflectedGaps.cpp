/**
 * This tests gaps that soft surfaces hold open: where hard surfaces are drawn behind these, and that steps of any
 * length keep the Boltzmann distribution. Particles are free, or on springs, before planes, so that all equations are
 * linear; with one gap, or gaps that share no particle, the law is exact then. Exact values are quadratures.
 *
 * The units are k_B T, the thermal depth (k_B T/k)^(1/2) of a surface, and the friction of a particle.
 */

#include "TestChains.h"
#include "couplings/CapsuleGeometry.h"
#include "networks/ReflectedGaps.h"
#include <algorithm>
#include <memory>
#include <numeric>
#include <random>
#include <set>

/** A plane at a distance from the origin, which particles are before, along the normal. */
struct Plane {
    Vec3d normal;
    double from;
};

/** What particles are in: planes, a constant force, and a spring to the origin. */
struct Surroundings {
    vector<Plane> planes;
    Vec3d load;
    double spring = 0;
    /** What errors of the force are compared with. */
    double sizeOfForce = 1;
    double energyOfPlanes(const Vec3d& x) const {
        double sum = 0;
        for (const Plane& plane : planes)
            sum += 0.5*pow(min(0.0, x.dot(plane.normal)-plane.from), 2);
        return sum;
    }
};

/** Means over particles: of the first gap, of the energy of all surfaces, and of the force on the first gap. */
struct Means {
    double gap, energy, force;
};

static Vec3d vectorAt(const Array& x, int particle) {
    return {x[3*particle], x[3*particle+1], x[3*particle+2]};
}

/** Particles that take steps, all alike. */
class Particles {
public:
    Particles(const Surroundings& surroundings, const vector<Vec3d>& starts, double kT = 1) :
            surroundings(surroundings), places(noChains, noBeams, noBodies, starts.size()),
            pack(coupledParticles(starts.size())), x(3*starts.size()) {
        places.setParticles(coupledParticles(starts.size()));
        vector<int> lanes(starts.size());
        iota(lanes.begin(), lanes.end(), 0);
        places.setPacks({lanes});
        settings.scheme = Scheme::Implicit;
        settings.kT = kT;
        settings.seed = kT == 0 ? 1 : ++seeds;
        for (size_t i = 0; i < starts.size(); i++) {
            x[3*i] = starts[i].x;
            x[3*i+1] = starts[i].y;
            x[3*i+2] = starts[i].z;
        }
    }
    int size() const {
        return x.size()/3;
    }
    Vec3d at(int particle) const {
        return vectorAt(x, particle);
    }
    void step(double stepSize) {
        const int count = size(), numPlanes = surroundings.planes.size();
        settings.stepSize = stepSize;
        settings.step++;
        Array forces(x.size());
        for (int i = 0; i < count; i++) {
            forces[3*i] = surroundings.load.x;
            forces[3*i+1] = surroundings.load.y;
            forces[3*i+2] = surroundings.load.z;
        }
        const unique_ptr<bool[]> taken(new bool[count]);
        fill_n(taken.get(), count, true);
        pack.begin(x.data(), forces.data(), NULL, settings, taken.get());
        pack.beginStage(0);
        vector<CouplingEquation> equations;
        if (surroundings.spring > 0)
            addSprings(equations);
        gaps.begin(settings, places);
        Array depths;
        for (int i = 0; i < count; i++)
            for (int plane = 0; plane < numPlanes; plane++) {
                const Vec3d& normal = surroundings.planes[plane].normal;
                Gap gap;
                Place place;
                place.first = i;
                check(places.find(place, gap.levers[0].places[0]), "a particle is found");
                const double gradient[] = {normal.x, normal.y, normal.z};
                copy(gradient, gradient+3, gap.levers[0].gradient);
                gap.numLevers = 1;
                gap.stiffness = 1;
                gap.key[0] = plane;
                gap.key[1] = i;
                const GapNoise& noise = gaps.getNoise();
                depths.push_back(placeHardSurface(settings.kT, noise.getLimit(), noise.drawSurface(gap), HUGE_VAL,
                        gapOf(i, plane), gap));
                gap.end = gap.start;
                gaps.add(gap);
            }
        gaps.addEquations(equations, SERIAL);
        const vector<PackStep*> packs = {&pack};
        const CoupledEquations::Demands demands;
        const PackFlags active(1, 1);
        LaneFlags unfinished;
        unfinished.emplace_back(new bool[count]);
        coupled.solve(packs, active, equations, settings.kT, demands, SERIAL);
        gaps.push(packs, active, vector<char>(places.getNumChains(), 1), coupled, demands, SERIAL);
        coupled.advance(packs, active, ShareOfChange(), unfinished, SERIAL);
        const Array begun = x;
        pack.getPositions(begun.data(), x.data());
        for (int gap = 0; gap < gaps.size(); gap++)
            gaps.get(gap).end = gapOf(gap/numPlanes, gap%numPlanes)+depths[gap];
        check(!gaps.anyUnfinished(SERIAL), "the only iteration leads gaps to where they are predicted");
    }
    Means getMeans(int particle) const {
        return {gapOf(particle, 0), surroundings.energyOfPlanes(at(particle)),
                gaps.getForce(particle*surroundings.planes.size())};
    }
private:
    static vector<CoupledParticle> coupledParticles(int count) {
        vector<CoupledParticle> result;
        for (int i = 0; i < count; i++)
            result.push_back({i, 1.0});
        return result;
    }
    double gapOf(int particle, int plane) const {
        return at(particle).dot(surroundings.planes[plane].normal)-surroundings.planes[plane].from;
    }
    /** Springs as the implicit scheme has them: k (theta y+(1-theta) x-(2 theta-1)^(1/2) x_random). */
    void addSprings(vector<CouplingEquation>& equations) {
        const double k = surroundings.spring, theta = max(0.5, 1-1/(k*settings.stepSize));
        const Array random = normal(x.size());
        for (int i = 0; i < size(); i++) {
            CouplingEquation equation = {};
            Place place;
            place.first = i;
            places.find(place, equation.places[0]);
            for (int axis = 0; axis < 3; axis++)
                equation.force[axis] = -k*(x[3*i+axis]-sqrt((2*theta-1)*settings.kT/k)*random[3*i+axis]);
            equation.stiffness[0] = equation.stiffness[3] = equation.stiffness[5] = theta*k;
            equations.push_back(equation);
        }
    }
    static int seeds;
    const Surroundings surroundings;
    const vector<Chain> noChains;
    const vector<BeamChain> noBeams;
    const vector<RigidBody> noBodies;
    ChainPlaces places;
    ParticleStep pack;
    CoupledEquations coupled;
    ReflectedGaps gaps;
    StepSettings settings = {};
    Array x;
    NormalNumbers normal = NormalNumbers(3);
};

int Particles::seeds = 0;

/** Places in the plane z = 0 on a lattice around the origin, of the weight exp(-U), and their means. */
class Lattice {
public:
    Lattice(const Surroundings& surroundings, double reach, int points, bool line) {
        const double width = 2*reach/points;
        for (int i = 0; i < points; i++)
            for (int k = 0; k < (line ? 1 : points); k++) {
                const Vec3d x = {(i+0.5)*width-reach, line ? 0 : (k+0.5)*width-reach, 0};
                const double energy = surroundings.energyOfPlanes(x), gap = x.dot(surroundings.planes[0].normal)-
                        surroundings.planes[0].from;
                const double weight = exp(-energy+surroundings.load.dot(x)-0.5*surroundings.spring*x.squared());
                sum += weight;
                exact.gap += weight*gap;
                exact.energy += weight*energy;
                exact.force -= weight*min(0.0, gap);
                sizeOfGap += weight*gap*gap;
                if (weight > 1e-12) {
                    found.push_back(x);
                    weights.push_back(weight);
                }
            }
        for (double* value : {&exact.gap, &exact.energy, &exact.force})
            *value /= sum;
        sizeOfGap = sqrt(sizeOfGap/sum);
    }
    vector<Vec3d> draw(int count) const {
        mt19937_64 generator(5);
        discrete_distribution<size_t> distribution(weights.begin(), weights.end());
        vector<Vec3d> result(count);
        for (Vec3d& x : result)
            x = found[distribution(generator)];
        return result;
    }
    Means exact = {};
    double sizeOfGap = 0;
private:
    double sum = 0;
    vector<Vec3d> found;
    Array weights;
};

/** Of steps: how far a free particle moves in one, (2 h)^(1/2); the number of particles, and that of steps. */
struct Run {
    double motion;
    int count, steps;
};

/**
 * Begin in equilibrium, take steps, and compare the means of the second half of these with exact ones.
 *
 * @param allowed  by how much they may be wrong, over the exact ones
 */
static void checkEquilibrium(const Surroundings& surroundings, const Lattice& lattice, const Run& run, double allowed,
        const string& name) {
    Particles particles(surroundings, lattice.draw(run.count));
    Array gaps(run.count), energies(run.count), forces(run.count);
    for (int step = 0; step < run.steps; step++) {
        particles.step(0.5*run.motion*run.motion);
        for (int i = 0; i < run.count && step >= run.steps/2; i++) {
            const Means own = particles.getMeans(i);
            gaps[i] += own.gap;
            energies[i] += own.energy;
            forces[i] += own.force;
        }
    }
    const char* const names[] = {"gap", "energy", "force"};
    const Array* const sums[] = {&gaps, &energies, &forces};
    const double exact[] = {lattice.exact.gap, lattice.exact.energy, lattice.exact.force};
    const double scales[] = {lattice.sizeOfGap, lattice.exact.energy, surroundings.sizeOfForce};
    for (int i = 0; i < 3; i++) {
        double mean = 0, square = 0;
        for (double sum : *sums[i]) {
            const double own = sum/(run.steps-run.steps/2);
            mean += own/run.count;
            square += own*own/run.count;
        }
        const double error = sqrt((square-mean*mean)/run.count);
        const string what = name+", motion "+to_string(run.motion)+": "+names[i];
        check(4*error < 0.05*scales[i], what+": not enough steps");
        checkClose(exact[i], mean, 4*error+allowed*scales[i], 1, what);
    }
}

static void testHardSurfaces() {
    Gap gap;
    gap.stiffness = 4;
    auto place = [&] (double kT, double variate, double limit, double begun, double deepest = HUGE_VAL) {
        return placeHardSurface(kT, limit, variate, deepest, begun, gap);
    };
    checkClose(0.7, place(2, 0.49, 6, 1.5), 1, 1e-14, "the depth from outside is that of the variate");
    check(gap.law == GapLaw::Reflection && fabs(gap.start-2.2) < 1e-14, "a start outside");
    checkClose(sqrt(1.21+0.49), place(2, 0.49, 6, -1.1), 1, 1e-14, "from within, it is no less than the start");
    check(gap.law == GapLaw::Reflection && fabs(gap.start-(sqrt(1.7)-1.1)) < 1e-14, "a start within");
    const double limit = 6*sqrt(0.5);
    checkClose(limit, place(2, 100, 6, -1.1), 1, 1e-14, "it is no more than the limit");
    check(gap.law == GapLaw::Reflection && fabs(gap.start-(limit-1.1)) < 1e-14, "a start within, with the largest");
    checkClose(0, place(2, 0.49, 6, -5), 1, 0, "what begins deeper has no hard surface behind it");
    check(gap.law == GapLaw::Spring && gap.start == -5 && fabs(gap.ceiling+limit) < 1e-14, "a spring holds it");
    check(place(2, 0.49, 8.4, -5) > 5 && gap.law == GapLaw::Reflection, "another limit is deeper");
    checkClose(2, place(2, 100, 6, -1.1, 2), 1, 1e-14, "no surface is deeper than it may be");
    check(place(2, 0.49, 6, -400) == 0 && gap.law == GapLaw::Spring && isinf(gap.ceiling), "far behind");
    checkClose(0, place(0, 0.49, 6, -0.1), 1, 0, "nor has what does not move thermally");
    check(gap.law == GapLaw::SpringBehind && gap.start == -0.1, "it is held by a spring behind the surface alone");
}

/**
 * One gap, under a load: free particles in steps from half the thermal depth to twenty of it, with loads that press
 * them outside of the limits of hard surfaces, between these, and beyond.
 */
static void testOneGap() {
    for (double load : {0.5, 2.0, 6.0, 20.0}) {
        const Surroundings surroundings = {{{{1, 0, 0}, 0}}, {-load, 0, 0}, 0, load};
        const Lattice lattice(surroundings, 40, 80000, true);
        checkClose(load, lattice.exact.force, 1, 1e-6, "in equilibrium the load is balanced");
        for (const Run& run : {Run {0.5, 16000, 48}, Run {3, 16000, 16}, Run {20, 16000, 16}})
            checkEquilibrium(surroundings, lattice, run, 0, "one gap with the load "+to_string(load));
    }
}

/** The same for particles on springs, which relax in the step or not, with the surface before and behind the middle. */
static void testSprings() {
    for (double from : {-0.5, 1.0}) {
        const Surroundings surroundings = {{{{1, 0, 0}, from}}, {-0.3, 0, 0}, 0.3, 0.5};
        const Lattice lattice(surroundings, 30, 60000, true);
        for (const Run& run : {Run {1, 14000, 24}, Run {5, 12000, 16}, Run {40, 12000, 16}})
            checkEquilibrium(surroundings, lattice, run, 0, "a spring");
    }
}

/** Two gaps that share a particle: a load into a corner, whose planes push each other's gap open or shut. */
static void testTwoGaps() {
    for (double angle : {60.0, 120.0}) {
        const double along = cos(angle*M_PI/180), across = sin(angle*M_PI/180);
        const Surroundings surroundings = {{{{1, 0, 0}, 0}, {{along, across, 0}, 0}},
                {-0.7-0.7*along, -0.7*across, 0}, 0, 0.7};
        const Lattice lattice(surroundings, 40, 1600, false);
        for (const Run& run : {Run {1, 8000, 24}, Run {3, 8000, 12}})
            checkEquilibrium(surroundings, lattice, run, 0.05, "planes at an angle of "+to_string(angle));
    }
}

/** Two that push each other's gap shut nearly as far as they open their own: what is between two surfaces. */
static void testOpposedGaps() {
    const double cosine = -0.8, sine = 0.6;
    for (double load : {0.7, 2.0}) {
        const Surroundings surroundings = {{{{1, 0, 0}, 0}, {{cosine, sine, 0}, 0}},
                {-load*(1+cosine), -load*sine, 0}, 0, load};
        const Lattice lattice(surroundings, 40, 1600, false);
        for (const Run& run : {Run {1.5, 16000, 32}, Run {3, 16000, 16}})
            checkEquilibrium(surroundings, lattice, run, 0.05, "opposed planes with the load "+to_string(load));
    }
}

/** Twelve gaps that share a particle: a narrow prism. */
static void testTwelveGaps() {
    Surroundings surroundings = {{}, {-2, 0, 0}, 0, 0.9};
    for (int i = 0; i < 12; i++)
        surroundings.planes.push_back({{cos(i*M_PI/6), sin(i*M_PI/6), 0}, -2.5});
    const Lattice lattice(surroundings, 15, 1200, false);
    for (const Run& run : {Run {1, 4000, 24}, Run {3, 6000, 12}})
        checkEquilibrium(surroundings, lattice, run, 0.05, "twelve gaps");
}

/** What is pressed in the cold comes to rest where the surface balances it, and what is not comes to the surface. */
static void testCold() {
    for (double stepSize : {0.1, 10.0, 1e4})
        for (double load : {0.0, 3.0, 50.0}) {
            Particles particles({{{{1, 0, 0}, 0}}, {-load, 0, 0}}, {{5, 0, 0}, {-0.1, 0, 0}, {-30, 0, 0}}, 0);
            for (int i = 0; i < 400; i++)
                particles.step(stepSize);
            for (int i = load == 0 ? 1 : 0; i < 3; i++) {
                checkClose(-load, particles.at(i).x, 1, 1e-6, "it rests where the surface balances the load");
                checkClose(load, particles.getMeans(i).force, 1, 1e-6, "it is held by the load");
            }
            if (load == 0)
                checkClose(5, particles.at(0).x, 1, 0, "what does not touch stays");
        }
}

/** An overlap that nothing presses goes away in steps in which it would, and is that of equilibrium then. */
static void testOverlaps() {
    const Surroundings surroundings = {{{{1, 0, 0}, 0}}, {-0.5, 0, 0}};
    const Lattice lattice(surroundings, 40, 80000, true);
    for (double motion : {1.0, 4.0, 30.0}) {
        Particles particles(surroundings, vector<Vec3d>(10000, Vec3d {-30, 0, 0}));
        double energy = 0, square = 0;
        for (int i = 0; i < (motion < 2 ? 80 : 40); i++)
            particles.step(0.5*motion*motion);
        for (int i = 0; i < particles.size(); i++) {
            const double own = particles.getMeans(i).energy;
            energy += own/particles.size();
            square += own*own/particles.size();
        }
        const double error = sqrt((square-energy*energy)/particles.size());
        check(4*error < 0.1*lattice.exact.energy, "enough overlaps");
        checkClose(lattice.exact.energy, energy, 4*error, 1, "an overlap that goes away, motion "+to_string(motion));
    }
}

/** Colors of gaps between chains at random, of which one has more than a word of colors holds. */
static void testColors() {
    mt19937 generator(1);
    const int numChains = 300;
    vector<Gap> gaps(3000);
    for (size_t i = 0; i < gaps.size(); i++) {
        gaps[i].numLevers = 1;
        const int one = i%30 == 0 ? 7 : generator()%numChains, other = generator()%numChains;
        // A wall, which does not move; two places on one chain.
        gaps[i].levers[0].places[0].pack = gaps[i].levers[0].places[1].pack = 0;
        gaps[i].levers[0].places[0].chain = one;
        gaps[i].levers[0].places[1].chain = i%50 == 1 ? one : other;
        if (i%40 == 1)
            gaps[i].levers[0].places[1] = PlaceOnChain();
    }
    GapResponses responses;
    responses.begin(numChains);
    responses.addPorts(gaps);
    GapColors colors, some;
    colors.sort(gaps.size(), responses);
    // What threads do at the same time is done here against the order: chains are then touched once in each call.
    vector<int> visits(gaps.size()), order;
    int calls = 0;
    const Loop loop = [&] (int count, const function<void(int)>& iteration) {
        calls++;
        set<int> touched;
        const size_t before = order.size();
        for (int i = count-1; i >= 0; i--)
            iteration(i);
        for (size_t k = before; k < order.size(); k++) {
            set<int> own;
            for (int side = 0; side < 2; side++)
                if (gaps[order[k]].packOf(side) >= 0)
                    own.insert(gaps[order[k]].chainOf(side));
            for (int chain : own)
                check(touched.insert(chain).second, "two gaps of a color share a chain");
        }
    };
    const auto visit = [&] (int gap) {
        visits[gap]++;
        order.push_back(gap);
        return (double) gap;
    };
    check(colors.visit(false, loop, visit) == gaps.size()-1.0, "the largest number is another one");
    check(calls > 5, "threads have nothing to do");
    check(count(visits.begin(), visits.end(), 1) == (int) gaps.size(), "a gap is not visited, or twice");
    some.select(colors, SERIAL, [] (int gap) {return gap%3 == 0;});
    order.clear();
    check(some.visit(true, loop, visit) == 2997 && order.size() == 1000, "others are visited");
}

int main() {
    return runTests({testHardSurfaces, testOneGap, testSprings, testTwoGaps, testOpposedGaps, testCold, testOverlaps,
            testColors}, {testTwelveGaps});
}
