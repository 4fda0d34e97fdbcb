#include "kinetics/SegmentCells.h"
#include <algorithm>
#include <cmath>
#include <cstdint>

using namespace cylchain;
using namespace std;

/** Coordinates of cells are between these. */
static const double LARGEST_COORDINATE = 1e9;
/** Cells grow in steps of this, so that they mostly stay what they are while segments stretch. */
static const double GROWTH = 1.02;
/** Of a segment: hands that reach less far have longer pieces, and more proposals that come to nothing. */
static const double MOST_PIECES = 1000;
/** Counts have so many bits less for their marks: these are read at random, and should be near. */
static const int COUNT_BITS_LESS = 3;

/** floor(), which the oldest processors do not have as an instruction. */
static inline double roundDown(double x) {
    if (!(fabs(x) < 1e15))
        return floor(x);
    const double whole = static_cast<double>(static_cast<int64_t>(x));
    return whole > x ? whole-1 : whole;
}

void SegmentCells::setGrid(double size, const double* box) {
    double changed[9] = {};
    int numbers[3] = {0, 0, 0};
    if (box == nullptr)
        changed[0] = changed[4] = changed[8] = 1/size;
    else {
        // Rows of the inverse of the box, which is a lower triangle: their sizes are one over the heights of the box.
        const double a = box[0], b = box[4], c = box[8];
        const double inverse[9] = {1/a, -box[3]/(a*b), (box[3]*box[7]-box[6]*b)/(a*b*c), 0, 1/b, -box[7]/(b*c), 0, 0,
                1/c};
        for (int k = 0; k < 3; k++) {
            const double* row = inverse+3*k;
            const double height = 1/sqrt(row[0]*row[0]+row[1]*row[1]+row[2]*row[2]);
            numbers[k] = static_cast<int>(min(LARGEST_COORDINATE, max(1.0, floor(height/size))));
            for (int j = 0; j < 3; j++)
                changed[3*k+j] = row[j]*numbers[k];
        }
    }
    if (!equal(changed, changed+9, toCells) || !equal(numbers, numbers+3, numCells))
        gridNumber++;
    copy(changed, changed+9, toCells);
    copy(numbers, numbers+3, numCells);
}

void SegmentCells::findCoordinates(const double* point, int* coordinates) const {
    // Written so that NaN is somewhere, too.
    if (numCells[0] == 0) {
        for (int k = 0; k < 3; k++)
            coordinates[k] = static_cast<int>(min(LARGEST_COORDINATE, max(-LARGEST_COORDINATE,
                    roundDown(toCells[4*k]*point[k]))));
        return;
    }
    for (int k = 0; k < 3; k++) {
        // Rows have nothing before their own axis.
        double coordinate = 0;
        for (int j = k; j < 3; j++)
            coordinate += toCells[3*k+j]*point[j];
        const int n = numCells[k];
        coordinate = roundDown(coordinate-n*roundDown(coordinate/n));
        coordinates[k] = static_cast<int>(min(n-1.0, max(0.0, coordinate)));
    }
}

/** The coordinates beside one, and itself, along an axis: each once. */
int SegmentCells::findNeighbours(int coordinate, int axis, int* found) const {
    const int n = numCells[axis];
    if (n == 0 || n > 2) {
        for (int shift = -1; shift <= 1; shift++)
            found[shift+1] = n == 0 ? coordinate+shift : (coordinate+shift+n)%n;
        return 3;
    }
    for (int i = 0; i < n; i++)
        found[i] = i;
    return n;
}

/** Cells that follow each other along the first axis have marks that do so. */
uint32_t SegmentCells::markOf(const int* coordinates) const {
    return (static_cast<uint32_t>(coordinates[0])+static_cast<uint32_t>(coordinates[1])*0x9e3779b1u+
            static_cast<uint32_t>(coordinates[2])*0x85ebca77u)&lastMark;
}

size_t SegmentCells::slotOf(const int* coordinates) const {
    const uint32_t mixed = static_cast<uint32_t>(coordinates[0])*0x9e3779b1u^
            static_cast<uint32_t>(coordinates[1])*0x85ebca77u^static_cast<uint32_t>(coordinates[2])*0xc2b2ae3du;
    return mixed*0x9e3779b1u>>slotShift;
}

