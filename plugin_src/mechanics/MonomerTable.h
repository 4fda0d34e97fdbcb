#ifndef CYLCHAIN_MONOMER_TABLE_H_
#define CYLCHAIN_MONOMER_TABLE_H_

#include "mechanics/Chain.h"
#include <vector>

namespace cylchain {

/** The monomers of a chain: those with the numbers first, first+1, ..., last-1, from its minus to its plus end. */
struct MonomerRange {
    int first = 0, last = 0;
    int size() const {
        return last-first;
    }
};

/** What the segments of a chain that grows are, by the numbers of their monomers. */
struct MonomerTable {
    /** Of each segment but those at ends. */
    int monomersPerSegment = 0;
    /** Of segments with 1, 2, ... monomers, to twice the number above. */
    std::vector<Segment> segments;
    /** The stiffness of the joint between two segments with 2, 3, ... monomers together, to three times that number. */
    std::vector<double> joints;
    const Segment& getSegment(int monomers) const {
        return segments[monomers-1];
    }
    double getJoint(int monomersOfBoth) const {
        return joints[monomersOfBoth-2];
    }
};

/**
 * How monomers are divided into segments: joints are at multiples of the number m of monomers of a segment, as far as
 * they leave half of that, rounded down, to the segment at an end. So the range alone says where joints are, and an end
 * that gains or loses a monomer changes the segment there and nothing else: it has m/2 monomers or more, and less than
 * 3m/2. Where there is no such multiple, there is one segment, of less than 2m monomers.
 */
class SegmentDivision {
public:
    SegmentDivision(MonomerRange range, int monomersPerSegment);
    int countSegments() const {
        return lastJoint-firstJoint+2;
    }
    /** Get the monomers of a segment. */
    int getMonomers(int segment) const;
    /** Get those of a segment, counted from the plus end (1) or the minus end (0). */
    int getMonomersFrom(int end, int segment) const {
        return getMonomers(end == 1 ? countSegments()-1-segment : segment);
    }
private:
    MonomerRange range;
    int perSegment, firstJoint, lastJoint;
};

/**
 * Let a chain have the segments of a range of monomers. Its nodes are the first ones of all its particles, and others
 * are spare: all of them if there are no monomers. Nodes that come or go are none that are fixed.
 */
void setMonomers(Chain& chain, const MonomerTable& table, MonomerRange range);

} // namespace cylchain

#endif /*CYLCHAIN_MONOMER_TABLE_H_*/
