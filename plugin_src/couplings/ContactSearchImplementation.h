#ifndef CYLCHAIN_CONTACT_SEARCH_IMPLEMENTATION_H_
#define CYLCHAIN_CONTACT_SEARCH_IMPLEMENTATION_H_

#include "couplings/CandidateLoops.h"
#include "couplings/ContactSearch.h"
#include "couplings/Crossings.h"
#include "mechanics/PeriodicBox.h"
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdlib>
#include <functional>
#include <vector>

/**
 * What a ContactSearch knows: ContactSearch.cpp finds pairs, ContactPlaces.cpp finds where these touch.
 */
namespace cylchain {

inline Vec3d position(const double* positions, int particle) {
    return {positions[3*particle], positions[3*particle+1], positions[3*particle+2]};
}

template <class Number> inline void set(Number* values, const Vec3d& vector) {
    values[0] = vector.x;
    values[1] = vector.y;
    values[2] = vector.z;
}

inline double smallestOf(double a, double b, double c, double d) {
    return std::min(std::min(a, b), std::min(c, d));
}

inline double largestOf(double a, double b, double c, double d) {
    return std::max(std::max(a, b), std::max(c, d));
}

/** Run some parts, one after the other if there is no loop. */
void runParts(const Loop& run, int parts, const std::function<void(int)>& part);

/** The number of images of the frame that are looked at, and that of what is not moved. */
const int NUM_IMAGES = 27, SAME_IMAGE = 13;

/** The parallelepiped in fractions of which cells are counted: the periodic box, or one around everything. */
struct Frame {
    bool periodic = false;
    Vec3d origin = {0, 0, 0};
    /** Its vectors, in reduced form, and its widths between opposite faces. */
    double vectors[9] = {}, widths[3] = {}, inverse[3] = {}, inverseWidths[3] = {};
    int cells[3] = {1, 1, 1};

    Vec3d toFractions(const Vec3d& v) const {
        const double z = v.z*inverse[2], y = (v.y-z*vectors[7])*inverse[1];
        return {(v.x-y*vectors[3]-z*vectors[6])*inverse[0], y, z};
    }
    Vec3d toVector(const Vec3d& f) const {
        return {f.x*vectors[0]+f.y*vectors[3]+f.z*vectors[6], f.y*vectors[4]+f.z*vectors[7], f.z*vectors[8]};
    }
    void findWidths() {
        const Vec3d a = {vectors[0], vectors[1], vectors[2]}, b = {vectors[3], vectors[4], vectors[5]},
                c = {vectors[6], vectors[7], vectors[8]};
        const double volume = std::fabs(a.dot(b.cross(c)));
        widths[0] = volume/std::sqrt(b.cross(c).squared());
        widths[1] = volume/std::sqrt(c.cross(a).squared());
        widths[2] = volume/std::sqrt(a.cross(b).squared());
        for (int k = 0; k < 3; k++) {
            inverse[k] = 1/vectors[4*k];
            inverseWidths[k] = 1/widths[k];
        }
    }
};

/** The box that a capsule sweeps in a step, in fractions of the frame. */
struct Described {
    bool finite;
    int cell;
    double center[3], half[3];
    CoarseCapsule coarse;
};

/** A capsule as it is at the start, for the order of cells: those that are near each other are so in memory. */
struct PlacedCapsule {
    int number;
    bool hasExclusions;
    Capsule capsule;
    /** What was taken off to get its center into the frame. */
    int images[3];
    Vec3d first, along;
};

/** Memory for candidates. All parts of the search that a thread runs share it, so that it stays in its cache. */
struct Candidates {
    std::vector<int> first, second, image;
    std::vector<float> distance, clearance, before;
    std::vector<CapsuleRow> rows;
    static Candidates& ofThread() {
        static thread_local Candidates memory;
        return memory;
    }
    CandidatePairs from(int from) {
        return {first.data()+from, second.data()+from, image.data()+from, distance.data()+from, clearance.data()+from,
                before.data()+from};
    }
    void makeRoom(int size) {
        if ((int) first.size() >= size)
            return;
        for (std::vector<int>* list : {&first, &second, &image})
            list->resize(size);
        for (std::vector<float>* list : {&distance, &clearance, &before})
            list->resize(size);
    }
};

struct ContactSearch::Implementation {
    /** Where capsules are at both ends of a step: positions or, without them, what setMotion() has taken note of. */
    struct Ends {
        const Implementation& search;
        const double *x, *y;
        bool moves;
        Vec3d along(int capsule, bool atEnd) const {
            if (y != NULL)
                return search.along(search.system.capsules[capsule], atEnd ? y : x);
            const double* v = atEnd ? search.moving[capsule].laterAlong : search.moving[capsule].along;
            return {v[0], v[1], v[2]};
        }
    };
    CapsuleSystem system;
    bool nearestImages;
    /** The capsule of the same chain that shares the second particle, or the first one, or -1. */
    std::vector<int> next, previous;
    /** Explicit exclusions of each capsule, sorted. */
    std::vector<std::vector<int> > excluded;
    bool anyExclusions;

