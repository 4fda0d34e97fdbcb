#include "couplings/ContactSearch.h"
#include "couplings/CandidateLoops.h"
#include "couplings/Crossings.h"
#include "mechanics/PeriodicBox.h"
#include "mechanics/Prefetch.h"
#include <cstddef>
#include <cstdlib>
#include <map>
#include <stdexcept>
#include <string>

using namespace cylchain;
using namespace std;

namespace {

/** Segments with a lesser sin^2 of their angle are nearly parallel. */
const double LARGEST_PARALLEL = 1e-3;
/** Fractions of a segment that are less than this are zero. */
const double AT_END = 1e-9;
/** Gaps that differ by less, relative to distances, are equal. */
const double LEAST_DIFFERENCE = 1e-10;
/** Capsules that are described together, those that are searched around together, and pairs looked at together. */
const int CHUNK = 512, FEW = 32, BATCH = 512;
/** Capsules that are far away in memory are asked for this many ahead. */
const int AHEAD = 8;
/** What rounding adds to distances in single precision, over the lengths that they are made of. */
const double SINGLE_ROUNDING = 1e-6;
/** The error of a distance where segments are nearly parallel, over their lengths, in single precision. */
const double PARALLEL_ERROR = 5e-3;
/** What a block of lanes may read or write beyond the end of an array. */
const int PADDING = 16;

Vec3d position(const double* positions, int particle) {
    return {positions[3*particle], positions[3*particle+1], positions[3*particle+2]};
}

double component(const Vec3d& vector, int k) {
    return k == 0 ? vector.x : k == 1 ? vector.y : vector.z;
}

template <class Number> void set(Number* values, const Vec3d& vector) {
    values[0] = vector.x;
    values[1] = vector.y;
    values[2] = vector.z;
}

double smallestOf(double a, double b, double c, double d) {
    return min(min(a, b), min(c, d));
}

double largestOf(double a, double b, double c, double d) {
    return max(max(a, b), max(c, d));
}

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
        const double volume = fabs(a.dot(b.cross(c)));
        widths[0] = volume/sqrt(b.cross(c).squared());
        widths[1] = volume/sqrt(c.cross(a).squared());
        widths[2] = volume/sqrt(a.cross(b).squared());
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

/** Memory for candidates. All parts of the search that a thread runs share it, so that it stays in the nearest cache. */
struct Candidates {
    vector<int> first, second, image;
    vector<float> distance, clearance;
    vector<CapsuleRow> rows;
    static Candidates& ofThread() {
        static thread_local Candidates memory;
        return memory;
    }
    CandidatePairs from(int from) {
        return {first.data()+from, second.data()+from, image.data()+from, distance.data()+from, clearance.data()+from};
    }
    void makeRoom(int size) {
        if ((int) first.size() >= size)
            return;
        for (vector<int>* list : {&first, &second, &image})
            list->resize(size);
        distance.resize(size);
        clearance.resize(size);
    }
};

/** Images are numbered from 0 to 26: by the number of vectors of the frame, each from -1 to 1. */
const int NUM_IMAGES = 27, SAME_IMAGE = 13;

int imageNumber(const int* images) {
    return 9*(images[0]+1)+3*(images[1]+1)+images[2]+1;
}

/** By how much a point of one segment moves against one of the other, at most. */
double largestMotion(const SegmentPair& start, const SegmentPair& end) {
    const Vec3d dw = end.w-start.w, dp = end.p-start.p, dq = end.q-start.q;
    return sqrt(largestOf(dw.squared(), (dw+dp).squared(), (dw-dq).squared(), (dw+dp-dq).squared()));
}

/** Whether capsules may pass through each other: from the distance of their axes at the end, and the sum of radii. */
bool mayPass(const SegmentPair& start, const SegmentPair& end, double distance, double radii) {
    return distance <= largestMotion(start, end)+(hasSphere(start) ? DEEP*radii : 0);
}

/** The gap of two capsules, signed if they have crossed. */
double findGap(const SegmentPair& start, const SegmentPair& end, double radii) {
    const double distance = sqrt(findNearestPoints(end).squared);
    if (!mayPass(start, end, distance, radii))
        return distance-radii;
    Passage passage;
    if (hasSphere(start))
        return (findPassage(start, end, radii, passage) ? passage.distance : distance)-radii;
    Crossing crossings[2];
    if (findCrossings(start, end, crossings) > 0)
        return end.between(crossings[0].s, crossings[0].t).dot(crossings[0].normal)-radii;
    return distance-radii;
}

/** Where two segments touch: where they are nearest, or if they are nearly parallel at both ends of their overlap. */
struct Places {
    bool parallel;
    double s[2], t[2], distance;
};

/** What is at an end but for rounding is there: joints are looked at apart. */
double takenToEnd(double fraction) {
    return fraction < AT_END ? 0 : fraction > 1-AT_END ? 1 : fraction;
}

Places findPlaces(const SegmentPair& pair) {
    const NearestPoints nearest = findNearestPoints(pair);
    Places places = {false, {takenToEnd(nearest.s), 0}, {takenToEnd(nearest.t), 0}, sqrt(nearest.squared)};
    const double a = pair.p.squared(), b = pair.p.dot(pair.q), e = pair.q.squared();
    if (a > 0 && e > 0 && a*e-b*b < LARGEST_PARALLEL*a*e) {
        // The ends of b, as fractions of a.
        const double c = pair.p.dot(pair.w), f = pair.q.dot(pair.w), first = -c/a, second = (b-c)/a;
        const double lower = max(0.0, min(first, second)), upper = min(1.0, max(first, second));
        places.parallel = upper > lower;
        if (places.parallel)
            for (int i = 0; i < 2; i++) {
                const double s = i == 0 ? lower : upper;
                places.s[i] = takenToEnd(s);
                places.t[i] = s == first ? 0 : s == second ? 1 : takenToEnd(clampToUnit((b*s+f)/e));
            }
    }
    return places;
}

/** A unit vector across both segments, or across one of them if they are parallel or the other has no length. */
Vec3d findNormal(const SegmentPair& pair, int side) {
    Vec3d normal = pair.p.cross(pair.q)*(side < 0 ? -1 : 1);
    if (!(normal.squared() > 0)) {
        const Vec3d& along = pair.p.squared() > 0 ? pair.p : pair.q;
        const double x = fabs(along.x), y = fabs(along.y), z = fabs(along.z);
        normal = along.cross({x <= y && x <= z ? 1.0 : 0.0, y < x && y <= z ? 1.0 : 0.0, z < x && z < y ? 1.0 : 0.0});
    }
    return normal.squared() > 0 ? normal*(1/sqrt(normal.squared())) : Vec3d{1, 0, 0};
}

} // namespace

