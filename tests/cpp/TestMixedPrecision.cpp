/**
 * This tests chains in single precision: that a step is that in double precision but for rounding, that energies and
 * motion are right in the mean, and that double precision is used where single precision would not do.
 */

#include "TestChains.h"
#include "dynamics/PackStep.h"
#include "lanes/Noise.h"
#include <algorithm>
#include <functional>
#include <memory>
#include <thread>

static const double KT = 2.5;

static const vector<int> LENGTHS = {5, 5, 4, 1, 2, 9, 5, 5, 5, 5, 3, 8, 9, 10, 9, 9, 9, 9, 10, 11, 9, 10};

struct StepResult {
    Array displacements;
    int divided = 0;
};

static StepResult stepIn(Precision precision, const ChainEngine& engine, const Array& x, const Array& f,
            StepSettings settings, const double* box = NULL) {
    settings.precision = precision;
    StepResult result = {Array(x.size())};
    for (int pack : engine.getPacksOfStep(settings)) {
        const Instability found = engine.step(pack, x.data(), f.data(), box, settings, result.displacements.data());
        check(found.chain < 0, "unstable step");
        result.divided += found.divided;
    }
    return result;
}

static int mixedChains(Precision precision, const ChainEngine& engine, StepSettings settings) {
    settings.precision = precision;
    return engine.getNumMixedChains(engine.getPacksOfStep(settings));
}

/** The displacements of a chain, one after the other. */
static Array ofChain(const Chain& chain, const Array& displacements) {
    Array result;
    for (int node : chain.nodes)
        result.insert(result.end(), &displacements[3*node], &displacements[3*node]+3);
    return result;
}

/** The root of the mean square difference over that of the values. */
static double relativeDifference(const Array& a, const Array& b) {
    double difference = 0, all = 0;
    for (size_t i = 0; i < a.size(); i++) {
        difference += (a[i]-b[i])*(a[i]-b[i]);
        all += a[i]*a[i];
    }
    return sqrt(difference/all);
}

static StepSettings settingsFor(Scheme scheme, double h, uint64_t step = 1) {
    return {scheme, KT, h, 11, step};
}

static vector<Chain> tethered(vector<Chain> chains, const Array& x) {
    for (Chain& chain : chains) {
        const double* position = &x[3*chain.nodes[1]];
        chain.tethers.push_back({1, {position[0]+1, position[1], position[2]-1}, 25});
        chain.tethers.push_back({0, {position[0]-9, position[1]+2, position[2]}, 400});
    }
    return chains;
}

static vector<Chain> tetheredChains(Array& x) {
    const vector<Chain> chains = makeChains(LENGTHS, BendingModel::InscribedCircle, StretchingModel::Harmonic, x);
    return tethered(chains, x);
}

static Array someForces(const Array& x) {
    Array f(x.size());
    for (size_t i = 0; i < f.size(); i++)
        f[i] = sin(i);
    return f;
}

static double sorted(Array values, double quantile) {
    sort(values.begin(), values.end());
    return values[quantile*(values.size()-1)];
}

static void checkSteps(const string& kind, const vector<Chain>& chains, const Array& x) {
    const ChainEngine engine(chains);
    const Array f = someForces(x);
    for (Scheme scheme : {Scheme::Implicit, Scheme::ImplicitSecondOrder}) {
        Array differences;
        for (double h : {1e-3, 0.03, 0.5})
            for (uint64_t step = 0; step < 10; step++) {
                const StepSettings settings = settingsFor(scheme, h, step);
                const int mixed = mixedChains(Precision::Mixed, engine, settings);
                check(mixed == (int) chains.size(), kind+" in mixed precision");
                const StepResult expected = stepIn(Precision::Double, engine, x, f, settings);
                const StepResult found = stepIn(Precision::Mixed, engine, x, f, settings);
                check(abs(expected.divided-found.divided) <= 1, "divided steps of "+kind);
                for (const Chain& chain : chains) {
                    const Array change = ofChain(chain, found.displacements);
                    differences.push_back(relativeDifference(ofChain(chain, expected.displacements), change));
                    for (size_t i = 2; i < change.size() && chain.planar; i += 3)
                        check(change[i] == 0, "chain that leaves its plane");
                    for (size_t node = 0; node < chain.nodes.size(); node++)
                        check(!chain.fixed[node] || change[3*node] == 0, "fixed node that moves");
                }
            }
        // Where one of them takes an iteration more, they differ by the tolerance of the iteration.
        check(sorted(differences, 0.5) < 5e-6, "steps of most "+kind);
        check(sorted(differences, 0.98) < 1e-4, "steps of nearly all "+kind);
        check(sorted(differences, 1) < 0.01, "steps of all "+kind);
    }
}

