#include "dynamics/ContactEquations.h"
#include "dynamics/SymmetricMatrices.h"
#include "dynamics/WallEquations.h"
#include <algorithm>
#include <cmath>
#include <cstddef>

using namespace cylchain;
using namespace std;

namespace {

/** How near pairs come that are looked at in a step, over their diameter: further iterations move them. */
const double REACH = 0.8;
/** The largest overlap that is mirrored, over the same. */
const double LARGEST_MIRRORED = 0.5;
/** Pairs with a larger gap are only looked at again if they may have come near, over the same. */
const double LARGEST_GAP = 0.3;
/** The largest change of a gap in the last iteration, over the thermal fluctuation of a contact. */
const double TOLERANCE = 0.3;
/** After so many iterations, this times as much is enough: one contact in thousands must not keep others waiting. */
const int PATIENT_ITERATIONS = 11;
const double LATE = 4;
/** What counts as no change of a gap, over how near pairs come. */
const double LEAST_CHANGE = 3e-3;
/** The number of iterations that look where capsules touch. */
const int SEARCHING_ITERATIONS = 6;
/** The number of iterations in which a contact may pass to a neighbour. */
const int PASSING_ITERATIONS = 3;
/** From this iteration on, contacts that touch go on to do so, even if that takes a small force which pulls. */
const int HOLDING_ITERATIONS = 9;
/** Pairs that a thread looks at together. */
const int CHUNK = 128;

} // namespace

void ContactEquations::setContacts(ContactSearch* newSearch, double newStiffness, const double* newBox) {
    search = newSearch;
    stiffness = newStiffness;
    box = newBox;
}

void ContactEquations::begin(const CoupledStart& start, const Loop& newLoop) {
    loop = &newLoop;
    begun = start.positions;
    kT = start.settings.kT;
    const vector<Capsule>& capsules = search->getSystem().capsules;
    places.resize(capsules.size());
    double diameter = 0;
    for (size_t i = 0; i < capsules.size(); i++) {
        const Capsule& capsule = capsules[i];
        diameter = max(diameter, 2*capsule.radius);
        Place place;
        place.first = capsule.first;
        place.second = capsule.second;
        PlaceOnChain& found = places[i].place;
        places[i].direction = 0;
        if (start.places.find(place, found) && start.taken[found.chain])
            places[i].direction = capsule.second < 0 ? 0 : found.fraction == 0 ? 1 : -1;
        else
            found = PlaceOnChain();
        places[i].response = found.pack < 0 ? 0 : start.settings.stepSize/start.places.getFriction(found);
    }
    reach = REACH*diameter;
    pairs.clear();
    states.clear();
    searched.clear();
}

void ContactEquations::beginStage(int, int, const double*) {
    iterations = 0;
}

PlaceOnChain ContactEquations::placeOf(int capsule, double fraction) const {
    PlaceOnChain place = places[capsule].place;
    place.fraction += places[capsule].direction*fraction;
    return place;
}

void ContactEquations::takeNoteOf(int capsule, const double* moved) {
    const Capsule& own = search->getSystem().capsules[capsule];
    copy_n(moved+3*own.first, 3, &searched[6*capsule]);
    copy_n(moved+3*own.end(), 3, &searched[6*capsule+3]);
}

void ContactEquations::findPairs(const double* moved) {
    search->findPairs(begun, moved, box, reach, pairs, *loop);
    searched.resize(6*places.size());
    for (size_t i = 0; i < places.size(); i++)
        takeNoteOf(i, moved);
    for (const ContactPair& pair : pairs)
        states.push_back({pair, true, 0, {0, 0}, {}, -1, {false, false}});
}

