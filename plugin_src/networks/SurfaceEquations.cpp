#include "networks/SurfaceEquations.h"
#include "dynamics/LastChange.h"
#include "lanes/Noise.h"
#include "mechanics/SymmetricMatrices.h"
#include "networks/TurnedResponse.h"
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <utility>

using namespace cylchain;
using namespace std;

namespace {

/** The largest change of a depth in the last iteration, over its thermal fluctuation. */
const double TOLERANCE_OF_DEPTH = 0.1;
/** The largest error of a depth that turning leaves, over the same. */
const double TOLERANCE_OF_CURVATURE = 0.07;
/** Without noise: by which angle the last iteration may turn what is held, and by how many nm a depth may change. */
const double OF_TURN_ON_SURFACE = 1e-2, LEAST_CHANGE_OF_DEPTH = 1e-7;
/** Without noise: the largest change of a depth over that of the whole step. */
const double OF_WHOLE_CHANGE = 1e-3;
/** The largest stiffness on a curved surface or beside gaps, over the friction in a step, in single precision. */
const double LARGEST_RATE_ON_SURFACE = 1e3;
/** As for links that turn: above this stiffness over the friction in a step, packs do not rest. */
const double LARGEST_RATE_OF_RESTS = 200;
/** The largest part of what resists turning that a push away from the middle takes away in an iteration. */
const double LARGEST_PUSH = 0.8;
/** The largest share by which the response along J is not that of the depth. */
const double LARGEST_RATIO_ON_SURFACE = 1.4;
const double LEAST_GRADIENT = 1e-30;
/** Particles that a thread looks at together. */
const int CHUNK_OF_HELD_PARTICLES = 64;

double largestOf(const double* matrix) {
    return max(matrix[0], max(matrix[3], matrix[5]));
}

} // namespace

void SurfaceEquations::setWalls(const WallSystem* newSystem, CouplingImpulses* newImpulses) {
    system = newSystem;
    impulses = newImpulses;
    turns = !isFlat(system->wall);
}

bool SurfaceEquations::needDoublePrecision(const ChainPlaces& places, double step, bool besideGaps) const {
    const double rate = system->stiffness*step;
    if (!(turns || besideGaps) || !(rate > LARGEST_RATE_ON_SURFACE*places.getLeastFriction()))
        return false;
    return any_of(system->particles.begin(), system->particles.end(), [&] (const WallParticle& particle) {
        PlaceOnChain found;
        return places.find(particle.getPlace(), found) &&
                rate > LARGEST_RATE_ON_SURFACE*places.getFriction(found);
    });
}

void SurfaceEquations::begin(const CoupledStart& start, const Loop& newLoop) {
    loop = &newLoop;
    active = &start.active;
    begun = start.positions;
    kT = start.settings.kT;
    stepSize = start.settings.stepSize;
    states.clear();
    for (size_t i = 0; i < system->particles.size() && system->stiffness > 0; i++) {
        State state;
        state.particle = i;
        if (!start.places.find(system->particles[i].getPlace(), state.place) || !start.takes(state.place))
            continue;
        // Those of a chain stand together.
        if (!states.empty() && states.back().place.chain == state.place.chain)
            state.alone = states.back().alone = false;
        states.push_back(state);
    }
    runInChunks(*loop, states.size(), CHUNK_OF_HELD_PARTICLES, [&] (int i) {
        describe(start, states[i]);
    });
    largestStiffness = 0;
    for (const State& state : states)
        largestStiffness = max(largestStiffness, stepSize*system->stiffness/state.friction);
    drawNoise(start);
}

void SurfaceEquations::describe(const CoupledStart& start, State& state) const {
    const WallParticle& own = system->particles[state.particle];
    copy_n(positionOf(own, begun).at, 3, state.start);
    state.friction = start.places.getFriction(state.place);
    const double theta = max(0.5, 1-state.friction/(stepSize*system->stiffness));
    double gradient[3];
    const double depth = findDepth(system->wall, 0, state.start, own.radius, gradient);
    state.response = system->stiffness*theta;
    state.constant = system->stiffness*(1-theta)*depth;
    if (turns)
        findCurvature(system->wall, state.start, state.curvature);
}