static void testStepsAreThoseOfDoublePrecision() {
    for (int bending = 0; bending < countOf<BendingModel>(); bending++) {
        Array x;
        const vector<Chain> chains = makeChains(LENGTHS, (BendingModel) bending, StretchingModel::Harmonic, x);
        vector<Chain> held = chains, propelled = chains, planar = chains;
        for (size_t i = 0; i < chains.size(); i++) {
            held[i].fixed[i%held[i].nodes.size()] = true;
            for (Segment& segment : propelled[i].segments)
                segment.propulsion = 3;
            planar[i].planar = true;
        }
        checkSteps("chains", chains, x);
        checkSteps("tethered chains", tethered(chains, x), x);
        checkSteps("chains with fixed nodes", held, x);
        checkSteps("propelled chains", propelled, x);
        checkSteps("chains of beads", beaded(chains), x);
        Array flat = x;
        for (size_t i = 2; i < x.size(); i += 3)
            flat[i] = 3;
        checkSteps("chains in a plane", planar, flat);
    }
}

/** Twist with frames at no end, at one or at both, of which one may have a torque or be turned. */
static vector<Chain> twisted(vector<Chain> chains, double friction) {
    for (size_t i = 0; i < chains.size(); i++) {
        ChainTwist& twist = chains[i].twist;
        for (size_t s = 0; s < chains[i].segments.size(); s++)
            twist.friction.push_back(friction*(1+0.02*s));
        for (size_t joint = 0; joint < chains[i].joints.size(); joint++) {
            twist.stiffness.push_back(60+joint);
            twist.rest.push_back(0.1*joint);
        }
        for (int end = 0; end < 2; end++)
            if (i%4 > 0 && (end == 1 || i%4 > 1))
                twist.ends[end] = {{0.6, 0.48, 0.64}, i%4 == 2 && end == 1 ? 0.0 : 120.0,
                        i%4 == 2 && end == 1 ? 3.0 : 0.0, i%4 == 3 && end == 1 ? 0.2 : 0.0};
    }
    return chains;
}

/** Some twists for the joints of chains, and those of its end frames. */
static vector<Array> someTwists(const vector<Chain>& chains) {
    vector<Array> twists;
    for (const Chain& chain : chains) {
        twists.emplace_back(chain.numTwists());
        for (size_t joint = 0; joint < twists.back().size(); joint++)
            twists.back()[joint] = 0.3*sin(7*joint+twists.size());
    }
    return twists;
}

static Array tangentOf(const Chain& chain, const Array& x, int s) {
    Array tangent(3);
    double square = 0;
    for (int k = 0; k < 3; k++) {
        tangent[k] = x[3*chain.nodes[s+1]+k]-x[3*chain.nodes[s]+k];
        square += tangent[k]*tangent[k];
    }
    for (double& component : tangent)
        component /= sqrt(square);
    return tangent;
}

/** The area of a spherical triangle. */
static double triangle(const Array& a, const Array& b, const Array& c) {
    auto dot = [] (const Array& u, const Array& v) {return u[0]*v[0]+u[1]*v[1]+u[2]*v[2];};
    const double volume = a[0]*(b[1]*c[2]-b[2]*c[1])+a[1]*(b[2]*c[0]-b[0]*c[2])+a[2]*(b[0]*c[1]-b[1]*c[0]);
    return 2*atan2(volume, 1+dot(a, b)+dot(b, c)+dot(c, a));
}

/** What the ribbon of tangents between both frames of a chain has swept on the unit sphere. */
static double sweptBy(const Chain& chain, const Array& x, const Array& y) {
    const EndFrame* const ends = chain.twist.ends;
    const Array first(ends[0].direction, ends[0].direction+3), last(ends[1].direction, ends[1].direction+3);
    const int segments = chain.segments.size();
    double area = 0;
    for (int s = 0; s <= segments; s++) {
        const Array a = s > 0 ? tangentOf(chain, x, s-1) : first, b = s < segments ? tangentOf(chain, x, s) : last;
        const Array newA = s > 0 ? tangentOf(chain, y, s-1) : first;
        const Array newB = s < segments ? tangentOf(chain, y, s) : last;
        area += triangle(a, b, newB)+triangle(a, newB, newA);
    }
    return area;
}

/** The torques between both frames of a chain turn nothing else: its linking number stays what it was. */
static void checkLinkingNumbers(const vector<Chain>& chains, const Array& start, const Array& displacements,
            const vector<Array>& changes, double h) {
    Array end = start;
    for (size_t i = 0; i < end.size(); i++)
        end[i] += displacements[i];
    for (size_t i = 0; i < chains.size(); i++) {
        if (i%4 < 2)
            continue;
        // Turns cancel, and so does what the areas of parts of a divided step differ by from that of the whole.
        double sum = -chains[i].twist.ends[1].angularVelocity*h-sweptBy(chains[i], start, end);
        for (double change : changes[i])
            sum += change;
        checkClose(0, remainder(sum, 4*M_PI), 1, 1e-12, "linking number of a chain");
    }
}

