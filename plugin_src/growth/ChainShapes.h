#ifndef CYLCHAIN_CHAIN_SHAPES_H_
#define CYLCHAIN_CHAIN_SHAPES_H_

#include "growth/GrowthSystem.h"
#include "growth/SegmentLaws.h"
#include "mechanics/ChainList.h"
#include <memory>
#include <vector>

namespace cylchain {

/** A chain that has got other monomers at one of its ends. */
struct CarriedEnd {
    /** All of its nodes. */
    std::vector<Vec3d> nodes;
    /** How many segments at the end have changed or gone, and how many are there instead. */
    int segmentsBefore = 1, segmentsAfter = 1;
    /** Where the joint that has come is on the segment that was divided, or the one that has gone on that of both. */
    double joint = 1;
};

/**
 * The shapes of chains that grow, in equilibrium.
 *
 * With its end, a chain changes the segment there and the joint behind it. These are carried from their law to that
 * with other monomers (SegmentLaws); a joint that comes is drawn, with its two segments, and one that goes is
 * forgotten. So a chain in equilibrium is so afterwards.
 */
class ChainShapes {
public:
    ChainShapes(const GrowthSystem& system, const std::vector<BendingModel>& bending,
            const std::vector<StretchingModel>& stretching, const std::vector<char>& planar);
    /** Whether two growing chains are made of the same. */
    bool areAlike(int index, int other) const {
        return lawsOf[index] == lawsOf[other];
    }
    bool isPlanar(int index) const {
        return planar[index] != 0;
    }
    double getMonomerLength(int index) const {
        return restLengthOf(index, 1);
    }
    /** Draw where the nodes of a chain are that gets other monomers at an end: its plus end (1) or minus end (0). */
    CarriedEnd carryEnd(int index, MonomerRange before, MonomerRange after, int end, const std::vector<Vec3d>& nodes,
            double kT, RandomNumbers& random);
    /** Draw the nodes of a chain that begins at a place with a direction. */
    std::vector<Vec3d> draw(int index, MonomerRange range, const Vec3d& start, const Vec3d& direction, double kT,
            RandomNumbers& random);
    /** Find the lengths along a chain, at rest, at which its nodes are. */
    std::vector<double> findLengths(int index, MonomerRange range) const;
private:
    struct Laws {
        double kT = -1;
        std::vector<std::unique_ptr<LengthLaw> > lengths;
        std::vector<std::unique_ptr<BendLaw> > bends;
    };
    const MonomerTable& tableOf(int index) const {
        return system.tables[system.chains[index].table];
    }
    const LengthLaw& getLengths(int index, int monomers, double kT);
    const BendLaw& getBends(int index, int monomersOfBoth, double kT);
    double restLengthOf(int index, int monomers) const {
        return tableOf(index).getSegment(monomers).restLength;
    }
    double drawLength(int index, int monomers, double kT, RandomNumbers& random);
    Vec3d turn(const Vec3d& along, const Vec3d& direction, bool flat, const BendLaw& from, const BendLaw& to,
            RandomNumbers& random) const;
    Vec3d bendFrom(const Vec3d& along, bool flat, const BendLaw& law, RandomNumbers& random) const;
    const GrowthSystem& system;
    std::vector<BendingModel> bending;
    std::vector<StretchingModel> stretching;
    std::vector<char> planar;
    /** Which laws each growing chain has: those of its table, its models, and whether it is planar. */
    std::vector<int> lawsOf;
    std::vector<Laws> laws;
};

} // namespace cylchain

#endif /*CYLCHAIN_CHAIN_SHAPES_H_*/
