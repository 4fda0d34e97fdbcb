#include "kinetics/SegmentCells.h"
#include <algorithm>
#include <cmath>
#include <cstddef>

using namespace cylchain;
using namespace std;

void SegmentCells::setGrid(double reach, const double* box) {
    periodic = box != nullptr;
    const size_t count = middles.size()/3;
    fill(toCells, toCells+9, 0.0);
    if (box != nullptr) {
        // Rows of the inverse of the box, which is a lower triangle: their sizes are one over the heights of the box.
        const double a = box[0], b = box[4], c = box[8];
        const double inverse[9] = {1/a, -box[3]/(a*b), (box[3]*box[7]-box[6]*b)/(a*b*c), 0, 1/b, -box[7]/(b*c), 0, 0,
                1/c};
        double heights[3];
        for (int k = 0; k < 3; k++) {
            const double* row = inverse+3*k;
            heights[k] = 1/sqrt(row[0]*row[0]+row[1]*row[1]+row[2]*row[2]);
            origin[k] = 0;
        }
        setNumbers(heights, reach, count);
        for (int k = 0; k < 3; k++)
            for (int j = 0; j < 3; j++)
                toCells[3*k+j] = inverse[3*k+j]*numCells[k];
        return;
    }
    double extents[3];
    for (int k = 0; k < 3; k++) {
        double least = HUGE_VAL, largest = -HUGE_VAL;
        for (size_t i = 0; i < count; i++) {
            least = min(least, middles[3*i+k]);
            largest = max(largest, middles[3*i+k]);
        }
        origin[k] = count == 0 ? 0 : least;
        extents[k] = count == 0 ? 0 : largest-least;
    }
    setNumbers(extents, reach, count);
    for (int k = 0; k < 3; k++)
        toCells[4*k] = numCells[k]/max(extents[k], numCells[k]*reach);
}

/** As many cells along each axis as the reach allows, but hardly more of them than pieces. */
void SegmentCells::setNumbers(const double* extents, double reach, size_t count) {
    double numbers[3];
    for (int k = 0; k < 3; k++)
        numbers[k] = max(1.0, floor(extents[k]/reach));
    while (numbers[0]*numbers[1]*numbers[2] > 1+2.0*count) {
        double& most = *max_element(numbers, numbers+3);
        most = max(1.0, floor(0.8*most));
    }
    copy(numbers, numbers+3, numCells);
}

int SegmentCells::findCell(const double* point) const {
    int cell = 0;
    for (int k = 2; k >= 0; k--) {
        double coordinate = 0;
        for (int j = 0; j < 3; j++)
            coordinate += toCells[3*k+j]*(point[j]-origin[j]);
        if (periodic)
            coordinate -= numCells[k]*floor(coordinate/numCells[k]);
        // What is beyond the grid is near the cells at its edge alone.
        const double number = min(numCells[k]-1.0, max(0.0, coordinate));
        cell = cell*numCells[k]+static_cast<int>(number);
    }
    return cell;
}

int SegmentCells::findCells(int cell, int* around) const {
    int along[3][3], counts[3];
    for (int k = 0, rest = cell; k < 3; k++) {
        const int n = numCells[k], own = rest%n;
        rest /= n;
        counts[k] = 0;
        for (int shift = -1; shift <= 1; shift++) {
            const int other = periodic ? (own+shift+n)%n : own+shift;
            const bool known = find(along[k], along[k]+counts[k], other) != along[k]+counts[k];
            if (other >= 0 && other < n && !known)
                along[k][counts[k]++] = other;
        }
    }
    int count = 0;
    for (int z = 0; z < counts[2]; z++)
        for (int y = 0; y < counts[1]; y++)
            for (int x = 0; x < counts[0]; x++)
                around[count++] = (along[2][z]*numCells[1]+along[1][y])*numCells[0]+along[0][x];
    return count;
}