/** Take a step as those of chains that are coupled are taken. */
static Array coupledStep(const ChainEngine& engine, const Array& x, const Array& f, StepSettings settings) {
    settings.precision = Precision::Mixed;
    Array displacements(x.size());
    for (int pack : engine.getPacksOfStep(settings)) {
        const unique_ptr<PackStep> step = engine.createStep(pack);
        const int lanes = engine.getChainsOfLanes(pack).size();
        unique_ptr<bool[]> taken(new bool[lanes]), unfinished(new bool[lanes]);
        fill_n(taken.get(), lanes, true);
        step->begin(x.data(), f.data(), NULL, settings, taken.get());
        step->beginStage(0);
        do {
            step->eliminate(NULL, 0, NULL);
            step->advance(NULL, {}, unfinished.get(), NULL);
        } while (any_of(unfinished.get(), unfinished.get()+lanes, [] (bool one) {return one;}));
        step->getDisplacements(displacements.data());
    }
    return displacements;
}

/** In long steps and with little friction, this is 10^-6 of the stiffness. */
static void checkTwist(double friction) {
    Array x;
    const vector<Chain> chains = twisted(makeChains(LENGTHS, BendingModel::KratkyPorod, StretchingModel::Harmonic, x),
            friction);
    const ChainEngine engine(chains);
    const Array f = someForces(x);
    vector<Array> twists = someTwists(chains), changes[] = {twists, twists};
    Array differences;
    int divided = 0;
    for (double h : {1e-3, 0.03, 0.5, 3.0})
        for (uint64_t number = 0; number < 10; number++) {
            StepSettings settings = settingsFor(Scheme::Implicit, h, number);
            settings.twists = &twists;
            check(mixedChains(Precision::Mixed, engine, settings) == (int) chains.size(), "twist in mixed precision");
            // Between two frames, one is so bent that its steps are divided.
            Array start = x;
            if (number > 7)
                start[3*chains[11].nodes[4]+2] += 30;
            settings.twistChanges = &changes[0];
            stepIn(Precision::Double, engine, start, f, settings);
            settings.twistChanges = &changes[1];
            const StepResult found = stepIn(Precision::Mixed, engine, start, f, settings);
            divided += found.divided;
            for (size_t i = 0; i < chains.size(); i++)
                differences.push_back(relativeDifference(changes[0][i], changes[1][i]));
            checkLinkingNumbers(chains, start, found.displacements, changes[1], h);
            if (h > 0.1)
                continue;
            checkLinkingNumbers(chains, x, coupledStep(engine, x, f, settings), changes[1], h);
        }
    check(divided > 0, "divided steps of chains with twist");
    check(sorted(differences, 0.5) < 1e-5, "twists of most chains");
    check(sorted(differences, 0.95) < 1e-3, "twists of nearly all chains");
}

static void testTwist() {
    checkTwist(4);
    checkTwist(4e-4);
}

static void testNoise() {
    const int count = 200003;
    vector<uint32_t> chains(count), parts(count);
    for (int i = 0; i < count; i++) {
        chains[i] = i/100;
        parts[i] = i%100;
    }
    for (uint32_t level : {0, 1, 7})
        for (NoiseKind kind : {NoiseKind::Segment, NoiseKind::Bend, NoiseKind::Tether}) {
            const NoiseKey key = {12345, level, 0x1ffffffffULL};
            Array expected(4*count), found(4*count);
            drawNormals(key, kind, chains.data(), parts.data(), count, expected.data());
            drawNormalsInSinglePrecision(key, kind, chains.data(), parts.data(), count, found.data());
            double square = 0;
            for (int i = 0; i < 4*count; i++) {
                checkClose(expected[i], found[i], 1, 3e-6, "normal number");
                square += (expected[i]-found[i])*(expected[i]-found[i])/(4*count);
            }
            check(sqrt(square) < 2e-7, "normal numbers");
        }
}

/** Positions that a shift by a power of two, or by whole numbers, does not round. */
static Array onLattice(Array x) {
    for (double& component : x)
        component = ldexp(round(ldexp(component, 20)), -20);
    return x;
}

