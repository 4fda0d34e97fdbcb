/**
 * This tests steps of chains of beads by their modes: cosine transforms against direct sums, steps against the
 * equations of the paper with dense matrices, noise against the numbers it is made of, and what is refused.
 */

#include "TestChains.h"
#include "lanes/CosineTables.h"
#include "lanes/Noise.h"
#include "mechanics/BeadModes.h"
#include "mechanics/PeriodicBox.h"
#include <algorithm>
#include <cstring>
#include <limits>

// In units of an ordinary chain: lambda, d, kappa and the friction of a bead.
const double LAMBDA = 70, D = 0.4, KAPPA = 24, FRICTION = 3;
const double STIFFNESS = LAMBDA-2*KAPPA, LENGTH = LAMBDA*D/STIFFNESS;

static Chain beads(int nodes, int firstParticle) {
    Chain chain;
    chain.bending = BendingModel::BondDifference;
    chain.stretching = StretchingModel::Harmonic;
    chain.nodeFriction = FRICTION;
    chain.fixed.resize(nodes);
    for (int node = 0; node < nodes; node++)
        chain.nodes.push_back(firstParticle+node);
    for (int s = 0; s < nodes-1; s++) {
        const int ends = (s == 0)+(s == nodes-2);
        const double k = STIFFNESS+ends*KAPPA;
        chain.segments.push_back({LAMBDA*D/k, k, 0, 0, 0, 0, 0});
    }
    chain.joints.resize(nodes-2, KAPPA);
    return chain;
}

/** Chains with bonds of about the length of inner ones, or exactly that one. */
static vector<Chain> makeBeads(const vector<int>& counts, double scatter, Array& x) {
    NormalNumbers normalNumbers(3);
    vector<Chain> chains;
    for (int nodes : counts) {
        chains.push_back(beads(nodes, x.size()/3));
        double node[] = {50.0*chains.size(), 4, -7}, direction[] = {1, 0, 0};
        for (int i = 0; i < nodes; i++) {
            x.insert(x.end(), node, node+3);
            const Array g = normalNumbers(4);
            double square = 0;
            for (int k = 0; k < 3; k++) {
                direction[k] += 0.3*g[k];
                square += direction[k]*direction[k];
            }
            for (int k = 0; k < 3; k++)
                node[k] += (direction[k] /= sqrt(square))*LENGTH*(1+scatter*g[3]);
        }
    }
    return chains;
}

static Array stepOfModes(const ChainEngine& engine, const Array& x, const Array& f, const StepSettings& settings,
            const double* box = NULL) {
    Array displacements(x.size());
    // In long steps, bonds turn by more than is called stable.
    for (int pack : engine.getPacksOfStep(settings))
        engine.step(pack, x.data(), f.data(), box, settings, displacements.data());
    return displacements;
}

/** (26) */
static double amplitude(int p, int node, int nodes) {
    return p == 0 ? sqrt(1.0/nodes) : sqrt(2.0/nodes)*cos(p*(node+0.5)*M_PI/nodes);
}

/** (27) and (45) in ordinary units. */
static double sineSquared(int p, int nodes) {
    return pow(sin(0.5*p*M_PI/nodes), 2);
}
static double linearRate(const Chain& chain, int p) {
    const int nodes = chain.nodes.size();
    const double kappa = nodes > 2 ? KAPPA : 0;
    return 4*sineSquared(p, nodes)*(LAMBDA-2*kappa*cos(p*M_PI/nodes))/FRICTION;
}
static double modeRate(const Chain& chain, int p) {
    const int nodes = chain.nodes.size();
    const double kappa = nodes > 2 ? KAPPA : 0;
    return linearRate(chain, p)-4*sineSquared(p, nodes)*(LAMBDA-2*kappa)/FRICTION;
}
static double meanDecay(double rate, double h) {
    return rate*h > 1e-12 ? -expm1(-rate*h)/rate : h;
}

