#include "dynamics/ChainPieces.h"
#include "dynamics/PackFilling.h"
#include "mechanics/PeriodicBox.h"
#include <algorithm>
#include <cmath>
#include <cstddef>

using namespace cylchain;
using namespace std;

namespace {

/** Pieces have about so many nodes besides those that they share, so that those of all lanes stay in the cache. */
const int NODES_OF_PIECE = 2000;
/**
 * The nodes that neighbours share, over the decay length, and those of them in the middle in which displacements pass
 * from one piece to the other: eight decay lengths from the end of each.
 */
const double SHARED = 18, JOINED_OF_SHARED = 1/9.0;
const int LEAST_SHARED = 72;
/** A node takes so much longer in all lanes than in one. */
const double LEAST_GAIN = 3;
/**
 * How far pieces may differ where they are joined: what a segment does over its length, and a node over that. These are
 * three tenths of what the last iteration may change, see ImplicitConvergence-inl.h.
 */
const double SEGMENTS_MAY_DIFFER = 0.003, LINEAR_BENDS_MAY_DIFFER = 0.009, NODES_MAY_DIFFER = 0.03;
const double TIGHTER_FOR_STAGES = 0.3;
/** The same of how far segments turn about themselves, in rad. */
const double TURNS_MAY_DIFFER = 0.003;

/** A piece of a chain, with particles of its own. */
Chain pieceOf(const Chain& chain, int first, int nodes, int firstParticle, PieceOfChain& origin) {
    Chain piece;
    for (int node = 0; node < nodes; node++)
        piece.nodes.push_back(firstParticle+node);
    piece.segments.assign(chain.segments.begin()+first, chain.segments.begin()+first+nodes-1);
    piece.joints.assign(chain.joints.begin()+first, chain.joints.begin()+first+nodes-2);
    piece.fixed.assign(chain.fixed.begin()+first, chain.fixed.begin()+first+nodes);
    piece.bending = chain.bending;
    piece.stretching = chain.stretching;
    piece.nodeFriction = chain.nodeFriction;
    piece.planar = chain.planar;
    if (chain.twist.isPresent()) {
        const ChainTwist& twist = chain.twist;
        ChainTwist& own = piece.twist;
        own.stiffness.assign(twist.stiffness.begin()+first, twist.stiffness.begin()+first+nodes-2);
        own.rest.assign(twist.rest.begin()+first, twist.rest.begin()+first+nodes-2);
        own.friction.assign(twist.friction.begin()+first, twist.friction.begin()+first+nodes-1);
        if (first == 0)
            own.ends[0] = twist.ends[0];
        if (first+nodes == (int) chain.nodes.size())
            own.ends[1] = twist.ends[1];
    }
    for (size_t number = 0; number < chain.tethers.size(); number++) {
        Tether tether = chain.tethers[number];
        tether.node -= first;
        if (tether.node >= 0 && tether.node < nodes) {
            piece.tethers.push_back(tether);
            origin.tethers.push_back(number);
        }
    }
    return piece;
}

/** Copy three numbers for each of some particles to places that follow each other. */
void copyTo(double* places, const double* values, const int* particles, int count) {
    for (int i = 0; i < count; i++)
        copy_n(values+3*particles[i], 3, places+3*i);
}

} // namespace

int PieceLayout::firstNode(int piece) const {
    return pieces == 1 ? 0 : (long long) piece*(nodes-nodesOfPiece)/(pieces-1);
}

int PieceLayout::firstJoined(int piece, int overlap) const {
    // It is in the middle of what they share.
    const int moved = firstNode(piece)-firstNode(piece-1), joined = min(moved, (int) (JOINED_OF_SHARED*overlap));
    return firstNode(piece)+(nodesOfPiece-moved-joined)/2;
}

int PieceLayout::endOfJoined(int piece, int overlap) const {
    const int moved = firstNode(piece)-firstNode(piece-1);
    return firstJoined(piece, overlap)+min(moved, (int) (JOINED_OF_SHARED*overlap));
}

struct ChainPieces::Cut {
    int overlap, lanes;
    vector<PieceLayout> layouts;
    /** Pieces of all chains, in their order; each of them has its own particles, which follow those of the last. */
    unique_ptr<ChainEngine> engine;
    vector<double> positions, forces, displacements;
    /** One for each node of each piece: see StepSettings. */
    vector<double> twistChanges, turns;
};

