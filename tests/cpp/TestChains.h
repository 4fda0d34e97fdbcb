#ifndef CYLCHAIN_TEST_CHAINS_H_
#define CYLCHAIN_TEST_CHAINS_H_

/**
 * Chains to test, checks, and dense linear algebra to compare with.
 */

#include "dynamics/ChainEngine.h"
#include "mechanics/Loop.h"
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <random>
#include <stdexcept>
#include <string>
#include <vector>

using namespace cylchain;
using namespace std;

typedef vector<double> Array;

/** Loops on one thread, one of them in the opposite order. */
const Loop SERIAL = [] (int count, const function<void(int)>& iteration) {
    for (int i = 0; i < count; i++)
        iteration(i);
};

const Loop BACKWARDS = [] (int count, const function<void(int)>& iteration) {
    for (int i = count-1; i >= 0; i--)
        iteration(i);
};

inline void check(bool condition, const string& what) {
    if (!condition)
        throw runtime_error(what);
}

inline void checkClose(double expected, double found, double scale, double tolerance, const string& what) {
    // Written so that NaN fails.
    if (!(fabs(expected-found) <= tolerance*scale))
        throw runtime_error(what+": expected "+to_string(expected)+", found "+to_string(found));
}

/** The length of a bend b = f (t2-t1), with the energy (stiffness/2) b^2, and its derivative by the angle. */
struct BendByHand {
    double length, slope;
};

inline BendByHand bendByHand(BendingModel model, double angle) {
    const double half = 0.5*angle;
    switch (model) {
    case BendingModel::BondDifference:
        break;
    case BendingModel::KratkyPorod:
        return {2*sin(half), cos(half)};
    case BendingModel::Quadratic:
        return {angle, 1};
    case BendingModel::InscribedCircle:
        return {2*tan(half), 1+tan(half)*tan(half)};
    }
    throw runtime_error("The tests do not know a bending model of an angle");
}

/** Normal numbers to make chains with. */
class NormalNumbers {
public:
    explicit NormalNumbers(int seed) : generator(seed) {
    }
    Array operator()(int count) {
        Array values(count);
        for (double& value : values)
            value = distribution(generator);
        return values;
    }
private:
    mt19937_64 generator;
    normal_distribution<double> distribution;
};

/** Bent chains of different lengths with different segments; node positions are appended to x. */
inline vector<Chain> makeChains(const vector<int>& segments, BendingModel bending, StretchingModel stretching,
        Array& x) {
    NormalNumbers normalNumbers(1);
    vector<Chain> chains;
    int particle = 0;
    for (int count : segments) {
        Chain chain;
        chain.bending = bending;
        chain.stretching = stretching;
        double node[] = {100.0*chains.size(), 0, 0};
        for (int s = 0; s <= count; s++) {
            chain.nodes.push_back(particle++);
            chain.fixed.push_back(s == 1 && count == 5);
            x.insert(x.end(), node, node+3);
            const Array g = normalNumbers(8);
            if (s < count)
                chain.segments.push_back({10+0.5*g[0], 30+g[1], 6, 5+0.2*g[2], 8+0.2*g[3], 70+g[4], 200+g[0]});
            if (s > 0 && s < count)
                chain.joints.push_back((20+g[1])*(isLinear(bending) ? 0.01 : 1));
            node[0] += 9.5+0.3*g[5];
            node[1] += 4*g[6];
            node[2] += 4*g[7];
            double* last = &x[x.size()-3];
            double length = 0;
            for (int k = 0; k < 3; k++)
                length += (node[k]-last[k])*(node[k]-last[k]);
            for (int k = 0; k < 3; k++)
                node[k] = last[k]+(node[k]-last[k])*(10+0.5*g[2])/sqrt(length);
        }
        chains.push_back(chain);
    }
    return chains;
}

