#include "dynamics/LastChange.h"
#include "mechanics/SymmetricMatrices.h"
#include "networks/ContactEquations.h"
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <utility>

using namespace cylchain;
using namespace std;

// When the iteration of contacts ends, which packs go on until then, and what has failed if it does not.

namespace {

/** The largest change of a gap in the last iteration, over the thermal fluctuation of a contact. */
const double TOLERANCE_OF_GAPS = 0.3;
/** The same for the change of a gap that one of the two does not know of. */
const double DRIFT_TOLERANCE = 0.1;
/** After so many iterations, this times as much is enough: one contact in thousands must not keep others waiting. */
const int PATIENT_ITERATIONS = 11;
const double LATE = 4;
/** What counts as no change of a gap, over how near pairs come. */
const double LEAST_CHANGE = 3e-3;
/** The first iteration that searches for new pairs: after those before, most capsules move on. */
const int FIRST_NEW_PAIRS = 3;
/** Where more capsules than this share have moved, all are searched for again, which takes less time for each. */
const double SHARE_OF_MOVERS = 0.4;

} // namespace

/** Mark the packs of the pairs that a function finds among all or those that are selected; false if there are none. */
template <class Function> bool ContactEquations::markPairs(bool all, Function findIn) {
    const int runs = selection.getNumRuns(pairs, all);
    if ((int) parts.size() < runs)
        parts.resize(runs);
    (*loop)(runs, [&] (int run) {
        parts[run].pairs.clear();
        findIn(run, parts[run]);
    });
    bool any = false;
    for (int run = 0; run < runs; run++)
        for (int pair : parts[run].pairs) {
            mark(pair);
            any = true;
        }
    return any;
}

/**
 * Find pairs by a first look at them.
 *
 * @param isDue    tells from the number of a pair, its watch and its way whether it is looked at
 * @param isFound  tells from its number and its outlook whether it is one of those
 */
template <class Due, class Found> void ContactEquations::findByOutlook(bool all, int run, Part& part, Due isDue,
            Found isFound) const {
    Looks& looks = Looks::ofThread();
    selection.forPairs(pairs, all, run, [&] (int i) {
        const CapsulePairs::Watch& watch = pairs.getWatch(i);
        if (!isDue(i, watch, motion.getWay(watch.a, watch.b)))
            return;
        search->prefetchMotion(watch.a, watch.b);
        looks.numbers.push_back(i);
        looks.due.push_back(&pairs.getPair(i));
    });
    looks.outlooks.resize(looks.due.size());
    search->findOutlooks(looks.due.data(), looks.due.size(), looks.outlooks.data());
    for (size_t i = 0; i < looks.due.size(); i++)
        if (isFound(looks.numbers[i], looks.outlooks[i]))
            part.pairs.push_back(looks.numbers[i]);
}

/** Look for pairs of capsules that have moved far, which no search has seen. */
void ContactEquations::findNewPairs(const double* moved) {
    const PairFilter known = [&] (int a, int b) {return pairs.isKnown(a, b);};
    const bool most = motion.getMovers().size() > SHARE_OF_MOVERS*places.size();
    try {
        if (most)
            search->findPairs(begun, moved, box, reach, found, *loop, known);
        else
            search->findPairsOf(motion.getMovers(), begun, moved, found, *loop, known);
    }
    catch (const NarrowBoxError&) {
        movesTooFar = true;
        return;
    }
    catch (const EndlessMotionError&) {
        movesTooFar = isEndless = true;
        return;
    }
    if (most)
        motion.beginAgain(moved, *loop);
    else
        motion.beginAgain(motion.getMovers(), moved);
    const int numBefore = pairs.getNumPairs();
    for (const ContactPair& pair : found)
        pairs.add(pair);
    selection.addFrom(numBefore, pairs);
}

/** Find pairs that were left out and may touch now, and new ones that may, from a number on. */
void ContactEquations::findNear(int firstNew, int run, Part& part) {
    const double tolerance = TOLERANCE_OF_GAPS*sqrt(kT/stiffness)+LEAST_CHANGE*reach;
    findByOutlook(selection.hasAll(), run, part, [&] (int i, const CapsulePairs::Watch& watch, double way) {
        return i >= firstNew || (watch.due > 0 && way > watch.due+tolerance);
    }, [&] (int i, const PairOutlook& outlook) {
        return !isApart(i, outlook, tolerance);
    });
}

/** Whether pairs that were left out may touch, or new ones: they take part from now on. */
bool ContactEquations::anyComeNear(const double* moved) {
    motion.follow([&] (int capsule) {
        return takesPart(capsule);
    }, moved, reach, *loop, [&] (const vector<int>& capsules) {
        search->updateMotion(capsules, moved);
    });
    if (crossingsKnown)
        transform(active->begin(), active->end(), movedSince.begin(), movedSince.begin(), [] (char one, char other) {
            return (char) (one | other);
        });
    if (iterations < 2)
        return true;
    // Pairs that no search has seen were out of reach: one of the two has moved by more than half of it.
    const int numKnown = pairs.getNumPairs();
    bool waits = false;
    if (motion.exceedsReach()) {
        if (iterations < FIRST_NEW_PAIRS)
            for (int capsule : motion.getMovers())
                waits |= markCapsule(capsule);
        if (!waits)
            findNewPairs(moved);
        if (movesTooFar)
            return false;
    }
    // Those that are not selected have not moved.
    return markPairs(selection.hasAll(), [&] (int run, Part& part) {
        findNear(numKnown, run, part);
    }) || waits;
}

