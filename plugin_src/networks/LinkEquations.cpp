#include "networks/LinkEquations.h"
#include "dynamics/LastChange.h"
#include "lanes/Noise.h"
#include "mechanics/Inline.h"
#include "mechanics/Prefetch.h"
#include "mechanics/SymmetricMatrices.h"
#include "networks/StageWeights.h"
#include "networks/TurnedResponse.h"
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdlib>
#include <new>
#include <utility>

using namespace cylchain;
using namespace std;

namespace {

#include "lanes/VectorLanes-inl.h"
#include "mechanics/StretchingModels-inl.h"

/** The largest change of a link in the last iteration, over its thermal fluctuation. */
const double TOLERANCE_OF_LINKS = 0.3;
/** The same for links that turn, which converge linearly. */
const double TOLERANCE_OF_TURNS = 0.1;
/** The same for what one end of a link does not know of. */
const double TOLERANCE_OF_ONE_SIDE = 0.05;
/** What counts as no change: over the change of the whole step, and over the length. */
const double OF_CHANGE = 1e-3, OF_CHANGE_WITH_NOISE = 1e-5, OF_LENGTH = 1e-7;
/** What rounding may leave of a change, over the largest coordinate; without noise, nothing else is left. */
const double OF_ROUNDING = 1e-11;
/** A place is rounded as are those of what it is on, in nm, also where it is at the origin itself. */
const double LEAST_COORDINATE = 100;
/** The least length for metric forces, over the rest length. */
const double LEAST_LENGTH = 0.05;
/** The largest stiffness of a link that has a direction, or is beside gaps, over the friction of a place in a step. */
const double LARGEST_RATE_IN_SINGLE_PRECISION = 1e3;
/**
 * The largest stiffness of a link that turns, over the friction of a place in a step, if packs are to rest. Up to 300,
 * energies of links are as they are without rests; with 3e3 they are 1 % too large, with 3e4 2 to 5 %.
 */
const double LARGEST_STIFFNESS_OF_RESTS = 200;
/** The largest part of what resists turning that compression takes away in the equations of an iteration. */
const double COMPRESSION = 0.8;
/** The largest share by which the response along a direction is not that of the distance. */
const double LARGEST_RATIO = 1.4;
/** The largest error of a distance that turning leaves, over the same. */
const double LENGTH_TOLERANCE = 0.07;
/** Without noise: the largest change across a link in the last iteration, over its length. */
const double OF_TURN = 1e-2;
/** Links that a thread looks at together. */
const int CHUNK_OF_LINKS = 64;
/** Nodes that follow each other are likely to do so in memory. */
struct NeighbouringNodes {
    double coordinates[6];
};

/** Whether a link has a direction. */
bool turns(const Link& link) {
    return link.restLength > 0 || hasRange(link.model);
}

/** The largest coordinate of the particles of a link. */
double largestCoordinate(const Link& link, const double* positions) {
    double largest = LEAST_COORDINATE;
    for (const Place& place : {link.first, link.second})
        for (int particle : {place.first, place.second})
            for (int k = 0; k < 3 && particle >= 0; k++)
                largest = max(largest, fabs(positions[3*particle+k]));
    return largest;
}

} // namespace

void LinkEquations::setLinks(const vector<Link>* newLinks, const LinkBoxes& newBoxes) {
    links = newLinks;
    boxes = newBoxes;
}

void LinkEquations::vectorOf(const State& state, const double* positions, double* r) const {
    double second[3];
    locate(state.link->first, positions, boxes.segments, r);
    locate(state.link->second, positions, boxes.segments, second);
    for (int k = 0; k < 3; k++)
        r[k] += state.shift[k]-second[k];
}

/** Ask for the positions around the places of a link. */
void LinkEquations::prefetchPlaces(const State& state, const double* positions) const {
    for (int particle : state.particles)
        if (particle >= 0)
            prefetch(reinterpret_cast<const NeighbouringNodes*>(positions+3*particle));
}

bool LinkEquations::needDoublePrecision(const ChainPlaces& places, double stepSize, bool besideGaps) const {
    for (const Link& link : *links) {
        const double rate = link.stiffness*stepSize;
        // Most are known to be soft without their places.
        if (!(turns(link) || besideGaps) || !(rate > LARGEST_RATE_IN_SINGLE_PRECISION*places.getLeastFriction()))
            continue;
        for (const Place& place : {link.first, link.second}) {
            PlaceOnChain found;
            if (places.find(place, found) && rate > LARGEST_RATE_IN_SINGLE_PRECISION*places.getFriction(found))
                return true;
        }
    }
    return false;
}