ChainPieces::ChainPieces(const vector<Chain>& all, const vector<int>& members, int lanes, int wideLanes) :
        lanes(lanes), wideLanes(wideLanes), numbers(members) {
    for (int member : members)
        chains.push_back(all[member]);
    response = responseOf(chains);
}

ChainPieces::~ChainPieces() {
}

ChainPieces::Response ChainPieces::responseOf(const vector<Chain>& chains) {
    Response result = {HUGE_VAL, HUGE_VAL, 0, 0, 0, 0, 0, HUGE_VAL, chains[0].planar ? 1 : 2};
    // The segments at the ends may be unlike all others, and no piece ends there.
    for (const Chain& chain : chains)
        for (size_t s = 1; s+1 < chain.segments.size(); s++) {
            const Segment& segment = chain.segments[s];
            const double length = segment.restLength, square = length*chain.segments[s-1].restLength;
            const double joint = chain.joints[s-1];
            const bool linear = isLinear(chain.bending);
            result.along = min(result.along, segment.parallel+chain.nodeFriction);
            result.across = min(result.across, segment.perpendicular+chain.nodeFriction);
            result.length = max(result.length, segment.stiffness);
            result.lengthFriction = max(result.lengthFriction, segment.extensional/(length*length));
            result.bend = max(result.bend, linear ? joint : joint/square);
            result.angle = max(result.angle, linear ? joint*square : joint);
            if (chain.twist.isPresent()) {
                result.twist = max(result.twist, chain.twist.stiffness[s-1]);
                result.turn = min(result.turn, chain.twist.friction[s]);
            }
        }
    return result;
}

double ChainPieces::Response::decayLength(const StepSettings& settings) const {
    const double h = settings.stepSize, friction = across/h;
    // A force T on a segment makes it shorter by T/(k+friction of the length), and by the mean square bend times how
    // far a force across the chain moves a node.
    const double bends = min(2.0, dimensions*settings.kT/angle);
    const double node = 1/(friction+2*sqrt(2.0)*pow(friction, 0.75)*pow(bend, 0.25));
    const double ofTension = 1/sqrt(along/h*(1/(length+lengthFriction/h)+bends*node));
    // Turns by a torque solve the difference equation of a chain of joints.
    const double joint = max(0.5, 1-turn/(4*h*twist))*twist;
    const double ofTwist = twist > 0 ? 1/acosh(1+0.5*turn/(h*joint)) : 0;
    return max(max(ofTension, ofTwist), sqrt(2.0)*pow(bend/friction, 0.25));
}

PieceLayout ChainPieces::layoutFor(int nodes, int chains, int overlap, int lanes) {
    const long long all = (long long) nodes*chains, registers = (long long) NODES_OF_PIECE*lanes;
    const int packs = max(1LL, (all+registers/2)/registers);
    const int pieces = max(1, packs*lanes/chains);
    return {nodes, pieces, (int) ((nodes+(pieces-1LL)*overlap+pieces-1)/pieces)};
}

double ChainPieces::costOf(const PieceLayout& layout, int chains, int lanes) {
    return (double) ((layout.pieces*chains+lanes-1)/lanes)*layout.nodesOfPiece;
}

bool ChainPieces::mayBeUsed(const vector<Chain>& chains, const vector<int>& members, int wideLanes) {
    const Chain& longest = chains[members[0]];
    const int nodes = longest.nodes.size(), count = members.size();
    return !longest.closed && !longest.twist.isBentAtRest() &&
            LEAST_GAIN*costOf(layoutFor(nodes, count, LEAST_SHARED, wideLanes), count, wideLanes) <= nodes;
}

int ChainPieces::overlapFor(const StepSettings& settings) const {
    const int longest = chains[0].nodes.size();
    const double needed = SHARED*response.decayLength(settings), shared = max((double) LEAST_SHARED, needed);
    // Written so that NaN is too many.
    if (!(needed < longest))
        return longest;
    // A step that changes a little need not be cut in another way.
    int grain = 1;
    while (16*grain <= shared)
        grain *= 2;
    return (int) ceil(shared/grain)*grain;
}