/** Whether a contact has moved too much in the last iteration, or by itself since one of its packs took part. */
bool ContactEquations::isUnfinished(int number, const double* move) {
    const int contact = contactsOfEquations[number];
    const CouplingEquation& equation = (*equations)[firstEquation+number];
    PairContact& side = pairs.getContact(contact/2, contact%2);
    // The squared change of the gap, times the stiffness.
    double pull[3];
    multiply(equation.stiffness, move, pull);
    double change = pull[0]*move[0]+pull[1]*move[1]+pull[2]*move[2];
    if (side.rest.isBack())
        change /= ContactRest::STIFFENING;
    const double least = LEAST_CHANGE*LEAST_CHANGE*reach*reach*stiffness;
    const double tolerance = TOLERANCE_OF_GAPS*(iterations < PATIENT_ITERATIONS ? 1 : LATE);
    if (!isLastChange(change, exchange(side.changeBefore, change), tolerance*tolerance*kT+least))
        return true;
    double& drift = side.drift;
    const double* n = side.contact.normal;
    drift += n[0]*move[0]+n[1]*move[1]+n[2]*move[2];
    const int a = equation.places[0].pack, b = equation.places[1].pack;
    if (a < 0 || b < 0 || (*active)[a] == (*active)[b])
        drift = 0;
    return !(drift*drift*stiffness < DRIFT_TOLERANCE*DRIFT_TOLERANCE*kT+least);
}

bool ContactEquations::finishIteration(const double* moves, const double* moved) {
    clear = false;
    unsettled = -1;
    unfinished.assign(active->size(), 0);
    if (movesTooFar)
        return false;
    if (!motion.hasBegun())
        return true;
    bool any = anyComeNear(moved);
    if (movesTooFar)
        return false;
    if (iterations < 2)
        return true;
    for (int pair : crossed)
        mark(pair);
    any |= !crossed.empty();
    for (size_t i = 0; i < contactsOfEquations.size(); i++)
        if (isUnfinished(i, moves+3*i)) {
            mark(contactsOfEquations[i]/2);
            if (unsettled < 0)
                unsettled = i;
            any = true;
        }
    if (any)
        return true;
    clear = !anyCross();
    return !clear;
}

bool ContactEquations::markUnfinished(PackFlags& packs) const {
    for (size_t pack = 0; pack < packs.size(); pack++)
        packs[pack] |= unfinished[pack];
    return iterations >= 2;
}

/** The pack of a capsule takes part in the next iteration; false if it has none. */
bool ContactEquations::markCapsule(int capsule) {
    if (packs[capsule] < 0)
        return false;
    unfinished[packs[capsule]] = 1;
    return true;
}

/** The packs of a pair take part in the next iteration. */
void ContactEquations::mark(int pair) {
    markCapsule(pairs.getWatch(pair).a);
    markCapsule(pairs.getWatch(pair).b);
}

/** Find pairs that cross. */
void ContactEquations::findCrossed(bool all, int run, Part& part) const {
    findByOutlook(all, run, part, [&] (int, const CapsulePairs::Watch& watch, double way) {
        return !(way < watch.clearance);
    }, [&] (int i, const PairOutlook& outlook) {
        return outlook.mayCross && search->crosses(pairs.getPair(i));
    });
}

/** Whether pairs cross elsewhere than where they were last seen to touch: they are looked at again. */
bool ContactEquations::anyCross() {
    // Pairs that have not moved since they were seen do not cross.
    const bool all = selection.hasAll() || !crossingsKnown || !selection.includes(movedSince);
    crossingsKnown = true;
    movedSince.assign(active->size(), 0);
    return markPairs(all, [&] (int run, Part& part) {
        findCrossed(all, run, part);
        for (int pair : part.pairs) {
            pairs.getWatch(pair).count = -1;
            pairs.getWatch(pair).due = -HUGE_VAL;
        }
    });
}

void ContactEquations::findFailures(const double* moved, vector<bool>& failed) {
    if (clear)
        return;
    if (movesTooFar)
        places.failAll(failed);
    for (int i = 0; i < pairs.getNumPairs(); i++)
        if (search->crosses(pairs.getPair(i), begun, moved))
            places.fail(pairs.getPair(i), failed);
}

bool ContactEquations::findCulprit(const double* moved, const CouplingEquation* equations,
        BrokenCoupling& culprit) const {
    // The chain itself is known.
    if (isEndless)
        return false;
    if (movesTooFar) {
        places.nameFastest(search->getSystem().capsules, begun, moved, culprit);
        return true;
    }
    for (int i = 0; i < pairs.getNumPairs(); i++)
        if (search->crosses(pairs.getPair(i), begun, moved)) {
            culprit.reason = BrokenCoupling::Crosses;
            places.name(pairs.getPair(i), culprit);
            return true;
        }
    if (unsettled < 0)
        return false;
    for (int side = 0; side < 2; side++)
        culprit.places[side] = describePlace(equations[unsettled].places[side]);
    return true;
}

void ContactEquations::findNeighbours(vector<pair<int, int> >& neighbours) const {
    for (int i = 0; i < pairs.getNumPairs(); i++)
        places.addNeighbours(pairs.getPair(i), neighbours);
}