/** The displacements of (48) and (49), with forces from outside as they are. */
static Array denseStep(const vector<Chain>& chains, const Array& x, const Array& f, double h) {
    Array result(x.size());
    for (const Chain& chain : chains) {
        const int n = chain.nodes.size(), first = 3*chain.nodes[0];
        const double stiffness = n > 2 ? STIFFNESS : LAMBDA;
        for (int k = 0; k < (chain.planar ? 2 : 3); k++) {
            Array nonlinear(n);
            for (int s = 0; s < n-1; s++) {
                double square = 0;
                for (int j = 0; j < (chain.planar ? 2 : 3); j++)
                    square += pow(x[first+3*s+3+j]-x[first+3*s+j], 2);
                const double g = (x[first+3*s+3+k]-x[first+3*s+k])*(LAMBDA*D/sqrt(square)-stiffness);
                nonlinear[s] -= g;
                nonlinear[s+1] += g;
            }
            for (int p = 0; p < n; p++) {
                double position = 0, force = 0, outside = 0;
                for (int node = 0; node < n; node++) {
                    position += amplitude(p, node, n)*(x[first+3*node+k]-x[first+k]);
                    force += amplitude(p, node, n)*nonlinear[node];
                    outside += amplitude(p, node, n)*f[first+3*node+k];
                }
                const double z = modeRate(chain, p), y = linearRate(chain, p);
                const double fast = p > 0 ? (exp(-z*h)-exp(-y*h))/(y-z) : h;
                const double change = expm1(-z*h)*position+(fast*force+meanDecay(z, h)*outside)/FRICTION;
                for (int node = 0; node < n; node++)
                    result[first+3*node+k] += amplitude(p, node, n)*change;
            }
        }
    }
    return result;
}

const vector<int> LENGTHS = {1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 15, 16, 17, 21, 23, 25, 32, 48, 49, 60, 61, 64,
        67, 90, 97, 121, 127, 128, 134, 143, 201, 211, 243, 256, 257, 500, 512, 1009};

static void testTransforms() {
    NormalNumbers normalNumbers(4);
    for (int n : LENGTHS)
        for (bool single : {false, true}) {
            auto transform = single ? transformCosinesInSinglePrecision : transformCosines;
            const int count = n > 200 ? 1 : 19;
            const Array x = normalNumbers(count*n);
            Array found = x;
            transform(n, count, found.data(), false);
            const double tolerance = (single ? 5e-7 : 1e-15)*sqrt(n)*log2(n+2);
            for (int sequence = 0; sequence < count; sequence++)
                for (int p = 0; p < n; p++) {
                    long double expected = 0;
                    for (long long j = 0; j < n; j++)
                        expected += x[sequence*n+j]*cosl(p*(2*j+1)%(4*n)*M_PIl/(2*n));
                    checkClose(expected, found[sequence*n+p], 1, tolerance, "cosine sum of "+to_string(n));
                }
            transform(n, count, found.data(), true);
            for (int i = 0; i < count*n; i++)
                checkClose(x[i], found[i], 1, tolerance, "inverse of "+to_string(n));
        }
}

const vector<int> COUNTS = {2, 3, 4, 5, 6, 17, 64, 64, 64, 64, 64, 64, 64, 64, 64, 64, 64, 67, 67, 67, 134, 2, 5, 3,
        60};

/** Bends decay as modes do alone where all bonds have the length at which nothing else acts. */
static void testDecayOfModes() {
    for (double h : {1e-3, 0.1, 10.0}) {
        Array x;
        const vector<Chain> chains = makeBeads({64, 64, 5, 3}, 0, x);
        const Array moved = stepOfModes(ChainEngine(chains), x, Array(x.size()), {Scheme::Modes, 0, h, 1, 1});
        for (const Chain& chain : chains) {
            const int n = chain.nodes.size(), first = 3*chain.nodes[0];
            for (int k = 0; k < 3; k++)
                for (int p = 0; p < n; p++) {
                    double before = 0, after = 0;
                    for (int node = 0; node < n; node++) {
                        const double relative = x[first+3*node+k]-x[first+k];
                        before += amplitude(p, node, n)*relative;
                        after += amplitude(p, node, n)*(relative+moved[first+3*node+k]);
                    }
                    checkClose(exp(-modeRate(chain, p)*h)*before, after, 100, 1e-13, "decay of a mode");
                }
        }
    }
}