void LinkEquations::begin(const CoupledStart& start, const Loop& newLoop) {
    loop = &newLoop;
    active = &start.active;
    begun = start.positions;
    kT = start.settings.kT;
    stepSize = start.settings.stepSize;
    states.resize(links->size());
    runInChunks(*loop, states.size(), CHUNK_OF_LINKS, [&] (int i) {
        place(start, (*links)[i], states[i]);
    });
    states.erase(remove_if(states.begin(), states.end(), [] (const State& state) {return state.link == NULL;}),
            states.end());
    addStiffness(start.places);
    runInChunks(*loop, states.size(), CHUNK_OF_LINKS, [&] (int i) {
        describe(start, states[i]);
    });
    anyTurns = any_of(states.begin(), states.end(), [] (const State& state) {return state.turns;});
    const bool twoStages = start.settings.scheme == Scheme::ImplicitSecondOrder;
    largestStiffness = demandingStiffness = turningStiffness = 0;
    for (const State& state : states)
        for (int side = 0; side < 2; side++) {
            if (state.places[side].pack < 0)
                continue;
            const double own = stepSize*state.link->stiffness/state.friction[side];
            if (state.places[1-side].pack >= 0)
                largestStiffness = max(largestStiffness, own);
            // All links of a body hold it together.
            if (start.places.isBody(state.places[side].chain))
                demandingStiffness = max(demandingStiffness,
                        stepSize*stiffness[state.particles[side]]/state.friction[side]);
            if (state.turns || twoStages || start.places.isBeam(state.places[side].chain))
                demandingStiffness = max(demandingStiffness, own);
            if (state.turns)
                turningStiffness = max(turningStiffness, own);
        }
    unfinished.assign(states.size(), 0);
    if (kT > 0)
        drawNoise(start);
}

/** Find the places of a link; it has none if it does not take part. */
void LinkEquations::place(const CoupledStart& start, const Link& link, State& state) const {
    const bool first = start.places.find(link.first, state.places[0]);
    const bool second = start.places.find(link.second, state.places[1]);
    const bool moves = (first || second) && link.stiffness != 0;
    state.link = moves && start.takes(state.places[0]) && start.takes(state.places[1]) ? &link : NULL;
    for (int side = 0; side < 2; side++)
        state.particles[side] = state.places[side].pack >= 0 ? start.places.getParticle(state.places[side]) : -1;
}

/** What holds each segment: links at the same place relax together. */
void LinkEquations::addStiffness(const ChainPlaces& places) {
    auto forPlaces = [&] (auto function) {
        for (const State& state : states)
            for (int particle : state.particles)
                if (particle >= 0)
                    function(particle, state.link->stiffness);
    };
    stiffness.resize(places.getNumParticles());
    forPlaces([&] (int particle, double) {stiffness[particle] = 0;});
    forPlaces([&] (int particle, double own) {stiffness[particle] += own;});
}

void LinkEquations::describe(const CoupledStart& start, State& state) const {
    const Link& link = *state.link;
    double direct[3];
    fill(state.shift, state.shift+3, 0.0);
    vectorOf(state, begun, direct);
    copy(direct, direct+3, state.start);
    if (boxes.distances != NULL)
        takeToNearestImage(state.start, boxes.distances);
    for (int k = 0; k < 3; k++)
        state.shift[k] = state.start[k]-direct[k];
    state.length = sqrt(dot(state.start, state.start));
    state.turns = turns(link);
    double rate = 0;
    state.alone = true;
    for (int side = 0; side < 2; side++) {
        const PlaceOnChain& place = state.places[side];
        if (place.pack < 0)
            continue;
        state.friction[side] = start.places.getFriction(place);
        const double total = stiffness[state.particles[side]];
        rate += total/state.friction[side];
        state.alone &= total == link.stiffness;
    }
    state.theta = max(0.5, 1-1/(stepSize*rate));
    state.multiplier = 0;
    state.compliant = false;
    double slope;
    const double inverse = link.maximumExtension > 0 ? 1/link.maximumExtension : 0;
    stretchCoordinate<double>(link.model, inverse, state.length-link.restLength, state.coordinate, slope);
    fill(state.random, state.random+3, 0.0);
}