static void testPlaceInSpaceDoesNotMatter() {
    Array x;
    const vector<Chain> plain = makeChains(LENGTHS, BendingModel::InscribedCircle, StretchingModel::Harmonic, x);
    x = onLattice(x);
    Array far = x;
    for (double& component : far)
        component += 131072;
    const ChainEngine engine(tethered(plain, x)), farEngine(tethered(plain, far));
    const Array f = someForces(x), wrapped = acrossBox(x);
    for (Scheme scheme : {Scheme::Implicit, Scheme::ImplicitSecondOrder})
        for (double h : {0.03, 0.5}) {
            const StepSettings settings = settingsFor(scheme, h);
            const StepResult here = stepIn(Precision::Mixed, engine, x, f, settings);
            const StepResult there = stepIn(Precision::Mixed, farEngine, far, f, settings);
            const StepResult across = stepIn(Precision::Mixed, engine, wrapped, f, settings, BOX);
            for (size_t i = 0; i < x.size(); i++) {
                checkClose(here.displacements[i], there.displacements[i], 0, 0, "step far from the origin");
                checkClose(here.displacements[i], across.displacements[i], 0, 0, "step across the box");
            }
        }
}

static void testChainsDoNotDependOnTheirPack() {
    Array x;
    const vector<Chain> chains = tetheredChains(x);
    const ChainEngine together(chains);
    // Some of its neighbours are taut.
    Array f = someForces(x);
    for (int chain : {1, 7}) {
        f[3*chains[chain].nodes.front()] -= 600;
        f[3*chains[chain].nodes.back()] += 600;
    }
    for (size_t chosen = 0; chosen < chains.size(); chosen++) {
        // The number of a chain is part of the key of its noise, so the others stay, in other packs.
        vector<Chain> others = chains;
        for (size_t i = 0; i < chains.size(); i++) {
            for (Segment& segment : others[i].segments)
                segment.maximumExtension = 100;
            if (i != chosen)
                others[i].stretching = StretchingModel::FENE;
        }
        const ChainEngine alone(others);
        for (uint64_t step = 0; step < 20; step++) {
            const StepSettings settings = settingsFor(Scheme::Implicit, 0.05, step);
            check(mixedChains(Precision::Mixed, alone, settings) == 1, "chain alone in its pack");
            for (Precision precision : {Precision::Mixed, Precision::Double}) {
                const Array a = ofChain(chains[chosen], stepIn(precision, together, x, f, settings).displacements);
                const Array b = ofChain(chains[chosen], stepIn(precision, alone, x, f, settings).displacements);
                checkClose(0, relativeDifference(a, b), 1, precision == Precision::Mixed ? 1e-5 : 1e-10, "chain alone");
            }
        }
    }
}

static void testThreadsThatMakePacks() {
    Array x;
    const vector<Chain> chains = tetheredChains(x);
    const Array f = someForces(x);
    const StepSettings settings = settingsFor(Scheme::Implicit, 0.05);
    const Array expected = stepIn(Precision::Mixed, ChainEngine(chains), x, f, settings).displacements;
    for (int repeat = 0; repeat < 50; repeat++) {
        const ChainEngine engine(chains);
        vector<Array> found(4);
        vector<thread> threads;
        for (Array& displacements : found)
            threads.emplace_back([&] () {
                displacements = stepIn(Precision::Mixed, engine, x, f, settings).displacements;
            });
        for (thread& each : threads)
            each.join();
        for (const Array& displacements : found)
            check(displacements == expected, "packs made by several threads");
    }
}

static void testDividedSteps() {
    Array x;
    const vector<Chain> chains = tetheredChains(x);
    const ChainEngine engine(chains);
    Array moved = x, f(x.size());
    moved[3*chains[5].nodes[4]+2] += 30;
    const StepSettings settings = settingsFor(Scheme::Implicit, 0.5);
    const StepResult expected = stepIn(Precision::Double, engine, moved, f, settings);
    const StepResult found = stepIn(Precision::Mixed, engine, moved, f, settings);
    check(expected.divided > 0 && found.divided == expected.divided, "divided steps");
    const Array a = ofChain(chains[5], expected.displacements), b = ofChain(chains[5], found.displacements);
    checkClose(0, relativeDifference(a, b), 1, 0.01, "divided step");

    f[3*chains[5].nodes[4]] = NAN;
    Array displacements(x.size());
    StepSettings mixed = settings;
    mixed.precision = Precision::Mixed;
    bool unstable = false;
    for (int pack : engine.getPacksOfStep(mixed)) {
        const Instability instability = engine.step(pack, x.data(), f.data(), NULL, mixed, displacements.data());
        check(instability.chain == -1 || instability.chain == 5, "wrong chain");
        unstable |= instability.chain == 5;
    }
    check(unstable, "instability not found");
}