int SegmentCells::findCell(const int* coordinates) const {
    for (size_t slot = slotOf(coordinates); slots[slot] >= 0; slot = slot+1 < slots.size() ? slot+1 : 0)
        if (equal(coordinates, coordinates+3, cells[slots[slot]].coordinates))
            return slots[slot];
    return -1;
}

int SegmentCells::addCell(const int* coordinates, int chain) {
    size_t slot = slotOf(coordinates);
    for (; slots[slot] >= 0; slot = slot+1 < slots.size() ? slot+1 : 0)
        if (equal(coordinates, coordinates+3, cells[slots[slot]].coordinates))
            return slots[slot];
    slots[slot] = static_cast<int>(cells.size());
    cells.push_back({{coordinates[0], coordinates[1], coordinates[2]}, 0, 0, chain, chain, false});
    mark(held, markOf(coordinates));
    return slots[slot];
}

/** Which of a cell and the two that follow it along the first axis may hold something: three bits. */
unsigned SegmentCells::readRow(const int* coordinates) const {
    const uint32_t number = markOf(coordinates), bit = number&63;
    uint64_t word = held[number>>6]>>bit;
    // There is a word more behind the last one, which is the first again.
    if (bit > 61)
        word |= held[(number>>6)+1]<<(64-bit);
    return word&7;
}

/** Call a function with each cell around some coordinates that holds something. */
template <class Function> void SegmentCells::forCellsAround(const int* coordinates, Function function) const {
    int x[3] = {}, y[3] = {}, z[3] = {};
    const int numX = findNeighbours(coordinates[0], 0, x), numY = findNeighbours(coordinates[1], 1, y);
    const int numZ = findNeighbours(coordinates[2], 2, z);
    const bool inRow = numX == 3 && x[1] == x[0]+1 && x[2] == x[1]+1;
    for (int k = 0; k < numZ; k++)
        for (int j = 0; j < numY; j++) {
            int other[3] = {x[0], y[j], z[k]};
            // Most rows hold nothing.
            const unsigned row = inRow ? readRow(other) : 7;
            for (int i = 0; i < numX; i++) {
                if ((row>>i&1) == 0)
                    continue;
                other[0] = x[i];
                const int cell = findCell(other);
                if (cell >= 0)
                    function(cell);
            }
        }
}

SegmentCells::Around SegmentCells::lookAround(const double* point) const {
    int coordinates[3];
    findCoordinates(point, coordinates);
    Around found;
    forCellsAround(coordinates, [&] (int cell) {
        addTo(found, cell);
    });
    return found;
}

uint32_t SegmentCells::findMark(const double* point) const {
    int coordinates[3];
    findCoordinates(point, coordinates);
    return markOf(coordinates);
}

void SegmentCells::cut(const Contours& contours, double reach) {
    reachOfPieces = reach;
    pieces.clear();
    firstOfSegment.clear();
    longest = 0;
    for (int segment = 0; segment < contours.getNumSegments(); segment++) {
        const double length = contours.getSegmentLength(segment);
        const int parts = static_cast<int>(min(MOST_PIECES, max(1.0, ceil(length/reach))));
        firstOfSegment.push_back(static_cast<int>(pieces.size()));
        for (int part = 0; part < parts; part++)
            pieces.push_back({segment, part*length/parts, length/parts,
                    contours.getStart(segment)+part*length/parts});
        longest = max(longest, length/parts);
    }
    firstOfSegment.push_back(static_cast<int>(pieces.size()));
    cellOf.resize(pieces.size());
    sorted.resize(pieces.size());
    numAround.assign(2*pieces.size()+1, 0);
    vectors.resize(3*static_cast<size_t>(contours.getNumSegments()));
    int slotBits = 4;
    while (slotBits < 30 && (static_cast<size_t>(1)<<slotBits) < 2*pieces.size()+2)
        slotBits++;
    slotShift = 32-slotBits;
    slots.resize(static_cast<size_t>(1)<<slotBits);
    lastMark = (static_cast<uint32_t>(1)<<min(31, slotBits+5))-1;
    held.resize((lastMark>>6)+2);
    near.resize(held.size());
    lastCount = lastMark>>COUNT_BITS_LESS;
    gridNumber++;
}

