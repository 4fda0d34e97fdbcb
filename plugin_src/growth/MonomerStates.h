#ifndef CYLCHAIN_MONOMER_STATES_H_
#define CYLCHAIN_MONOMER_STATES_H_

#include "growth/GrowthSystem.h"
#include "kinetics/RandomNumbers.h"
#include <deque>
#include <vector>

namespace cylchain {

/**
 * The states of the monomers of a chain, such as which nucleotide they have bound. Each changes by itself. Only that
 * of a monomer at an end is followed in time: others keep the time at which they were known, and change all at once
 * when they are looked at.
 */
class MonomersOfChain {
public:
    /** @param states  of which the rates are those of changing inside a chain */
    MonomersOfChain(std::deque<MonomerState>& monomers, const std::vector<EndState>& states) : monomers(monomers),
            states(states) {
    }
    /** Add one at the plus end (1) or the minus end (0), whose state is to be set. */
    void add(int end);
    void remove(int end);
    void set(int end, MonomerState state) {
        (end == 1 ? monomers.back() : monomers.front()) = state;
    }
    /** Find the state of the last one at an end. */
    int reveal(int end, double time, RandomNumbers& random) {
        return revealAt(end == 1 ? monomers.size()-1 : 0, time, random);
    }
    /** Find the state of a monomer. */
    int revealAt(std::size_t number, double time, RandomNumbers& random);
private:
    std::deque<MonomerState>& monomers;
    const std::vector<EndState>& states;
};

} // namespace cylchain

#endif /*CYLCHAIN_MONOMER_STATES_H_*/