struct ContactSearch::Implementation {
    /** Where capsules are at both ends of a step: positions, or what setMotion() has taken note of if there are none. */
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
    vector<int> next, previous;
    /** Explicit exclusions of each capsule, sorted. */
    vector<vector<int> > excluded;
    bool anyExclusions;

    // The last search.
    Frame frame;
    double reach = 0, largestRadius = 0;
    vector<Described> described;
    vector<PlacedCapsule> placed, sortedPlaced;
    vector<int> cellStart, members;
    vector<float> boxes;
    vector<CoarseCapsule> sorted;
    SweptBoxes sweptBoxes;
    float margin = 0, imageShifts[4*NUM_IMAGES];
    /** The largest half width of a box, and by how much a center has left its cell at most, in fractions. */
    double largestHalf[3], largestExcess[3];
    /** Where each capsule is in the order of cells, and whether it is searched for again. */
    vector<int> slots, movers;
    vector<char> again;
    /** What each part of the search finds. */
    vector<vector<ContactPair> > parts;
    vector<size_t> firstOf;
    /** What setMotion() has taken note of. */
    vector<MovingSegment> moving;
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
    void describeAgain(const vector<int>& capsules, const double* x, const double* y);
    void putInOrder(int slot, int i);
    int searchAround(int i, Candidates& candidates, int count) const;
    void keepPairs(Candidates& candidates, int count, const double* x, const double* y,
            vector<ContactPair>& found) const;
    void checkPositions(const double* x, const double* y) const;
    void setCells();
    void searchCells(int part, const double* x, const double* y);
    int findRows(int column, int iz, CapsuleRow* rows) const;
    bool addPair(const PlacedCapsule& one, const PlacedCapsule& other, const int* images, bool sure, const double* x,
            const double* y, vector<ContactPair>& found) const;
    bool areNeighbors(const Capsule& first, const Capsule& second) const;
    void gather(vector<ContactPair>& pairs);
    bool isOwned(const Contact& contact, const ContactPair& pair, const SegmentPair& start, const SegmentPair& end,
            bool parallel, bool ofA, const Ends& ends) const;
    double shareOf(const Crossing& crossing, const ContactPair& pair) const;
    int evaluate(const ContactPair& pair, const SegmentPair& start, const SegmentPair& end, const Ends& ends,
            Contact* contacts, double limit) const;
    bool crosses(const ContactPair& pair, const SegmentPair& start, const SegmentPair& end) const;
    bool isOfNeighbor(const ContactPair& pair, int flags) const;
};

ContactSearch::Implementation::Implementation(const CapsuleSystem& system, bool nearestImages) :
        system(system), nearestImages(nearestImages) {
    const vector<Capsule>& capsules = system.capsules;
    map<pair<int, int>, int> startsAt;
    for (size_t i = 0; i < capsules.size(); i++) {
        const Capsule& capsule = capsules[i];
        const string name = "Capsule "+to_string(i);
        if (capsule.first < 0 || capsule.second < -1 || capsule.first == capsule.second)
            throw invalid_argument(name+" has no particle, or the same one twice");
        if (!(capsule.radius >= 0 && isfinite(capsule.radius)))
            throw invalid_argument(name+" has a radius that is negative or not finite");
        if (capsule.chain < -1 || capsule.chain >= (int) system.chains.size())
            throw invalid_argument(name+" is in a chain that there is not");
        if (capsule.chain >= 0 && (capsule.index < 0 || capsule.index >= system.chains[capsule.chain].numCapsules))
            throw invalid_argument(name+" has a number in its chain that there is not");
        if (capsule.chain >= 0 && capsule.second >= 0)
            startsAt[{capsule.chain, capsule.first}] = i;
    }
    next.assign(capsules.size(), -1);
    previous.assign(capsules.size(), -1);
    for (size_t i = 0; i < capsules.size(); i++)
        if (capsules[i].chain >= 0 && capsules[i].second >= 0) {
            const auto found = startsAt.find({capsules[i].chain, capsules[i].second});
            if (found != startsAt.end()) {
                next[i] = found->second;
                previous[found->second] = i;
            }
        }
    excluded.resize(capsules.size());
    anyExclusions = !system.exclusions.empty();
    for (const pair<int, int>& exclusion : system.exclusions) {
        for (int i : {exclusion.first, exclusion.second})
            if (i < 0 || i >= (int) capsules.size())
                throw invalid_argument("An exclusion names capsule "+to_string(i)+", which there is not");
        excluded[exclusion.first].push_back(exclusion.second);
        excluded[exclusion.second].push_back(exclusion.first);
    }
    for (vector<int>& others : excluded)
        sort(others.begin(), others.end());
    described.resize(capsules.size());
    placed.resize(capsules.size());
    sortedPlaced.resize(capsules.size());
    slots.resize(capsules.size());
    again.resize(capsules.size(), 0);
}

/** Whether two capsules share a particle or are near each other in a chain. */
bool ContactSearch::Implementation::areNeighbors(const Capsule& first, const Capsule& second) const {
    if (first.first == second.first || first.end() == second.end() || first.first == second.end() ||
            first.end() == second.first)
        return true;
    if (first.chain < 0 || first.chain != second.chain)
        return false;
    const CapsuleChain& chain = system.chains[first.chain];
    int apart = abs(first.index-second.index);
    if (chain.closed)
        apart = min(apart, chain.numCapsules-apart);
    return apart <= chain.excludedNeighbors;
}