static void testForcesOfSegments() {
    Array x;
    vector<Chain> chains = makeChains(LENGTHS, BendingModel::InscribedCircle, StretchingModel::Harmonic, x);
    for (Chain& chain : chains)
        fill(chain.fixed.begin(), chain.fixed.end(), false);
    const ChainEngine engine(chains);
    const Array f = someForces(x);
    for (Scheme scheme : {Scheme::Implicit, Scheme::ImplicitSecondOrder})
        for (double h : {0.03, 1.0}) {
            vector<vector<SegmentForces> > forces;
            for (const Chain& chain : chains)
                forces.push_back(vector<SegmentForces>(chain.segments.size()));
            StepSettings settings = settingsFor(scheme, h);
            const Array unrecorded = stepIn(Precision::Mixed, engine, x, f, settings).displacements;
            settings.segmentForces = &forces;
            const Array change = stepIn(Precision::Mixed, engine, x, f, settings).displacements;
            for (size_t i = 0; i < x.size(); i++)
                checkClose(unrecorded[i], change[i], 0, 0, "step that is recorded");
            for (size_t chain = 0; chain < chains.size(); chain++) {
                Array sum(3*chains[chain].nodes.size());
                double scale = 0;
                for (size_t s = 0; s < forces[chain].size(); s++)
                    for (int k = 0; k < 3; k++) {
                        sum[3*s+k] += forces[chain][s].minus[k];
                        sum[3*s+3+k] += forces[chain][s].plus[k];
                        scale = max(scale, fabs(forces[chain][s].plus[k]));
                    }
                const Array outside = ofChain(chains[chain], f);
                for (size_t i = 0; i < sum.size(); i++)
                    checkClose(0, sum[i]+outside[i], scale, 2e-4, "balance of a node");
            }
        }
}

/** A chain of equal segments of length 100 and its mean energies. */
struct Material {
    double stretching, joint;
    Segment segment;
    /** Lengths of k l0^2/k_B T and joints in k_B T. */
    Material(double stretching, double joint) : stretching(stretching*KT/1e4), joint(joint*KT),
            segment {100, this->stretching, 0, 1e5, 1.6e5, 2e8, 1e7} {
    }
    double meanStretching() const {
        double weights = 0, mean = 0;
        const double deviation = sqrt(KT/stretching);
        for (int i = -8000; i <= 8000; i++) {
            const double e = 1e-3*i*deviation, weight = e > -100 ? (100+e)*(100+e)*exp(-0.5*stretching*e*e/KT) : 0;
            weights += weight;
            mean += weight*0.5*stretching*e*e;
        }
        return mean/weights;
    }
    double meanBending() const {
        // V = k b^2/2 with a density of b^2 of 1/(1+b^2/4)^2.
        double weights = 0, mean = 0;
        for (int i = 0; i < 100000; i++) {
            const double v = 4e-4*(i+0.5)*KT, square = 2*v/joint;
            const double weight = exp(-v/KT)/((1+0.25*square)*(1+0.25*square));
            weights += weight;
            mean += weight*v;
        }
        return mean/weights;
    }
    vector<Chain> chains(int count, int segments, Array& x) const {
        vector<Chain> result;
        for (int i = 0; i < count; i++) {
            Chain chain;
            for (int node = 0; node <= segments; node++) {
                chain.nodes.push_back(x.size()/3);
                chain.fixed.push_back(false);
                x.insert(x.end(), {100.0*node, 1e4*i, -1e5});
            }
            chain.segments.assign(segments, segment);
            chain.joints.assign(segments-1, joint);
            chain.bending = BendingModel::InscribedCircle;
            chain.stretching = StretchingModel::Harmonic;
            result.push_back(chain);
        }
        return result;
    }
};

/** Independent means of blocks. */
struct Blocks {
    Array means;
    double sum = 0;
    int count = 0;
    const int size;
    explicit Blocks(int size) : size(size) {
    }
    void add(double value) {
        sum += value;
        if (++count == size) {
            means.push_back(sum/size);
            sum = count = 0;
        }
    }
    double mean() const {
        double total = 0;
        for (double one : means)
            total += one/means.size();
        return total;
    }
    double error() const {
        double square = 0;
        for (double one : means)
            square += (one-mean())*(one-mean())/(means.size()*(means.size()-1.0));
        return sqrt(square);
    }
    void checkMean(double expected, double systematic, const string& what) const {
        check(error() < 0.005*expected, "statistics of "+what);
        checkClose(expected, mean(), 1, 4*error()+systematic*expected, what);
    }
};

