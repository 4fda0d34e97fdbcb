#ifndef CYLCHAIN_SEGMENT_CELLS_H_
#define CYLCHAIN_SEGMENT_CELLS_H_

#include "couplings/Contours.h"
#include <cstddef>
#include <cstdint>
#include <vector>

namespace cylchain {

/** A part of a segment: where it begins along the segment at rest, and along its chain, and its length. */
struct SegmentPiece {
    int segment;
    double start, length, alongChain;
};

/**
 * Pieces of segments, and of the curves of beam elements, in cells by their middles, so that one of those near a piece
 * or a point can be drawn.
 *
 * Only cells that hold something are kept, in a table by their coordinates: what this costs does not depend on how much
 * room there is between chains. What is found follows from the positions alone, not from earlier ones.
 */
class SegmentCells {
public:
    /** The cells around a place that hold something: where their sorted pieces are, and how many these are. */
    struct Around {
        int numCells = 0, numPieces = 0;
        struct {
            int first, count;
        } cells[27];
    };
    /**
     * Cut segments and curves into pieces that are no longer than the reach, or a thousandth of the segment, and sort
     * these into cells.
     *
     * @param reach       pieces that come this near to a point, or to any place of a piece, are among those around it
     * @param box         the periodic box if distances are those of nearest images, or NULL
     * @param segmentBox  the box in which the second end of a segment is that nearest to the first, or NULL
     * @param forPoints   whether isNear() is going to be asked
     * @param forCounts   whether getMostAround() is
     */
    void build(const Contours& contours, const double* positions, double reach, const double* box,
            const double* segmentBox, bool forPoints, bool forCounts = false);
    /** Take note that segments are others than those that were cut. */
    void forgetSegments() {
        reachOfPieces = 0;
    }
    /** The number of the piece at a length along a segment. */
    int findPiece(const Contours& contours, int segment, double along) const;
    const SegmentPiece& getPiece(int piece) const {
        return pieces[piece];
    }
    int getNumPieces() const {
        return static_cast<int>(pieces.size());
    }
    /** The number of pieces around a piece, itself among them. */
    int countAround(int piece) const {
        return numAround[piece];
    }
    /** The same, but zero if all of them belong to its own chain. */
    int countOthersAround(int piece) const {
        return numAround[pieces.size()+piece];
    }
    /** The numbers around all pieces, then those of other chains, then a zero. */
    const int* getNumbersAround() const {
        return numAround.data();
    }
    /** The longest piece. */
    double getLongest() const {
        return longest;
    }
    const Around& lookAround(int piece) const {
        return around[cellOf[piece]];
    }
    Around lookAround(const double* point) const;
    /** The piece of a number among those around a place. */
    const SegmentPiece& getAround(const Around& found, int number) const;
    /** A number of the cell of a point, for isNear(), until getGridNumber() is another one. */
    std::uint32_t findMark(const double* point) const;
    /** Whether there may be pieces around a point: if not, there are none. */
    bool isNear(std::uint32_t mark) const {
        return (near[mark>>6]>>(mark&63)&1) != 0;
    }
    /** At least how many pieces are around a point, and mostly as many: marks have sums over cells. */
    unsigned getMostAround(const double* point) const {
        return counts[findMark(point)&lastCount];
    }
    /** The largest number of getMostAround(). */
    unsigned getMostOfAll() const {
        return mostOfAll;
    }
    std::uint64_t getGridNumber() const {
        return gridNumber;
    }
private:
    struct Cell {
        int coordinates[3];
        /** The pieces in it, as they are sorted; the chains of the first and the last. */
        int first, count, firstChain, lastChain;
        /** Whether those around it, itself among them, belong to several chains. */
        bool several;
    };
    double findVectors(const Contours& contours, const double* positions, const double* segmentBox);
    void cut(const Contours& contours, double reach);
    void setGrid(double size, const double* box);
    void findCoordinates(const double* point, int* coordinates) const;
    int findNeighbours(int coordinate, int axis, int* found) const;
    std::uint32_t markOf(const int* coordinates) const;
    std::size_t slotOf(const int* coordinates) const;
    int findCell(const int* coordinates) const;
    unsigned readRow(const int* coordinates) const;
    int addCell(const int* coordinates, int chain);
    void clear();
    void mark(std::vector<std::uint64_t>& bits, std::uint32_t number) const {
        bits[number>>6] |= static_cast<std::uint64_t>(1)<<(number&63);
    }
    template <class Function> void forCellsAround(const int* coordinates, Function function) const;
    void addTo(Around& found, int cell) const {
        found.cells[found.numCells++] = {cells[cell].first, cells[cell].count};
        found.numPieces += cells[cell].count;
    }
    void lookAhead(int cell);
    void see(int cell, int other);
    void sortAll();
    void markAround();
    void countAround();
    template <class Function> void forMarksAround(const Cell& cell, Function function) const;
    /** The vectors that take a point to its coordinates in cells, and how many there are along axes of a box, or 0. */
    double toCells[9] = {};
    int numCells[3] = {0, 0, 0};
    std::uint64_t gridNumber = 0;
    /** Pieces stay the same as long as the reach does. */
    std::vector<SegmentPiece> pieces;
    std::vector<int> firstOfSegment;
    double reachOfPieces = 0, longest = 0;
    std::vector<double> vectors;
    std::vector<int> cellOf, sorted;
    std::vector<int> numAround = std::vector<int>(1, 0);
    std::vector<Cell> cells;
    /** Of each cell, itself among them. */
    std::vector<Around> around;
    /** Where cells are by their coordinates: -1 where none is. */
    std::vector<int> slots;
    /** A bit for each cell, and for each one beside a cell; others may have the same. */
    std::vector<std::uint64_t> held, near;
    /** How many pieces are around cells, by their marks. */
    std::vector<unsigned> counts = std::vector<unsigned>(1, 0);
    unsigned mostOfAll = 0;
    std::uint32_t lastMark = 0, lastCount = 0;
    int slotShift = 0;
};

} // namespace cylchain

#endif /*CYLCHAIN_SEGMENT_CELLS_H_*/
