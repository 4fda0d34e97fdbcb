#include "networks/WallEquations.h"
#include "dynamics/LastChange.h"
#include "mechanics/SymmetricMatrices.h"
#include "networks/PlaceResponses.h"
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <utility>

using namespace cylchain;
using namespace std;

namespace {

/** The largest change of a depth in the last iteration, over the depth that thermal motion gets to. */
const double TOLERANCE_OF_DEPTHS = 0.3;
/** The same in nm, where nothing moves thermally. */
const double LEAST_TOLERANCE = 1e-7;
/** The number of iterations that know of no walls: what they lead to is predicted. */
const int FREE_ITERATIONS = 2;
/** The number of iterations that look where faces are. */
const int ITERATIONS_THAT_LOOK_AT_FACES = 10;
/** By how much a tangent plane may be wrong, over the gap below which there is a force. */
const double LARGEST_DEVIATION = 0.1;
/** The largest way beyond a curved face or back from it, over the way to the middle. */
const double LARGEST_WAY_TO_FACE = 0.5;
/** Particles that a thread looks at together. */
const int CHUNK_OF_PARTICLES = 256;

} // namespace

void WallEquations::setWalls(const WallSystem* newSystem) {
    system = newSystem;
    numFaces = countFaces(system->wall);
}

void WallEquations::begin(const CoupledStart& start, const Loop& newLoop) {
    loop = &newLoop;
    active = &start.active;
    begun = start.positions;
    stepSize = start.settings.stepSize;
    wallDepth = findDepthOfWall(start.settings.kT, system->stiffness);
    tolerance = max(LEAST_TOLERANCE, TOLERANCE_OF_DEPTHS*sqrt(start.settings.kT/system->stiffness));
    const size_t count = system->particles.size();
    places.resize(count);
    responses.resize(count);
    together.assign(count, 0);
    PlaceResponses found;
    found.begin(start.places, stepSize);
    parts.resize((count+CHUNK_OF_PARTICLES-1)/CHUNK_OF_PARTICLES);
    (*loop)(parts.size(), [&] (int part) {
        for (size_t i = (size_t) part*CHUNK_OF_PARTICLES; i < min(count, (size_t) (part+1)*CHUNK_OF_PARTICLES); i++) {
            if (start.places.find(system->particles[i].getPlace(), places[i]) && start.taken[places[i].chain]) {
                responses[i] = found.find(places[i]);
                together[i] = found.moveTogether(places[i].chain);
            }
            else
                places[i] = PlaceOnChain();
        }
    });
}

void WallEquations::beginStage(int, int, const double*) {
    reached.assign(places.size(), 0);
    rooms.assign(places.size(), RoomBeforeWall());
    for (Part& part : parts)
        part.states.clear();
}

double WallEquations::findDepthAt(const State& state, const double* positions) const {
    const WallPosition position = positionOf(state.particle, positions);
    const double* y = position.at;
    const double* g = state.gradient;
    return state.offset+g[0]*y[0]+g[1]*y[1]+g[2]*y[2];
}

void WallEquations::linearise(int iteration, const double* moved, vector<CouplingEquation>& equations) {
    iterations = iteration;
    const double own = system->stiffness;
    const size_t first = equations.size();
    for (Part& part : parts)
        for (State& state : part.states) {
            if (!takesPart(state.particle))
                continue;
            const WallParticle& particle = system->particles[state.particle];
            const bool searches = iteration <= ITERATIONS_THAT_LOOK_AT_FACES || state.deviates;
            if (searches) {
                const WallPosition position = positionOf(state.particle, moved);
                const double* y = position.at;
                double* const g = state.gradient;
                const double depth = findDepth(system->wall, state.face, y, particle.radius, g);
                state.offset = depth-(g[0]*y[0]+g[1]*y[1]+g[2]*y[2]);
                // The distance from the middle. Where it is short, there would be more stiffness than steps can have.
                const double distance = depth-particle.radius+system->wall.length;
                const bool turns = isRound(system->wall) && system->wall.side != WallSide::Outside;
                state.curvature = turns ? 1/max(distance, LARGEST_WAY_TO_FACE*system->wall.length) : 0;
            }
            state.equation = -1;
            const double beyond = findDepthAt(state, moved)+state.restGap.get();
            if (!(beyond > 0))
                continue;
            state.equation = equations.size()-first;
            CouplingEquation equation;
            equation.places[0] = places[state.particle];
            const double* g = state.gradient;
            for (int k = 0; k < 3; k++)
                equation.force[k] = -own*beyond*g[k];
            setOuter(own, g, equation.stiffness);
            if (searches)
                addTurning(system->wall, positionOf(state.particle, moved).at, g, state.force*state.curvature,
                        equation.stiffness);
            equations.push_back(equation);
        }
}

RestGap WallEquations::findRestGap(int particle, int face, double depth) const {
    const WallParticle& own = system->particles[particle];
    double gradient[3];
    const double before = findDepth(system->wall, face, positionOf(particle, begun).at, own.radius, gradient);
    const double sign = system->wall.side == WallSide::Outside ? -1 : 1;
    const double largest = isFlat(system->wall) ? HUGE_VAL :
            LARGEST_WAY_TO_FACE*(getRoom(system->wall)-sign*own.radius);
    return RestGap(max(-largest, -depth), min(largest, -before), system->stiffness*responses[particle],
            wallDepth);
}

