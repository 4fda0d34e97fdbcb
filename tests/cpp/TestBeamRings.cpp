/**
 * This tests rings of beam elements: forces against differences of energies, steps that do not depend on which node is
 * the first, and packs of rings and open chains.
 */

#include "TestBeamChains.h"

/** A circle around a center; its particles are appended to x. */
static BeamChain ring(int elements, double h, double modulus, double rigidity, Array& x) {
    BeamChain chain = beamOfNodes(elements, h, modulus, rigidity, x);
    chain.closed = true;
    const double radius = elements*h/(2*M_PI);
    for (int node = 0; node < elements; node++) {
        const double angle = 2*M_PI*node/elements, c = cos(angle), s = sin(angle);
        x.insert(x.end(), {radius*c, radius*s, 0, radius*c-h/3*s, radius*s+h/3*c, 0});
    }
    return chain;
}

static void scatter(Array& x, double width, int seed) {
    NormalNumbers normalNumbers(seed);
    const Array moves = normalNumbers(x.size());
    for (size_t i = 0; i < x.size(); i++)
        x[i] += width*moves[i];
}

static void testForces() {
    Array x;
    vector<BeamChain> chains;
    for (int elements : {5, 3, 4, 4, 5, 5}) {
        chains.push_back(ring(elements, 2, 50, 7, x));
        chains.back().shortening = 0.02;
        chains.back().tethers = {{elements-1, {0.5, 0.2, 0.7}, 0.9}, {0, {0.2, 1, -0.3}, 0.4}};
    }
    chains.push_back(beam(5, 2, 50, 7, x));
    scatter(x, 0.1, 1);
    const BeamEngine engine(chains);
    Array f(x.size());
    for (int pack = 0; pack < engine.getNumPacks(); pack++)
        engine.addForces(pack, x.data(), f.data(), NULL, false);
    for (size_t i = 0; i < x.size(); i++) {
        Array plus = x, minus = x;
        plus[i] += 1e-5;
        minus[i] -= 1e-5;
        const double slope = (energyOf(engine, plus)-energyOf(engine, minus))/2e-5;
        checkClose(-slope, f[i], 1, 1e-6, "force on coordinate "+to_string(i));
    }
}

/** Long steps without noise, of free, hinged and clamped rings: the same when nodes are counted from another one. */
static void testWhereItBegins() {
    const int elements = 5, turn = 4;
    for (int held : {0, 1, 2}) {
        Array x, f;
        BeamChain chain = ring(elements, 1, 1e4, 20, x);
        scatter(x, 0.05, 2+held);
        f = Array(x.size());
        for (size_t i = 0; i < f.size(); i++)
            f[i] = 3*sin(7.0*i);
        for (int k = 0; k < held; k++)
            chain.fixed[4+k] = true;
        BeamChain turned = chain;
        for (int i = 0; i < 2*elements; i++) {
            turned.particles[i] = chain.particles[(i+turn)%(2*elements)];
            turned.fixed[i] = chain.fixed[(i+turn)%(2*elements)];
        }
        Array ends[2] = {x, x};
        for (int which = 0; which < 2; which++) {
            StepSettings settings = {Scheme::Implicit, 0, 0.05, 1, 0};
            const BeamEngine engine({which == 0 ? chain : turned});
            for (int step = 0; step < 4; step++)
                advance(engine, ends[which], f, settings);
        }
        double largest = 0;
        for (size_t i = 0; i < x.size(); i++) {
            largest = max(largest, fabs(ends[0][i]-x[i]));
            checkClose(ends[0][i], ends[1][i], 1, 1e-9, "a ring that begins elsewhere");
        }
        check(largest > 0.1, "the ring has hardly moved");
        for (int k = 0; k < 3*held; k++)
            checkClose(x[3*chain.particles[4]+k], ends[1][3*chain.particles[4]+k], 1, 0, "a hinge or clamp");
    }
}

/** Rings move in packs as they do alone, with the noise of their numbers, beside open chains. */
static void testNeighbours() {
    Array x;
    vector<BeamChain> chains;
    for (int elements : {6, 5, 5, 5, 6, 6, 6, 6, 6, 6})
        chains.push_back(ring(elements, 1, 1e4, 20, x));
    chains.push_back(beam(6, 1, 1e4, 20, x));
    chains[2].fixed[0] = true;
    chains[4].fixed[0] = chains[4].fixed[1] = true;
    checkNeighbours(chains, x, "a ring among others");
}

static void testWhatIsRefused() {
    Array x;
    BeamChain chain = ring(3, 1, 1e4, 20, x);
    chain.particles.resize(4);
    chain.fixed.resize(4);
    try {
        BeamEngine engine({chain});
    }
    catch (const invalid_argument& error) {
        check(string(error.what()).find("at least 3 nodes") != string::npos, error.what());
        return;
    }
    check(false, "a ring of two nodes was taken");
}

int main() {
    return runTests({testForces, testWhereItBegins, testNeighbours, testWhatIsRefused});
}