void LinkEquations::drawNoise(const CoupledStart& start) {
    const NoiseKey key = {(uint32_t) start.settings.seed, (uint32_t) start.settings.level, start.settings.step};
    const size_t count = states.size();
    // Each force numbers its links by itself.
    chains.assign(count, force);
    parts.resize(count);
    normals.resize(4*count);
    (*loop)((count+CHUNK_OF_LINKS-1)/CHUNK_OF_LINKS, [&] (int chunk) {
        const size_t begin = (size_t) chunk*CHUNK_OF_LINKS, end = min(count, begin+CHUNK_OF_LINKS);
        for (size_t i = begin; i < end; i++)
            parts[i] = states[i].link->number;
        drawNormals(key, NoiseKind::Link, &chains[begin], &parts[begin], end-begin, &normals[4*begin]);
        for (size_t i = begin; i < end; i++) {
            State& state = states[i];
            const Link& link = *state.link;
            if (hasRange(link.model)) {
                const double range = link.maximumExtension, stiffness = link.stiffness*range*range/kT;
                double drawn;
                drawFeneCoordinates(key, &chains[i], &parts[i], &stiffness, 1, &drawn);
                state.random[0] = drawn*range;
            }
            else
                for (int k = 0; k < (state.turns ? 1 : 3); k++)
                    state.random[k] = normals[4*i+k]*sqrt(kT/link.stiffness);
        }
    });
}

void LinkEquations::beginStage(int stage, int numStages, const double* moved) {
    const bool first = numStages == 2 && stage == 0;
    shareOfMetricForces = first ? NOISE_OF_FIRST*NOISE_OF_FIRST : 1;
    for (State& state : states) {
        state.changeBefore = 0;
        double before[3] = {state.coordinate, 0, 0}, ofStart, ofRandom;
        fill(state.drift, state.drift+3, 0.0);
        if (!state.turns)
            copy(state.start, state.start+3, before);
        state.implicit = DIAGONAL;
        if (first) {
            ofStart = 0;
            ofRandom = DIAGONAL*NOISE_OF_FIRST;
        }
        else if (numStages == 2 && !state.turns) {
            // As bends: the end of the first stage is part of the second.
            vectorOf(state, moved, before);
            ofStart = 1-DIAGONAL;
            ofRandom = 2*DIAGONAL;
        }
        else {
            // As lengths.
            state.implicit = state.theta;
            ofStart = 1-state.theta;
            ofRandom = sqrt(2*state.theta-1);
        }
        if (stage > 0)
            state.multiplier /= NOISE_OF_FIRST;
        for (int k = 0; k < (state.turns ? 1 : 3); k++)
            state.constant[k] = ofStart*before[k]-ofRandom*state.random[k];
    }
}

/** Select the links a place of which takes part in the iteration. */
void LinkEquations::select() {
    auto takesPart = [&] (const PlaceOnChain& place) {
        return place.pack >= 0 && (*active)[place.pack];
    };
    selected.clear();
    for (size_t i = 0; i < states.size(); i++)
        if (takesPart(states[i].places[0]) || takesPart(states[i].places[1]))
            selected.push_back(i);
}

void LinkEquations::linearise(int, const double* moved, vector<CouplingEquation>& equations) {
    select();
    const size_t first = equations.size();
    equations.resize(first+selected.size());
    runInChunks(*loop, selected.size(), CHUNK_OF_LINKS, [&] (int i) {
        if (i+AHEAD < (int) selected.size())
            prefetchPlaces(states[selected[i+AHEAD]], moved);
        linearise(states[selected[i]], moved, equations[first+i]);
    });
}