int SegmentCells::findPiece(const Contours& contours, int segment, double along) const {
    const int first = firstOfSegment[segment], parts = firstOfSegment[segment+1]-first;
    const int part = static_cast<int>(along*parts/contours.getSegmentLength(segment));
    return first+min(parts-1, max(0, part));
}

void SegmentCells::clear() {
    fill(slots.begin(), slots.end(), -1);
    fill(held.begin(), held.end(), 0);
    cells.clear();
}

/** Find the vectors of segments; return the square of a length that no piece exceeds. */
double SegmentCells::findVectors(const Contours& contours, const double* positions, const double* segmentBox) {
    double stretched = 0;
    for (int segment = 0; segment < contours.getNumSegments(); segment++) {
        auto between = [&] (int first, int second, double* vector) {
            for (int k = 0; k < 3; k++)
                vector[k] = positions[3*second+k]-positions[3*first+k];
            if (segmentBox != nullptr)
                takeToNearestImage(vector, segmentBox);
        };
        double* const vector = &vectors[3*segment];
        between(contours.getFirst(segment), contours.getSecond(segment), vector);
        double square = vector[0]*vector[0]+vector[1]*vector[1]+vector[2]*vector[2];
        if (contours.isOnCurve(segment)) {
            // The derivative of a cubic is a mean of three times the vectors between its Bezier points.
            double first[3], last[3], middle[3];
            between(contours.getFirst(segment), contours.getControl(segment, 0), first);
            between(contours.getSecond(segment), contours.getControl(segment, 1), last);
            for (int k = 0; k < 3; k++)
                middle[k] = vector[k]-first[k]-last[k];
            for (const double* part : {first, middle, last})
                square = max(square, 9*(part[0]*part[0]+part[1]*part[1]+part[2]*part[2]));
        }
        const double parts = firstOfSegment[segment+1]-firstOfSegment[segment];
        stretched = max(stretched, square/(parts*parts));
    }
    return stretched;
}

void SegmentCells::build(const Contours& contours, const double* positions, double reach, const double* box,
            const double* segmentBox, bool forPoints, bool forCounts) {
    if (reach != reachOfPieces)
        cut(contours, reach);
    const int segments = contours.getNumSegments();
    const double stretched = findVectors(contours, positions, segmentBox);
    // From any place of a piece to the middle of another one.
    double size = reach+GROWTH*longest;
    while (size < reach+sqrt(stretched) && size < LARGEST_COORDINATE)
        size *= GROWTH;
    setGrid(size, box);
    clear();
    int last[3] = {0, 0, 0}, cell = -1;
    for (int segment = 0; segment < segments; segment++) {
        const double* first = positions+3*contours.getFirst(segment);
        const double* vector = &vectors[3*segment];
        const int begin = firstOfSegment[segment], end = firstOfSegment[segment+1], chain = contours.getChain(segment);
        const bool onCurve = contours.isOnCurve(segment);
        for (int i = begin; i < end; i++) {
            const double fraction = (i-begin+0.5)/(end-begin);
            double middle[3];
            if (onCurve)
                locate(contours.placeOn(segment, fraction), positions, segmentBox, middle);
            else
                for (int k = 0; k < 3; k++)
                    middle[k] = first[k]+fraction*vector[k];
            int coordinates[3];
            findCoordinates(middle, coordinates);
            if (cell < 0 || !equal(coordinates, coordinates+3, last)) {
                cell = addCell(coordinates, chain);
                copy(coordinates, coordinates+3, last);
            }
            cellOf[i] = cell;
            cells[cell].count++;
            cells[cell].lastChain = chain;
        }
    }
    held.back() = held.front();
    sortAll();
    if (forPoints)
        markAround();
    if (forCounts)
        countAround();
}