/** Get whether a neighbour in the chain, with which a particle moves together, is deeper beyond a face. */
bool WallEquations::isBesideDeeper(int particle, int face, double depth, const double* moved) const {
    if (!together[particle])
        return false;
    for (int other : {particle-1, particle+1}) {
        if (other < 0 || other >= (int) places.size() || places[other].pack < 0 ||
                places[other].chain != places[particle].chain)
            continue;
        const WallParticle& own = system->particles[other];
        double gradient[3];
        if (findDepth(system->wall, face, positionOf(other, moved).at, own.radius, gradient) > depth)
            return true;
    }
    return false;
}

void WallEquations::finishPart(int number, const double* moves, const double* moved) {
    Part& part = parts[number];
    part.unfinished.clear();
    for (State& state : part.states) {
        if (!takesPart(state.particle))
            continue;
        const double depth = findDepthAt(state, moved), b = state.restGap.get(), beyond = depth+b;
        if (state.equation < 0) {
            state.unfinished = beyond > tolerance;
            state.changeBefore = 0;
        }
        else {
            const double *g = state.gradient, *move = moves+3*state.equation;
            const double change = g[0]*move[0]+g[1]*move[1]+g[2]*move[2];
            const double before = exchange(state.changeBefore, change*change);
            state.unfinished = !isLastChange(change*change, before, tolerance*tolerance) || !(beyond >= -tolerance);
        }
        state.force = system->stiffness*max(0.0, beyond);
        // The particle may be beyond a curved face, but not beyond its tangent plane elsewhere.
        const WallParticle& own = system->particles[state.particle];
        double gradient[3];
        const double real = findDepth(system->wall, state.face, positionOf(state.particle, moved).at, own.radius,
                gradient);
        state.deviates = !(real+b-max(0.0, beyond) <= max(tolerance, LARGEST_DEVIATION*b));
        state.unfinished |= state.deviates;
        if (!state.unfinished)
            continue;
        state.restGap.correct(-depth);
        part.unfinished.push_back(places[state.particle].pack);
    }
    const int count = places.size();
    for (int i = number*CHUNK_OF_PARTICLES; i < min(count, (number+1)*CHUNK_OF_PARTICLES); i++) {
        if (!takesPart(i))
            continue;
        const WallParticle& own = system->particles[i];
        const WallPosition position = positionOf(i, moved);
        if (rooms[i].holds(position.at))
            continue;
        double deepest = -HUGE_VAL;
        for (int face = 0; face < numFaces; face++) {
            if ((reached[i]>>face)&1)
                continue;
            State state;
            state.particle = i;
            state.face = face;
            const double depth = findDepth(system->wall, face, position.at, own.radius, state.gradient);
            deepest = max(deepest, depth);
            // What is beyond a face later on has been pushed there or was beside what was deeper: no prediction.
            const bool predicts = iterations < FREE_ITERATIONS;
            if (!(depth > (predicts ? 0 : tolerance)))
                continue;
            state.restGap = findRestGap(i, face, predicts ? depth : 0);
            if (!(depth+state.restGap.get() > (predicts ? 0 : tolerance)))
                continue;
            part.unfinished.push_back(places[i].pack);
            if (iterations < FREE_ITERATIONS-1 || (predicts && isBesideDeeper(i, face, depth, moved)))
                continue;
            reached[i] |= 1<<face;
            const double* y = position.at;
            state.offset = depth-(state.gradient[0]*y[0]+state.gradient[1]*y[1]+state.gradient[2]*y[2]);
            part.states.push_back(state);
        }
        // That of an ellipsoid is no distance.
        if (deepest < 0 && system->wall.shape != WallShape::Ellipsoid) {
            copy_n(position.at, 3, rooms[i].from);
            rooms[i].square = deepest*deepest;
        }
    }
}

bool WallEquations::finishIteration(const double* moves, const double* moved) {
    (*loop)(parts.size(), [&] (int part) {
        finishPart(part, moves, moved);
    });
    return any_of(parts.begin(), parts.end(), [] (const Part& part) {return !part.unfinished.empty();});
}

bool WallEquations::markUnfinished(PackFlags& packs) const {
    for (const Part& part : parts)
        for (int pack : part.unfinished)
            packs[pack] = 1;
    return true;
}

void WallEquations::findFailures(const double* moved, vector<bool>& failed) {
    for (const Part& part : parts)
        for (const State& state : part.states)
            if (state.unfinished)
                failed[places[state.particle].chain] = true;
    for (int i : findPassed(*system, places, begun, moved))
        failed[places[i].chain] = true;
}

bool WallEquations::findCulprit(const double* moved, const CouplingEquation*, BrokenCoupling& culprit) const {
    auto find = [&] (int particle) {
        culprit.places[0] = describePlace(places[particle]);
        return true;
    };
    for (const Part& part : parts)
        for (const State& state : part.states)
            if (state.unfinished)
                return find(state.particle);
    const vector<int> passed = findPassed(*system, places, begun, moved);
    return !passed.empty() && find(passed[0]);
}

void WallEquations::findPushes(const double* moved, vector<Push>& pushes) const {
    for (const Part& part : parts)
        for (const State& state : part.states) {
            if (state.equation < 0)
                continue;
            const double force = system->stiffness*(findDepthAt(state, moved)+state.restGap.get());
            pushes.push_back(pushOfWall(*system, state.particle, state.face, force, state.gradient));
            pushes.back().chains[0] = places[state.particle].chain;
        }
}