/** Chains with a step of z times the relaxation time of their sharpest bends. */
static void checkEnergies(double stretching, double joint, double z, Scheme scheme, uint64_t seed) {
    const Material material(stretching, joint);
    Array x;
    const int count = 128, segments = 12;
    const vector<Chain> chains = material.chains(count, segments, x);
    const ChainEngine engine(chains);
    const double h = z*material.segment.rotational/(4*material.joint);
    const Array f(x.size());
    Array ignored(x.size());
    Blocks lengths(20), bends(20);
    int divided = 0;
    const int steps = 800, first = 60;
    for (int step = 0; step < steps; step++) {
        const StepSettings settings = {scheme, KT, h, seed, (uint64_t) step};
        check(mixedChains(Precision::Automatic, engine, settings) == count, "chains in mixed precision");
        const StepResult found = stepIn(Precision::Automatic, engine, x, f, settings);
        divided += found.divided;
        for (size_t i = 0; i < x.size(); i++)
            x[i] += found.displacements[i];
        if (step < first)
            continue;
        ChainEnergy energy;
        for (int pack = 0; pack < engine.getNumPacks(); pack++) {
            const ChainEnergy one = engine.addForces(pack, x.data(), ignored.data(), NULL, true);
            energy.stretching += one.stretching;
            energy.bending += one.bending;
        }
        lengths.add(energy.stretching/(count*segments));
        bends.add(energy.bending/(count*(segments-1)));
    }
    const string of = " of chains with "+to_string(stretching)+", "+to_string(joint)+" k_B T and z = "+to_string(z);
    check(divided <= 1e-3*count*steps, "divided steps"+of);
    lengths.checkMean(material.meanStretching(), 0.005, "stretching"+of);
    bends.checkMean(material.meanBending(), 0.005, "bending"+of);
}

static void testEnergies() {
    checkEnergies(1e6, 50, 40, Scheme::Implicit, 1);
    checkEnergies(1e9, 10, 10, Scheme::Implicit, 2);
    checkEnergies(1e5, 1000, 9.9e3, Scheme::Implicit, 3);
    checkEnergies(9.9e8, 1000, 9.9e3, Scheme::Implicit, 4);
    checkEnergies(1e6, 50, 40, Scheme::ImplicitSecondOrder, 5);
    checkEnergies(9.9e8, 1000, 9.9e3, Scheme::ImplicitSecondOrder, 6);
}

static void testEnergiesOfTwist() {
    // On one path, with free ends and between frames that share four turns.
    const Material material(1e5, 10);
    const double h = 10*material.segment.rotational/(4*material.joint), stiffness = 20*KT;
    const int count = 64, segments = 12, steps = 300, first = 50;
    double energies[2][3] = {};
    for (Precision precision : {Precision::Double, Precision::Mixed}) {
        Array x;
        vector<Chain> chains = material.chains(count, segments, x);
        vector<Array> twists, changes;
        for (int i = 0; i < count; i++) {
            Chain& chain = chains[i];
            chain.twist.friction.assign(segments, 0.05*h*stiffness);
            chain.twist.stiffness.assign(segments-1, stiffness);
            chain.twist.rest.assign(segments-1, 1);
            if (i%2 == 1) {
                chain.fixed[0] = chain.fixed[1] = true;
                for (EndFrame& frame : chain.twist.ends)
                    frame = {{1, 0, 0}, 2*stiffness, 0, 0};
            }
            twists.emplace_back(segments+1, i%2 == 1 ? 1+4*M_PI/segments : 1);
            twists.back().front() = twists.back().back() = i%2 == 1 ? 2*M_PI/segments : 0;
        }
        changes = twists;
        const ChainEngine engine(chains);
        StepSettings settings = settingsFor(Scheme::Implicit, h);
        settings.twists = &twists;
        settings.twistChanges = &changes;
        Array f(x.size());
        for (int i = 1; i < count; i += 2)
            f[3*chains[i].nodes.back()] = 20*KT/100;
        double* const sums = energies[precision == Precision::Mixed];
        for (int step = 0; step < steps; step++) {
            settings.step = step;
            const int mixed = mixedChains(precision, engine, settings);
            check(mixed == (precision == Precision::Mixed ? count : 0), "mixed chains");
            const StepResult found = stepIn(precision, engine, x, f, settings);
            for (size_t i = 0; i < x.size(); i++)
                x[i] += found.displacements[i];
            for (int i = 0; i < count; i++)
                for (int joint = 0; joint <= segments; joint++) {
                    twists[i][joint] += changes[i][joint];
                    const bool isInner = joint > 0 && joint < segments;
                    const double energy = isInner ? 0.5*stiffness*pow(twists[i][joint]-1, 2)/(steps-first) : 0;
                    sums[i%2] += step < first ? 0 : energy;
                    sums[2] += step < first ? 0 : (i%2)*twists[i][joint]/(steps-first);
                }
        }
    }
    // There are 32 free chains, each of whose joints has half of k_B T.
    checkClose(0.5*KT*32*(segments-1), energies[0][0], energies[0][0], 0.05, "energy of twist");
    for (int kind = 0; kind < 3; kind++)
        checkClose(1, energies[1][kind]/energies[0][kind], 1, 5e-4, "energies of twist in mixed precision");
}

