#include "networks/CandidatePairs.h"
#include <algorithm>
#include <cmath>
#include <cstddef>

using namespace cylchain;
using namespace std;

namespace {

/** How much farther than needed pairs are looked for, over the diameter: further iterations move them. */
const double SLACK = 0.25;
/** Parts of all this that pairs are looked for in where a periodic box is too narrow for more. */
const double NARROWER[] = {1, 0.6, 0.35, 0.2};
/** The largest depth of a hard surface, over the sum of the radii: it is before the axes. */
const double LARGEST_DEPTH = 0.95;
/** Pairs that a thread looks at together. */
const int CHUNK_OF_CANDIDATES = 256;

} // namespace

/** Pairs that are looked at together, in memory of a thread. */
struct CandidatePairs::Looks {
    vector<const ContactPair*> pairs;
    vector<int> numbers;
    vector<PairOutlook> outlooks;
    static Looks& ofThread() {
        static thread_local Looks memory;
        memory.pairs.clear();
        memory.numbers.clear();
        return memory;
    }
    void add(int number, const ContactPair& pair) {
        pairs.push_back(&pair);
        numbers.push_back(number);
    }
    void look(const ContactSearch& search) {
        outlooks.resize(pairs.size());
        search.findOutlooks(pairs.data(), pairs.size(), outlooks.data());
    }
};

void CandidatePairs::setSearch(ContactSearch* newSearch, double newStiffness, const double* newBox) {
    search = newSearch;
    stiffness = newStiffness;
    box = newBox;
}

void CandidatePairs::begin(const CoupledStart& start, const CapsulePlaces& newPlaces,
        const vector<double>& newResponses, const Loop& newLoop) {
    loop = &newLoop;
    begun = start.positions;
    kT = start.settings.kT;
    places = &newPlaces;
    active = &start.active;
    responses = &newResponses;
    const vector<Capsule>& capsules = search->getSystem().capsules;
    double diameter = 0, response = 0;
    for (size_t i = 0; i < capsules.size(); i++) {
        diameter = max(diameter, 2*capsules[i].radius);
        response = max(response, 2*newResponses[i]);
    }
    reach = sqrt(LARGEST_GAP_EXPONENT*kT*response);
    slack = SLACK*diameter;
    tooFar = isEndless = false;
    pairs.clear();
    rooms.clear();
    surfaces.clear();
    motion.clear();
}

/** Look for pairs of all capsules that are not known, as far as the periodic box is wide enough. */
void CandidatePairs::findPairs(const double* moved, const PairFilter& known) {
    tooFar = true;
    for (double part : NARROWER)
        try {
            search->findPairs(begun, moved, box, part*(reach+slack), found, *loop, known);
            tooFar = false;
            return;
        }
        catch (const NarrowBoxError&) {
            found.clear();
        }
        catch (const EndlessMotionError&) {
            found.clear();
            isEndless = true;
            return;
        }
}

/** Look for pairs of capsules that have moved far, which no search has seen. */
void CandidatePairs::findNewPairs(const double* moved) {
    const PairFilter known = [&] (int a, int b) {
        return pairs.isKnown(a, b);
    };
    try {
        search->findPairsOf(motion.getMovers(), begun, moved, found, *loop, known);
    }
    catch (const NarrowBoxError&) {
        findPairs(moved, known);
    }
    catch (const EndlessMotionError&) {
        tooFar = isEndless = true;
    }
    motion.beginAgain(motion.getMovers(), moved);
    for (const ContactPair& pair : found)
        pairs.add(pair);
}

bool CandidatePairs::follow(bool settled, const double* moved, const GapNoise& newNoise) {
    candidates.clear();
    crossedAreKnown = false;
    noise = &newNoise;
    if (tooFar)
        return false;
    int firstNew = 0;
    if (!motion.hasBegun()) {
        findPairs(moved, PairFilter());
        motion.begin(search->getSystem().capsules, moved, *loop);
        pairs.begin(found, places->size());
        search->setMotion(begun, moved, *loop);
    }
    else {
        motion.follow([&] (int capsule) {
            return takesPart(capsule);
        }, moved, slack, *loop, [&] (const vector<int>& capsules) {
            search->updateMotion(capsules, moved);
        });
        firstNew = pairs.size();
        // While much moves, it may come back.
        if (motion.exceedsReach() && settled)
            findNewPairs(moved);
    }
    if (!tooFar)
        select(firstNew);
    return !tooFar;
}

/**
 * Get whether the gap of a pair may be closed that begins and ends so; if not, how far its capsules may travel until it
 * may.
 */
bool CandidatePairs::mayClose(int number, double before, double after, double& room) const {
    const double least = LARGEST_GAP_EXPONENT*kT*((*responses)[get(number).a]+(*responses)[get(number).b]);
    auto isFar = [&] (double depth) {
        const double start = before+depth;
        room = after+depth-least/start;
        return start > 0 && room > 0;
    };
    if (isFar(0))
        return false;
    Gap gap;
    gap.stiffness = stiffness;
    const double depth = placeHardSurface(number, before, gap);
    return gap.law != GapLaw::Reflection || !isFar(depth);
}