static void testStepsWithoutNoise() {
    for (bool planar : {false, true})
        for (double h : {1e-3, 0.05, 1.0, 30.0}) {
            Array x;
            vector<Chain> chains = makeBeads(COUNTS, 0.1, x);
            for (size_t i = 0; i < x.size() && planar; i += 3)
                x[i+2] = 5;
            for (Chain& chain : chains)
                chain.planar = planar;
            Array f(x.size());
            for (size_t i = 0; i < f.size(); i++)
                f[i] = 0.03*sin(i);
            Array all = f;
            for (size_t c = 0; c < chains.size(); c += 2) {
                Chain& chain = chains[c];
                const int node = chain.nodes.size()/2, particle = 3*chain.nodes[node];
                chain.tethers.push_back({node, {x[particle]+0.1, x[particle+1], x[particle+2]-0.3}, 0.2});
                all[particle] += 0.2*0.1;
                all[particle+2] -= 0.2*0.3;
                const int s = c%chain.segments.size(), before = 3*chain.nodes[s];
                chain.segments[s].propulsion = 0.07;
                double square = 0;
                for (int k = 0; k < 3; k++)
                    square += pow(x[before+3+k]-x[before+k], 2);
                for (int k = 0; k < 6; k++)
                    all[before+k] += 0.5*0.07*(x[before+3+k%3]-x[before+k%3])/sqrt(square);
            }
            const Array expected = denseStep(chains, x, all, h);
            const ChainEngine engine(chains);
            const StepSettings settings = {Scheme::Modes, 0, h, 1, 1};
            const Array found = stepOfModes(engine, x, f, settings);
            for (size_t i = 0; i < x.size(); i++)
                checkClose(expected[i], found[i], 1, 1e-11, "step of modes");
            if (planar)
                continue;
            const Array wrapped = acrossBox(x);
            vector<Chain> withoutTethers = chains;
            for (Chain& chain : withoutTethers)
                chain.tethers.clear();
            const ChainEngine free(withoutTethers);
            const Array inBox = stepOfModes(free, wrapped, f, settings, BOX), whole = stepOfModes(free, x, f, settings);
            for (size_t i = 0; i < x.size(); i++)
                checkClose(whole[i], inBox[i], 1, 1e-11, "step of modes in a box");
        }
}

/** Small steps are those of the energy that a chain has. */
static void testSmallSteps() {
    Array x;
    const vector<Chain> chains = makeBeads(COUNTS, 0.1, x);
    const ChainEngine engine(chains);
    const double h = 1e-8;
    const Array forces = forcesOf(engine, x), none(x.size());
    const Array found = stepOfModes(engine, x, none, {Scheme::Modes, 0, h, 1, 1});
    for (size_t i = 0; i < x.size(); i++)
        checkClose(forces[i]/FRICTION, found[i]/h, 100, 1e-6, "small step of modes");
}

static void testFlow() {
    Array x;
    const vector<Chain> chains = makeBeads({5, 8, 8, 8}, 0.1, x);
    const double h = 0.02, rate = 0.7;
    // A shear flow carries along exactly by u+h G u/2.
    BackgroundFlow shear = {true, {0.3, -0.2, 0.1}, {0, rate, 0, 0, 0, 0, 0, 0, 0}, {1, 2, 3}};
    Array drag(x.size());
    for (size_t i = 0; i < x.size(); i += 3) {
        double u[3];
        shear.getVelocity(&x[i], u);
        u[0] += 0.5*h*rate*u[1];
        for (int k = 0; k < 3; k++)
            drag[i+k] = FRICTION*u[k];
    }
    const Array expected = denseStep(chains, x, drag, h);
    const ChainEngine engine(chains);
    const Array found = stepOfModes(engine, x, Array(x.size()), {Scheme::Modes, 0, h, 1, 1, 0, shear});
    for (size_t i = 0; i < x.size(); i++)
        checkClose(expected[i], found[i], 1, 1e-11, "shear flow");

    // A turning fluid turns centres without changing their distance from the axis, however large the step is.
    const BackgroundFlow turning = {true, {0, 0, 0}, {0, -1, 0, 1, 0, 0, 0, 0, 0}};
    for (bool planar : {false, true}) {
        const double large = 1.3;
        const BackgroundFlow mean = turning.carriedAlong(large, planar);
        const double r[] = {2, 1, 5};
        double u[3];
        mean.getVelocity(r, u);
        checkClose(2*cos(large)-sin(large), r[0]+large*u[0], 1, 1e-14, "turning fluid");
        checkClose(2*sin(large)+cos(large), r[1]+large*u[1], 1, 1e-14, "turning fluid");
        checkClose(0, u[2], 1, 1e-14, "turning fluid");
    }
}

