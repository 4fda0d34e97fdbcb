#include "mechanics/BrokenSegment.h"
#include "mechanics/PeriodicBox.h"
#include <algorithm>
#include <cmath>
#include <cstddef>

using namespace cylchain;
using namespace std;

static bool isFinite(const double* vector) {
    return isfinite(vector[0]) && isfinite(vector[1]) && isfinite(vector[2]);
}

static double norm(const double* vector) {
    return sqrt(vector[0]*vector[0]+vector[1]*vector[1]+vector[2]*vector[2]);
}

/** The vector from the first node of a segment to its second one. */
struct Difference {
    double d[3];
    Difference(const double* values, int first, int second) {
        for (int k = 0; k < 3; k++)
            d[k] = values[3*second+k]-values[3*first+k];
    }
};

/** The length that a segment would have after a step. */
static double newLength(const double* positions, const double* displacements, const double* box, int first,
        int second) {
    Difference after(positions, first, second);
    const Difference change(displacements, first, second);
    if (box != NULL)
        takeToNearestImage(after.d, box);
    for (int k = 0; k < 3; k++)
        after.d[k] += change.d[k];
    return norm(after.d);
}

BrokenSegment cylchain::findBrokenSegment(const Chain& chain, const double* positions, const double* forces,
        const double* displacements, const double* box, bool implicit) {
    const vector<int>& nodes = chain.nodes;

    // A force that is not finite spoils the whole chain, so look for where it acts.
    for (size_t node = 0; node < nodes.size(); node++)
        if (!isFinite(positions+3*nodes[node]) || !isFinite(forces+3*nodes[node]))
            return {max((int) node-1, 0), BrokenSegment::NotFinite, 0};

    // An excessive force moves its neighbors as well, so choose the segment with the greatest. Where no segment changes
    // that much, one leaves its range.
    BrokenSegment result = {0, implicit ? BrokenSegment::NotSolved : BrokenSegment::MovesTooFar, 0};
    double greatest = -1, farthest = 0;
    int beyond = 0;
    for (int s = 0; s < (int) chain.segments.size(); s++) {
        const int first = nodes[s], second = nodes[(s+1)%nodes.size()];
        const Segment& segment = chain.segments[s];
        const double change = norm(Difference(displacements, first, second).d);
        const double force = norm(forces+3*first)+norm(forces+3*second);
        if (!(change < segment.restLength) && force > greatest) {
            greatest = force;
            result.segment = s;
            result.value = change;
        }
        const double length = newLength(positions, displacements, box, first, second);
        const double extension = segment.maximumExtension > 0 ? segment.maximumExtension : segment.restLength;
        const double relative = fabs(length-segment.restLength)/extension;
        if (farthest < 1 && relative > farthest) {
            farthest = relative;
            beyond = s;
        }
    }
    if (greatest < 0) {
        result.segment = beyond;
        if (!implicit) {
            result.reason = BrokenSegment::LeavesRange;
            result.value = newLength(positions, displacements, box, nodes[beyond], nodes[(beyond+1)%nodes.size()]);
        }
    }
    return result;
}
