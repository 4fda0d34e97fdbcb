#include "dynamics/WidePack.h"
#include "dynamics/PackFilling.h"
#include "dynamics/PackPlaces.h"
#include <algorithm>
#include <cstddef>

using namespace cylchain;
using namespace std;

namespace {

/**
 * Where single precision is right, as measured: see docs/design/implicit_scheme.md. This is for the stiffness of
 * lengths, k l0^2/k_B T.
 */
const double LARGEST_STRETCHING = 1e9;
/** The same for the stiffness of twist over k_B T, times the root of one and how far a segment may turn in a step. */
const double LARGEST_TWISTING = 1e5;
/** The same for the step over the relaxation time of the sharpest bends, 4 h kappa/gamma_rot or 16 h kappa/xi. */
double largestBendingRate(BendKind kind) {
    switch (kind) {
        case BendKind::Angular:
            return 1e4;
        case BendKind::Linear:
            return 1e6;
    }
    noOtherEntry();
}
/** The stiffness of a bend against turning its segments, the shorter of which has some length. */
double turningStiffness(BendKind kind, double stiffness, double length) {
    switch (kind) {
        case BendKind::Angular:
            return stiffness;
        case BendKind::Linear:
            return stiffness*length*length;
    }
    noOtherEntry();
}
/** The change of a length by its noise in a step, over the length. Rounding adds to it. */
const double LEAST_CHANGE = 1e-5;
/** The resistance of a node to its motion. Third powers of it are computed, also for a thousandth of a step. */
const double LEAST_RESISTANCE = 1e-9, LARGEST_RESISTANCE = 1e8;

/** Copy arrays that have a row of lanes for each node or segment, into lanes from one on. */
template <class From, class To> void copyLanes(const vector<From>& from, int lanes, vector<To>& to, int allLanes,
        int firstLane) {
    for (size_t row = 0; row*lanes < from.size(); row++)
        copy_n(from.begin()+row*lanes, lanes, to.begin()+row*allLanes+firstLane);
}

/** Some packs as one in single precision, as long as the longest of them. */
ChainPack<float> widened(const ChainPack<double>* first, const ChainPack<double>* last, int lanes,
        PropertyTables<float>& tables) {
    const ChainPack<double>* const longest = max_element(first, last,
            [] (const ChainPack<double>& a, const ChainPack<double>& b) {return a.nodes < b.nodes;});
    ChainPack<float> wide = packWithoutChains<float>(*longest, lanes);
    PropertyRows<float> properties(wide.nodes, lanes);
    int lane = 0;
    for (const ChainPack<double>* pack = first; pack != last; lane += pack->lanes, pack++) {
        auto copyTo = [&] (auto& to, const auto& from) {
            copyLanes(from, pack->lanes, to, lanes, lane);
        };
        copyTo(wide.chain, pack->chain);
        copyTo(wide.nodesOfLane, pack->nodesOfLane);
        copyTo(wide.segmentsOfLane, pack->segmentsOfLane);
        copyTo(wide.firstNode, pack->firstNode);
        copyTo(wide.particles, pack->particles);
        properties.setLanes(lane, *pack);
        copyTo(wide.free, pack->free);
        copyTo(wide.turning, pack->turning);
        copyTo(wide.nodeFriction, pack->nodeFriction);
        copyTo(wide.rootNodeFriction, pack->rootNodeFriction);
        if (pack->twist.isPresent()) {
            if (!wide.twist.isPresent())
                wide.twist = PackTwist<float>(wide.segments, lanes);
            copyTo(wide.twist.stiffness, pack->twist.stiffness);
            copyTo(wide.twist.torque, pack->twist.torque);
            copyTo(wide.twist.rest, pack->twist.rest);
            copyTo(wide.twist.angularVelocity, pack->twist.angularVelocity);
            copyTo(wide.twist.frameMobility, pack->twist.frameMobility);
            copyTo(wide.twist.friction, pack->twist.friction);
            copyTo(wide.twist.directions, pack->twist.directions);
            copyTo(wide.twist.held, pack->twist.held);
            wide.twist.isHeld |= pack->twist.isHeld;
        }
        if (!pack->propulsions.empty())
            wide.propulsions.resize((size_t) (wide.nodes-1)*lanes);
        copyTo(wide.propulsions, pack->propulsions);
        wide.particlesOfChains.insert(wide.particlesOfChains.end(), pack->particlesOfChains.begin(),
                pack->particlesOfChains.end());
        for (LaneTether tether : pack->tethers) {
            tether.lane += lane;
            wide.tethers.push_back(tether);
        }
    }
    properties.giveTo(wide, tables);
    sortTethers(wide);
    return wide;
}

} // namespace

