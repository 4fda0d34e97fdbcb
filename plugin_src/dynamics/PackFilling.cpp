#include "dynamics/PackFilling.h"
#include "dynamics/PackPlaces.h"
#include "lanes/InstructionSet.h"
#include <algorithm>
#include <cmath>
#include <cstddef>

using namespace cylchain;
using namespace std;

namespace {

bool hasSegmentFriction(const Chain& chain) {
    return any_of(chain.segments.begin(), chain.segments.end(), [] (const Segment& segment) {
        return segment.parallel > 0 || segment.perpendicular > 0 || segment.rotational > 0 || segment.extensional > 0;
    });
}

/** Find the friction of a chain against turning if it were straight. */
double frictionOfTurning(const Chain& chain) {
    double length = 0, centre = 0, friction = 0, weight = 0;
    for (const Segment& segment : chain.segments) {
        const double middle = length+0.5*segment.restLength;
        centre += segment.perpendicular*middle;
        weight += segment.perpendicular;
        length += segment.restLength;
    }
    centre /= weight;
    length = 0;
    for (const Segment& segment : chain.segments) {
        const double arm = length+0.5*segment.restLength-centre;
        friction += segment.rotational+segment.perpendicular*arm*arm;
        length += segment.restLength;
    }
    return friction;
}

/** Whether a chain turns as a rod does: its segments have friction, and nothing holds it. */
bool turnsFreely(const Chain& chain) {
    return !chain.closed && isAngular(chain.bending) && hasSegmentFriction(chain) && chain.tethers.empty() &&
            none_of(chain.fixed.begin(), chain.fixed.end(), [] (bool fixed) {return fixed;});
}

void fillLane(ChainPack<double>& pack, PropertyRows<double>& properties, int lane, const Chain& chain, int index) {
    typedef ChainPack<double> Pack;
    const size_t own = chain.nodes.size(), unrolled = own+(chain.closed ? 2 : 0);
    placeChain(pack, lane, chain, index);
    for (size_t node = 0; node < unrolled; node++)
        properties.at(node, Pack::Mobile)[lane] = chain.fixed[node%own] ? 0 : 1;
    pack.free[lane] = any_of(chain.fixed.begin(), chain.fixed.end(), [] (bool fixed) {return fixed;}) ? 0.0 : 1.0;
    // Where joints turn as well, they take half of what a part of a step may turn.
    pack.turning[lane] = turnsFreely(chain) ? (chain.joints.empty() ? 1 : 2)/frictionOfTurning(chain) : 0;
    pack.nodeFriction[lane] = chain.nodeFriction;
    pack.rootNodeFriction[lane] = sqrt(chain.nodeFriction);
    for (size_t node = 1; node < unrolled-1; node++)
        properties.at(node, Pack::Joint)[lane] = chain.joints[chain.closed ? node%own : node-1];
    for (size_t s = 0; s < unrolled-1; s++)
        properties.setSegment(s, lane, chain.segments[s%chain.segments.size()], chain.planar ? 2 : 3);
}

void fillTwist(PackTwist<double>& twist, int lanes, int lane, const Chain& chain) {
    if (!chain.twist.isPresent())
        return;
    const ChainTwist& own = chain.twist;
    const size_t segments = chain.segments.size();
    if (!twist.isPresent()) {
        twist = PackTwist<double>(segments, lanes);
        if (own.isBentAtRest())
            twist.bends.resize(2*(segments+1)*lanes);
    }
    for (size_t s = 0; s < segments; s++)
        twist.friction[s*lanes+lane] = own.friction[s];
    for (size_t joint = 0; joint < own.stiffness.size(); joint++) {
        const size_t node = chain.closed && joint == 0 ? segments : chain.closed ? joint : joint+1;
        twist.stiffness[node*lanes+lane] = own.stiffness[joint];
        twist.rest[node*lanes+lane] = own.rest[joint];
        for (int k = 0; k < 2 && own.isBentAtRest(); k++)
            twist.bends[(2*node+k)*lanes+lane] = own.bends[2*joint+k];
    }
    // Nodes move with segments that do not turn where joints are bent at rest, and share no torque.
    const bool isHeld = !own.isBentAtRest() &&
            (chain.closed || (own.ends[0].stiffness > 0 && own.ends[1].stiffness > 0));
    twist.held[lane] = isHeld;
    twist.isHeld |= isHeld;
    for (int end = 0; end < 2 && !chain.closed; end++) {
        const EndFrame& frame = own.ends[end];
        const double sign = end == 0 ? -1 : 1;
        twist.stiffness[(end == 0 ? 0 : segments)*lanes+lane] = frame.stiffness;
        if (frame.friction > 0) {
            twist.frameMobility[end*lanes+lane] = 1/frame.friction;
            twist.angularVelocity[end*lanes+lane] = sign*frame.torque/frame.friction;
        }
        else {
            twist.angularVelocity[end*lanes+lane] = sign*frame.angularVelocity;
            twist.torque[end*lanes+lane] = sign*frame.torque;
        }
        for (int k = 0; k < 3; k++)
            twist.directions[(3*end+k)*lanes+lane] = frame.direction[k];
    }
    double* const first = &twist.directions[lane];
    if (own.isBentAtRest() && first[0] == 0 && first[lanes] == 0 && first[2*lanes] == 0)
        first[2*lanes] = 1;
}

} // namespace

