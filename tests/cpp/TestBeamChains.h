#ifndef CYLCHAIN_TEST_BEAM_CHAINS_H_
#define CYLCHAIN_TEST_BEAM_CHAINS_H_

/**
 * Chains of beam elements to test.
 */

#include "TestChains.h"
#include "beams/BeamEngine.h"

/** A straight chain along x; its particles are appended to x. */
inline BeamChain beam(int elements, double h, double modulus, double rigidity, Array& x) {
    BeamChain chain;
    chain.elementLength = h;
    chain.stretchingModulus = modulus;
    chain.bendingRigidity = rigidity;
    chain.parallelFriction = 1;
    chain.perpendicularFriction = 2;
    const int first = x.size()/3;
    const double y = 3*first;
    for (int node = 0; node <= elements; node++) {
        chain.particles.insert(chain.particles.end(), {first+2*node, first+2*node+1});
        x.insert(x.end(), {node*h, y, 0, (node+1.0/3)*h, y, 0});
    }
    chain.fixed.resize(chain.particles.size(), false);
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

#endif /*CYLCHAIN_TEST_BEAM_CHAINS_H_*/