/** Look for pairs of some capsules again; false if all that are found take part already. */
bool ContactEquations::findPairsOf(const vector<int>& capsules, const double* moved, double slack) {
    search->findPairsOf(capsules, begun, moved, slack, pairs);
    for (int capsule : capsules)
        takeNoteOf(capsule, moved);
    auto isBefore = [] (const State& one, const State& other) {
        return one.pair.a < other.pair.a || (one.pair.a == other.pair.a && one.pair.b < other.pair.b);
    };
    const size_t known = states.size();
    bool any = false;
    for (const ContactPair& pair : pairs) {
        const State state = {pair, true, 0, {0, 0}, {}, -1, {false, false}};
        const auto found = lower_bound(states.begin(), states.begin()+known, state, isBefore);
        if (found == states.begin()+known || isBefore(state, *found)) {
            states.push_back(state);
            any = true;
        }
        else if (!found->near) {
            found->near = any = true;
            found->count = -1;
        }
    }
    inplace_merge(states.begin(), states.begin()+known, states.end(), isBefore);
    return any;
}

void ContactEquations::updateContacts(State& state, const double* moved) const {
    const vector<Capsule>& capsules = search->getSystem().capsules;
    const double radii = capsules[state.pair.a].radius+capsules[state.pair.b].radius;
    for (int i = 0; i < state.count; i++) {
        Contact& contact = state.contacts[i];
        double r[3];
        search->findVector(state.pair, contact.s, contact.t, moved, r);
        const double* n = contact.normal;
        contact.gap = r[0]*n[0]+r[1]*n[1]+r[2]*n[2]-radii;
    }
}

void ContactEquations::evaluate(State& state, const double* moved, bool first, Part& part) const {
    const ContactPair& pair = state.pair;
    const PlaceOnChain &a = places[pair.a].place, &b = places[pair.b].place;
    state.near = a.pack >= 0 || b.pack >= 0;
    if (!state.near)
        return;
    const double diameter = search->getSystem().capsules[pair.a].radius+search->getSystem().capsules[pair.b].radius;
    if (iterations < SEARCHING_ITERATIONS || state.count < 0) {
        // What is farther away is left out, until it may have come near. Overlaps that are mirrored count.
        const double limit = LARGEST_GAP*diameter+max(state.mirrored[0], state.mirrored[1]);
        Contact contacts[2];
        const int count = search->evaluate(pair, begun, moved, contacts, limit);
        // A contact at a joint may pass from one segment to the next and back: in the end, it must not be lost.
        if (count == 0 && state.count > 0 && iterations >= PASSING_ITERATIONS)
            updateContacts(state, moved);
        else {
            state.count = count;
            copy(contacts, contacts+2, state.contacts);
            state.near = count >= 0 || !first;
            state.gap = contacts[0].gap;
        }
    }
    else
        updateContacts(state, moved);
    for (int i = 0; i < state.count; i++) {
        const Contact& contact = state.contacts[i];
        // Where contacts are not looked for any more, anyCross() sees whether they have come back.
        part.crossed |= contact.crossed && iterations < SEARCHING_ITERATIONS;
        if (first)
            state.mirrored[i] = min(max(0.0, -contact.gap), LARGEST_MIRRORED*diameter)*
                    shareMirrored(stiffness*(places[pair.a].response+places[pair.b].response));
        const double overlap = state.mirrored[i]-contact.gap;
        // Contacts that open and close in turn would keep the iteration from ending.
        const bool holds = iterations >= HOLDING_ITERATIONS && state.touched[i];
        state.touched[i] = overlap > 0 || holds;
        if (!state.touched[i])
            continue;
        CouplingEquation equation;
        equation.places[0] = placeOf(pair.a, contact.s);
        equation.places[1] = placeOf(pair.b, contact.t);
        const double* n = contact.normal;
        const double own = contact.weight*stiffness;
        for (int k = 0; k < 3; k++)
            equation.force[k] = own*overlap*n[k];
        setOuter(own, n, equation.stiffness);
        part.equations.push_back(equation);
    }
}