const ChainKernels& cylchain::bestKernels() {
    static const ChainKernels& best = loopsOfBest<baselineKernels, avx2Kernels, avx512Kernels>();
    return best;
}

bool cylchain::mayShareLanes(const Chain& longest, const Chain& chain, double filling) {
    const size_t most = longest.segments.size();
    const size_t least = longest.closed ? most : ceil((1-filling)*most);
    return hasSegmentFriction(chain) == hasSegmentFriction(longest) &&
            (chain.nodeFriction > 0) == (longest.nodeFriction > 0) && chain.bending == longest.bending &&
            chain.stretching == longest.stretching && chain.closed == longest.closed &&
            chain.planar == longest.planar && chain.twist.isPresent() == longest.twist.isPresent() &&
            chain.twist.isBentAtRest() == longest.twist.isBentAtRest() &&
            chain.segments.size() >= least;
}

template <class Scalar> ChainPack<Scalar> cylchain::packWithoutChains(const PackShape& shape, int lanes) {
    ChainPack<Scalar> pack = emptyPack<Scalar>(shape, lanes);
    pack.free.resize(lanes);
    pack.turning.resize(lanes);
    pack.nodeFriction.resize(lanes);
    pack.rootNodeFriction.resize(lanes);
    return pack;
}

template ChainPack<double> cylchain::packWithoutChains<double>(const PackShape& shape, int lanes);
template ChainPack<float> cylchain::packWithoutChains<float>(const PackShape& shape, int lanes);

ChainPack<double> cylchain::packed(const vector<Chain>& chains, const vector<int>& members, int lanes,
            PropertyTables<double>& tables) {
    if (members.empty()) {
        ChainPack<double> none = packWithoutChains<double>({2, 1, {}, {}, false, false, false, true}, lanes);
        PropertyRows<double>(2, lanes).giveTo(none, tables);
        return none;
    }
    const Chain& longest = chains[members[0]];
    ChainPack<double> pack = packWithoutChains<double>({(int) longest.nodes.size()+(longest.closed ? 2 : 0),
            (int) longest.segments.size(), longest.bending, longest.stretching, longest.closed, longest.planar,
            longest.nodeFriction > 0, hasSegmentFriction(longest)}, lanes);
    PropertyRows<double> properties(pack.nodes, lanes);
    for (size_t lane = 0; lane < members.size(); lane++)
        fillLane(pack, properties, lane, chains[members[lane]], members[lane]);
    for (size_t lane = 0; lane < members.size(); lane++)
        fillTwist(pack.twist, lanes, lane, chains[members[lane]]);
    properties.giveTo(pack, tables);
    sortTethers(pack);
    return pack;
}

void cylchain::setOrigins(ChainPack<double>& pack, const vector<PieceOfChain>& origins) {
    for (LaneTether& tether : pack.tethers)
        tether.number = origins[pack.chain[tether.lane]].tethers[tether.number];
    for (int lane = 0; lane < pack.lanes && pack.chain[lane] >= 0; lane++) {
        const PieceOfChain& origin = origins[pack.chain[lane]];
        pack.firstNode[lane] = origin.firstNode;
        pack.chain[lane] = origin.chain;
    }
}
