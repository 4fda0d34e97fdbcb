#ifndef OPENMM_CYLINDERCHAIN_CHAINTABLES_H_
#define OPENMM_CYLINDERCHAIN_CHAINTABLES_H_

#include "mechanics/Chain.h"
#include <map>
#include <string>
#include <vector>

namespace OpenMM {

/**
 * The order of the numbers that the host and the kernels exchange.
 */
namespace layout {
#include "../kernels/layout.cc"
} // namespace layout

/**
 * Chains of the same models as numbers for the kernels: see layout.cc.
 */
struct ChainTable {
    int numChains, numPlaces, numFields;
    std::vector<int> numbers;
    std::vector<double> properties, places;
};

/**
 * Get what kernels for a chain are compiled with.  Chains that have the same may be computed by the same kernel.
 */
std::map<std::string, std::string> definesFor(const cylchain::Chain& chain);

/**
 * Describe some chains.
 *
 * @param members       the chains, of which the first is the longest
 * @param firstNodes    the number of the first node of each chain among those of all
 * @param chainByChain  whether the places of a chain lie next to each other, rather than the same places of all chains
 */
ChainTable tabulate(const std::vector<cylchain::Chain>& chains, const std::vector<int>& members,
        const std::vector<int>& firstNodes, bool chainByChain);

/**
 * The tethers of all chains in the order of their nodes, and the number of the first tether of each node, or of the
 * one that follows.
 */
struct TetherTable {
    std::vector<int> first;
    std::vector<double> properties;
};

TetherTable tabulateTethers(const std::vector<cylchain::Chain>& chains);

} // namespace OpenMM

#endif /*OPENMM_CYLINDERCHAIN_CHAINTABLES_H_*/