void LinkEquations::linearise(State& state, const double* moved, CouplingEquation& equation) const {
    copy(state.places, state.places+2, equation.places);
    const Link& link = *state.link;
    double* const r = state.now;
    vectorOf(state, moved, r);
    double* const k = equation.stiffness;
    if (!state.turns) {
        state.response = link.stiffness*state.implicit;
        for (int i = 0; i < 3; i++)
            equation.force[i] = -link.stiffness*(state.implicit*r[i]+state.constant[i]);
        k[0] = k[3] = k[5] = state.response;
        k[1] = k[2] = k[4] = 0;
        return;
    }
    state.distance = sqrt(dot(r, r));
    if (hasRange(link.model)) {
        const FeneTension law = {link.stiffness, 1/link.maximumExtension, link.restLength, state.length,
                state.implicit, state.constant[0], 0, 0};
        double own = state.distance;
        if (state.multiplier != 0)
            own = law.lengthFor(state.multiplier, own, state.response);
        law.evaluate(own, state.tension, state.response);
        state.tension += state.response*(state.distance-own);
    }
    else {
        state.response = link.stiffness*state.implicit;
        state.tension = link.stiffness*(state.implicit*(state.distance-link.restLength)+state.constant[0]);
    }
    // The gradient between start and end: its product with the change of r is the change of the distance.
    double* const m = state.direction;
    const double perSum = 1/max(state.length+state.distance, LEAST);
    for (int i = 0; i < 3; i++)
        m[i] = perSum*(state.start[i]+r[i]);
    const double square = dot(m, m);
    double metricForce[3];
    const double ratio = describeMetric(state, r, metricForce);
    state.slope = ratio*state.response;
    // Compression lets links turn, up to a part of what resists. What others at the same place do is not known.
    const double compliance = max(state.compliance[0], max(state.compliance[3], state.compliance[5]));
    const double least = state.compliant && state.alone ? -COMPRESSION/compliance : 0;
    const double turning = max(least, state.multiplier*perSum);
    const double rest = state.slope-turning/max(square, LEAST);
    for (int i = 0; i < 3; i++)
        equation.force[i] = shareOfMetricForces*metricForce[i]-state.tension*m[i];
    k[0] = turning+rest*m[0]*m[0];
    k[1] = rest*m[0]*m[1];
    k[2] = rest*m[0]*m[2];
    k[3] = turning+rest*m[1]*m[1];
    k[4] = rest*m[1]*m[2];
    k[5] = turning+rest*m[2]*m[2];
}

void LinkEquations::setCompliances(const double* compliances) {
    for (size_t i = 0; i < states.size(); i++) {
        State& state = states[i];
        if (!state.turns)
            continue;
        fill(state.compliance, state.compliance+6, 0.0);
        const double* t = state.direction;
        for (int side = 0; side < 2; side++) {
            if (state.places[side].pack < 0)
                continue;
            // The compliances are those with the link's own stiffness at the place.
            const double* own = compliances+12*i+6*side;
            double along[3], outer[6];
            multiply(own, t, along);
            const double largest = 1+state.response*stepSize/state.friction[side];
            const double without = 1/max(1/largest, 1-state.response*dot(t, along));
            setOuter(state.response*without, along, outer);
            for (int k = 0; k < 6; k++)
                state.compliance[k] += own[k]+outer[k];
        }
        const double size = max(sqrt(dot(t, t)), LEAST);
        for (int k = 0; k < 3; k++)
            state.first[k] = t[k]/size;
        multiply(state.compliance, state.first, state.firstResponse);
        state.compliant = true;
    }
}

/**
 * Find the metric force, and by how much the response along the direction must be larger than that of the distance, so
 * that a force along the direction changes the distance as it does.
 */
double LinkEquations::describeMetric(const State& state, const double* r, double* force) const {
    fill(force, force+3, 0.0);
    if (!state.compliant)
        return 1;
    const double* const m = state.direction;
    double response[3];
    if (state.alone)
        multiply(state.compliance, m, response);
    else
        turnResponse(m, state.first, state.firstResponse, response);
    const double along = dot(m, response);
    const double least = LEAST_LENGTH*(state.link->restLength+state.link->maximumExtension);
    const double before = max(state.length, least), after = max(state.distance, least);
    // Where a second stage follows, the distance resists by theta there.
    const double resistance = state.response*state.theta/state.implicit;
    const double size = kT*state.link->stiffness*state.theta*0.5*(1/before+1/after)/(1+resistance*along);
    for (int k = 0; k < 3; k++)
        force[k] = -size*(response[k]-along*m[k]);
    if (!state.alone)
        return 1;
    const double ofDistance = dot(r, response)/max(state.distance, LEAST);
    return along > 0 ? min(LARGEST_RATIO, max(1/LARGEST_RATIO, ofDistance/along)) : 1;
}