void SegmentCells::cut(const Contours& contours, double reach) {
    reachOfPieces = reach;
    pieces.clear();
    longest = 0;
    for (int segment = 0; segment < contours.getNumSegments(); segment++) {
        const double length = contours.getSegmentLength(segment);
        const int parts = static_cast<int>(max(1.0, ceil(length/reach)));
        for (int part = 0; part < parts; part++)
            pieces.push_back({segment, part*length/parts, length/parts});
        longest = max(longest, length/parts);
    }
}

void SegmentCells::build(const Contours& contours, const double* positions, double reach, const double* box,
            const double* segmentBox) {
    if (reach != reachOfPieces)
        cut(contours, reach);
    const int count = pieces.size();
    middles.resize(3*static_cast<size_t>(count));
    double largest = 0;
    for (int i = 0; i < count; i++) {
        const SegmentPiece& piece = pieces[i];
        const double* first = positions+3*contours.getFirst(piece.segment);
        const double* second = positions+3*contours.getSecond(piece.segment);
        const double length = contours.getSegmentLength(piece.segment);
        const double middle = (piece.start+0.5*piece.length)/length, part = piece.length/length;
        double vector[3];
        for (int k = 0; k < 3; k++)
            vector[k] = second[k]-first[k];
        if (segmentBox != nullptr)
            takeToNearestImage(vector, segmentBox);
        for (int k = 0; k < 3; k++)
            middles[3*i+k] = first[k]+middle*vector[k];
        largest = max(largest, part*part*(vector[0]*vector[0]+vector[1]*vector[1]+vector[2]*vector[2]));
    }
    setGrid(reach+0.5*sqrt(largest), box);

    // By counting.

    const int cells = numCells[0]*numCells[1]*numCells[2];
    cellOf.resize(count);
    firstOfCell.assign(cells+1, 0);
    for (int i = 0; i < count; i++) {
        cellOf[i] = findCell(&middles[3*i]);
        firstOfCell[cellOf[i]+1]++;
    }
    for (int cell = 0; cell < cells; cell++)
        firstOfCell[cell+1] += firstOfCell[cell];
    sorted.resize(count);
    vector<int>& next = numAround;
    next.assign(firstOfCell.begin(), firstOfCell.end()-1);
    for (int i = 0; i < count; i++)
        sorted[next[cellOf[i]]++] = i;
    for (int cell = 0; cell < cells; cell++)
        numAround[cell] = firstOfCell[cell+1]-firstOfCell[cell];
    for (int k = 0, stride = 1; k < 3; stride *= numCells[k++])
        addNeighbours(k, stride);
    largestNumber = cells == 0 ? 0 : *max_element(numAround.begin(), numAround.end());
}

/** To the number of each cell, add those of the cells before and behind it along an axis. */
void SegmentCells::addNeighbours(int axis, int stride) {
    const int n = numCells[axis], cells = numAround.size();
    if (n == 1)
        return;
    // Cells along the other axes that follow each other in memory are taken side by side.
    before.resize(stride);
    first.resize(stride);
    for (int start = 0; start < cells; start += n*stride) {
        int* const row = &numAround[start];
        const int* const end = row+(n-1)*static_cast<ptrdiff_t>(stride);
        for (int j = 0; j < stride; j++) {
            first[j] = row[j];
            // With two cells, that behind is the one before.
            before[j] = periodic && n > 2 ? end[j] : 0;
        }
        for (int i = 0; i < n; i++) {
            int* const own = row+i*static_cast<ptrdiff_t>(stride);
            for (int j = 0; j < stride; j++) {
                const int number = own[j];
                const int behind = i+1 < n ? own[stride+j] : periodic && n > 2 ? first[j] : 0;
                own[j] += before[j]+behind;
                before[j] = number;
            }
        }
    }
}

const SegmentPiece& SegmentCells::getAround(int cell, int number) const {
    int around[27];
    const int cells = findCells(cell, around);
    int i = 0;
    for (; number >= firstOfCell[around[i]+1]-firstOfCell[around[i]] && i+1 < cells; i++)
        number -= firstOfCell[around[i]+1]-firstOfCell[around[i]];
    return pieces[sorted[firstOfCell[around[i]]+number]];
}
