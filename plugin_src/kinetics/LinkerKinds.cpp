#include "kinetics/LinkerKinetics.h"
#include <cmath>
#include <cstddef>
#include <cstdint>

using namespace cylchain;
using namespace std;

namespace {

/** To a linker in a step. */
const double FEW_PROPOSALS = 0.2;

} // namespace

/** Find where the rates of linkers come from, by their types and what they hold. */
void LinkerKinetics::findKinds(const KineticStep& step) {
    kinds.assign(4*system.types.size(), Kind());
    for (size_t number = 0; number < kinds.size(); number++) {
        const LinkerType& type = system.types[number/4];
        const int held = number%4;
        Kind& kind = kinds[number];
        // An anchor always holds its side.
        if (type.hands[0] < 0 && (held&1) == 0)
            continue;
        kind.atAnchor = type.hands[0] < 0 && held == 1;
        kind.sameChain = type.sameChain;
        kind.needsSites = usesSites(type);
        kind.pulls = held == 3;
        kind.isFree = type.diffuses() && held == 0;
        kind.isPlanar = type.planar;
        kind.width = kind.isFree ? 2*sqrt(6*type.diffusion*step.stepSize) : 0;
        bool known = true;
        for (int side = 0; side < 2; side++) {
            if (type.hands[side] < 0)
                continue;
            const Hand& hand = system.hands[type.hands[side]];
            const bool hops = hand.siteSpacing > 0 && hand.speed != 0;
            if ((held&(1<<side)) != 0) {
                const bool dependsOnPlace = hand.atEnd.unbindingRate >= 0;
                if (!dependsOnPlace && (held != 3 || !type.mustStay(side)))
                    kind.rate += unbindingRate(hand, HandPlace(), 0, 0);
                kind.rate += hops ? fabs(hand.speed)/hand.siteSpacing : 0;
                kind.slides = kind.slides || hand.slidingFriction > 0;
                kind.walks = kind.walks || kind.slides || (hand.speed != 0 && !hops);
                kind.velocity = hops ? 0 : hand.speed;
                kind.isStoppedByTorque = kind.isStoppedByTorque || hand.helix.stallTorque > 0;
                // A barrier may hold it.
                const bool mayBeHeld = hand.speed != 0 && !system.barriers.empty();
                known = known && !mayBeHeld && !dependsOnPlace &&
                        (held != 3 || !(hand.isLoaded() || hops || (type.hasAngles() && type.reversible)));
            }
            else if (held != 0)
                kind.perPiece = type.mayBind(side, true) ? proposalRate(hand) : 0;
            else if (kind.isFree)
                kind.perPiece += freeRate(type, side)*cells.getLongest();
            else if (type.concentration < 0)
                kind.rate += captureRate(type, side, step);
        }
        // To look where each of them is would take longer than proposals that come to nothing.
        if (kind.isFree && kind.perPiece*cells.getMostOfAll()*step.stepSize < FEW_PROPOSALS)
            kind.most = cells.getMostOfAll();
        kind.rests = known && !kind.isFree && !kind.atAnchor && !kind.walks && !kind.pulls;
        if (!known)
            kind.rate = -1;
    }
}

LinkerKinetics::Watch LinkerKinetics::watch(const Linker& linker) const {
    const int held = (linker.isHeld(0) ? 1 : 0)+(linker.isHeld(1) ? 2 : 0);
    // That of nothing around.
    Watch watch = {4*linker.type+held, 2*cells.getNumPieces()};
    if (system.isFree(linker)) {
        watch.where = static_cast<int>(linker.number);
        return watch;
    }
    if (held == 0 || held == 3 || !anyBinding)
        return watch;
    const HandPlace& hand = linker.hands[held-1];
    if (hand.isBound()) {
        const int segment = contours.findSegment(hand.chain, hand.position);
        const int piece = cells.findPiece(contours, segment, hand.position-contours.getStart(segment));
        watch.where = system.types[linker.type].sameChain ? piece : cells.getNumPieces()+piece;
    }
    else
        watch.where = linker.anchor;
    return watch;
}

/** Derive what follows from a state, unless it is the one that the last step left. */
void LinkerKinetics::know(LinkerState& state) {
    if (state.knownTo.number == ownNumber && known == &state)
        return;
    known = &state;
    const vector<Linker>& linkers = state.linkers;
    state.clocks.resize(linkers.size(), 0);
    state.positions.resize(anyDiffuses ? 3*linkers.size() : 0, NO_POSITION);
    state.events.resize(system.types.size());
    watches.clear();
    taken.clear();
    for (const Linker& linker : linkers) {
        watches.push_back(watch(linker));
        const LinkerType& type = system.types[linker.type];
        for (int side = 0; side < 2; side++)
            if (linker.hands[side].isBound() && spacings[type.hands[side]] >= 0)
                taken.insert(siteOf(system.hands[type.hands[side]], linker.hands[side]));
    }
    state.knownTo.number = ownNumber;
}

/** Find where anchors are among the cells: points stay where they are as long as the grid does. */
void LinkerKinetics::findMarks(const KineticStep& step) {
    const bool all = gridOfMarks != cells.getGridNumber() || marks.size() != system.anchors.size();
    marks.resize(system.anchors.size());
    for (size_t anchor = 0; anchor < marks.size(); anchor++)
        if (all || !system.anchors[anchor].isPoint()) {
            double place[3];
            locate(system.anchors[anchor], step.positions, step.boxes.segments, place);
            marks[anchor] = cells.findMark(place);
        }
    gridOfMarks = cells.getGridNumber();
}

/** How many pieces are around a linker to which it could bind. */
int LinkerKinetics::countAround(const Watch& watch, const KineticStep& step) const {
    if (!kinds[watch.kind].atAnchor)
        return cells.getNumbersAround()[watch.where];
    if (!cells.isNear(marks[watch.where]))
        return 0;
    double place[3];
    locate(system.anchors[watch.where], step.positions, step.boxes.segments, place);
    return cells.lookAround(place).numPieces;
}
