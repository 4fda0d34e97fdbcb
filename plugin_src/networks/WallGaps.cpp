#include "networks/WallGaps.h"
#include "mechanics/SymmetricMatrices.h"
#include "networks/PlaceResponses.h"
#include <algorithm>
#include <cmath>
#include <cstddef>

using namespace cylchain;
using namespace std;

namespace {

/** The largest way beyond a curved face or back from it, over the way to the middle. */
const double LEAST_WAY_TO_MIDDLE = 0.5;
/** Particles that a thread looks at together. */
const int CHUNK_OF_WALL_GAPS = 256;

/** How a unit force on a round face turns with it, if that makes steps stiffer. */
void findTurning(const Wall& wall, const double* position, const double* g, double distance, double* turning) {
    if (!isRound(wall) || wall.side == WallSide::Outside)
        return;
    // Where the middle is near, there would be more stiffness than steps can have.
    fill_n(turning, 6, 0.0);
    addTurning(wall, position, g, 0.5/max(distance, LEAST_WAY_TO_MIDDLE*wall.length), turning);
}

} // namespace

void WallGaps::setWalls(const WallSystem* newSystem, CouplingImpulses* newImpulses) {
    hard.setWalls(newSystem);
    system = newSystem;
    impulses = newImpulses;
    numFaces = countFaces(system->wall);
}

void WallGaps::begin(const CoupledStart& start, const Loop& newLoop) {
    loop = &newLoop;
    begun = start.positions;
    kT = start.settings.kT;
    const size_t count = system->particles.size();
    places.resize(count);
    responses.resize(count);
    PlaceResponses found;
    found.begin(start.places, start.settings.stepSize);
    parts.resize((count+CHUNK_OF_WALL_GAPS-1)/CHUNK_OF_WALL_GAPS);
    runInChunks(*loop, count, CHUNK_OF_WALL_GAPS, [&] (int i) {
        if (start.places.find(system->particles[i].getPlace(), places[i]) && start.taken[places[i].chain])
            responses[i] = GAP_RESPONSE_MARGIN*found.find(places[i]);
        else
            places[i] = PlaceOnChain();
    });
}

void WallGaps::beginStage(int, int, const double*) {
    reached.assign(places.size(), 0);
    rooms.assign(places.size(), RoomBeforeWall());
    states.clear();
}

/** Find where a gap is now, and its gradient half-way there. */
void WallGaps::follow(const State& state, const double* moved, Gap& gap) const {
    const double radius = system->particles[state.particle].radius;
    const WallPosition from = positionOf(state.particle, begun), to = positionOf(state.particle, moved);
    double middle[3], gradient[3];
    for (int k = 0; k < 3; k++)
        middle[k] = 0.5*(from.at[k]+to.at[k]);
    gap.end = state.depth-findDepth(system->wall, state.face, to.at, radius, gradient);
    const double depth = findDepth(system->wall, state.face, middle, radius, gradient);
    findTurning(system->wall, middle, gradient, depth-radius+system->wall.length, gap.turning);
    for (int k = 0; k < 3; k++)
        gap.levers[0].gradient[k] = -gradient[k];
}

/** Find gaps of a chunk of particles that may be closed. */
void WallGaps::findNew(int number, const double* moved) {
    Part& part = parts[number];
    part.states.clear();
    part.gaps.clear();
    const int count = places.size();
    for (int i = number*CHUNK_OF_WALL_GAPS; i < min(count, (number+1)*CHUNK_OF_WALL_GAPS); i++) {
        if (places[i].pack < 0)
            continue;
        const double radius = system->particles[i].radius;
        const WallPosition from = positionOf(i, begun), to = positionOf(i, moved);
        if (rooms[i].holds(to.at))
            continue;
        const double least = LARGEST_GAP_EXPONENT*kT*responses[i];
        double room = HUGE_VAL;
        for (int face = 0; face < numFaces; face++) {
            if ((reached[i]>>face)&1)
                continue;
            double gradient[3];
            const double before = -findDepth(system->wall, face, from.at, radius, gradient);
            const double after = -findDepth(system->wall, face, to.at, radius, gradient);
            if (before > 0 && after > 0 && before*after >= least) {
                room = min(room, after-least/before);
                continue;
            }
            room = 0;
            Gap gap;
            gap.levers[0].places[0] = places[i];
            gap.numLevers = 1;
            gap.stiffness = system->stiffness;
            gap.response = responses[i];
            gap.key[0] = (uint32_t) force*0x9E3779B1u+face;
            gap.key[1] = system->particles[i].particle;
            const GapNoise& noise = all->getNoise();
            State state = {i, face, -1,
                    placeHardSurface(kT, noise.getLimit(), noise.drawSurface(gap), HUGE_VAL, before, gap)};
            if (gap.law == GapLaw::Reflection && gap.start*(state.depth+after) >= least)
                continue;
            reached[i] |= 1<<face;
            follow(state, moved, gap);
            part.states.push_back(state);
            part.gaps.push_back(gap);
        }
        // That of an ellipsoid is no distance.
        if (room > 0 && room < HUGE_VAL && system->wall.shape != WallShape::Ellipsoid) {
            copy_n(to.at, 3, rooms[i].from);
            rooms[i].square = room*room;
        }
    }
}

bool WallGaps::findGaps(int, bool, const double* moved, ReflectedGaps& gaps) {
    all = &gaps;
    for (const State& state : states)
        follow(state, moved, gaps.get(state.gap));
    (*loop)(parts.size(), [&] (int part) {
        findNew(part, moved);
    });
    for (Part& part : parts)
        for (size_t i = 0; i < part.states.size(); i++) {
            part.states[i].gap = gaps.add(part.gaps[i]);
            states.push_back(part.states[i]);
        }
    return false;
}

void WallGaps::findFailures(const double* moved, vector<bool>& failed) {
    for (int i : findPassed(*system, places, begun, moved))
        failed[places[i].chain] = true;
}

bool WallGaps::findCulprit(const double* moved, const CouplingEquation*, BrokenCoupling& culprit) const {
    auto find = [&] (int particle) {
        culprit.places[0] = describePlace(places[particle]);
        return true;
    };
    for (const State& state : states)
        if (all->isUnfinished(state.gap))
            return find(state.particle);
    const vector<int> passed = findPassed(*system, places, begun, moved);
    return !passed.empty() && find(passed[0]);
}

void WallGaps::findPushes(const double*, vector<Push>& pushes) const {
    for (const State& state : states) {
        const double force = all->getForce(state.gap);
        if (force == 0)
            continue;
        const double* const towards = all->get(state.gap).levers[0].gradient;
        const double gradient[] = {-towards[0], -towards[1], -towards[2]};
        pushes.push_back(pushOfWall(*system, state.particle, state.face, force, gradient));
        pushes.back().chains[0] = places[state.particle].chain;
    }
}