static void testNoise() {
    const double kT = 2.5;
    for (double h : {0.01, 3.0})
        for (int level : {0, 3}) {
            Array x;
            const vector<Chain> chains = makeBeads({5, 64, 64, 67}, 0.1, x);
            const ChainEngine engine(chains);
            const Array f(x.size());
            const StepSettings settings = {Scheme::Modes, kT, h, 7, 91, level};
            const Array moved = stepOfModes(engine, x, f, settings);
            const Array still = stepOfModes(engine, x, f, {Scheme::Modes, 0, h, 7, 91, level});
            for (size_t c = 0; c < chains.size(); c++) {
                const int n = chains[c].nodes.size(), first = 3*chains[c].nodes[0];
                for (int p = 0; p < n; p++) {
                    const uint32_t chain = c, part = p;
                    double normals[4];
                    drawNormals({7, (uint32_t) level, 91}, NoiseKind::Node, &chain, &part, 1, normals);
                    const double z = modeRate(chains[c], p);
                    const double width = sqrt(kT/FRICTION*2*meanDecay(2*z, h));
                    for (int k = 0; k < 3; k++) {
                        double noise = 0;
                        for (int node = 0; node < n; node++)
                            noise += amplitude(p, node, n)*(moved[first+3*node+k]-still[first+3*node+k]);
                        checkClose(width*normals[k], noise, width, 1e-9, "noise of a mode");
                    }
                }
            }
        }
}

/** Whatever chains share lanes, and in mixed precision, but for rounding. */
static void testNeighboursAndPrecision() {
    const double kT = 2.5, h = 0.4;
    Array x;
    const vector<Chain> chains = makeBeads(vector<int>(21, 64), 0.1, x);
    const Array f(x.size());
    const ChainEngine engine(chains);
    StepSettings settings = {Scheme::Modes, kT, h, 7, 91};
    check(engine.getNumMixedChains(engine.getPacksOfStep(settings)) == 0, "chains in mixed precision");
    const Array together = stepOfModes(engine, x, f, settings);
    settings.precision = Precision::Mixed;
    check(engine.getNumMixedChains(engine.getPacksOfStep(settings)) == 21, "no chains in mixed precision");
    const Array mixed = stepOfModes(engine, x, f, settings);
    double square = 0;
    for (size_t i = 0; i < x.size(); i++) {
        checkClose(together[i], mixed[i], LENGTH, 1e-5, "mixed precision");
        square += pow(together[i]-mixed[i], 2);
    }
    check(sqrt(square/x.size()) < 1e-6*LENGTH, "mixed precision");
    // The numbers of chains are those of the noise, so that the last one comes with chains of other lengths.
    Array other;
    vector<Chain> few = makeBeads(vector<int>(21, 64), 0.1, other);
    for (int c = 0; c < 20; c++)
        few[c] = beads(2+c, few[c].nodes[0]);
    settings.precision = Precision::Double;
    const Array alone = stepOfModes(ChainEngine(few), x, f, settings);
    for (int node : few[20].nodes)
        for (int k = 0; k < 3; k++)
            checkClose(together[3*node+k], alone[3*node+k], LENGTH, 1e-12, "chain among others");
}