void SurfaceEquations::drawNoise(const CoupledStart& start) {
    if (kT == 0)
        return;
    const NoiseKey key = {(uint32_t) start.settings.seed, (uint32_t) start.settings.level, start.settings.step};
    const size_t count = states.size();
    vector<uint32_t> forces(count, force), particles(count);
    vector<double> normals(4*count);
    for (size_t i = 0; i < count; i++)
        particles[i] = system->particles[states[i].particle].particle;
    drawNormals(key, NoiseKind::Link, forces.data(), particles.data(), count, normals.data());
    const double k = system->stiffness, size = sqrt(kT/k);
    for (size_t i = 0; i < count; i++)
        states[i].constant -= k*sqrt(2*states[i].response/k-1)*size*normals[4*i];
}

void SurfaceEquations::linearise(int, const double* moved, vector<CouplingEquation>& equations) {
    selected.clear();
    for (size_t i = 0; i < states.size(); i++)
        if ((*active)[states[i].place.pack])
            selected.push_back(i);
    const size_t first = equations.size();
    equations.resize(first+selected.size());
    runInChunks(*loop, selected.size(), CHUNK_OF_HELD_PARTICLES, [&] (int i) {
        linearise(states[selected[i]], moved, equations[first+i]);
    });
}

void SurfaceEquations::linearise(State& state, const double* moved, CouplingEquation& equation) const {
    const WallParticle& own = system->particles[state.particle];
    const WallPosition position = positionOf(own, moved);
    equation.places[0] = state.place;
    equation.places[1] = PlaceOnChain();
    double gradient[3];
    const double depth = findDepth(system->wall, 0, position.at, own.radius, gradient);
    double* const J = state.direction;
    findMeanGradient(system->wall, state.start, position.at, J);
    state.tension = state.response*depth+state.constant;
    state.slope = state.response;
    fill_n(state.metric, 3, 0.0);
    double* const K = equation.stiffness;
    setOuter(state.slope, J, K);
    if (turns) {
        double curvature[6];
        findCurvature(system->wall, position.at, curvature);
        state.slope *= describeMetric(state, curvature, gradient);
        setOuter(state.slope, J, K);
        // J turns by half of what the gradient does. A push away from the middle lets it turn, up to a part of what
        // resists. What others on the same chain do is not known.
        const double size = 0.5*largestOf(curvature);
        const double least = state.compliant && state.alone ?
                -LARGEST_PUSH/max(size*largestOf(state.compliance), LEAST_GRADIENT) : 0;
        const double turning = 0.5*max(least, state.multiplier);
        for (int k = 0; k < 6; k++)
            K[k] += turning*curvature[k];
    }
    for (int k = 0; k < 3; k++)
        equation.force[k] = state.metric[k]-state.tension*J[k];
}

void SurfaceEquations::setCompliances(const double* compliances) {
    for (size_t i = 0; i < selected.size(); i++) {
        State& state = states[selected[i]];
        const double *own = compliances+12*i, *J = state.direction;
        // The compliance is that with the stiffness of this coupling at the place.
        double along[3], outer[6];
        multiply(own, J, along);
        const double largest = 1+state.response*stepSize/state.friction;
        const double without = 1/max(1/largest, 1-state.response*dot(J, along));
        setOuter(state.response*without, along, outer);
        for (int k = 0; k < 6; k++)
            state.compliance[k] = own[k]+outer[k];
        const double size = max(sqrt(dot(J, J)), LEAST_GRADIENT);
        for (int k = 0; k < 3; k++)
            state.first[k] = J[k]/size;
        multiply(state.compliance, state.first, state.firstResponse);
        state.compliant = true;
    }
}

/**
 * Find the metric force, and by how much the response along J must be larger than that of the depth, so that a force
 * along J changes the depth as it does.
 */