/** Rings that are neither regular nor flat, unless they are planar; node positions are appended to x. */
inline vector<Chain> makeRings(const vector<int>& segments, BendingModel bending, StretchingModel stretching,
            bool planar, Array& x) {
    NormalNumbers normalNumbers(2);
    vector<Chain> rings;
    for (int count : segments) {
        Chain ring;
        ring.bending = bending;
        ring.stretching = stretching;
        ring.closed = true;
        ring.planar = planar;
        for (int s = 0; s < count; s++) {
            const Array g = normalNumbers(8);
            ring.nodes.push_back(x.size()/3);
            ring.fixed.push_back((s == 1 && count == 6) || (s == 0 && count == 7));
            ring.segments.push_back({10+0.3*g[0], 30+g[1], 6, 5+0.2*g[2], 8+0.2*g[3], 70+g[4], 200+g[0]});
            ring.joints.push_back((20+g[1])*(isLinear(bending) ? 0.01 : 1));
            const double angle = 2*M_PI*s/count, radius = 5/sin(M_PI/count)+0.4*g[5];
            x.insert(x.end(), {100.0*rings.size()+radius*cos(angle), -200+radius*sin(angle), planar ? 3 : 0.7*g[6]});
        }
        rings.push_back(ring);
    }
    return rings;
}

const vector<int> RINGS = {6, 4, 6, 5, 6, 7, 4, 4, 6, 12};

/** Open chains and rings together. */
inline vector<Chain> makeAll(BendingModel bending, StretchingModel stretching, Array& x) {
    vector<Chain> chains = makeChains({5, 5, 4, 1, 2, 9, 5, 5}, bending, stretching, x);
    for (const Chain& ring : makeRings(RINGS, bending, stretching, false, x))
        chains.push_back(ring);
    for (const Chain& ring : makeRings({6, 5, 6}, bending, stretching, true, x))
        chains.push_back(ring);
    return chains;
}

/** Chains whose nodes have friction; some of them have no other. */
inline vector<Chain> beaded(vector<Chain> chains) {
    for (size_t i = 0; i < chains.size(); i++) {
        chains[i].nodeFriction = 3;
        for (Segment& segment : chains[i].segments)
            if (i != 1)
                segment.parallel = segment.perpendicular = segment.rotational = segment.extensional = 0;
    }
    return chains;
}

/** Set what does not act on chains in a plane, and on fixed nodes, to zero. */
inline Array withoutHeld(const vector<Chain>& chains, Array f) {
    for (const Chain& chain : chains)
        for (size_t node = 0; node < chain.nodes.size(); node++)
            for (int k = 0; k < 3; k++)
                if (chain.fixed[node] || (chain.planar && k == 2))
                    f[3*chain.nodes[node]+k] = 0;
    return f;
}

inline double energyOf(const ChainEngine& engine, const Array& x) {
    Array forces(x.size());
    double energy = 0;
    for (int pack = 0; pack < engine.getNumPacks(); pack++) {
        ChainEnergy one = engine.addForces(pack, x.data(), forces.data(), NULL, true);
        energy += one.stretching+one.bending;
    }
    return energy;
}

inline Array forcesOf(const ChainEngine& engine, const Array& x, const double* box = NULL) {
    Array forces(x.size());
    for (int pack = 0; pack < engine.getNumPacks(); pack++)
        engine.addForces(pack, x.data(), forces.data(), box, false);
    return forces;
}

inline Array stepOf(const ChainEngine& engine, const Array& x, const Array& f, const StepSettings& settings,
            const double* box = NULL) {
    Array displacements(x.size());
    for (int pack = 0; pack < engine.getNumPacks(); pack++)
        check(engine.step(pack, x.data(), f.data(), box, settings, displacements.data()).chain < 0, "unstable step");
    return displacements;
}

/**
 * The resistance of all chains as a dense matrix, with the rows and columns of fixed nodes those of the identity, or
 * with the resistance of fixed nodes as well.
 */