static void testInstability() {
    Array x;
    const vector<Chain> chains = makeBeads({64, 64, 64, 5}, 0.1, x);
    const ChainEngine engine(chains);
    auto unstableChain = [&] (const Array& f, double kT, double h) {
        Array displacements(x.size());
        int found = -1;
        const StepSettings settings = {Scheme::Modes, kT, h, 7, 91, 0, {}, NULL, Precision::Mixed};
        for (int pack : engine.getPacksOfStep(settings))
            found = max(found, engine.step(pack, x.data(), f.data(), NULL, settings, displacements.data()).chain);
        return found;
    };
    Array f(x.size());
    check(unstableChain(f, 0, 0.1) == -1 && unstableChain(f, 2.5, 0.1) == -1, "steps that are stable");
    // Noise alone is not unstable, however long the step is.
    Array bent = x;
    for (size_t i = 0; i < x.size(); i += 3) {
        x[i] = LENGTH*i/3;
        x[i+1] = x[i+2] = 0;
    }
    check(unstableChain(f, 2.5, 3) == -1 && unstableChain(f, 25, 0.1) == -1, "straight chains");
    swap(x, bent);
    f[3*chains[2].nodes[30]] = numeric_limits<double>::quiet_NaN();
    check(unstableChain(f, 0, 0.1) == 2 && unstableChain(f, 2.5, 0.1) == 2, "a force that is not a number");
    f[3*chains[2].nodes[30]] = 1e6;
    check(unstableChain(f, 2.5, 0.1) == 2, "a large force");
}

static void checkReason(const Chain& chain, const string& expected) {
    string reason;
    check(!findModes(chain, reason).has_value(), "modes in spite of: "+expected);
    check(reason.find(expected) != string::npos, "expected \""+expected+"\", found \""+reason+"\"");
}

static void testRefusals() {
    string reason;
    for (int nodes : {2, 3, 4, 9})
        check(findModes(beads(nodes, 0), reason).has_value(), "no modes: "+reason);
    Chain chain = beads(6, 0);
    chain.closed = true;
    checkReason(chain, "closed");
    chain = beads(6, 0);
    chain.fixed[2] = true;
    checkReason(chain, "fixed");
    chain = beads(6, 0);
    chain.bending = BendingModel::InscribedCircle;
    checkReason(chain, "bond-difference");
    chain = beads(6, 0);
    chain.stretching = StretchingModel::FENE;
    checkReason(chain, "harmonic");
    chain = beads(6, 0);
    chain.nodeFriction = 0;
    checkReason(chain, "no friction");
    chain = beads(6, 0);
    chain.segments[3].rotational = 1;
    checkReason(chain, "segment 3 has friction");
    chain = beads(6, 0);
    chain.joints[2] *= 1.01;
    checkReason(chain, "joint 2");
    chain = beads(6, 0);
    chain.segments[4] = chain.segments[3];
    checkReason(chain, "segment 4");
    chain = beads(6, 0);
    chain.segments[2].restLength *= 1.01;
    checkReason(chain, "segment 2");
    chain = beads(3, 0);
    chain.joints[0] = 2*chain.segments[0].stiffness;
    checkReason(chain, "not stiffer");

    const StepSettings modes = {Scheme::Modes, 1, 1, 1, 1}, implicit = {Scheme::Implicit, 1, 1, 1, 1};
    Array x, displacements(18);
    for (int node = 0; node < 6; node++)
        x.insert(x.end(), {LENGTH*node, 0, 0});
    const ChainEngine with({beads(6, 0)}), without({chain});
    auto isRefused = [&] (auto function) {
        try {
            function();
        }
        catch (const invalid_argument&) {
            return true;
        }
        return false;
    };
    check(isRefused([&] {without.getPacksOfStep(modes);}), "packs without modes");
    for (const StepSettings& settings : {modes, implicit})
        for (int pack : with.getPacksOfStep(settings.scheme == Scheme::Modes ? implicit : modes))
            check(isRefused([&] {with.step(pack, x.data(), x.data(), NULL, settings, displacements.data());}),
                    "a pack of another scheme");
}

int main() {
    return runTests({testTransforms, testDecayOfModes, testStepsWithoutNoise, testSmallSteps, testFlow, testNoise,
            testNeighboursAndPrecision, testInstability, testRefusals});
}
