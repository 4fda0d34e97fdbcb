#include "dynamics/LinkEquations.h"
#include "dynamics/SymmetricMatrices.h"
#include "lanes/Noise.h"
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdlib>
#include <new>

using namespace cylchain;
using namespace std;

namespace {

#include "lanes/VectorLanes-inl.h"
#include "mechanics/StretchingModels-inl.h"

/** As for the stages of chains: see dynamics/ImplicitState-inl.h. */
const double DIAGONAL = 1-M_SQRT1_2, NOISE_OF_FIRST = DIAGONAL/(1-DIAGONAL);
/** The largest change of a link in the last iteration, over its thermal fluctuation. */
const double TOLERANCE = 0.3;
/** What counts as no change: over the change of the whole step, and over the length. */
const double OF_CHANGE = 1e-3, OF_CHANGE_WITH_NOISE = 1e-5, OF_LENGTH = 1e-7;
/** The least length for metric forces, over the rest length. */
const double LEAST_LENGTH = 0.05;
/** The largest error of a distance that turning leaves, over the same. */
const double LENGTH_TOLERANCE = 0.07;
/** Without noise: the largest change across a link in the last iteration, over its length. */
const double OF_TURN = 1e-2;
/** The least cosine of the angle by which a link may turn in a step. */
const double LEAST_COSINE = -0.9;

double dot(const double* a, const double* b) {
    return a[0]*b[0]+a[1]*b[1]+a[2]*b[2];
}

} // namespace

void LinkEquations::setLinks(const vector<Link>* newLinks, const LinkBoxes& newBoxes, int newForce) {
    links = newLinks;
    boxes = newBoxes;
    force = newForce;
}

void LinkEquations::vectorOf(const State& state, const double* positions, double* r) const {
    double second[3];
    locate(state.link->first, positions, boxes.segments, r);
    locate(state.link->second, positions, boxes.segments, second);
    for (int k = 0; k < 3; k++)
        r[k] += state.shift[k]-second[k];
}

void LinkEquations::begin(const CoupledStart& start, const Loop&) {
    begun = start.positions;
    kT = start.settings.kT;
    stepSize = start.settings.stepSize;
    states.clear();
    anyTurns = false;
    for (const Link& link : *links) {
        State state;
        state.link = &link;
        const bool first = start.places.find(link.first, state.places[0]);
        const bool second = start.places.find(link.second, state.places[1]);
        if ((!first && !second) || link.stiffness == 0)
            continue;
        if (!start.takes(state.places[0]) || !start.takes(state.places[1]))
            continue;
        states.push_back(state);
    }
    addStiffness(start.places);
    for (State& state : states) {
        describe(start, state);
        anyTurns |= state.turns;
    }
    if (kT > 0)
        drawNoise(start);
}