WidePack::WidePack(const vector<Chain>& all, const vector<int>& members, int first, int last) : first(first),
        last(last), chains(members.size()) {
    for (int member : members)
        include(all[member]);
}

void WidePack::make(const vector<ChainPack<double> >& packs, PropertyTables<float>& tables) {
    if (!pack)
        pack = widened(packs.data()+first, packs.data()+last, bestKernels().wide.lanes, tables);
}

bool WidePack::isUsed(const StepSettings& settings) const {
    if (settings.precision == Precision::Automatic && 2*chains <= bestKernels().wide.lanes)
        return false;
    const double h = settings.stepSize;
    // What hands on the helix do to turns may be too stiff.
    if (twisting > 0 && settings.turnedPairs != NULL)
        return false;
    // A flow needs to know where chains are. Written so that NaN is not right.
    return settings.precision != Precision::Double && isImplicit(settings.scheme) && !settings.flow.present &&
            settings.kT > 0 && stretching <= LARGEST_STRETCHING*settings.kT &&
            twisting*sqrt(1+2*settings.kT*h/leastAxialFriction) <= LARGEST_TWISTING*settings.kT &&
            h*bendingRate <= 1 && leastFriction >= LEAST_RESISTANCE*h &&
            largestFriction+h*bending <= LARGEST_RESISTANCE*h &&
            2*settings.kT*h >= LEAST_CHANGE*LEAST_CHANGE*lengthFriction;
}

void WidePack::include(const Chain& chain) {
    for (const Segment& segment : chain.segments) {
        const double square = segment.restLength*segment.restLength;
        stretching = max(stretching, segment.stiffness*square);
        lengthFriction = max(lengthFriction,
                segment.extensional+0.25*(segment.parallel+chain.nodeFriction)*square);
        leastFriction = min(leastFriction,
                0.25*min(segment.parallel, segment.perpendicular)+chain.nodeFriction);
        largestFriction = max(largestFriction,
                0.25*segment.perpendicular+segment.rotational/square+chain.nodeFriction);
    }
    for (size_t joint = 0; joint < chain.joints.size(); joint++) {
        const Segment& before = chain.segments[joint];
        const Segment& behind = chain.segments[joint+1];
        const double length = min(before.restLength, behind.restLength);
        const BendKind kind = kindOf(chain.bending);
        const double stiffness = turningStiffness(kind, chain.joints[joint], length);
        const double friction = min(before.rotational, behind.rotational)+0.25*length*length*chain.nodeFriction;
        bendingRate = max(bendingRate, 4*stiffness/friction/largestBendingRate(kind));
        bending = max(bending, 4*stiffness/(length*length));
    }
    for (double friction : chain.twist.friction)
        leastAxialFriction = min(leastAxialFriction, friction);
    for (double stiffness : chain.twist.stiffness)
        twisting = max(twisting, stiffness);
    for (const EndFrame& frame : chain.twist.ends)
        twisting = max(twisting, frame.stiffness);
    for (const Tether& tether : chain.tethers)
        bending = max(bending, tether.stiffness);
}