inline vector<Array> denseResistance(const vector<Chain>& chains, const Array& x, bool ofFixedNodes = false) {
    vector<Array> z(x.size(), Array(x.size()));
    vector<bool> fixed(x.size()/3);
    for (const Chain& chain : chains) {
        for (size_t node = 0; node < chain.nodes.size(); node++)
            fixed[chain.nodes[node]] = chain.fixed[node] && !ofFixedNodes;
        for (int node : chain.nodes)
            for (int i = 0; i < 3; i++)
                z[3*node+i][3*node+i] += chain.nodeFriction;
        for (size_t s = 0; s < chain.segments.size(); s++) {
            const Segment& segment = chain.segments[s];
            const int ends[] = {chain.nodes[s], chain.nodes[(s+1)%chain.nodes.size()]};
            double t[3], square = 0;
            for (int k = 0; k < 3; k++) {
                t[k] = x[3*ends[1]+k]-x[3*ends[0]+k];
                square += t[k]*t[k];
            }
            for (int i = 0; i < 3; i++)
                for (int j = 0; j < 3; j++) {
                    const double tt = t[i]*t[j]/square, one = (i == j)-tt;
                    const double trans = 0.25*(segment.parallel*tt+segment.perpendicular*one);
                    const double turn = (segment.extensional*tt+segment.rotational*one)/square;
                    for (int a = 0; a < 2; a++)
                        for (int b = 0; b < 2; b++)
                            z[3*ends[a]+i][3*ends[b]+j] += trans+(a == b ? turn : -turn);
                }
        }
    }
    for (size_t i = 0; i < x.size(); i++)
        for (size_t j = 0; j < x.size(); j++)
            if (fixed[i/3] || fixed[j/3])
                z[i][j] = (i == j);
    return z;
}

const BackgroundFlow FLOW = {true, {20, -30, 10}, {0.2, 1, -0.6, 0.8, -0.4, 1.2, 0.4, -1, 0.2}};

/** The drag of the flow on nodes at rest, Z u. */
inline Array denseDrag(const vector<Chain>& chains, const Array& x) {
    Array u(x.size()), drag(x.size());
    for (const Chain& chain : chains)
        for (int node : chain.nodes)
            for (int i = 0; i < (chain.planar ? 2 : 3); i++) {
                u[3*node+i] = FLOW.velocity[i];
                for (int k = 0; k < 3; k++)
                    u[3*node+i] += FLOW.gradient[3*i+k]*x[3*node+k];
            }
    const vector<Array> z = denseResistance(chains, x, true);
    for (size_t i = 0; i < x.size(); i++)
        for (size_t j = 0; j < x.size(); j++)
            drag[i] += z[i][j]*u[j];
    return withoutHeld(chains, drag);
}

inline Array denseSolution(vector<Array> a, Array b) {
    const int n = b.size();
    for (int i = 0; i < n; i++)
        for (int row = i+1; row < n; row++) {
            const double factor = a[row][i]/a[i][i];
            for (int column = i; column < n; column++)
                a[row][column] -= factor*a[i][column];
            b[row] -= factor*b[i];
        }
    for (int i = n-1; i >= 0; i--) {
        for (int column = i+1; column < n; column++)
            b[i] -= a[i][column]*b[column];
        b[i] /= a[i][i];
    }
    return b;
}

const vector<int> SEGMENTS = {5, 5, 4, 1, 2, 9, 5, 5, 5, 5, 3, 8, 9};

const double BOX[] = {60, 0, 0, 10, 50, 0, -5, 8, 70};

/** Positions with every node moved to one of its periodic images. */
inline Array acrossBox(const Array& x) {
    Array wrapped = x;
    for (size_t i = 0; i < x.size()/3; i++)
        for (int vector = 0; vector < 3; vector++)
            for (int k = 0; k < 3; k++)
                wrapped[3*i+k] += BOX[3*vector+k]*((int) (i*(vector+1)%3)-1);
    return wrapped;
}

/**
 * Run all tests, and return the exit code of the program. Repeats are long, and run code that others run as well: they
 * are left out where CYLCHAIN_WITHOUT_REPEATS is set, as with sanitizers.
 */
inline int runTests(vector<void (*)()> tests, const vector<void (*)()>& repeats = {}) {
    if (getenv("CYLCHAIN_WITHOUT_REPEATS") == NULL)
        tests.insert(tests.end(), repeats.begin(), repeats.end());
    try {
        for (auto test : tests)
            test();
    }
    catch (const exception& error) {
        printf("FAILED (%s): %s\n", ChainEngine::getInstructionSet().c_str(), error.what());
        return 1;
    }
    printf("Passed with %s\n", ChainEngine::getInstructionSet().c_str());
    return 0;
}

#endif /*CYLCHAIN_TEST_CHAINS_H_*/