/** Sort pieces into cells, and find what is around each cell. */
void SegmentCells::sortAll() {
    int next = 0;
    for (Cell& cell : cells) {
        cell.first = next;
        next += cell.count;
        cell.count = 0;
    }
    for (size_t i = 0; i < pieces.size(); i++) {
        Cell& cell = cells[cellOf[i]];
        sorted[cell.first+cell.count++] = static_cast<int>(i);
    }
    const bool small = find_if(numCells, numCells+3, [] (int n) {return n == 1 || n == 2;}) != numCells+3;
    const int numFound = static_cast<int>(cells.size());
    around.assign(numFound, Around());
    for (int i = 0; i < numFound; i++)
        cells[i].several = cells[i].lastChain != cells[i].firstChain;
    for (int i = 0; i < numFound; i++)
        if (small)
            forCellsAround(cells[i].coordinates, [&] (int other) {
                see(i, other);
            });
        else {
            addTo(around[i], i);
            lookAhead(i);
        }
    for (size_t i = 0; i < pieces.size(); i++) {
        const int cell = cellOf[i];
        numAround[i] = around[cell].numPieces;
        numAround[pieces.size()+i] = cells[cell].several ? around[cell].numPieces : 0;
    }
}

/** Let a cell know of one around it. */
void SegmentCells::see(int cell, int other) {
    Cell& own = cells[cell];
    const Cell& there = cells[other];
    addTo(around[cell], other);
    own.several = own.several || there.firstChain != own.firstChain || there.lastChain != own.firstChain;
}

/** Find those of the half of the neighbours of a cell that come after it. */
void SegmentCells::lookAhead(int cell) {
    const int coordinates[3] = {cells[cell].coordinates[0], cells[cell].coordinates[1], cells[cell].coordinates[2]};
    int x[3] = {}, y[3] = {}, z[3] = {};
    findNeighbours(coordinates[0], 0, x);
    findNeighbours(coordinates[1], 1, y);
    findNeighbours(coordinates[2], 2, z);
    const bool inRow = x[1] == x[0]+1 && x[2] == x[1]+1;
    static const int ROWS[5][2] = {{1, 1}, {2, 1}, {0, 2}, {1, 2}, {2, 2}};
    for (const int* row : ROWS) {
        int other[3] = {x[0], y[row[0]], z[row[1]]};
        unsigned found = inRow ? readRow(other) : 7;
        // Of its own row, what is behind it.
        if (row == ROWS[0])
            found &= 4;
        for (int i = 0; found != 0; i++, found >>= 1)
            if ((found&1) != 0) {
                other[0] = x[i];
                const int known = findCell(other);
                if (known >= 0) {
                    see(cell, known);
                    see(known, cell);
                }
            }
    }
}

/** Call a function with the mark of each cell around one. */
template <class Function> void SegmentCells::forMarksAround(const Cell& cell, Function function) const {
    int x[3] = {}, y[3] = {}, z[3] = {};
    const int numX = findNeighbours(cell.coordinates[0], 0, x), numY = findNeighbours(cell.coordinates[1], 1, y);
    const int numZ = findNeighbours(cell.coordinates[2], 2, z);
    for (int k = 0; k < numZ; k++)
        for (int j = 0; j < numY; j++)
            for (int i = 0; i < numX; i++) {
                const int other[3] = {x[i], y[j], z[k]};
                function(markOf(other));
            }
}

/** Mark all cells that have one which holds something around them. */
void SegmentCells::markAround() {
    fill(near.begin(), near.end(), 0);
    for (const Cell& cell : cells)
        forMarksAround(cell, [&] (uint32_t number) {
            mark(near, number);
        });
}

/** Add the number of pieces in each cell to the marks of those around it. */
void SegmentCells::countAround() {
    counts.assign(static_cast<size_t>(lastCount)+1, 0);
    mostOfAll = 0;
    for (const Cell& cell : cells)
        forMarksAround(cell, [&] (uint32_t number) {
            unsigned& own = counts[number&lastCount];
            own += cell.count;
            mostOfAll = max(mostOfAll, own);
        });
}

const SegmentPiece& SegmentCells::getAround(const Around& found, int number) const {
    int i = 0;
    for (; i+1 < found.numCells && number >= found.cells[i].count; i++)
        number -= found.cells[i].count;
    return pieces[sorted[found.cells[i].first+number]];
}
