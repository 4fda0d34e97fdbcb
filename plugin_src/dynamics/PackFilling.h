#ifndef CYLCHAIN_PACK_FILLING_H_
#define CYLCHAIN_PACK_FILLING_H_

#include "dynamics/ChainEngine.h"
#include "dynamics/ChainPack.h"
#include "dynamics/PackProperties.h"
#include "mechanics/Chain.h"
#include <vector>

/**
 * Which chains share a pack, and how they come into its lanes.
 */
namespace cylchain {

/** Chains share a pack if they use the same models and at most a fifth of a lane is filled up. */
const double LARGEST_FILLING = 0.2;
/** The same of chains that have grown since they were put there. */
const double LARGEST_FILLING_OF_GROWN = 0.5;

/** The loops over packs for the best instruction set of this processor. */
const ChainKernels& bestKernels();
/** Whether a chain may be in the same pack as the longest one there, by how much of its lane is filled up. */
bool mayShareLanes(const Chain& longest, const Chain& chain, double filling = LARGEST_FILLING);
/** A pack whose lanes are all filled up, but for its properties. */
template <class Scalar> ChainPack<Scalar> packWithoutChains(const PackShape& shape, int lanes);
/** A pack of some chains, the longest of which comes first, or of none. */
ChainPack<double> packed(const std::vector<Chain>& chains, const std::vector<int>& members, int lanes,
        PropertyTables<double>& tables);
/** Let the chains of a pack be pieces of others. */
void setOrigins(ChainPack<double>& pack, const std::vector<PieceOfChain>& origins);

} // namespace cylchain

#endif /*CYLCHAIN_PACK_FILLING_H_*/