double SurfaceEquations::describeMetric(State& state, const double* curvature, const double* gradient) const {
    if (!state.compliant)
        return 1;
    const double* const J = state.direction;
    double response[3], mean[6];
    // Others of the chain turn as it does, and with them what resists.
    if (state.alone)
        multiply(state.compliance, J, response);
    else
        turnResponse(J, state.first, state.firstResponse, response);
    for (int k = 0; k < 6; k++)
        mean[k] = 0.5*(state.curvature[k]+curvature[k]);
    const double along = dot(J, response), size = kT*state.response/(1+state.response*along);
    multiply(mean, response, state.metric);
    for (double& component : state.metric)
        component *= -size;
    if (state.alone || !(along > 0))
        return 1;
    return min(LARGEST_RATIO_ON_SURFACE, max(1/LARGEST_RATIO_ON_SURFACE, dot(gradient, response)/along));
}

bool SurfaceEquations::isUnfinished(State& state, const double* move, const double* moved) const {
    const double* const J = state.direction;
    const double along = dot(J, move);
    state.multiplier = state.tension+state.slope*along;
    for (int k = 0; k < 3; k++)
        state.pull[k] = state.metric[k]-state.multiplier*J[k];
    const WallPosition position = positionOf(system->particles[state.particle], moved);
    double whole = 0;
    for (int k = 0; k < 3; k++)
        whole += (position.at[k]-state.start[k])*(position.at[k]-state.start[k]);
    const double least = LEAST_CHANGE_OF_DEPTH*LEAST_CHANGE_OF_DEPTH+
            (kT == 0 ? OF_WHOLE_CHANGE*OF_WHOLE_CHANGE*whole : 0);
    const double fluctuation = kT/state.response;
    const double before = exchange(state.changeBefore, along*along);
    state.change = along*along;
    if (!isLastChange(along*along, before, TOLERANCE_OF_DEPTH*TOLERANCE_OF_DEPTH*fluctuation+least))
        return true;
    if (!turns)
        return false;
    double curvature[6], turned[3];
    findCurvature(system->wall, position.at, curvature);
    multiply(curvature, move, turned);
    // Written so that NaN is too much.
    if (kT == 0)
        return !(dot(turned, turned) <= OF_TURN_ON_SURFACE*OF_TURN_ON_SURFACE);
    const double error = 0.5*dot(turned, move)/TOLERANCE_OF_CURVATURE;
    return !(error*error <= fluctuation+least);
}

bool SurfaceEquations::finishIteration(const double* moves, const double* moved) {
    runInChunks(*loop, selected.size(), CHUNK_OF_HELD_PARTICLES, [&] (int i) {
        State& state = states[selected[i]];
        state.unfinished = isUnfinished(state, moves+3*i, moved);
    });
    return any_of(states.begin(), states.end(), [] (const State& state) {return state.unfinished;});
}

Rests SurfaceEquations::getRests() const {
    return turns && largestStiffness > LARGEST_RATE_OF_RESTS ? Rests::Wrong : Rests::Possible;
}

bool SurfaceEquations::markUnfinished(PackFlags& packs) const {
    for (const State& state : states)
        if (state.unfinished)
            packs[state.place.pack] = 1;
    return true;
}

void SurfaceEquations::findFailures(const double*, vector<bool>& failed) {
    for (const State& state : states)
        if (state.unfinished)
            failed[state.place.chain] = true;
}

bool SurfaceEquations::findCulprit(const double*, const CouplingEquation*, BrokenCoupling& culprit) const {
    // The one that is farthest from its solution.
    const State* found = nullptr;
    for (const State& state : states)
        if (state.unfinished && (found == nullptr || state.change > found->change))
            found = &state;
    if (found == nullptr)
        return false;
    culprit.places[0] = describePlace(found->place);
    return true;
}

void SurfaceEquations::findPushes(const double*, vector<Push>& pushes) const {
    for (const State& state : states) {
        pushes.push_back(pushOfWall(*system, state.particle, 0, state.multiplier, state.direction));
        copy_n(state.pull, 3, pushes.back().force);
        pushes.back().chains[0] = state.place.chain;
    }
}