    // The last search.
    Frame frame;
    double reach = 0, largestRadius = 0;
    std::vector<Described> described;
    std::vector<PlacedCapsule> placed, sortedPlaced;
    std::vector<int> cellStart, members;
    std::vector<float> boxes;
    std::vector<CoarseCapsule> sorted;
    SweptBoxes sweptBoxes;
    float margin = 0, imageShifts[4*NUM_IMAGES];
    /** The largest half width of a box, and by how much a center has left its cell at most, in fractions. */
    double largestHalf[3], largestExcess[3];
    /** Where each capsule is in the order of cells, and whether it is searched for again: those that are, in order. */
    std::vector<int> slots, movers;
    std::vector<char> again;
    /** What each part of the search finds. */
    std::vector<std::vector<ContactPair> > parts;
    std::vector<std::size_t> firstOf;
    /** What setMotion() has taken note of. */
    std::vector<MovingSegment> moving;
    bool moves = false;

    Implementation(const CapsuleSystem& system, bool nearestImages);
    bool isExcluded(int a, int b) const;
    double radii(int a, int b) const {
        return system.capsules[a].radius+system.capsules[b].radius;
    }
    Vec3d along(const Capsule& capsule, const double* positions) const;
    SegmentPair segments(int a, int b, const double* shift, const double* positions) const;
    SegmentPair movingSegments(const ContactPair& pair, bool atEnd) const;
    void setFrame(const double* x, const double* y, const double* box);
    void describe(int i, const double* x, const double* y, Described& result, PlacedCapsule& place,
            bool keepsImage = false) const;
    void describeAgain(const std::vector<int>& capsules, const double* x, const double* y);
    void putInOrder(int slot, int i);
    int searchAround(int i, Candidates& candidates, int count) const;
    void keepPairs(Candidates& candidates, int count, const double* x, const double* y, const PairFilter& known,
            std::vector<ContactPair>& found) const;
    void checkPositions(const double* x, const double* y) const;
    void setCells();
    void searchCells(int part, const double* x, const double* y, const PairFilter& known);
    int findRows(int column, int iz, CapsuleRow* rows) const;
    bool addPair(const PlacedCapsule& one, const PlacedCapsule& other, const int* images, bool sure, const double* x,
            const double* y, std::vector<ContactPair>& found) const;
    bool areNeighbors(const Capsule& first, const Capsule& second) const;
    void gather(std::vector<ContactPair>& pairs);
    bool isOwned(const Contact& contact, const ContactPair& pair, const SegmentPair& start, const SegmentPair& end,
            bool parallel, bool ofA, const Ends& ends) const;
    double shareOf(const Crossing& crossing, const ContactPair& pair) const;
    int evaluate(const ContactPair& pair, const SegmentPair& start, const SegmentPair& end, const Ends& ends,
            Contact* contacts, double limit) const;
    bool crosses(const ContactPair& pair, const SegmentPair& start, const SegmentPair& end) const;
    bool isOfNeighbor(const ContactPair& pair, int flags) const;
};

/** Whether two capsules share a particle or are near each other in a chain. */
inline bool ContactSearch::Implementation::areNeighbors(const Capsule& first, const Capsule& second) const {
    if (first.first == second.first || first.end() == second.end() || first.first == second.end() ||
            first.end() == second.first)
        return true;
    if (first.chain < 0 || first.chain != second.chain)
        return false;
    const CapsuleChain& chain = system.chains[first.chain];
    int apart = std::abs(first.index-second.index);
    if (chain.closed)
        apart = std::min(apart, chain.numCapsules-apart);
    return apart <= chain.excludedNeighbors;
}

inline bool ContactSearch::Implementation::isExcluded(int a, int b) const {
    return a == b || areNeighbors(system.capsules[a], system.capsules[b]) ||
            (anyExclusions && std::binary_search(excluded[a].begin(), excluded[a].end(), b));
}

inline Vec3d ContactSearch::Implementation::along(const Capsule& capsule, const double* positions) const {
    if (capsule.second < 0)
        return {0, 0, 0};
    Vec3d difference = position(positions, capsule.second)-position(positions, capsule.first);
    if (nearestImages && frame.periodic) {
        double d[] = {difference.x, difference.y, difference.z};
        takeToNearestImage(d, frame.vectors);
        difference = {d[0], d[1], d[2]};
    }
    return difference;
}

inline SegmentPair ContactSearch::Implementation::segments(int a, int b, const double* shift,
        const double* positions) const {
    const Capsule &first = system.capsules[a], &second = system.capsules[b];
    const Vec3d w = position(positions, first.first)-position(positions, second.first);
    return {along(first, positions), along(second, positions), {w.x+shift[0], w.y+shift[1], w.z+shift[2]}};
}

/** The same from what setMotion() has taken note of. */
inline SegmentPair ContactSearch::Implementation::movingSegments(const ContactPair& pair, bool atEnd) const {
    const MovingSegment &a = moving[pair.a], &b = moving[pair.b];
    auto vector = [] (const double* v) {
        return Vec3d {v[0], v[1], v[2]};
    };
    const Vec3d w = vector(atEnd ? a.laterFirst : a.first)-vector(atEnd ? b.laterFirst : b.first);
    return {vector(atEnd ? a.laterAlong : a.along), vector(atEnd ? b.laterAlong : b.along),
            {w.x+pair.shift[0], w.y+pair.shift[1], w.z+pair.shift[2]}};
}

} // namespace cylchain

#endif /*CYLCHAIN_CONTACT_SEARCH_IMPLEMENTATION_H_*/
