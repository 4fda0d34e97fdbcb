#ifndef CYLCHAIN_CONTOURS_H_
#define CYLCHAIN_CONTOURS_H_

#include "couplings/Place.h"
#include "mechanics/Chain.h"
#include <cstddef>
#include <vector>

namespace cylchain {

/**
 * Lengths along chains, from their minus ends, with segments at rest; and where such lengths are.
 *
 * Segments of all chains are numbered in the order of chains.
 */
class Contours {
public:
    explicit Contours(const std::vector<Chain>& chains);
    int getNumChains() const {
        return chains.size();
    }
    int getNumSegments() const {
        return segments.size();
    }
    /** The length of a chain. */
    double getLength(int chain) const {
        return chains[chain].length;
    }
    bool isClosed(int chain) const {
        return chains[chain].closed;
    }
    /** The chain that has a segment. */
    int getChain(int segment) const {
        return segments[segment].chain;
    }
    /** Where a segment begins along its chain, and its length. */
    double getStart(int segment) const {
        return segments[segment].start;
    }
    double getSegmentLength(int segment) const {
        return segments[segment].length;
    }
    /** The particles at the ends of a segment. */
    int getFirst(int segment) const {
        return segments[segment].first;
    }
    int getSecond(int segment) const {
        return segments[segment].second;
    }
    /** Find the segment of a chain that has a position; positions beyond an end belong to the segment there. */
    int findSegment(int chain, double position) const;
    /** Find the place at a position. */
    Place findPlace(int chain, double position) const;
private:
    struct Contour {
        int firstSegment, numSegments;
        double length;
        /** The length of each segment if all are the same, or else zero. */
        double ofSegments;
        bool closed;
    };
    struct ContourSegment {
        int chain, first, second;
        double start, length;
    };
    std::vector<Contour> chains;
    std::vector<ContourSegment> segments;
};

} // namespace cylchain

#endif /*CYLCHAIN_CONTOURS_H_*/
