#include "kinetics/LinkerKinetics.h"
#include "lanes/Noise.h"
#include "mechanics/SymmetricMatrices.h"
#include <algorithm>
#include <cmath>
#include <cstddef>

using namespace cylchain;
using namespace std;

namespace {

/** Levels of noise: the events of linkers are at level 0. */
const uint32_t LEVEL_OF_DIFFUSION = 30, LEVEL_OF_RELEASE = 29, LEVEL_OF_ENDS = 28, LEVEL_OF_SLIDING = 27,
        LEVEL_OF_BARRIERS = 26;
/** Near a wall, of where a linker is put whose hand had to let go. */
const int MOST_TRIES = 100;
/** Of a word of 32 bits. */
const double WORD = 0x1p-32;

} // namespace

/**
 * The rate at which a hand of a linker that diffuses binds, for each length of chains within its reach. The rate for
 * each concentration is the same for both hands, and that of linkers without positions.
 */
double LinkerKinetics::freeRate(const LinkerType& type, int side) const {
    if (!type.mayBind(side, false))
        return 0;
    const Hand& own = system.hands[type.hands[side]];
    const double ratio = system.hands[type.hands[1-side]].reach/own.reach;
    return own.bindingRate*(type.planar ? ratio : ratio*sqrt(ratio));
}

/**
 * Move the linkers of a chunk that are free. Each coordinate moves by a number with a uniform distribution and the
 * variance 2 D h. Moves that would leave the region are not made, so that all of it stays equally likely.
 */
void LinkerKinetics::diffuse(LinkerState& state, const KineticStep& step, int first, int last) const {
    uint32_t numbers[CHUNK], forces[CHUNK], words[4*CHUNK];
    int indices[CHUNK], count = 0;
    for (int i = first; i < last; i++)
        if (kinds[watches[i].kind].isFree) {
            indices[count] = i;
            forces[count] = step.force;
            // Where a linker that is free has its number.
            numbers[count++] = static_cast<uint32_t>(watches[i].where);
        }
    if (count == 0)
        return;
    const NoiseKey key = {step.seed, LEVEL_OF_DIFFUSION, state.steps};
    drawWords(key, NoiseKind::Linker, 0, forces, numbers, count, words);
    for (int n = 0; n < count; n++) {
        const int own = watches[indices[n]].kind;
        const Kind& kind = kinds[own];
        const LinkerRegion region(system.wallsOf(system.types[own/4]), step.boxes.distances);
        double* const position = &state.positions[3*indices[n]];
        double moved[3];
        for (int k = 0; k < 3; k++)
            moved[k] = position[k]+kind.width*((words[4*n+k]+0.5)*WORD-0.5);
        if (kind.isPlanar)
            moved[2] = position[2];
        if (region.encloses(moved))
            copy(moved, moved+3, position);
        else if (!region.encloses(position)) {
            // Walls have moved.
            RandomNumbers random({step.seed, LEVEL_OF_RELEASE, state.steps}, step.force, numbers[n]);
            region.draw(random, kind.isPlanar, position);
        }
    }
}

/** Propose a place to a hand of a linker that is free: all of them within its reach are as likely. */
bool LinkerKinetics::proposeToFree(const Linker& linker, const double* position, int side, const KineticStep& step,
        RandomNumbers& random, const Sites* sites, HandPlace& found) const {
    const int number = system.types[linker.type].hands[side];
    const double which = random.uniform(), where = random.uniform();
    const SegmentCells::Around around = cells.lookAround(position);
    const int chosen = static_cast<int>(which*countAroundFree(linker.type, position));
    if (chosen >= around.numPieces || !toProposed(number, cells.getAround(around, chosen), where, sites, found))
        return false;
    double vector[3];
    vectorTo(found, position, step, vector);
    const double reach = system.hands[number].reach;
    return dot(vector, vector) <= reach*reach;
}

/**
 * Find where a linker is when its last hand unbinds: anywhere within its reach, as it binds from there. Where that is
 * beyond a wall it does not unbind now, so that both ways stay equally likely.
 */
bool LinkerKinetics::findRelease(const Linker& linker, int side, const KineticStep& step, RandomNumbers& random,
        double* position) const {
    const LinkerType& type = system.types[linker.type];
    const double reach = system.hands[type.hands[side]].reach;
    double center[3];
    locate(placeOf(linker, side), step.positions, step.boxes.segments, center);
    drawAround(random, center, reach, type.planar, position);
    const LinkerRegion region(system.wallsOf(type), step.boxes.distances);
    if (region.encloses(position))
        return true;
    // A hand that was carried away from all places where it could let go.
    return region.isBeyond(center, reach) && region.draw(random, type.planar, position);
}

/**
 * Put a linker somewhere whose last hand has let go because a chain has ended, within reach of where it was.
 *
 * @param before    what the hand held
 * @param contours  of the chains then
 */
void LinkerKinetics::release(LinkerState& state, size_t index, int side, const HandPlace& before,
        const Contours& contours, const KineticStep& step, RandomNumbers& random) const {
    const LinkerType& type = system.types[state.linkers[index].type];
    const LinkerRegion region(system.wallsOf(type), step.boxes.distances);
    double* const position = &state.positions[3*index];
    double center[3];
    locate(contours.findPlace(before.chain, before.position), step.positions, step.boxes.segments, center);
    for (int i = 0; i < MOST_TRIES; i++) {
        drawAround(random, center, system.hands[type.hands[side]].reach, type.planar, position);
        if (region.encloses(position))
            return;
    }
    region.draw(random, type.planar, position);
}

/** The hands of a linker walk; one that diffuses may be free then. */
void LinkerKinetics::walkOne(LinkerState& state, size_t index, const KineticStep& step, Count& count) {
    Linker& linker = state.linkers[index];
    const int side = linker.hands[0].isBound() ? 0 : 1;
    const HandPlace before = linker.hands[side];
    if (kinds[watches[index].kind].slides) {
        RandomNumbers random({step.seed, LEVEL_OF_SLIDING, state.steps}, step.force, linker.number);
        slide(linker, step, random, count);
        watches[index] = watch(linker);
    }
    if (kinds[watches[index].kind].walks) {
        RandomNumbers random({step.seed, LEVEL_OF_BARRIERS, state.steps}, step.force, linker.number);
        walkAll(linker, step, watches[index], random, count);
    }
    if (system.isFree(linker)) {
        RandomNumbers random({step.seed, LEVEL_OF_RELEASE, state.steps}, step.force, linker.number);
        release(state, index, side, before, contours, step, random);
    }
}

/** Chains have grown or shrunk: a linker that diffuses may be free then. */
void LinkerKinetics::releaseFromEnd(LinkerState& state, size_t index, const HandPlace* held, const Contours& before,
        const KineticStep& step) const {
    const Linker& linker = state.linkers[index];
    const int side = held[0].isBound() ? 0 : 1;
    if (!held[side].isBound() || !system.isFree(linker))
        return;
    RandomNumbers random({step.seed, LEVEL_OF_ENDS, state.steps}, step.force, linker.number);
    release(state, index, side, held[side], before, step, random);
}
