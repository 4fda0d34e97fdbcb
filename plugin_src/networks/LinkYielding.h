#ifndef CYLCHAIN_LINK_YIELDING_H_
#define CYLCHAIN_LINK_YIELDING_H_

#include "networks/CoupledEquations.h"
#include <cstddef>
#include <vector>

namespace cylchain {

/**
 * How links between chains yield to forces on these chains.
 *
 * Responses of a chain are found as if the other places of its links were held. Let a force on one chain move the place
 * of a link there by u, and one on the other chain the other place by v. With the stiffness K of the link, and the
 * compliances C and D of its places, its yielding adds
 *
 *     u.K D B^T u  to the response of the one chain to itself,
 *     v.K C B v    to that of the other,
 *     u.B v        to that of one to a force on the other,      B = (1-K D K C)^-1 K.
 *
 * All this is exact for a single link of two chains. Of several, it is what each does as if the others were held. If
 * both places are on one chain, all three are for that, as if a force on one place did not move the other.
 */
class LinkYielding {
public:
    /** A link: its equation, the chains of its places, and the matrices above, row by row. */
    struct Link {
        std::size_t equation;
        int chains[2];
        double stiffness[6];
        double ofPlace[2][9], between[9];
    };
    /** Take note of the links among equations. */
    void setEquations(const std::vector<CouplingEquation>& equations, int numChains);
    /** Find the matrices, after the equations have been solved in a step of some precision. */
    void find(const std::vector<PackStep*>& packs, CoupledEquations& coupled, Precision precision, const Loop& loop);
    const std::vector<Link>& getLinks() const {
        return links;
    }
    /** A link of a chain, and which of its places is on it. */
    struct Side {
        int link, side;
    };
    /** Those of a chain follow each other. */
    const Side* begin(int chain) const {
        return sides.data()+firstSide[chain];
    }
    const Side* end(int chain) const {
        return sides.data()+firstSide[chain+1];
    }
    /** The number of a link among those of a chain. */
    int getNumber(int link, int side) const {
        return numberOfSide[2*link+side];
    }
private:
    std::vector<Link> links;
    std::vector<Side> sides;
    std::vector<int> firstSide, numberOfSide;
    std::vector<double> compliances;
};

} // namespace cylchain

#endif /*CYLCHAIN_LINK_YIELDING_H_*/