void ContactEquations::linearise(int iteration, const double* moved, vector<CouplingEquation>& equations) {
    iterations = iteration;
    normals.clear();
    crossed = false;
    if (iteration == 0 && searched.empty())
        return;
    const bool first = searched.empty();
    if (first)
        findPairs(moved);
    const int count = states.size(), chunks = (count+CHUNK-1)/CHUNK;
    if ((int) parts.size() < chunks)
        parts.resize(chunks);
    (*loop)(chunks, [&] (int chunk) {
        Part& part = parts[chunk];
        part.equations.clear();
        part.crossed = false;
        for (int i = chunk*CHUNK; i < min(count, (chunk+1)*CHUNK); i++)
            if (states[i].near)
                evaluate(states[i], moved, first, part);
    });
    for (int chunk = 0; chunk < chunks; chunk++) {
        const Part& part = parts[chunk];
        crossed |= part.crossed;
        equations.insert(equations.end(), part.equations.begin(), part.equations.end());
        for (const CouplingEquation& equation : part.equations)
            for (int k : {0, 3, 5})
                normals.push_back(equation.stiffness[k]);
    }
}

/** Whether pairs that were left out may touch, or new ones: they take part from now on. */
bool ContactEquations::anyComeNear(const double* moved) {
    const vector<Capsule>& capsules = search->getSystem().capsules;
    motion.resize(capsules.size());
    double largest = 0, second = 0;
    for (size_t i = 0; i < capsules.size(); i++) {
        double square = 0;
        for (int end = 0; end < 2; end++) {
            const double* now = moved+3*(end == 0 ? capsules[i].first : capsules[i].end());
            const double* before = &searched[6*i+3*end];
            double own = 0;
            for (int k = 0; k < 3; k++)
                own += (now[k]-before[k])*(now[k]-before[k]);
            square = max(square, own);
        }
        motion[i] = sqrt(square);
        second = max(second, min(largest, motion[i]));
        largest = max(largest, motion[i]);
    }
    bool any = false;
    for (State& state : states)
        if (!state.near && motion[state.pair.a]+motion[state.pair.b] > state.gap) {
            state.near = any = true;
            state.count = -1;
        }
    // Pairs that no search has seen were out of reach: one of the two has moved by more than half of it.
    if (largest+second > reach) {
        movers.clear();
        for (size_t i = 0; i < motion.size(); i++)
            if (2*motion[i] > reach)
                movers.push_back(i);
        any |= findPairsOf(movers, moved, largest);
    }
    return any;
}

bool ContactEquations::finishIteration(const double* moves, const double* moved) {
    clear = false;
    if (iterations < 2 || anyComeNear(moved) || crossed)
        return true;
    for (size_t i = 0; i < normals.size(); i += 3) {
        // At most the squared change of the gap, times the stiffness.
        double change = 0;
        for (int k = 0; k < 3; k++)
            change += sqrt(normals[i+k])*fabs(moves[i+k]);
        const double least = LEAST_CHANGE*LEAST_CHANGE*reach*reach*stiffness;
        const double tolerance = TOLERANCE*(iterations < PATIENT_ITERATIONS ? 1 : LATE);
        if (!(change*change < tolerance*tolerance*kT+least))
            return true;
    }
    clear = !anyCross(moved);
    return !clear;
}

/** Whether pairs cross elsewhere than where they were last seen to touch: they are looked at again. */
bool ContactEquations::anyCross(const double* moved) {
    const int count = states.size(), chunks = (count+CHUNK-1)/CHUNK;
    (*loop)(chunks, [&] (int chunk) {
        parts[chunk].crossed = false;
        for (int i = chunk*CHUNK; i < min(count, (chunk+1)*CHUNK); i++)
            if (search->crosses(states[i].pair, begun, moved)) {
                states[i].near = parts[chunk].crossed = true;
                states[i].count = -1;
            }
    });
    return any_of(parts.begin(), parts.begin()+chunks, [] (const Part& part) {return part.crossed;});
}

void ContactEquations::findFailures(const double* moved, vector<bool>& failed) const {
    if (clear)
        return;
    for (const State& state : states)
        if (search->crosses(state.pair, begun, moved))
            for (int capsule : {state.pair.a, state.pair.b})
                if (places[capsule].place.pack >= 0)
                    failed[places[capsule].place.chain] = true;
}

void ContactEquations::findNeighbours(vector<pair<int, int> >& neighbours) const {
    for (const State& state : states) {
        const PlaceOnChain &a = places[state.pair.a].place, &b = places[state.pair.b].place;
        if (a.pack >= 0 && b.pack >= 0)
            neighbours.push_back(make_pair(a.chain, b.chain));
    }
}
