#ifndef CYLCHAIN_MODE_PACK_H_
#define CYLCHAIN_MODE_PACK_H_

#include "dynamics/ChainPack.h"
#include "lanes/CosineTables.h"
#include "mechanics/BeadModes.h"
#include <memory>
#include <mutex>
#include <vector>

namespace cylchain {

/**
 * What a step of some size does to the modes of a chain of N nodes, for its cosine sums: a mode is such a sum of
 * positions times (1/N)^(1/2) if it is the first one, and (2/N)^(1/2) otherwise.
 */
template <class Scalar> struct ModeCoefficients {
    /**
     * What forces move each mode by, over N: those that change with the bends, and those that decay with the bonds,
     * (49), and the noise, (35).
     */
    std::vector<Scalar> slow, fast, noise;
    /** The square of the change of a bond that neither noise nor its forces reach. */
    double largestChange;
};

/** The modes of all chains that are alike. What they share is made when it is needed. */
template <class Scalar> class ModeFamily {
public:
    ModeFamily(const BeadModes& modes, int nodes);
    const BeadModes modes;
    const int nodes;
    /** Any number of threads may ask for these. */
    std::shared_ptr<const CosineTables<Scalar> > getTables() const;
    std::shared_ptr<const ModeCoefficients<Scalar> > getCoefficients(double stepSize, double kT) const;
private:
    mutable std::mutex access;
    mutable std::shared_ptr<const CosineTables<Scalar> > tables;
    mutable std::shared_ptr<const ModeCoefficients<Scalar> > coefficients;
    mutable double stepSize, kT;
};

/**
 * Chains of one family side by side. They have the same number of nodes, so that their modes have the same transform.
 * The pack has no properties of segments and joints, because the family has them.
 */
template <class Scalar> struct ModePack {
    ChainPack<Scalar> pack;
    std::shared_ptr<const ModeFamily<Scalar> > family;
};

} // namespace cylchain

#endif /*CYLCHAIN_MODE_PACK_H_*/