bool ContactSearch::Implementation::isExcluded(int a, int b) const {
    return a == b || areNeighbors(system.capsules[a], system.capsules[b]) ||
            (anyExclusions && binary_search(excluded[a].begin(), excluded[a].end(), b));
}

Vec3d ContactSearch::Implementation::along(const Capsule& capsule, const double* positions) const {
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

SegmentPair ContactSearch::Implementation::segments(int a, int b, const double* shift, const double* positions) const {
    const Capsule &first = system.capsules[a], &second = system.capsules[b];
    const Vec3d w = position(positions, first.first)-position(positions, second.first);
    return {along(first, positions), along(second, positions), {w.x+shift[0], w.y+shift[1], w.z+shift[2]}};
}

/** The same from what setMotion() has taken note of. */
SegmentPair ContactSearch::Implementation::movingSegments(const ContactPair& pair, bool atEnd) const {
    const MovingSegment &a = moving[pair.a], &b = moving[pair.b];
    auto vector = [] (const double* v) {
        return Vec3d {v[0], v[1], v[2]};
    };
    const Vec3d w = vector(atEnd ? a.laterFirst : a.first)-vector(atEnd ? b.laterFirst : b.first);
    return {vector(atEnd ? a.laterAlong : a.along), vector(atEnd ? b.laterAlong : b.along),
            {w.x+pair.shift[0], w.y+pair.shift[1], w.z+pair.shift[2]}};
}

void ContactSearch::Implementation::setFrame(const double* x, const double* y, const double* box) {
    frame = Frame();
    frame.periodic = box != NULL;
    largestRadius = 0;
    for (const Capsule& capsule : system.capsules)
        largestRadius = max(largestRadius, capsule.radius);
    if (frame.periodic) {
        copy(box, box+9, frame.vectors);
        if (box[1] != 0 || box[2] != 0 || box[5] != 0 || !(box[0] > 0 && box[4] > 0 && box[8] > 0))
            throw invalid_argument("The vectors of the periodic box are not in reduced form");
    }
    else {
        Vec3d lower = {0, 0, 0}, upper = lower;
        bool isFirst = true;
        for (const Capsule& capsule : system.capsules)
            for (int particle : {capsule.first, capsule.end()})
                for (const double* positions : {x, y}) {
                    const Vec3d v = position(positions, particle);
                    if (isFirst)
                        lower = upper = v;
                    isFirst = false;
                    lower = {min(lower.x, v.x), min(lower.y, v.y), min(lower.z, v.z)};
                    upper = {max(upper.x, v.x), max(upper.y, v.y), max(upper.z, v.z)};
                }
        frame.origin = lower;
        for (int k = 0; k < 3; k++) {
            // Never flat.
            const double extent = component(upper, k)-component(lower, k);
            frame.vectors[4*k] = max(extent, max(2*largestRadius+reach, 1e-3));
        }
    }
    frame.findWidths();
}

/** Find the box, in fractions of the frame, that a capsule sweeps. */
void ContactSearch::Implementation::describe(int i, const double* x, const double* y, Described& result,
        PlacedCapsule& place, bool keepsImage) const {
    const Capsule& capsule = system.capsules[i];
    const Vec3d x0 = position(x, capsule.first)-frame.origin, p = along(capsule, x);
    const Vec3d y0 = position(y, capsule.first)-frame.origin, q = x == y ? p : along(capsule, y);
    const Vec3d ends[] = {frame.toFractions(x0), frame.toFractions(x0+p), frame.toFractions(y0),
            frame.toFractions(y0+q)};
    const int images[3] = {place.images[0], place.images[1], place.images[2]};
    place = {i, anyExclusions && !excluded[i].empty(), capsule, {0, 0, 0}, x0, p};
    double center[3];
    for (int k = 0; k < 3; k++) {
        const double f[] = {component(ends[0], k), component(ends[1], k), component(ends[2], k), component(ends[3], k)};
        // Written so that NaN fails.
        result.finite = fabs(f[0])+fabs(f[1])+fabs(f[2])+fabs(f[3]) < 1e9;
        if (!result.finite)
            return;
        const double lower = smallestOf(f[0], f[1], f[2], f[3]), upper = largestOf(f[0], f[1], f[2], f[3]);
        center[k] = 0.5*(lower+upper);
        if (frame.periodic)
            place.images[k] = keepsImage ? images[k] : (int) floor(center[k]);
        result.center[k] = center[k]-place.images[k];
        result.half[k] = 0.5*(upper-lower)+(capsule.radius+0.5*reach)*frame.inverseWidths[k]+SINGLE_ROUNDING;
    }
    const Vec3d unwrapped = frame.toVector({center[0], center[1], center[2]});
    CoarseCapsule& coarse = result.coarse;
    set(coarse.center, frame.toVector({result.center[0], result.center[1], result.center[2]}));
    set(coarse.middle, x0+p*0.5-unwrapped);
    set(coarse.half, p*0.5);
    set(coarse.laterMiddle, y0+q*0.5-unwrapped);
    set(coarse.laterHalf, q*0.5);
    coarse.radius = capsule.radius;
}

void ContactSearch::Implementation::checkPositions(const double* x, const double* y) const {
    for (size_t i = 0; i < described.size(); i++)
        if (!described[i].finite) {
            const Capsule& capsule = system.capsules[i];
            for (int particle : {capsule.first, capsule.end()})
                for (const double* positions : {x, y})
                    for (int k = 0; k < 3; k++)
                        if (!isfinite(positions[3*particle+k]))
                            throw invalid_argument("The position of particle "+to_string(particle)+" is not finite");
            throw invalid_argument("Capsule "+to_string(i)+" is too far away");
        }
}

/** Divide the frame into cells, and sort capsules by them. Capsules in cells that are not neighbors do not meet. */
void ContactSearch::Implementation::setCells() {
    const int count = described.size();
    double largestLength = 0;
    fill(largestHalf, largestHalf+3, 0.0);
    fill(largestExcess, largestExcess+3, 0.0);
    for (const Described& capsule : described) {
        for (int k = 0; k < 3; k++)
            largestHalf[k] = max(largestHalf[k], capsule.half[k]);
        const float *half = capsule.coarse.half, *later = capsule.coarse.laterHalf;
        largestLength = max(largestLength, (double) max(half[0]*half[0]+half[1]*half[1]+half[2]*half[2],
                later[0]*later[0]+later[1]*later[1]+later[2]*later[2]));
    }
    largestLength = 2*sqrt(largestLength);
    double size = 0;
    for (double entry : frame.vectors)
        size += fabs(entry);
    margin = SINGLE_ROUNDING*(size+largestLength+reach+largestRadius)+PARALLEL_ERROR*largestLength;
    // In a box of that many cells in each direction, there is one for every few capsules.
    const double mostCells = max(1.0, cbrt(2.0*count)+1);
    for (int k = 0; k < 3; k++) {
        if (frame.periodic && 4*largestHalf[k] > 1)
            throw NarrowBoxError("The periodic box is too small for contacts: its width along vector "+
                    to_string(k)+" is "+to_string(frame.widths[k])+", but twice the largest extent of a capsule in a "
                    "step with its diameter and the reach of the search is "+
                    to_string(4*largestHalf[k]*frame.widths[k])+". Take a larger box or shorter segments, and "
                    "chains that are whole");
        frame.cells[k] = max(1.0, floor(min(0.5/largestHalf[k], frame.periodic ? mostCells : 4*mostCells)));
    }
    // Where capsules fill a part of the frame only, there are more cells.
    while ((double) frame.cells[0]*frame.cells[1]*frame.cells[2] > 16.0*count+64)
        for (int k = 0; k < 3; k++)
            frame.cells[k] = (frame.cells[k]+1)/2;

    const int* cells = frame.cells;
    const int numCells = cells[0]*cells[1]*cells[2];
    cellStart.assign(numCells+1, 0);
    for (Described& capsule : described) {
        int cell = 0;
        for (int k = 0; k < 3; k++)
            cell = cell*cells[k]+min(max((int) (capsule.center[k]*cells[k]), 0), cells[k]-1);
        capsule.cell = cell;
        cellStart[cell+1]++;
    }
    for (int cell = 0; cell < numCells; cell++)
        cellStart[cell+1] += cellStart[cell];
    members.resize(count);
    for (int i = 0; i < count; i++)
        members[cellStart[described[i].cell]++] = i;
    for (int cell = numCells; cell > 0; cell--)
        cellStart[cell] = cellStart[cell-1];
    cellStart[0] = 0;

    for (int image = 0; image < NUM_IMAGES; image++)
        set(&imageShifts[4*image], frame.toVector({image/9-1.0, image/3%3-1.0, image%3-1.0}));

    const size_t stride = count+PADDING;
    boxes.resize(6*stride);
    sorted.resize(count);
    for (int k = 0; k < 3; k++) {
        sweptBoxes.center[k] = &boxes[k*stride];
        sweptBoxes.half[k] = &boxes[(3+k)*stride];
    }
    for (int i = 0; i < count; i++) {
        if (i+AHEAD < count) {
            prefetch(&described[members[i+AHEAD]]);
            prefetch(&placed[members[i+AHEAD]]);
        }
        slots[members[i]] = i;
        putInOrder(i, members[i]);
    }
}

/** Write a capsule where it is in the order of cells. */
void ContactSearch::Implementation::putInOrder(int slot, int i) {
    const size_t stride = described.size()+PADDING;
    for (int k = 0; k < 3; k++) {
        boxes[k*stride+slot] = described[i].center[k];
        boxes[(3+k)*stride+slot] = described[i].half[k];
    }
    sorted[slot] = described[i].coarse;
    sortedPlaced[slot] = placed[i];
}

/** Find the rows of capsules in half of the neighbors of a cell: each two cells, in each image, meet once. */
int ContactSearch::Implementation::findRows(int column, int iz, CapsuleRow* rows) const {
    const int* cells = frame.cells;
    int numRows = 0;
    auto add = [&] (int column, int from, int to, const int* images) {
        // Cells that follow each other in a column are one row.
        const int first = cellStart[column*cells[2]+from], last = cellStart[column*cells[2]+to+1];
        if (first < last)
            rows[numRows++] = {first, last, imageNumber(images), {(float) images[0], (float) images[1],
                    (float) images[2]}};
    };
    for (int dx = 0; dx <= 1; dx++)
        for (int dy = (dx == 0 ? 0 : -1); dy <= 1; dy++) {
            int images[3] = {0, 0, 0}, jx = column/cells[1]+dx, jy = column%cells[1]+dy;
            if (jx == cells[0]) {
                jx = 0;
                images[0] = 1;
            }
            if (jy < 0) {
                jy = cells[1]-1;
                images[1] = -1;
            }
            else if (jy == cells[1]) {
                jy = 0;
                images[1] = 1;
            }
            if (!frame.periodic && imageNumber(images) != SAME_IMAGE)
                continue;
            const int other = jx*cells[1]+jy, last = cells[2]-1;
            const int lower = dx == 0 && dy == 0 ? iz+1 : iz-1, upper = iz+1;
            if (max(lower, 0) <= min(upper, last))
                add(other, max(lower, 0), min(upper, last), images);
            if (frame.periodic && lower < 0) {
                images[2] = -1;
                add(other, last, last, images);
            }
            if (frame.periodic && upper > last) {
                images[2] = 1;
                add(other, 0, 0, images);
            }
        }
    return numRows;
}

/** Look for pairs with a capsule in one column of cells. */
void ContactSearch::Implementation::searchCells(int column, const double* x, const double* y) {
    const CandidateKernels& kernels = candidateKernels();
    vector<ContactPair>& found = parts[column];
    found.clear();
    Candidates& candidates = Candidates::ofThread();
    int count = 0;
    auto look = [&] {
        keepPairs(candidates, count, x, y, found);
        count = 0;
    };
    CapsuleRow rows[32];
    for (int iz = 0; iz < frame.cells[2]; iz++) {
        const int cell = column*frame.cells[2]+iz, first = cellStart[cell], last = cellStart[cell+1];
        if (first == last)
            continue;
        const int numRows = 1+findRows(column, iz, rows+1);
        int most = last-first;
        for (int row = 1; row < numRows; row++)
            most += rows[row].last-rows[row].first;
        for (int i = first; i < last; i++) {
            rows[0] = {i+1, last, SAME_IMAGE, {0, 0, 0}};
            candidates.makeRoom(max(count+most, 2*BATCH)+PADDING);
            count += kernels.findOverlaps(sweptBoxes, i, rows, numRows, candidates.from(count));
            if (count >= BATCH)
                look();
        }
    }
    look();
}

/** Add those of some pairs of boxes that are near enough. */
void ContactSearch::Implementation::keepPairs(Candidates& candidates, int count, const double* x, const double* y,
        vector<ContactPair>& found) const {
    count = candidateKernels().keepNear(sorted.data(), imageShifts, reach, margin, candidates.from(0), count);
    for (int i = 0; i < count; i++) {
        if (i+AHEAD < count)
            prefetch(&sortedPlaced[candidates.second[i+AHEAD]]);
        const PlacedCapsule &one = sortedPlaced[candidates.first[i]], &other = sortedPlaced[candidates.second[i]];
        const int image = candidates.image[i]%SURE, images[3] = {image/9-1, image/3%3-1, image%3-1};
        // Two that are both searched for again find each other twice. Others are not at y.
        const bool isAgain = again[one.number] != 0;
        if (isAgain && again[other.number] != 0 && one.number >= other.number)
            continue;
        if (addPair(one, other, images, isAgain || candidates.image[i] >= SURE, x, y, found)) {
            found.back().distance = isAgain ? 0 : candidates.distance[i];
            found.back().clearance = isAgain ? 0 : candidates.clearance[i];
        }
    }
}

/** Take note of where some capsules are now. They stay in the order of cells where they are. */
void ContactSearch::Implementation::describeAgain(const vector<int>& capsules, const double* x, const double* y) {
    const size_t stride = described.size()+PADDING;
    for (size_t number = 0; number < capsules.size(); number++) {
        if (number+AHEAD < capsules.size()) {
            const int slot = slots[capsules[number+AHEAD]];
            prefetch(&sorted[slot]);
            prefetch(&sortedPlaced[slot]);
            for (int k = 0; k < 6; k++)
                prefetch(&boxes[k*stride+slot]);
        }
        const int i = capsules[number];
        Described& own = described[i];
        const int cell = own.cell, cells[3] = {cell/(frame.cells[1]*frame.cells[2]),
                cell/frame.cells[2]%frame.cells[1], cell%frame.cells[2]};
        describe(i, x, y, own, placed[i], true);
        if (!own.finite)
            throw NarrowBoxError("A capsule has moved too far");
        for (int k = 0; k < 3; k++) {
            largestHalf[k] = max(largestHalf[k], own.half[k]);
            const double place = own.center[k]*frame.cells[k]-cells[k];
            largestExcess[k] = max(largestExcess[k], max(-place, place-1)/frame.cells[k]);
        }
        putInOrder(slots[i], i);
    }
    for (int k = 0; k < 3; k++)
        if (frame.periodic && (4*largestHalf[k] > 1 || 4*largestExcess[k] > 1))
            throw NarrowBoxError("The periodic box is too small for contacts: a capsule moves too far");
}

/** Add pairs of boxes with that of one capsule, in all cells that it may reach now; returns how many there are. */
int ContactSearch::Implementation::searchAround(int i, Candidates& candidates, int count) const {
    const Described& own = described[i];
    int lower[3], upper[3];
    for (int k = 0; k < 3; k++) {
        const double range = own.half[k]+largestHalf[k]+largestExcess[k];
        lower[k] = (int) floor((own.center[k]-range)*frame.cells[k]);
        upper[k] = (int) floor((own.center[k]+range)*frame.cells[k]);
        // What leaves a frame that is not periodic stays in its outermost cells.
        const int last = frame.cells[k]-1;
        lower[k] = frame.periodic ? max(lower[k], -frame.cells[k]) : min(max(lower[k], 0), last);
        upper[k] = frame.periodic ? min(upper[k], frame.cells[k]+last) : min(max(upper[k], 0), last);
    }
    candidates.rows.clear();
    int most = 0, images[3];
    auto wrapped = [&] (int cell, int k) {
        images[k] = cell < 0 ? -1 : cell >= frame.cells[k] ? 1 : 0;
        return cell-images[k]*frame.cells[k];
    };
    for (int cx = lower[0]; cx <= upper[0]; cx++)
        for (int cy = lower[1]; cy <= upper[1]; cy++) {
            const int jx = wrapped(cx, 0), column = jx*frame.cells[1]+wrapped(cy, 1);
            for (int cz = lower[2]; cz <= upper[2];) {
                // Cells that follow each other in a column are one row.
                const int from = wrapped(cz, 2);
                const int to = min(from+upper[2]-cz, frame.cells[2]-1);
                const int first = cellStart[column*frame.cells[2]+from], last = cellStart[column*frame.cells[2]+to+1];
                if (first < last)
                    candidates.rows.push_back({first, last, imageNumber(images), {(float) images[0], (float) images[1],
                            (float) images[2]}});
                most += last-first;
                cz += to-from+1;
            }
        }
    candidates.makeRoom(max(count+most, 2*BATCH)+PADDING);
    return count+candidateKernels().findOverlaps(sweptBoxes, slots[i], candidates.rows.data(), candidates.rows.size(),
            candidates.from(count));
}

/** Add a pair if it is near enough, in double precision where there is doubt; false if it is not. */
bool ContactSearch::Implementation::addPair(const PlacedCapsule& one, const PlacedCapsule& other, const int* images,
        bool sure, const double* x, const double* y, vector<ContactPair>& found) const {
    const bool inOrder = one.number < other.number;
    const PlacedCapsule &first = inOrder ? one : other, &second = inOrder ? other : one;
    const int a = first.number, b = second.number;
    if (areNeighbors(first.capsule, second.capsule) || (first.hasExclusions && isExcluded(a, b)))
        return false;
    // Where images are wrapped into the frame, the other one is taken by some vectors of it to where it is near.
    double number[3];
    for (int k = 0; k < 3; k++)
        number[k] = (inOrder ? 1 : -1)*(other.images[k]-one.images[k]-images[k]);
    const Vec3d shift = frame.toVector({number[0], number[1], number[2]});
    ContactPair pair = {a, b, {shift.x, shift.y, shift.z}, 0, 0, 0};
    const SegmentPair start = {first.along, second.along, first.first-second.first+shift};
    if (!sure) {
        const double limit = first.capsule.radius+second.capsule.radius+reach;
        const double before = sqrt(findNearestPoints(start).squared);
        if (before >= limit) {
            if (x == y)
                return false;
            const SegmentPair end = segments(a, b, pair.shift, y);
            const double after = sqrt(findNearestPoints(end).squared);
            const double way = largestMotion(start, end)+2*reach+(hasSphere(start) ? 2*DEEP*(limit-reach) : 0);
            if (after >= limit && before+after > way)
                return false;
        }
    }
    const double volume = start.volume();
    pair.side = volume > 0 ? 1 : volume < 0 ? -1 : 0;
    found.push_back(pair);
    return true;
}

/** Sort what the parts have found: by a, in one turn, then the few with the same a. */
void ContactSearch::Implementation::gather(vector<ContactPair>& pairs) {
    firstOf.assign(system.capsules.size()+1, 0);
    const size_t numParts = (size_t) frame.cells[0]*frame.cells[1];
    for (size_t part = 0; part < numParts; part++)
        for (const ContactPair& pair : parts[part])
            firstOf[pair.a+1]++;
    for (size_t i = 1; i < firstOf.size(); i++)
        firstOf[i] += firstOf[i-1];
    pairs.resize(firstOf.back());
    for (size_t part = 0; part < numParts; part++)
        for (const ContactPair& pair : parts[part])
            pairs[firstOf[pair.a]++] = pair;
    // Each entry is now where the next one starts.
    size_t first = 0;
    for (size_t i = 0; i+1 < firstOf.size(); i++) {
        sort(pairs.begin()+first, pairs.begin()+firstOf[i], [] (const ContactPair& one, const ContactPair& other) {
            return one.b < other.b;
        });
        first = firstOf[i];
    }
}

/** Replace one of two segments by its neighbor in its chain, which lies along a vector. */
static SegmentPair withNeighbor(const SegmentPair& segments, const Vec3d& beside, bool ofA, bool atEnd) {
    if (ofA)
        return {beside, segments.q, atEnd ? segments.w+segments.p : segments.w-beside};
    return {segments.p, beside, atEnd ? segments.w-segments.q : segments.w+beside};
}

/** Get whether a contact belongs to its pair, or to a neighbor of a, or of b, in its chain. */
bool ContactSearch::Implementation::isOwned(const Contact& contact, const ContactPair& pair, const SegmentPair& start,
        const SegmentPair& end, bool parallel, bool ofA, const Ends& ends) const {
    const int own = ofA ? pair.a : pair.b, other = ofA ? pair.b : pair.a;
    const double fraction = ofA ? contact.s : contact.t, sum = radii(pair.a, pair.b);
    const double least = LEAST_DIFFERENCE*(sum+fabs(contact.gap));
    const Vec3d &ownAlong = ofA ? end.p : end.q, &otherAlong = ofA ? end.q : end.p;
    for (bool atEnd : {false, true}) {
        const int neighbor = atEnd ? next[own] : previous[own];
        const bool atJoint = fraction == (atEnd ? 1 : 0);
        if (neighbor < 0 || (parallel && !atJoint) || isExcluded(neighbor, other))
            continue;
        const Vec3d later = ends.along(neighbor, true);
        auto withNeighborBefore = [&] {
            return withNeighbor(start, ends.along(neighbor, false), ofA, atEnd);
        };
        if (!atJoint) {
            // If the distance from the other capsule grows as one goes from the joint into the neighbor, that has no
            // place nearer than the joint, unless it has been crossed.
            const Vec3d joint = (ofA ? end.w : end.w*-1)+ownAlong*(atEnd ? 1 : 0);
            const Vec3d fromOther = joint-otherAlong*nearestFraction(otherAlong, joint*-1);
            const Vec3d into = later*(atEnd ? 1 : -1);
            const double distance = sqrt(fromOther.squared());
            if (fromOther.dot(into) >= 0 && distance-sum > contact.gap+2*least &&
                    (!ends.moves || !mayPass(withNeighborBefore(), withNeighbor(end, later, ofA, atEnd), distance, sum)))
                continue;
        }
        const SegmentPair beside = withNeighbor(end, later, ofA, atEnd);
        const Places places = findPlaces(beside);
        bool endsThere = false;
        if (places.parallel)
            for (int i = 0; i < 2; i++)
                endsThere = endsThere || (ofA ? places.s[i] : places.t[i]) == (atEnd ? 0 : 1);
        if (endsThere) {
            // The neighbor has a contact at the joint.
            const Vec3d joint = (ofA ? end.w : end.w*-1)+ownAlong*(atEnd ? 1 : 0);
            const Vec3d fromOther = joint-otherAlong*nearestFraction(otherAlong, joint*-1);
            if (parallel ? !atEnd : !(contact.gap < sqrt(fromOther.squared())-sum-least))
                return false;
            continue;
        }
        const SegmentPair before = ends.moves ? withNeighborBefore() : beside;
        const double gap = findGap(before, beside, radii(neighbor, other));
        // What differs by rounding is equal. Then the one that ends there counts.
        if (parallel || atEnd ? gap < contact.gap-least : !(contact.gap < gap-least))
            return false;
    }
    return true;
}

/** At a joint, both segments have crossed: the share of the one. */
double ContactSearch::Implementation::shareOf(const Crossing& crossing, const ContactPair& pair) const {
    double share = 1;
    for (bool ofA : {true, false}) {
        const double fraction = takenToEnd(ofA ? crossing.s : crossing.t);
        const int own = ofA ? pair.a : pair.b, other = ofA ? pair.b : pair.a;
        const int neighbor = fraction == 0 ? previous[own] : fraction == 1 ? next[own] : -1;
        if (neighbor >= 0 && !isExcluded(neighbor, other))
            share *= 0.5;
    }
    return share;
}

int ContactSearch::Implementation::evaluate(const ContactPair& pair, const SegmentPair& start, const SegmentPair& end,
        const Ends& ends, Contact* contacts, double limit) const {
    const double sum = radii(pair.a, pair.b);
    const Places places = findPlaces(end);
    if (ends.moves && mayPass(start, end, places.distance, sum)) {
        if (hasSphere(start)) {
            Passage passage;
            if (findPassage(start, end, sum, passage)) {
                const Vec3d& n = passage.normal;
                contacts[0] = {takenToEnd(passage.s), takenToEnd(passage.t), {n.x, n.y, n.z}, passage.distance-sum, 1,
                        passage.through};
                if (contacts[0].gap >= limit)
                    return -1;
                return isOwned(contacts[0], pair, start, end, false, true, ends) &&
                        isOwned(contacts[0], pair, start, end, false, false, ends);
            }
        }
        else {
            Crossing crossings[2];
            const int count = findCrossings(start, end, crossings);
            for (int i = 0; i < count; i++) {
                const Crossing& crossing = crossings[i];
                const Vec3d& n = crossing.normal;
                contacts[i] = {crossing.s, crossing.t, {n.x, n.y, n.z},
                        end.between(crossing.s, crossing.t).dot(n)-sum, shareOf(crossing, pair)/count, true};
            }
            if (count > 0)
                return min(contacts[0].gap, contacts[count-1].gap) < limit ? count : -1;
        }
    }
    contacts[0].gap = places.distance-sum;
    if (contacts[0].gap >= limit)
        return -1;
    int kept = 0;
    const int count = places.parallel ? 2 : 1;
    for (int i = 0; i < count; i++) {
        const double s = places.s[i], t = places.t[i];
        const Vec3d r = end.between(s, t);
        const double length = sqrt(r.squared());
        if (length-sum >= limit)
            continue;
        const Vec3d n = length > 0 ? r*(1/length) : findNormal(end, pair.side);
        const Contact contact = {s, t, {n.x, n.y, n.z}, length-sum, 1.0/count, false};
        if (isOwned(contact, pair, start, end, places.parallel, true, ends) &&
                isOwned(contact, pair, start, end, places.parallel, false, ends))
            contacts[kept++] = contact;
    }
    return kept;
}

ContactSearch::ContactSearch(const CapsuleSystem& system, bool nearestImages) :
        implementation(new Implementation(system, nearestImages)) {
}

ContactSearch::~ContactSearch() {
}

const CapsuleSystem& ContactSearch::getSystem() const {
    return implementation->system;
}

void ContactSearch::setRadius(int capsule, double radius) {
    implementation->system.capsules.at(capsule).radius = radius;
}

bool ContactSearch::isExcluded(int a, int b) const {
    return implementation->isExcluded(a, b);
}

int ContactSearch::getNeighbor(int capsule, bool atEnd) const {
    return (atEnd ? implementation->next : implementation->previous).at(capsule);
}

static void runParts(const Loop& run, int parts, const function<void(int)>& part) {
    if (run)
        run(parts, part);
    else
        for (int i = 0; i < parts; i++)
            part(i);
}

void ContactSearch::findPairs(const double* x, const double* y, const double* box, double reach,
        vector<ContactPair>& pairs, const Loop& run) {
    if (!(reach >= 0 && isfinite(reach)))
        throw invalid_argument("The reach of a search for contacts is negative or not finite");
    pairs.clear();
    Implementation& search = *implementation;
    const int count = search.system.capsules.size();
    if (count == 0)
        return;
    search.reach = reach;
    search.setFrame(x, y, box);
    runParts(run, (count+CHUNK-1)/CHUNK, [&] (int chunk) {
        for (int i = chunk*CHUNK; i < min(count, (chunk+1)*CHUNK); i++)
            search.describe(i, x, y, search.described[i], search.placed[i]);
    });
    search.checkPositions(x, y);
    search.setCells();
    const int columns = search.frame.cells[0]*search.frame.cells[1];
    if ((int) search.parts.size() < columns)
        search.parts.resize(columns);
    runParts(run, columns, [&] (int column) {search.searchCells(column, x, y);});
    search.gather(pairs);
}

void ContactSearch::findPairsOf(const vector<int>& capsules, const double* x, const double* y,
        vector<ContactPair>& pairs, const Loop& run) {
    Implementation& search = *implementation;
    search.describeAgain(capsules, x, y);
    for (int i : capsules)
        search.again[i] = 1;
    // In the order of cells, those that follow each other find the same others in the processor's caches.
    vector<int>& inOrder = search.movers;
    inOrder.resize(capsules.size());
    transform(capsules.begin(), capsules.end(), inOrder.begin(), [&] (int i) {return search.slots[i];});
    sort(inOrder.begin(), inOrder.end());
    const int count = capsules.size(), chunks = (count+FEW-1)/FEW;
    if ((int) search.parts.size() < chunks)
        search.parts.resize(chunks);
    runParts(run, chunks, [&] (int chunk) {
        search.parts[chunk].clear();
        Candidates& candidates = Candidates::ofThread();
        int found = 0;
        for (int i = chunk*FEW; i < min(count, (chunk+1)*FEW); i++)
            found = search.searchAround(search.members[inOrder[i]], candidates, found);
        search.keepPairs(candidates, found, x, y, search.parts[chunk]);
    });
    for (int i : capsules)
        search.again[i] = 0;
    pairs.clear();
    for (int chunk = 0; chunk < chunks; chunk++)
        pairs.insert(pairs.end(), search.parts[chunk].begin(), search.parts[chunk].end());
}

int ContactSearch::evaluate(const ContactPair& pair, const double* x, const double* y, Contact* contacts,
        double limit) const {
    const SegmentPair end = implementation->segments(pair.a, pair.b, pair.shift, y);
    const SegmentPair start = x == y ? end : implementation->segments(pair.a, pair.b, pair.shift, x);
    return implementation->evaluate(pair, start, end, {*implementation, x, y, x != y}, contacts, limit);
}

int ContactSearch::evaluate(const ContactPair& pair, Contact* contacts, double limit) const {
    const Implementation& search = *implementation;
    return search.evaluate(pair, search.movingSegments(pair, false), search.movingSegments(pair, true),
            {search, NULL, NULL, search.moves}, contacts, limit);
}

void ContactSearch::setMotion(const double* x, const double* y, const Loop& run) {
    Implementation& search = *implementation;
    const vector<Capsule>& capsules = search.system.capsules;
    search.moves = x != y;
    vector<MovingSegment>& moving = search.moving;
    moving.resize(capsules.size());
    const int count = capsules.size();
    runParts(run, (count+CHUNK-1)/CHUNK, [&] (int chunk) {
        for (int i = chunk*CHUNK; i < min(count, (chunk+1)*CHUNK); i++) {
            const Capsule& own = capsules[i];
            const int next = search.next[i];
            MovingSegment& segment = moving[i];
            set(segment.first, position(x, own.first));
            set(segment.along, search.along(own, x));
            set(segment.laterFirst, position(y, own.first));
            set(segment.laterAlong, search.along(own, y));
            set(segment.laterNext, next < 0 ? Vec3d {0, 0, 0} : search.along(capsules[next], y));
            segment.radius = own.radius;
        }
    });
}

void ContactSearch::updateMotion(const vector<int>& numbers, const double* y) {
    Implementation& search = *implementation;
    for (int i : numbers) {
        const Capsule& own = search.system.capsules[i];
        const Vec3d along = search.along(own, y);
        set(search.moving[i].laterFirst, position(y, own.first));
        set(search.moving[i].laterAlong, along);
        if (search.previous[i] >= 0)
            set(search.moving[search.previous[i]].laterNext, along);
    }
}

/** Whether a contact that is not parallel and has not crossed is surely not owned: see isOwned(). */
bool ContactSearch::Implementation::isOfNeighbor(const ContactPair& pair, int flags) const {
    // What starts at a joint is the neighbor's that ends there, or nearer than that.
    auto counts = [&] (int neighbor, int other) {
        return neighbor >= 0 && !isExcluded(neighbor, other);
    };
    return ((flags & FIRST_AT_START) != 0 && counts(previous[pair.a], pair.b)) ||
            ((flags & FIRST_GOES_NEARER) != 0 && counts(next[pair.a], pair.b)) ||
            ((flags & SECOND_AT_START) != 0 && counts(previous[pair.b], pair.a)) ||
            ((flags & SECOND_GOES_NEARER) != 0 && counts(next[pair.b], pair.a));
}

void ContactSearch::findOutlooks(const ContactPair* const* pairs, int count, PairOutlook* outlooks) const {
    const int most = 64;
    int first[most], second[most], flags[most];
    double x[most], y[most], z[most], distance[most];
    const CandidateKernels& kernels = candidateKernels();
    const vector<MovingSegment>& moving = implementation->moving;
    for (int start = 0; start < count; start += most) {
        const int own = min(most, count-start);
        for (int i = 0; i < (own+7)/8*8; i++) {
            const ContactPair& pair = *pairs[start+min(i, own-1)];
            first[i] = pair.a;
            second[i] = pair.b;
            x[i] = pair.shift[0];
            y[i] = pair.shift[1];
            z[i] = pair.shift[2];
        }
        kernels.outlook(moving.data(), LARGEST_PARALLEL, AT_END,
                {first, second, {x, y, z}, distance, flags}, own);
        for (int i = 0; i < own; i++) {
            const ContactPair& pair = *pairs[start+i];
            // How near a sphere comes on its way is not known here.
            const MovingSegment &a = moving[pair.a], &b = moving[pair.b];
            const bool mayCross = !a.hasLength() || !b.hasLength() || (flags[i] & MAY_CROSS) != 0;
            const bool isKnown = !mayCross && (flags[i] & MAY_BE_PARALLEL) == 0;
            const double radii = a.radius+b.radius;
            outlooks[start+i] = {distance[i]-radii, radii, mayCross,
                    isKnown && implementation->isOfNeighbor(pair, flags[i])};
        }
    }
}

void ContactSearch::prefetchMotion(int a, int b) const {
    for (int capsule : {a, b}) {
        prefetch(&implementation->moving[capsule]);
        prefetch(&implementation->system.capsules[capsule]);
        prefetch(&implementation->next[capsule]);
        prefetch(&implementation->previous[capsule]);
    }
}

void ContactSearch::findVector(const ContactPair& pair, double s, double t, bool atEnd, double* result) const {
    const Vec3d r = implementation->movingSegments(pair, atEnd).between(s, t);
    result[0] = r.x;
    result[1] = r.y;
    result[2] = r.z;
}

bool ContactSearch::Implementation::crosses(const ContactPair& pair, const SegmentPair& start,
        const SegmentPair& end) const {
    if (hasSphere(start)) {
        Passage passage;
        return findPassage(start, end, radii(pair.a, pair.b), passage) && passage.through;
    }
    Crossing crossings[2];
    return findCrossings(start, end, crossings) > 0;
}

bool ContactSearch::crosses(const ContactPair& pair, const double* x, const double* y) const {
    const Implementation& search = *implementation;
    return search.crosses(pair, search.segments(pair.a, pair.b, pair.shift, x),
            search.segments(pair.a, pair.b, pair.shift, y));
}

bool ContactSearch::crosses(const ContactPair& pair) const {
    const Implementation& search = *implementation;
    return search.crosses(pair, search.movingSegments(pair, false), search.movingSegments(pair, true));
}
