#ifndef CYLCHAIN_CHAIN_GROWTH_H_
#define CYLCHAIN_CHAIN_GROWTH_H_

#include "couplings/Surroundings.h"
#include "growth/ChainPopulation.h"
#include "growth/ChainShapes.h"
#include "growth/EndGrowth.h"
#include "growth/GrowthSystem.h"
#include "mechanics/ChainList.h"
#include <vector>

namespace cylchain {

/**
 * Chains that gain and lose monomers at their ends, begin, vanish and are cut.
 *
 * The weight of a chain of N monomers with its nodes at x is
 *
 *     z^N exp(-U/k_B T)/Z(N) exp(-V/k_B T),    z = k_on c/k_off,
 *
 * with U the energies of its lengths and bends, Z(N) their integral, and V the energies of all that is around it. So a
 * free end gains k_on c monomers and loses k_off per time, whatever segments are. A step is a Markov process in
 * continuous time, in which all else stands still. All that happens to ends (EndGrowth) and to chains as a whole
 * (ChainPopulation) keeps this equilibrium, where rates have one.
 *
 * Random numbers belong to the seed, the number of the step, and the chain or nucleator or, if its pool is closed, the
 * pool: all chains and nucleators of a closed pool take their turns in the order of time.
 */
class ChainGrowth {
public:
    ChainGrowth(const GrowthSystem& system, const std::vector<BendingModel>& bending,
            const std::vector<StretchingModel>& stretching, const std::vector<char>& planar);
    /**
     * Take a step.
     *
     * @param chains     the chains, of which those that grow get other segments, joints and nodes
     * @param positions  of all particles, three numbers for each: those of chains that have changed are set
     * @param around     what chains feel
     */
    GrowthChanges advance(GrowthState& state, const GrowthStep& step, ChainList& chains, double* positions,
            const std::vector<Surroundings*>& around);
private:
    /** Chains and nucleators that take their turns: by their numbers. */
    struct Group {
        std::vector<int> chains, nucleators;
        RandomNumbers random;
    };
    bool takeTurns(GrowthState& state, const GrowthStep& step, Group& group, double time, ChainsInStep& chains,
            GrowthChanges& changes);
    const GrowthSystem system;
    ChainShapes shapes;
    EndGrowth ends;
    ChainPopulation population;
    /** Of closed pools, or of chains and nucleators by themselves. */
    std::vector<Group> groups;
    /** The group of each chain. */
    std::vector<int> groupOf;
    std::vector<GrowthEvent> events;
};

} // namespace cylchain

#endif /*CYLCHAIN_CHAIN_GROWTH_H_*/
