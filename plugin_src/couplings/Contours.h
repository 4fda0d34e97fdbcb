#ifndef CYLCHAIN_CONTOURS_H_
#define CYLCHAIN_CONTOURS_H_

#include "couplings/Place.h"
#include "mechanics/ChainList.h"
#include <cmath>
#include <cstddef>
#include <vector>

namespace cylchain {

/**
 * Lengths along chains, from their minus ends or where these were before they grew, with segments at rest; and where
 * such lengths are.
 *
 * Segments of all chains are numbered in the order of the list of chains. Those of beam elements are the elements, on
 * the curves of which lengths are.
 */
class Contours {
public:
    explicit Contours(const ChainList& chains);
    int getNumChains() const {
        return chains.size();
    }
    int getNumSegments() const {
        return segments.size();
    }
    /** The length at which a chain begins: zero, unless it has grown there. */
    double getBegin(int chain) const {
        return chains[chain].begin;
    }
    /** The length at which its plus end (1) or its minus end (0) is. */
    double getEnd(int chain, int end) const {
        return end == 1 ? chains[chain].begin+chains[chain].length : chains[chain].begin;
    }
    /** Whether a position on a chain is so near to an end. */
    bool isNearEnd(int chain, double position, int end, double range) const {
        return !isClosed(chain) && std::fabs(position-getEnd(chain, end)) <= range;
    }
    /** The length of a chain. */
    double getLength(int chain) const {
        return chains[chain].length;
    }
    /** Whether there is a position on a chain that is open. */
    bool isWithin(int chain, double position) const {
        return chain >= 0 && getLength(chain) > 0 && position >= getBegin(chain) && position <= getEnd(chain, 1);
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
    /** Whether a segment is the curve of a beam element. */
    bool isOnCurve(int segment) const {
        return segments[segment].controls[0] >= 0;
    }
    /** The control point at the first (0) or second (1) end of a segment that is a curve. */
    int getControl(int segment, int end) const {
        return segments[segment].controls[end];
    }
    /** Find the segment of a chain that has a position; positions beyond an end belong to the segment there. */
    int findSegment(int chain, double position) const;
    /** Find the place at a position. */
    Place findPlace(int chain, double position) const {
        const int segment = findSegment(chain, position);
        return placeOn(segment, (position-segments[segment].start)/segments[segment].length);
    }
    /** The place at a fraction of a segment. */
    Place placeOn(int segment, double fraction) const;
    /**
     * Find how far one gets along a chain for each length of it at rest: a vector along its segment, or along the
     * tangent of its curve.
     *
     * @param box  nine numbers if particles of a segment are the images nearest to the first one, or NULL
     */
    void findTangent(int chain, double position, const double* positions, const double* box, double* tangent) const;
private:
    void add(const Chain& chain);
    void add(const BeamChain& beam);
    struct Contour {
        int firstSegment, numSegments;
        double begin, length;
        /** The length of each segment, or of each but those at ends, if these are the same, or else zero. */
        double ofSegments;
        /** The length of the first one if it is another, or zero. */
        double ofFirst;
        bool closed;
    };
    struct ContourSegment {
        int chain, first, second;
        double start, length;
        /** The control points of both ends on a curve, or -1. */
        int controls[2];
    };
    std::vector<Contour> chains;
    std::vector<ContourSegment> segments;
};

} // namespace cylchain

#endif /*CYLCHAIN_CONTOURS_H_*/