/** What holds each segment: links at the same place relax together. */
void LinkEquations::addStiffness(const ChainPlaces& places) {
    auto forPlaces = [&] (auto function) {
        for (const State& state : states)
            for (const PlaceOnChain& place : state.places)
                if (place.pack >= 0)
                    function(places.getParticle(place), state.link->stiffness);
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
    state.turns = link.restLength > 0 || hasRange(link.model);
    double rate = 0;
    for (const PlaceOnChain& place : state.places)
        if (place.pack >= 0)
            rate += stiffness[start.places.getParticle(place)]/start.places.getFriction(place);
    state.theta = max(0.5, 1-1/(stepSize*rate));
    state.multiplier = 0;
    double slope;
    const double inverse = link.maximumExtension > 0 ? 1/link.maximumExtension : 0;
    stretchCoordinate<double>(link.model, inverse, state.length-link.restLength, state.coordinate, slope);
    fill(state.random, state.random+3, 0.0);
    fill(state.metricForce, state.metricForce+3, 0.0);
}

void LinkEquations::drawNoise(const CoupledStart& start) {
    const NoiseKey key = {(uint32_t) start.settings.seed, (uint32_t) start.settings.level, start.settings.step};
    const size_t count = states.size();
    // Each force numbers its links by itself.
    chains.assign(count, force);
    parts.resize(count);
    normals.resize(4*count);
    for (size_t i = 0; i < count; i++)
        parts[i] = states[i].link->number;
    drawNormals(key, NoiseKind::Link, chains.data(), parts.data(), count, normals.data());
    for (size_t i = 0; i < count; i++) {
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
}

void LinkEquations::beginStage(int stage, int numStages, const double* moved) {
    const bool first = numStages == 2 && stage == 0;
    shareOfMetricForces = first ? NOISE_OF_FIRST*NOISE_OF_FIRST : 1;
    for (State& state : states) {
        double before[3] = {state.coordinate, 0, 0}, ofStart, ofRandom;
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

void LinkEquations::linearise(int, const double* moved, vector<CouplingEquation>& equations) {
    for (State& state : states) {
        CouplingEquation equation;
        copy(state.places, state.places+2, equation.places);
        const Link& link = *state.link;
        double r[3];
        vectorOf(state, moved, r);
        double* const k = equation.stiffness;
        if (!state.turns) {
            state.response = link.stiffness*state.implicit;
            for (int i = 0; i < 3; i++)
                equation.force[i] = -link.stiffness*(state.implicit*r[i]+state.constant[i]);
            k[0] = k[3] = k[5] = state.response;
            k[1] = k[2] = k[4] = 0;
            equations.push_back(equation);
            continue;
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
        double* const m = state.direction;
        for (int i = 0; i < 3; i++)
            m[i] = state.start[i]+r[i];
        const double size = sqrt(dot(m, m));
        for (int i = 0; i < 3; i++)
            m[i] = size > 0 ? m[i]/size : 0;
        const double turning = max(0.0, 0.5*state.multiplier/max(state.distance, 1e-9*(1+link.restLength)));
        const double rest = state.response-turning;
        for (int i = 0; i < 3; i++)
            equation.force[i] = shareOfMetricForces*state.metricForce[i]-state.tension*m[i];
        k[0] = turning+rest*m[0]*m[0];
        k[1] = rest*m[0]*m[1];
        k[2] = rest*m[0]*m[2];
        k[3] = turning+rest*m[1]*m[1];
        k[4] = rest*m[1]*m[2];
        k[5] = turning+rest*m[2]*m[2];
        equations.push_back(equation);
    }
}

void LinkEquations::setCompliances(const double* compliances) {
    for (size_t i = 0; i < states.size(); i++) {
        State& state = states[i];
        if (!state.turns)
            continue;
        double response[3] = {};
        const double* t = state.direction;
        for (int side = 0; side < 2; side++) {
            // The compliances are those with the link's own stiffness at the place.
            double ofSide[3];
            multiply(compliances+12*i+6*side, t, ofSide);
            const double without = 1/max(1e-6, 1-state.response*dot(t, ofSide));
            for (int k = 0; k < 3; k++)
                response[k] += ofSide[k]*without;
        }
        // Where a second stage follows, the distance resists by theta there.
        const double along = dot(t, response), resistance = state.response*state.theta/state.implicit;
        const double length = max(state.length, LEAST_LENGTH*(state.link->restLength+state.link->maximumExtension));
        const double size = kT*state.link->stiffness*(2*state.theta-1)/(length*(1+resistance*along));
        for (int k = 0; k < 3; k++)
            state.metricForce[k] = -size*(response[k]-along*t[k]);
    }
}

bool LinkEquations::finishIteration(const double* moves, const double* moved) {
    bool unfinished = false;
    for (size_t i = 0; i < states.size(); i++) {
        State& state = states[i];
        const double* move = moves+3*i;
        double r[3], square = dot(move, move), ofStep = 0;
        vectorOf(state, moved, r);
        for (int k = 0; k < 3; k++)
            ofStep += (r[k]-state.start[k])*(r[k]-state.start[k]);
        const double ofChange = kT > 0 ? OF_CHANGE_WITH_NOISE : OF_CHANGE;
        const double least = ofChange*ofChange*ofStep+
                OF_LENGTH*OF_LENGTH*(state.length*state.length+state.link->restLength*state.link->restLength);
        const double thermal = TOLERANCE*TOLERANCE*kT/state.response;
        // Written so that NaN is not finished.
        if (!state.turns) {
            unfinished |= !(square <= thermal+least);
            continue;
        }
        const double along = dot(state.direction, move);
        state.multiplier = state.tension+state.response*along;
        const double error = (square-along*along)/(2*LENGTH_TOLERANCE*max(state.length, LEAST));
        unfinished |= !(along*along <= thermal+least);
        unfinished |= kT > 0 && !(error*error <= thermal/(TOLERANCE*TOLERANCE)+least);
        unfinished |= kT == 0 && !(square <= OF_TURN*OF_TURN*state.length*state.length+least);
    }
    return unfinished;
}

void LinkEquations::findFailures(const double* moved, vector<bool>& failed) const {
    for (const State& state : states) {
        if (!state.turns)
            continue;
        double r[3];
        vectorOf(state, moved, r);
        const double length = sqrt(dot(r, r));
        const bool turned = !(dot(state.start, r) >= LEAST_COSINE*state.length*length);
        const bool left = hasRange(state.link->model) &&
                !(fabs(length-state.link->restLength) < state.link->maximumExtension);
        if (turned || left)
            for (const PlaceOnChain& place : state.places)
                if (place.pack >= 0)
                    failed[place.chain] = true;
    }
}

void LinkEquations::findNeighbours(vector<pair<int, int> >& pairs) const {
    for (const State& state : states)
        if (state.places[0].pack >= 0 && state.places[1].pack >= 0)
            pairs.push_back(make_pair(state.places[0].chain, state.places[1].chain));
}
