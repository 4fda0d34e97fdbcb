#ifndef CYLCHAIN_WIDE_PACK_H_
#define CYLCHAIN_WIDE_PACK_H_

#include "dynamics/ChainEngine.h"
#include "dynamics/ChainPack.h"
#include "dynamics/PackProperties.h"
#include "mechanics/Chain.h"
#include <cmath>
#include <optional>
#include <vector>

namespace cylchain {

/** A pack in single precision, in place of some of those in double precision, and what decides where it is right. */
class WidePack {
public:
    /** The packs that it replaces. */
    int first, last;
    int chains;
    /** Nothing before a step takes it: with few chains, it is far larger than the packs that it replaces. */
    std::optional<ChainPack<float> > pack;
    WidePack(const std::vector<Chain>& all, const std::vector<int>& members, int first, int last);
    void make(const std::vector<ChainPack<double> >& packs, PropertyTables<float>& tables);
    bool isUsed(const StepSettings& settings) const;
private:
    /**
     * The largest k l0^2, 4 kappa/gamma_rot over what a step may have, kappa/l0^2 and friction of a node, and the least
     * of the latter.
     */
    double stretching = 0, bendingRate = 0, bending = 0, largestFriction = 0, leastFriction = HUGE_VAL;
    /** The largest stiffness of twist, and the least friction of segments against turning about themselves. */
    double twisting = 0, leastAxialFriction = HUGE_VAL;
    /** The largest friction against a change of a length, times its square. */
    double lengthFriction = 0;
    void include(const Chain& chain);
};

} // namespace cylchain

#endif /*CYLCHAIN_WIDE_PACK_H_*/
