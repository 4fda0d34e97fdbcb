#ifndef CYLCHAIN_TEST_BEAM_CHAINS_H_
#define CYLCHAIN_TEST_BEAM_CHAINS_H_

/**
 * Chains of beam elements to test.
 */

#include "TestChains.h"
#include "beams/BeamEngine.h"
#include <numeric>

/** A chain whose particles come behind those of x. */
inline BeamChain beamOfNodes(int nodes, double h, double modulus, double rigidity, const Array& x) {
    BeamChain chain;
    chain.elementLength = h;
    chain.stretchingModulus = modulus;
    chain.bendingRigidity = rigidity;
    chain.parallelFriction = 1;
    chain.perpendicularFriction = 2;
    chain.particles.resize(2*nodes);
    iota(chain.particles.begin(), chain.particles.end(), (int) x.size()/3);
    chain.fixed.resize(chain.particles.size(), false);
    return chain;
}

/** A straight chain along x; its particles are appended to x. */
inline BeamChain beam(int elements, double h, double modulus, double rigidity, Array& x) {
    const BeamChain chain = beamOfNodes(elements+1, h, modulus, rigidity, x);
    const double y = x.size();
    for (int node = 0; node <= elements; node++)
        x.insert(x.end(), {node*h, y, 0, (node+1.0/3)*h, y, 0});
    return chain;
}

inline double energyOf(const BeamEngine& engine, const Array& x, const double* box = NULL) {
    Array unused(x.size());
    double energy = 0;
    for (int pack = 0; pack < engine.getNumPacks(); pack++) {
        const ChainEnergy one = engine.addForces(pack, x.data(), unused.data(), box, true);
        energy += one.stretching+one.bending+one.tethers;
    }
    return energy;
}

inline double bendingEnergyOf(const BeamEngine& engine, const Array& x) {
    Array unused(x.size());
    double energy = 0;
    for (int pack = 0; pack < engine.getNumPacks(); pack++)
        energy += engine.addForces(pack, x.data(), unused.data(), NULL, true).bending;
    return energy;
}

/** Take a step with some forces, and move the particles. Returns the number of chains whose step was divided. */
inline int advance(const BeamEngine& engine, Array& x, const Array& f, StepSettings& settings) {
    Array moves(x.size());
    int divided = 0;
    for (int pack = 0; pack < engine.getNumPacks(); pack++) {
        const Instability found = engine.step(pack, x.data(), f.data(), NULL, settings, moves.data());
        check(found.chain == -1, "a chain of beams is unstable");
        divided += found.divided;
    }
    for (size_t i = 0; i < x.size(); i++)
        x[i] += moves[i];
    settings.step++;
    return divided;
}

/** Check that chains move together as they do alone, with the noise of their numbers, and return where that leads. */
inline Array checkNeighbours(const vector<BeamChain>& chains, const Array& x, const string& what) {
    const Array f(x.size());
    const BeamEngine engine(chains, 40);
    StepSettings settings = {Scheme::Implicit, 1, 1e-3, 5, 0};
    Array together = x;
    for (int i = 0; i < 20; i++)
        advance(engine, together, f, settings);
    for (size_t i = 0; i < chains.size(); i++) {
        const BeamEngine alone({chains[i]}, 40+i);
        Array moved = x;
        settings.step = 0;
        for (int step = 0; step < 20; step++)
            advance(alone, moved, f, settings);
        for (int particle : chains[i].particles)
            for (int k = 0; k < 3; k++)
                checkClose(moved[3*particle+k], together[3*particle+k], 1, 1e-6, what);
    }
    return together;
}

#endif /*CYLCHAIN_TEST_BEAM_CHAINS_H_*/
