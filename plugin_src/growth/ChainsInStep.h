#ifndef CYLCHAIN_CHAINS_IN_STEP_H_
#define CYLCHAIN_CHAINS_IN_STEP_H_

#include "couplings/Surroundings.h"
#include "growth/ChainShapes.h"
#include "growth/GrowthSystem.h"
#include "kinetics/RandomNumbers.h"
#include "mechanics/ChainList.h"
#include <map>
#include <vector>

namespace cylchain {

/**
 * Chains that grow, within a step in which all else stands still: where their nodes are, and what they feel. Chains and
 * positions stay as they are until finish().
 */
class ChainsInStep {
public:
    /** @param around  what chains feel */
    ChainsInStep(const GrowthSystem& system, const GrowthStep& step, const ChainList& chains, const double* positions,
            const std::vector<Surroundings*>& around) : system(system), step(step), chains(chains),
            positions(positions), around(around), present(system.chains.size()) {
        for (const ActingHand& hand : step.hands)
            hands[hand.chain].push_back(hand);
    }
    const Chain& getChain(int index) const {
        return chains.getChain(system.chains[index].chain);
    }
    /** Get the most nodes that a growing chain can have. */
    size_t getMostNodes(int index) const {
        return getChain(index).nodes.size()+getChain(index).spareNodes.size();
    }
    /** Get the nodes of a growing chain. */
    const std::vector<Vec3d>& getNodes(int index);
    /** Get whether one of some nodes is fixed. */
    bool isAnyFixed(int index, int firstNode, int count) const;
    bool hasSurroundings() const {
        return !around.empty();
    }
    /** Find the change of the energies of all that is around. */
    double findChange(const EndChange& change);
    /** Get whether something happens that changes energies. */
    bool isTaken(double change, RandomNumbers& random) const {
        return change <= 0 || std::log(random.uniform())*step.kT < -change;
    }
    /** Let others see a chain with some nodes, which are at lengths along it. */
    void show(int index, const std::vector<Vec3d>& nodes, const std::vector<double>& along);
    /** Let a chain have some nodes. */
    void set(int index, const std::vector<Vec3d>& nodes);
    /** Let what is beyond a length along a chain belong to another one, as others see it. */
    void move(int index, int other, double beyond);
    /** Call a function of each hand that takes monomers off an end of a growing chain, or cuts it where that is -1. */
    template <class Function> void forHands(int index, int end, Function function) const {
        const auto found = hands.find(system.chains[index].chain);
        if (found != hands.end())
            for (const ActingHand& hand : found->second)
                if (hand.end == end)
                    function(hand);
    }
    /** Find how often hands take a monomer off an end of a growing chain, which a capped one keeps. */
    double findOffRate(int index, int end) const {
        double rate = 0;
        if (!hands.empty() && system.chains[index].ends[end].grows())
            forHands(index, end, [&] (const ActingHand& hand) {
                rate += hand.rate;
            });
        return rate;
    }
    /** Take note of a cut. */
    void addCut(const ChainCut& cut, GrowthChanges& changes);
    /** Set the chains and the positions that have changed. */
    void finish(const GrowthState& state, ChainList& list, double* all, GrowthChanges& changes) const;
private:
    struct Present {
        std::vector<Vec3d> nodes;
        bool isKnown = false, hasChanged = false;
    };
    void beginAround();
    const GrowthSystem& system;
    const GrowthStep& step;
    const ChainList& chains;
    const double* positions;
    const std::vector<Surroundings*>& around;
    std::vector<Present> present;
    /** By the numbers of chains. */
    std::map<int, std::vector<ActingHand> > hands;
    /** Whether what is around has taken note of the step. */
    bool aroundIsKnown = false;
};

} // namespace cylchain

#endif /*CYLCHAIN_CHAINS_IN_STEP_H_*/