static void testDiffusionOfRods() {
    const Material material(5e8, 1);
    Array x;
    const int count = 256;
    const ChainEngine engine(material.chains(count, 1, x));
    const double h = 0.01*material.segment.rotational/KT;
    const Array f(x.size());
    Blocks along(25), across(25), cosines(25);
    for (int step = 0; step < 1500; step++) {
        const StepSettings settings = settingsFor(Scheme::Implicit, h, step);
        check(mixedChains(Precision::Automatic, engine, settings) == count, "rods in mixed precision");
        const StepResult found = stepIn(Precision::Automatic, engine, x, f, settings);
        check(found.divided == 0, "divided step of a rod");
        double sumAlong = 0, sumAcross = 0, cosine = 0;
        for (int rod = 0; rod < count; rod++) {
            double before[3], after[3], middle[3], lengths[2] = {}, projected = 0, square = 0, product = 0;
            for (int k = 0; k < 3; k++) {
                const double *d = &found.displacements[6*rod], *p = &x[6*rod];
                before[k] = p[3+k]-p[k];
                after[k] = before[k]+d[3+k]-d[k];
                middle[k] = 0.5*(d[k]+d[3+k]);
                lengths[0] += before[k]*before[k];
                lengths[1] += after[k]*after[k];
                projected += middle[k]*before[k];
                square += middle[k]*middle[k];
                product += before[k]*after[k];
            }
            sumAlong += projected*projected/lengths[0]/count;
            sumAcross += (square-projected*projected/lengths[0])/count;
            cosine += product/sqrt(lengths[0]*lengths[1])/count;
        }
        along.add(sumAlong);
        across.add(sumAcross);
        cosines.add(1-cosine);
        for (size_t i = 0; i < x.size(); i++)
            x[i] += found.displacements[i];
    }
    // In the time of a step, a rod that turns mixes both directions.
    const double parallel = 2*KT*h/material.segment.parallel, perpendicular = 4*KT*h/material.segment.perpendicular;
    along.checkMean(parallel, 0.01, "diffusion of rods along");
    across.checkMean(perpendicular, 0.01, "diffusion of rods across");
    cosines.checkMean(1-exp(-2*0.01), 0.005, "rotation of rods");
}

/** The step in which noise changes lengths by 1e-5 of themselves. */
static double shortestStep(const Material& material) {
    const Segment& segment = material.segment;
    return 1e-10*(segment.extensional+0.25*segment.parallel*1e4)/(2*KT);
}

static void testLengthsBeginToFluctuateInShortSteps() {
    // What rounding adds to the changes of lengths would heat them.
    const Material material(1e6, 10);
    const int count = 64, steps = 400;
    StepSettings settings = settingsFor(Scheme::Implicit, 1.01*shortestStep(material));
    double energies[2] = {};
    for (Precision precision : {Precision::Double, Precision::Mixed}) {
        Array x;
        const vector<Chain> chains = material.chains(count, 16, x);
        const ChainEngine engine(chains);
        check(mixedChains(precision, engine, settings) == (precision == Precision::Mixed ? count : 0), "mixed chains");
        for (settings.step = 0; settings.step < steps; settings.step++) {
            const StepResult found = stepIn(precision, engine, x, Array(x.size()), settings);
            for (size_t i = 0; i < x.size(); i++)
                x[i] += found.displacements[i];
        }
        for (const Chain& chain : chains)
            for (size_t s = 0; s < chain.segments.size(); s++) {
                double square = 0;
                for (int k = 0; k < 3; k++)
                    square += pow(x[3*chain.nodes[s+1]+k]-x[3*chain.nodes[s]+k], 2);
                energies[precision == Precision::Mixed] += pow(sqrt(square)-100, 2);
            }
    }
    checkClose(1, energies[1]/energies[0], 1, 0.003, "energy of lengths in short steps");
}

/** How many of some equal chains are computed in mixed precision. */
static int mixedOf(Precision precision, int count, const function<void(Chain&)>& change, StepSettings settings) {
    Array x;
    vector<Chain> chains = Material(1e5, 100).chains(count, 4, x);
    for (Chain& chain : chains)
        change(chain);
    const ChainEngine engine(chains);
    // Together, packs hold each particle once.
    settings.precision = precision;
    vector<int> found(x.size()/3);
    for (int pack : engine.getPacksOfStep(settings))
        for (int particle : engine.getParticles(pack))
            found[particle]++;
    check(count_if(found.begin(), found.end(), [] (int times) {return times != 1;}) == 0, "particles of packs");
    return mixedChains(precision, engine, settings);
}