bool ChainPieces::isUsed(const StepSettings& settings) const {
    // In a periodic flow, all of a chain belongs to the image of its first node.
    if (!isImplicit(settings.scheme) || settings.segmentForces != NULL || settings.turnedPairs != NULL ||
            (settings.flow.present && settings.flow.box != NULL))
        return false;
    const int longest = chains[0].nodes.size(), count = chains.size(), lanes = lanesOfStep(settings);
    return LEAST_GAIN*costOf(layoutFor(longest, count, overlapFor(settings), lanes), count, lanes) <= longest;
}

ChainPieces::Cut& ChainPieces::cutFor(const StepSettings& settings) {
    const lock_guard<mutex> lock(cutting);
    const int overlap = overlapFor(settings), lanes = lanesOfStep(settings);
    if (cut && cut->overlap == overlap && cut->lanes == lanes)
        return *cut;
    cut.reset(new Cut());
    cut->overlap = overlap;
    cut->lanes = lanes;
    vector<Chain> pieces;
    vector<PieceOfChain> origins;
    int particles = 0;
    for (size_t i = 0; i < chains.size(); i++) {
        const PieceLayout layout = layoutFor(chains[i].nodes.size(), chains.size(), overlap, lanes);
        cut->layouts.push_back(layout);
        for (int piece = 0; piece < layout.pieces; piece++, particles += layout.nodesOfPiece) {
            const int first = layout.firstNode(piece);
            origins.push_back({numbers[i], first, {}});
            pieces.push_back(pieceOf(chains[i], first, layout.nodesOfPiece, particles, origins.back()));
        }
    }
    cut->engine.reset(new ChainEngine(pieces, origins));
    for (vector<double>* values : {&cut->positions, &cut->forces, &cut->displacements})
        values->resize(3*(size_t) particles);
    for (vector<double>* values : {&cut->twistChanges, &cut->turns})
        values->resize(chains[0].twist.isPresent() ? particles : 0);
    return *cut;
}

bool ChainPieces::isMixed(const StepSettings& settings) {
    const ChainEngine& engine = *cutFor(settings).engine;
    return engine.getNumMixedChains(engine.getPacksOfStep(settings), settings) > 0;
}

vector<vector<bool> > ChainPieces::findJoined(const StepSettings& settings) {
    const Cut& own = cutFor(settings);
    vector<vector<bool> > result;
    for (size_t i = 0; i < chains.size(); i++) {
        const PieceLayout& layout = own.layouts[i];
        result.emplace_back(layout.nodes);
        for (int piece = 1; piece < layout.pieces; piece++)
            fill(result[i].begin()+layout.firstJoined(piece, own.overlap),
                    result[i].begin()+layout.endOfJoined(piece, own.overlap), true);
    }
    return result;
}

bool ChainPieces::step(const double* positions, const double* forces, const double* box, const StepSettings& settings,
        double* displacements, Instability& result) {
    Cut& own = cutFor(settings);
    size_t place = 0;
    for (size_t i = 0; i < chains.size(); i++) {
        const PieceLayout& layout = own.layouts[i];
        for (int piece = 0; piece < layout.pieces; piece++, place += 3*layout.nodesOfPiece) {
            const int* const particles = &chains[i].nodes[layout.firstNode(piece)];
            copyTo(&own.positions[place], positions, particles, layout.nodesOfPiece);
            copyTo(&own.forces[place], forces, particles, layout.nodesOfPiece);
        }
    }

    StepSettings undivided = settings;
    undivided.mayDivide = false;
    undivided.twistChangesOfPieces = own.twistChanges.data();
    undivided.turnsOfPieces = own.turns.data();
    result = Instability();
    for (int pack : own.engine->getPacksOfStep(settings)) {
        const Instability found = own.engine->step(pack, own.positions.data(), own.forces.data(), box, undivided,
                own.displacements.data());
        if (found.chain >= 0)
            return false;
        result.iterations = max(result.iterations, found.iterations);
    }

    place = 0;
    for (size_t i = 0; i < chains.size(); i++) {
        const PieceLayout& layout = own.layouts[i];
        for (int piece = 0; piece < layout.pieces; piece++, place += 3*layout.nodesOfPiece) {
            const int first = layout.firstNode(piece);
            const double* const found = &own.displacements[place];
            int begin = 0;
            if (piece > 0) {
                const int moved = first-layout.firstNode(piece-1), joined = layout.firstJoined(piece, own.overlap);
                begin = layout.endOfJoined(piece, own.overlap)-first;
                const double* const behind = found+3*(joined-first);
                if (!join(chains[i], joined, first+begin-joined, settings.scheme,
                        behind-3*(layout.nodesOfPiece-moved), behind, displacements))
                    return false;
            }
            for (int node = begin; node < layout.nodesOfPiece; node++)
                copy_n(found+3*node, 3, displacements+3*chains[i].nodes[first+node]);
        }
        const size_t firstPlace = place/3-(size_t) layout.pieces*layout.nodesOfPiece;
        if (chains[i].twist.isPresent() && !joinTwists(chains[i], layout, own.overlap, &own.twistChanges[firstPlace],
                &own.turns[firstPlace], positions, box, displacements, (*settings.twistChanges)[numbers[i]]))
            return false;
    }
    return true;
}