bool LinkEquations::isUnfinished(State& state, const double* move, const double* moved) const {
    double ofStep = 0;
    for (int k = 0; k < 3; k++) {
        const double way = state.now[k]+move[k]-state.start[k];
        ofStep += way*way;
    }
    const double ofChange = kT > 0 ? OF_CHANGE_WITH_NOISE : OF_CHANGE;
    const double rounding = kT > 0 ? 0 : OF_ROUNDING*largestCoordinate(*state.link, moved);
    const double least = ofChange*ofChange*ofStep+rounding*rounding+
            OF_LENGTH*OF_LENGTH*(state.length*state.length+state.link->restLength*state.link->restLength);
    state.change = state.response*dot(move, move);
    if (state.turns)
        state.multiplier = state.tension+state.slope*dot(state.direction, move);
    const double fluctuation = kT/state.response;
    const double tolerance = state.turns ? TOLERANCE_OF_TURNS : TOLERANCE_OF_LINKS;
    const double last = findChange(state, move), before = exchange(state.changeBefore, last);
    if (!isLastChange(last, before, tolerance*tolerance*fluctuation+least) || turnsTooMuch(state, move, least))
        return true;
    const int a = state.places[0].pack, b = state.places[1].pack;
    const bool oneSided = a >= 0 && b >= 0 && (*active)[a] != (*active)[b];
    for (int k = 0; k < 3; k++)
        state.drift[k] = oneSided ? state.drift[k]+move[k] : 0;
    return !(findChange(state, state.drift) <= TOLERANCE_OF_ONE_SIDE*TOLERANCE_OF_ONE_SIDE*fluctuation+least) ||
            turnsTooMuch(state, state.drift, least);
}

/** The square of how much a move changes what the energy of a link is of. */
double LinkEquations::findChange(const State& state, const double* move) const {
    if (!state.turns)
        return dot(move, move);
    const double along = dot(state.direction, move);
    return along*along;
}

/** Whether a move turns a link by more than it may, or than what counts as no change. */
bool LinkEquations::turnsTooMuch(const State& state, const double* move, double least) const {
    if (!state.turns)
        return false;
    const double square = dot(move, move);
    // Written so that NaN is too much.
    if (kT == 0)
        return !(square <= OF_TURN*OF_TURN*state.length*state.length+least);
    const double error = (square-findChange(state, move))/(2*LENGTH_TOLERANCE*max(state.length, LEAST));
    return !(error*error <= kT/state.response+least);
}

bool LinkEquations::finishIteration(const double* moves, const double* moved) {
    runInChunks(*loop, selected.size(), CHUNK_OF_LINKS, [&] (int i) {
        unfinished[selected[i]] = isUnfinished(states[selected[i]], moves+3*i, moved);
    });
    return find(unfinished.begin(), unfinished.end(), 1) != unfinished.end();
}

Rests LinkEquations::getRests() const {
    if (turningStiffness > LARGEST_STIFFNESS_OF_RESTS)
        return Rests::Wrong;
    return anyTurns ? Rests::Worthwhile : Rests::Possible;
}

bool LinkEquations::markUnfinished(PackFlags& packs) const {
    for (size_t i = 0; i < states.size(); i++)
        for (const PlaceOnChain& place : states[i].places)
            if (unfinished[i] && place.pack >= 0)
                packs[place.pack] = 1;
    return true;
}

/** Whether a link cannot be solved, or has left the range of its potential. */
bool LinkEquations::hasFailed(size_t number, const double* moved) const {
    const State& state = states[number];
    if (unfinished[number] != 0)
        return true;
    if (!hasRange(state.link->model))
        return false;
    double r[3];
    vectorOf(state, moved, r);
    return !(fabs(sqrt(dot(r, r))-state.link->restLength) < state.link->maximumExtension);
}

void LinkEquations::findFailures(const double* moved, vector<bool>& failed) {
    for (size_t i = 0; i < states.size(); i++)
        if (hasFailed(i, moved))
            for (const PlaceOnChain& place : states[i].places)
                if (place.pack >= 0)
                    failed[place.chain] = true;
}

bool LinkEquations::findCulprit(const double* moved, const CouplingEquation*, BrokenCoupling& culprit) const {
    // The one that is farthest from its solution.
    size_t number = states.size();
    for (size_t i = 0; i < states.size(); i++)
        if (hasFailed(i, moved) && (number == states.size() || states[i].change > states[number].change))
            number = i;
    if (number == states.size())
        return false;
    const State& state = states[number];
    culprit.reason = unfinished[number] != 0 ? BrokenCoupling::NotSolved : BrokenCoupling::LeavesRange;
    culprit.link = state.link->number;
    for (int side = 0; side < 2; side++)
        culprit.places[side] = describePlace(state.places[side]);
    return true;
}

void LinkEquations::findTouched(const ChainPlaces& places, vector<bool>& touched) const {
    for (const Link& link : *links)
        for (const Place* place : {&link.first, &link.second}) {
            PlaceOnChain found;
            if (places.find(*place, found))
                touched[found.chain] = true;
        }
}

void LinkEquations::findNeighbours(vector<pair<int, int> >& pairs) const {
    for (const State& state : states)
        if (state.places[0].pack >= 0 && state.places[1].pack >= 0)
            pairs.push_back(make_pair(state.places[0].chain, state.places[1].chain));
}