double CandidatePairs::placeHardSurface(int number, double start, Gap& gap) const {
    gap.key[0] = keyOf(get(number));
    gap.key[1] = get(number).b;
    return cylchain::placeHardSurface(kT, noise->getLimit(), surfaces[number], LARGEST_DEPTH*radiiOf(number), start,
            gap);
}

/** Draw what the hard surfaces of some pairs are found with. */
void CandidatePairs::drawSurfaces(int first, int last) {
    if (first >= last)
        return;
    static thread_local vector<uint32_t> keys, others;
    keys.clear();
    others.clear();
    for (int i = first; i < last; i++) {
        keys.push_back(keyOf(get(i)));
        others.push_back(get(i).b);
    }
    noise->drawSurfaces(keys.data(), others.data(), last-first, &surfaces[first]);
}

/** Find the pairs from a number on, or those that have travelled far enough, whose gaps may be closed. */
void CandidatePairs::select(int firstNew) {
    const int count = pairs.size(), chunks = (count+CHUNK_OF_CANDIDATES-1)/CHUNK_OF_CANDIDATES;
    rooms.resize(count, 0.0);
    surfaces.resize(count);
    parts.resize(max(parts.size(), (size_t) chunks));
    (*loop)(chunks, [&] (int chunk) {
        Looks& looks = Looks::ofThread();
        const int first = chunk*CHUNK_OF_CANDIDATES, last = min(count, first+CHUNK_OF_CANDIDATES);
        drawSurfaces(max(first, firstNew), last);
        for (int i = first; i < last; i++) {
            if (rooms[i] < 0 || (i < firstNew && getWay(i) < rooms[i]))
                continue;
            const ContactPair& pair = get(i);
            const double radii = i < firstNew ? 0 : radiiOf(i);
            double room;
            if (places->areHeld(pair))
                rooms[i] = HUGE_VAL;
            else if (i >= firstNew && pair.clearance > 0 && !mayClose(i, pair.before-radii, pair.distance-radii, room))
                rooms[i] = getWay(i)+min(room, (double) pair.clearance);
            else
                looks.add(i, pair);
        }
        looks.look(*search);
        vector<int>& own = parts[chunk];
        own.clear();
        for (size_t k = 0; k < looks.pairs.size(); k++) {
            const ContactPair& pair = *looks.pairs[k];
            const int number = looks.numbers[k];
            const PairOutlook& outlook = looks.outlooks[k];
            double before = pair.before-outlook.radii, room;
            // The surface of what overlaps is as deep as it does: that must be exact, as the end is.
            if (before < 0)
                before = sqrt(findNearestPoints(search->getSegments(pair, false)).squared)-outlook.radii;
            if (mayClose(number, before, outlook.gap, room) || (outlook.mayCross && search->crosses(pair)))
                own.push_back(number);
            else
                rooms[number] = getWay(number)+room;
        }
    });
    for (int chunk = 0; chunk < chunks; chunk++)
        candidates.insert(candidates.end(), parts[chunk].begin(), parts[chunk].end());
    for (int pair : candidates)
        rooms[pair] = -1;
}

const vector<int>& CandidatePairs::getCrossed() {
    if (crossedAreKnown)
        return crossed;
    crossed.clear();
    crossedAreKnown = true;
    if (tooFar)
        return crossed;
    const int count = pairs.size(), chunks = (count+CHUNK_OF_CANDIDATES-1)/CHUNK_OF_CANDIDATES;
    (*loop)(chunks, [&] (int chunk) {
        Looks& looks = Looks::ofThread();
        for (int i = chunk*CHUNK_OF_CANDIDATES; i < min(count, (chunk+1)*CHUNK_OF_CANDIDATES); i++)
            if (!places->areHeld(get(i)) && !(getWay(i) < get(i).clearance))
                looks.add(i, get(i));
        looks.look(*search);
        vector<int>& own = parts[chunk];
        own.clear();
        for (size_t k = 0; k < looks.pairs.size(); k++)
            if (looks.outlooks[k].mayCross && search->crosses(*looks.pairs[k]))
                own.push_back(looks.numbers[k]);
    });
    for (int chunk = 0; chunk < chunks; chunk++)
        crossed.insert(crossed.end(), parts[chunk].begin(), parts[chunk].end());
    return crossed;
}

bool CandidatePairs::findCulprit(const double* moved, BrokenCoupling& culprit) const {
    // The chain whose motion has no end is known.
    if (isEndless)
        return false;
    if (tooFar)
        places->nameFastest(search->getSystem().capsules, begun, moved, culprit);
    else if (crossedAreKnown && !crossed.empty()) {
        culprit.reason = BrokenCoupling::Crosses;
        places->name(get(crossed[0]), culprit);
    }
    else
        return false;
    return true;
}
