#include "couplings/ContactSearchImplementation.h"
#include "mechanics/Prefetch.h"
#include <algorithm>
#include <map>
#include <stdexcept>
#include <string>

using namespace cylchain;
using namespace std;

namespace {

/** Capsules that are described together, those that are searched around together, and pairs looked at together. */
const int CHUNK = 512, FEW = 32, BATCH = 512;
/** What rounding adds to distances in single precision, over the lengths that they are made of. */
const double SINGLE_ROUNDING = 1e-6;
/** The error of a distance where segments are nearly parallel, over their lengths, in single precision. */
const double PARALLEL_ERROR = 5e-3;
/** What a block of lanes may read or write beyond the end of an array. */
const int PADDING = 16;

double component(const Vec3d& vector, int k) {
    return k == 0 ? vector.x : k == 1 ? vector.y : vector.z;
}

/** The number of an image, from 0 to 26: by the number of vectors of the frame, each from -1 to 1. */
int imageNumber(const int* images) {
    return 9*(images[0]+1)+3*(images[1]+1)+images[2]+1;
}

} // namespace

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

void ContactSearch::Implementation::setFrame(const double* x, const double* y, const double* box) {
    frame = Frame();
    frame.periodic = box != NULL;
    largestRadius = 0;
    for (const Capsule& capsule : system.capsules)
        largestRadius = max(largestRadius, capsule.radius);
    if (box != NULL) {
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
            for (const double* positions : {x, y})
                for (int particle : {capsule.first, capsule.end()})
                    for (int k = 0; k < 3; k++)
                        if (!isfinite(positions[3*particle+k])) {
                            const string what = "The position of particle "+to_string(particle)+" is not finite";
                            if (positions == x)
                                throw invalid_argument(what);
                            throw EndlessMotionError(what+" where it moves to");
                        }
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
void ContactSearch::Implementation::searchCells(int column, const double* x, const double* y,
        const PairFilter& known) {
    const CandidateKernels& kernels = candidateKernels();
    vector<ContactPair>& found = parts[column];
    found.clear();
    Candidates& candidates = Candidates::ofThread();
    int count = 0;
    auto look = [&] {
        keepPairs(candidates, count, x, y, known, found);
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
        const PairFilter& known, vector<ContactPair>& found) const {
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
        if (known && known(min(one.number, other.number), max(one.number, other.number)))
            continue;
        if (addPair(one, other, images, isAgain || candidates.image[i] >= SURE, x, y, found)) {
            found.back().distance = isAgain ? 0 : candidates.distance[i];
            found.back().clearance = isAgain ? 0 : candidates.clearance[i];
            found.back().before = candidates.before[i];
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
            throw EndlessMotionError("A capsule has moved too far");
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
    ContactPair pair = {a, b, {shift.x, shift.y, shift.z}, 0, 0, 0, 0};
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

ContactSearch::ContactSearch(const CapsuleSystem& system, bool nearestImages) :
        implementation(new Implementation(system, nearestImages)) {
}

ContactSearch::~ContactSearch() {
}

const CapsuleSystem& ContactSearch::getSystem() const {
    return implementation->system;
}

void ContactSearch::setSystem(const CapsuleSystem& system) {
    implementation.reset(new Implementation(system, implementation->nearestImages));
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

void cylchain::runParts(const Loop& run, int parts, const function<void(int)>& part) {
    if (run)
        run(parts, part);
    else
        for (int i = 0; i < parts; i++)
            part(i);
}

void ContactSearch::findPairs(const double* x, const double* y, const double* box, double reach,
        vector<ContactPair>& pairs, const Loop& run, const PairFilter& known) {
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
    runParts(run, columns, [&] (int column) {search.searchCells(column, x, y, known);});
    search.gather(pairs);
}

void ContactSearch::findPairsOf(const vector<int>& capsules, const double* x, const double* y,
        vector<ContactPair>& pairs, const Loop& run, const PairFilter& known) {
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
            prefetch(&search.described[search.members[inOrder[i]]]);
        for (int i = chunk*FEW; i < min(count, (chunk+1)*FEW); i++)
            found = search.searchAround(search.members[inOrder[i]], candidates, found);
        search.keepPairs(candidates, found, x, y, known, search.parts[chunk]);
    });
    for (int i : capsules)
        search.again[i] = 0;
    pairs.clear();
    for (int chunk = 0; chunk < chunks; chunk++)
        pairs.insert(pairs.end(), search.parts[chunk].begin(), search.parts[chunk].end());
}