static void testWhereSinglePrecisionWouldNotDo() {
    // The relaxation time of the sharpest bends is 2e8/(4*100*2.5).
    const double time = 2e5;
    const StepSettings usual = settingsFor(Scheme::Implicit, 10*time);
    auto mixed = [&] (const function<void(Chain&)>& change, const StepSettings& settings) {
        return mixedOf(Precision::Mixed, 20, change, settings);
    };
    auto asItIs = [] (Chain&) {};
    check(mixed(asItIs, usual) == 20, "usual chains");
    check(mixedOf(Precision::Double, 20, asItIs, usual) == 0, "double precision");

    StepSettings changed = usual;
    for (Scheme scheme : {Scheme::Euler, Scheme::Midpoint}) {
        changed.scheme = scheme;
        check(mixed(asItIs, changed) == 0, "explicit scheme");
    }
    changed.scheme = Scheme::ImplicitSecondOrder;
    check(mixed(asItIs, changed) == 20, "scheme of second order");
    changed = usual;
    changed.flow.present = true;
    check(mixed(asItIs, changed) == 0, "flow");
    changed = usual;
    changed.kT = 0;
    check(mixed(asItIs, changed) == 0, "zero temperature");
    changed.kT = KT*1.01e-4;
    check(mixed(asItIs, changed) == 20, "low temperature");
    changed.kT = KT*0.99e-4;
    check(mixed(asItIs, changed) == 0, "lengths that are too stiff at a low temperature");
    changed = usual;
    changed.stepSize = 0.99e4*time;
    check(mixed(asItIs, changed) == 20, "long step");
    changed.stepSize = 1.01e4*time;
    check(mixed(asItIs, changed) == 0, "step that is too long for bends");
    // Lengths change by 1e-5 of themselves in a step of 1e-10 (gamma_def+gamma_par l^2/4)/(2 k_B T).
    const double shortest = shortestStep(Material(1e5, 100));
    changed.stepSize = 1.01*shortest;
    check(mixed(asItIs, changed) == 20, "short step");
    changed.stepSize = 0.99*shortest;
    check(mixed(asItIs, changed) == 0, "step that is too short for lengths");
    changed.stepSize = 1e-4;
    check(mixed(asItIs, changed) == 0, "friction per step that overflows");
    changed.stepSize = 1e15;
    check(mixed([] (Chain& chain) {chain.joints.assign(3, 0);}, changed) == 0, "friction per step that underflows");

    check(mixed([] (Chain& chain) {chain.segments[2].stiffness *= 1.01e4;}, usual) == 0, "a length that is too stiff");
    check(mixed([] (Chain& chain) {chain.joints[1] *= 1.01e3;}, usual) == 0, "one joint that is too stiff");
    check(mixed([] (Chain& chain) {chain.joints[1] *= 0.99e3;}, usual) == 20, "one joint that is nearly too stiff");
    auto withTwist = [] (double stiffness) {
        return [=] (Chain& chain) {
            chain.twist.friction.assign(4, 2*KT*2e6/3);
            chain.twist.stiffness.assign(3, stiffness*KT);
            chain.twist.rest.assign(3, 0);
        };
    };
    // With three square radians, which segments turn in the step, on top.
    check(mixed(withTwist(0.99*5e4), usual) == 20, "twist that is nearly too stiff");
    check(mixed(withTwist(1.01*5e4), usual) == 0, "twist that is too stiff");
    changed = usual;
    const vector<vector<TurnedPair> > pairs;
    changed.turnedPairs = &pairs;
    check(mixed(withTwist(100), changed) == 0, "hands on the helix");
    check(mixed(asItIs, changed) == 20, "hands on the helix of others");
    check(mixed([] (Chain& chain) {
        chain.stretching = StretchingModel::FENE;
        for (Segment& segment : chain.segments)
            segment.maximumExtension = 50;
    }, usual) == 0, "FENE");
    check(mixed([] (Chain& chain) {
        chain.closed = true;
        chain.segments.push_back(chain.segments[0]);
        chain.joints.assign(5, chain.joints[0]);
    }, usual) == 0, "rings");
}

static void testWhereSinglePrecisionIsFaster() {
    const StepSettings settings = settingsFor(Scheme::Implicit, 2e6);
    auto asItIs = [] (Chain&) {};
    const string instructionSet = ChainEngine::getInstructionSet();
    const int lanes = instructionSet == "avx512" ? 16 : instructionSet == "avx2" ? 8 : 4;
    for (int count = 1; count <= 3*lanes; count++) {
        check(mixedOf(Precision::Mixed, count, asItIs, settings) == count, "mixed precision where it is right");
        const int rest = count%lanes;
        check(mixedOf(Precision::Automatic, count, asItIs, settings) == (2*rest > lanes ? count : count-rest),
                "mixed precision where it is faster");
    }
}

int main() {
    return runTests({
        testStepsAreThoseOfDoublePrecision,
        testTwist,
        testNoise,
        testPlaceInSpaceDoesNotMatter,
        testChainsDoNotDependOnTheirPack,
        testThreadsThatMakePacks,
        testDividedSteps,
        testForcesOfSegments,
        testEnergies,
        testEnergiesOfTwist,
        testDiffusionOfRods,
        testLengthsBeginToFluctuateInShortSteps,
        testWhereSinglePrecisionWouldNotDo,
        testWhereSinglePrecisionIsFaster
    });
}