bool ChainPieces::joinTwists(const Chain& chain, const PieceLayout& layout, int overlap, const double* ofPieces,
        const double* turns, const double* positions, const double* box, const double* displacements,
        vector<double>& changes) {
    auto findSegment = [&] (int s, double* vector, double* newVector) {
        const int a = 3*chain.nodes[s], b = 3*chain.nodes[s+1];
        for (int k = 0; k < 3; k++)
            vector[k] = positions[b+k]-positions[a+k];
        if (box != NULL)
            takeToNearestImage(vector, box);
        for (int k = 0; k < 3; k++)
            newVector[k] = vector[k]+(displacements[b+k]-displacements[a+k]);
    };
    for (int piece = 0; piece < layout.pieces; piece++) {
        const int nodes = layout.nodesOfPiece, first = layout.firstNode(piece);
        const double* const own = turns+(size_t) piece*nodes-first;
        int begin = first;
        if (piece > 0) {
            const double* const before = turns+(size_t) (piece-1)*nodes-layout.firstNode(piece-1);
            const int joined = layout.firstJoined(piece, overlap), end = layout.endOfJoined(piece, overlap);
            const int middle = (joined+end)/2;
            begin = end+1;
            double vectors[2][3], newVectors[2][3];
            findSegment(joined-2, vectors[0], newVectors[0]);
            for (int s = joined-1; s < begin; s++) {
                const int here = (s-joined) & 1, other = 1-here;
                findSegment(s, vectors[here], newVectors[here]);
                // Written so that NaN is too much.
                if (!(fabs(own[s]-before[s]) <= TURNS_MAY_DIFFER))
                    return false;
                changes[s] = (s < middle ? before : own)[s]-(s-1 < middle ? before : own)[s-1]+
                        bestKernels().findSweptArea(vectors[other], vectors[here], newVectors[other], newVectors[here]);
            }
        }
        const double* const found = ofPieces+(size_t) piece*nodes;
        copy(found+(begin-first), found+nodes, changes.begin()+begin);
    }
    return true;
}

bool ChainPieces::join(const Chain& chain, int first, int count, Scheme scheme, const double* before,
        const double* behind, double* displacements) {
    const double stages = scheme == Scheme::ImplicitSecondOrder ? TIGHTER_FOR_STAGES : 1;
    const double segments = stages*(isLinear(chain.bending) ? LINEAR_BENDS_MAY_DIFFER : SEGMENTS_MAY_DIFFER);
    const double nodes = stages*NODES_MAY_DIFFER;
    double last[3] = {};
    for (int node = 0; node < count; node++) {
        const double share = (node+1.0)/(count+1);
        double ofNode = 0, ofSegment = 0;
        for (int k = 0; k < 3; k++) {
            const double difference = behind[3*node+k]-before[3*node+k];
            displacements[3*chain.nodes[first+node]+k] = before[3*node+k]+share*difference;
            ofNode += difference*difference;
            ofSegment += (difference-last[k])*(difference-last[k]);
            last[k] = difference;
        }
        const double length = chain.segments[first+node].restLength, square = length*length;
        // Written so that NaN is too much.
        if (!(ofNode <= nodes*nodes*square) || (node > 0 && !(ofSegment <= segments*segments*square)))
            return false;
    }
    return true;
}
