#ifndef CYLCHAIN_SEGMENT_CELLS_H_
#define CYLCHAIN_SEGMENT_CELLS_H_

#include "couplings/Contours.h"
#include <cstddef>
#include <vector>

namespace cylchain {

/** A part of a segment: where it begins along the segment at rest, and its length. */
struct SegmentPiece {
    int segment;
    double start, length;
};

/**
 * A grid of cells that hold pieces of segments by their middles, so that one of those near a point can be drawn.
 */
class SegmentCells {
public:
    /**
     * Cut segments into pieces that are no longer than the reach, and sort these into cells.
     *
     * @param reach       pieces that come this near to a point are among those around it
     * @param box         the periodic box if distances are those of nearest images, or NULL
     * @param segmentBox  the box in which the second end of a segment is that nearest to the first, or NULL
     */
    void build(const Contours& contours, const double* positions, double reach, const double* box,
            const double* segmentBox);
    /** The cell of a point. */
    int findCell(const double* point) const;
    /** The number of pieces in a cell and the cells around it. */
    int countAround(int cell) const {
        return numAround[cell];
    }
    /** The largest number of pieces around any cell. */
    int getLargestNumber() const {
        return largestNumber;
    }
    /** The longest piece. */
    double getLongest() const {
        return longest;
    }
    /** The piece of a number among those around a cell. */
    const SegmentPiece& getAround(int cell, int number) const;
private:
    void cut(const Contours& contours, double reach);
    void setGrid(double reach, const double* box);
    void setNumbers(const double* extents, double reach, std::size_t count);
    void addNeighbours(int axis, int stride);
    int findCells(int cell, int* around) const;
    /** How many cells there are along each axis, and whether they follow each other periodically. */
    int numCells[3] = {1, 1, 1};
    bool periodic = false;
    /** Where the grid begins, and the vectors that take a point to its coordinates in cells. */
    double origin[3] = {}, toCells[9] = {};
    /** Pieces stay the same as long as the reach does. */
    std::vector<SegmentPiece> pieces;
    double reachOfPieces = 0, longest = 0;
    std::vector<double> middles;
    int largestNumber = 0;
    std::vector<int> cellOf, firstOfCell, sorted, numAround, before, first;
};

} // namespace cylchain

#endif /*CYLCHAIN_SEGMENT_CELLS_H_*/
