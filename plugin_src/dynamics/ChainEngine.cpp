#include "dynamics/ChainEngine.h"
#include "dynamics/ChainPack.h"
#include "dynamics/ChainPieces.h"
#include "dynamics/ModePacks.h"
#include "dynamics/PackPlaces.h"
#include "dynamics/PackProperties.h"
#include "dynamics/PackStep.h"
#include "dynamics/PlannedDivision.h"
#include "lanes/InstructionSet.h"
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <mutex>
#include <numeric>
#include <optional>
#include <set>
#include <stdexcept>
#include <tuple>

using namespace cylchain;
using namespace std;

namespace {

/** Chains share a pack if they use the same models and at most a fifth of a lane is filled up. */
const double LARGEST_FILLING = 0.2;
/** The same of chains that have grown since they were put there. */
const double LARGEST_FILLING_OF_GROWN = 0.5;
/** Packs of chains that come and go have at most so many times the lanes of these, and so many packs besides. */
const int MOST_LANES_OF_GROWN = 3, MOST_LANES_BESIDE = 16;

const ChainKernels& kernels() {
    static const ChainKernels& best = loopsOfBest<baselineKernels, avx2Kernels, avx512Kernels>();
    return best;
}

bool hasSegmentFriction(const Chain& chain) {
    return any_of(chain.segments.begin(), chain.segments.end(), [] (const Segment& segment) {
        return segment.parallel > 0 || segment.perpendicular > 0 || segment.rotational > 0 || segment.extensional > 0;
    });
}

bool mayShareLanes(const Chain& longest, const Chain& chain, double filling = LARGEST_FILLING) {
    const size_t least = longest.closed ? longest.segments.size() : ceil((1-filling)*longest.segments.size());
    return hasSegmentFriction(chain) == hasSegmentFriction(longest) &&
            (chain.nodeFriction > 0) == (longest.nodeFriction > 0) && chain.bending == longest.bending &&
            chain.stretching == longest.stretching && chain.closed == longest.closed &&
            chain.planar == longest.planar && chain.segments.size() >= least;
}

/**
 * Where single precision is right, as measured: see docs/design/implicit_scheme.md. This is for the stiffness of
 * lengths, k l0^2/k_B T.
 */
const double LARGEST_STRETCHING = 1e9;
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

/** A pack whose lanes are all filled up, but for its properties. */
template <class Scalar> ChainPack<Scalar> packWithoutChains(const PackShape& shape, int lanes) {
    ChainPack<Scalar> pack = emptyPack<Scalar>(shape, lanes);
    pack.free.resize(lanes);
    pack.turning.resize(lanes);
    pack.nodeFriction.resize(lanes);
    pack.rootNodeFriction.resize(lanes);
    return pack;
}

ChainPack<double> packed(const vector<Chain>& chains, const vector<int>& members, int lanes,
            PropertyTables<double>& tables) {
    const Chain& longest = chains[members[0]];
    ChainPack<double> pack = packWithoutChains<double>({(int) longest.nodes.size()+(longest.closed ? 2 : 0),
            (int) longest.segments.size(), longest.bending, longest.stretching, longest.closed, longest.planar,
            longest.nodeFriction > 0, hasSegmentFriction(longest)}, lanes);
    PropertyRows<double> properties(pack.nodes, lanes);
    for (size_t lane = 0; lane < members.size(); lane++)
        fillLane(pack, properties, lane, chains[members[lane]], members[lane]);
    properties.giveTo(pack, tables);
    sortTethers(pack);
    return pack;
}

/** Let the chains of a pack be pieces of others. */
void setOrigins(ChainPack<double>& pack, const vector<PieceOfChain>& origins) {
    for (LaneTether& tether : pack.tethers)
        tether.number = origins[pack.chain[tether.lane]].tethers[tether.number];
    for (int lane = 0; lane < pack.lanes && pack.chain[lane] >= 0; lane++) {
        const PieceOfChain& origin = origins[pack.chain[lane]];
        pack.firstNode[lane] = origin.firstNode;
        pack.chain[lane] = origin.chain;
    }
}

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

/** The pieces of the chains of a pack that are few and long, or NULL. */
unique_ptr<ChainPieces> piecesOf(const vector<Chain>& chains, const vector<int>& members) {
    if (members.empty() || !ChainPieces::mayBeUsed(chains, members, kernels().wide.lanes))
        return NULL;
    return make_unique<ChainPieces>(chains, members, kernels().lanes, kernels().wide.lanes);
}

template <class Scalar> ParticleRange particlesOf(const ChainPack<Scalar>& pack) {
    return {pack.particlesOfChains.data(), pack.particlesOfChains.data()+pack.particlesOfChains.size()};
}

/** A pack in single precision, in place of some of those in double precision, and what decides where it is right. */
class WidePack {
public:
    /** The packs that it replaces. */
    int first, last;
    int chains;
    /** Nothing before a step takes it: with few chains, it is far larger than the packs that it replaces. */
    optional<ChainPack<float> > pack;
    WidePack(const vector<Chain>& all, const vector<int>& members, int first, int last) :
            first(first), last(last), chains(members.size()) {
        for (int member : members)
            include(all[member]);
    }
    void make(const vector<ChainPack<double> >& packs, PropertyTables<float>& tables) {
        if (!pack)
            pack = widened(packs.data()+first, packs.data()+last, kernels().wide.lanes, tables);
    }
    bool isUsed(const StepSettings& settings) const {
        if (settings.precision == Precision::Automatic && 2*chains <= kernels().wide.lanes)
            return false;
        const double h = settings.stepSize;
        // A flow needs to know where chains are. Written so that NaN is not right.
        return settings.precision != Precision::Double && isImplicit(settings.scheme) && !settings.flow.present &&
                settings.kT > 0 && stretching <= LARGEST_STRETCHING*settings.kT &&
                h*bendingRate <= 1 && leastFriction >= LEAST_RESISTANCE*h &&
                largestFriction+h*bending <= LARGEST_RESISTANCE*h &&
                2*settings.kT*h >= LEAST_CHANGE*LEAST_CHANGE*lengthFriction;
    }
private:
    /**
     * The largest k l0^2, 4 kappa/gamma_rot over what a step may have, kappa/l0^2 and friction of a node, and the least
     * of the latter.
     */
    double stretching = 0, bendingRate = 0, bending = 0, largestFriction = 0, leastFriction = HUGE_VAL;
    /** The largest friction against a change of a length, times its square. */
    double lengthFriction = 0;
    void include(const Chain& chain) {
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
        for (const Tether& tether : chain.tethers)
            bending = max(bending, tether.stiffness);
    }
};

} // namespace

void SegmentForces::add(const SegmentForces& other, double weight) {
    tension += weight*other.tension;
    for (int k = 0; k < 3; k++) {
        minus[k] += weight*other.minus[k];
        plus[k] += weight*other.plus[k];
        direction[k] += weight*other.direction[k];
    }
}

struct ChainEngine::Implementation {
    /** Chains whose modes are used may be all or none. */
    explicit Implementation(const vector<Chain>& ofModes) : modes(ofModes, kernels().lanes, kernels().wide.lanes) {
    }
    /** Packs are counted through all of these. Wide ones are in the order of those that they replace. */
    vector<ChainPack<double> > packs;
    vector<WidePack> wide;
    /** The chains of each pack in double precision, the longest first. */
    vector<vector<int> > members;
    PropertyTables<double> tables;
    PropertyTables<float> wideTables;
    ModePacks modes;
    /** Those of each pack in double precision whose chains are few and long, or NULL. */
    vector<unique_ptr<ChainPieces> > pieces;
    /** Whether chains come and go. All wide packs are used then, or none: where single precision is right for all. */
    bool mayChange = false;
    unique_ptr<WidePack> limits;
    void findLimits(const vector<Chain>& chains);
    /** Held where wide packs and their tables are made. */
    mutex making;
    vector<int> placeChains(const vector<Chain>& chains, const vector<int>& changed);
    void fill(int pack, const vector<Chain>& chains, int lanes);
    void addWide(const vector<Chain>& chains, int first, int last);
    bool isOfModes(int pack) const {
        return pack >= (int) (packs.size()+wide.size());
    }
    ChainPieces* piecesOf(int pack) const {
        return pack < (int) pieces.size() ? pieces[pack].get() : NULL;
    }
    /** Call a function with a pack: one in double precision, a wide one, or the number of one of modes. */
    template <class Double, class Single, class Modes> decltype(auto) with(int pack, Double ofDouble, Single ofSingle,
                Modes ofModes) const {
        const int count = packs.size();
        if (pack < count)
            return ofDouble(packs[pack]);
        return isOfModes(pack) ? ofModes(pack-count-(int) wide.size()) : ofSingle(wide[pack-count]);
    }
};

ChainEngine::ChainEngine(const vector<Chain>& chains, bool mayChange) : ChainEngine(chains, vector<PieceOfChain>()) {
    if (!mayChange)
        return;
    implementation->mayChange = true;
    for (unique_ptr<ChainPieces>& pieces : implementation->pieces)
        pieces.reset();
    implementation->findLimits(chains);
}

ChainEngine::ChainEngine(const vector<Chain>& chains, const vector<PieceOfChain>& origins) {
    for (size_t i = 0; i < chains.size(); i++)
        if (!isEntry(chains[i].bending) || !isEntry(chains[i].stretching))
            throw invalid_argument("Chain "+to_string(i)+" has a model that there is not");
    implementation.reset(new Implementation(origins.empty() ? chains : vector<Chain>()));
    // Chains of similar length come next to each other, the longest first, so that threads end together.
    // Those that are empty now are in none.
    vector<int> order;
    for (size_t i = 0; i < chains.size(); i++)
        if (!chains[i].nodes.empty())
            order.push_back(i);
    stable_sort(order.begin(), order.end(), [&] (int a, int b) {
        auto key = [&] (const Chain& chain) {
            return make_tuple(-(int) chain.nodes.size(), chain.bending, chain.stretching, chain.closed, chain.planar,
                    chain.nodeFriction > 0);
        };
        return key(chains[a]) < key(chains[b]);
    });
    vector<vector<int> >& members = implementation->members;
    for (size_t first = 0; first < order.size();) {
        int fitting = 1;
        while (fitting < kernels().lanes && first+fitting < order.size() &&
                mayShareLanes(chains[order[first]], chains[order[first+fitting]]))
            fitting++;
        members.push_back(vector<int>(order.begin()+first, order.begin()+first+fitting));
        implementation->packs.push_back(packed(chains, members.back(),
                lanesFor(fitting, kernels().lanes), implementation->tables));
        if (!origins.empty())
            setOrigins(implementation->packs.back(), origins);
        implementation->pieces.push_back(origins.empty() ? piecesOf(chains, members.back()) : NULL);
        first += fitting;
    }

    // Wide packs are made of those that come next to each other.
    for (size_t first = 0, last; first < members.size(); first = last) {
        const Chain& longest = chains[members[first][0]];
        vector<int> together = members[first];
        int lanes = implementation->packs[first].lanes;
        for (last = first+1; last < members.size(); last++) {
            lanes += implementation->packs[last].lanes;
            if (lanes > kernels().wide.lanes || !mayShareLanes(longest, chains[members[last].back()]))
                break;
            together.insert(together.end(), members[last].begin(), members[last].end());
        }
        if (!longest.closed && !hasRange(longest.stretching))
            implementation->wide.push_back(WidePack(chains, together, first, last));
    }
}

ChainEngine::~ChainEngine() {
}

Replacement ChainEngine::replaceChains(const vector<Chain>& chains, const vector<int>& changed) {
    vector<vector<int> >& members = implementation->members;
    const vector<int> packs = implementation->placeChains(chains, changed);
    size_t lanes = 0, taken = 0;
    for (size_t pack = 0; pack < members.size(); pack++) {
        lanes += kernels().lanes;
        taken += members[pack].size();
    }
    if (lanes > MOST_LANES_OF_GROWN*taken+MOST_LANES_BESIDE*kernels().lanes)
        return Replacement::Impossible;
    // Tables of what has changed are its own, and those before are gone with it.
    implementation->tables = PropertyTables<double>();
    implementation->wideTables = PropertyTables<float>();
    Replacement result = Replacement::SameNodes;
    for (int pack : packs) {
        ChainPack<double>& own = implementation->packs[pack];
        const vector<int> chainsBefore = own.chain, particlesBefore = own.particles;
        implementation->fill(pack, chains, max(own.lanes, lanesFor(members[pack].size(), kernels().lanes)));
        if (own.chain != chainsBefore || own.particles != particlesBefore)
            result = Replacement::OtherNodes;
    }
    for (WidePack& wide : implementation->wide) {
        if (none_of(packs.begin(), packs.end(), [&] (int pack) {return pack >= wide.first && pack < wide.last;}))
            continue;
        vector<int> together;
        for (int pack = wide.first; pack < wide.last; pack++)
            together.insert(together.end(), members[pack].begin(), members[pack].end());
        wide = WidePack(chains, together, wide.first, wide.last);
    }
    implementation->findLimits(chains);
    return result;
}

/** Find the limits of all chains that may be in wide packs. */
void ChainEngine::Implementation::findLimits(const vector<Chain>& chains) {
    vector<int> all;
    for (size_t i = 0; i < chains.size(); i++)
        if (!chains[i].nodes.empty() && !chains[i].closed && !hasRange(chains[i].stretching))
            all.push_back(i);
    limits = make_unique<WidePack>(chains, all, 0, packs.size());
}

vector<int> ChainEngine::getArrangement() const {
    vector<int> result = {getNumPacks()};
    for (size_t pack = 0; pack < implementation->members.size(); pack++) {
        const vector<int>& own = implementation->members[pack];
        result.insert(result.end(), {implementation->packs[pack].lanes, static_cast<int>(own.size())});
        result.insert(result.end(), own.begin(), own.end());
    }
    for (const WidePack& wide : implementation->wide)
        result.insert(result.end(), {wide.first, wide.last});
    return result;
}

void ChainEngine::setArrangement(const vector<Chain>& chains, const vector<int>& arrangement) {
    size_t next = 0;
    auto take = [&] {
        return next < arrangement.size() ? arrangement[next++] : -1;
    };
    vector<vector<int> > members(max(0, take()));
    vector<int> lanes, seen(chains.size(), 0);
    bool isRight = true;
    for (vector<int>& own : members) {
        lanes.push_back(take());
        for (int count = take(); count > 0; count--)
            own.push_back(take());
        isRight = isRight && lanes.back() >= 1 && lanes.back() <= kernels().lanes &&
                static_cast<int>(own.size()) <= lanes.back();
        for (int chain : own)
            if (chain < 0 || chain >= static_cast<int>(chains.size()) || chains[chain].nodes.empty())
                isRight = false;
            else
                seen[chain]++;
        isRight = isRight && (own.empty() || mayShareLanes(chains[own.front()], chains[own.back()],
                LARGEST_FILLING_OF_GROWN));
    }
    for (size_t i = 0; i < chains.size(); i++)
        isRight = isRight && seen[i] == (chains[i].nodes.empty() ? 0 : 1);
    vector<pair<int, int> > wide;
    while (next < arrangement.size()) {
        const int first = take(), last = take();
        int ofBoth = 0;
        for (int pack = first; pack < last && pack >= 0 && pack < static_cast<int>(lanes.size()); pack++)
            ofBoth += lanes[pack];
        isRight = isRight && first >= (wide.empty() ? 0 : wide.back().second) && first < last &&
                last <= static_cast<int>(members.size()) && ofBoth <= kernels().wide.lanes;
        wide.push_back({first, last});
    }
    // That of another processor, which has other lanes, has other digits anyway.
    if (!isRight)
        return;
    implementation->tables = PropertyTables<double>();
    implementation->wideTables = PropertyTables<float>();
    implementation->members = members;
    implementation->packs.clear();
    implementation->pieces.clear();
    implementation->wide.clear();
    for (size_t pack = 0; pack < members.size(); pack++) {
        implementation->packs.emplace_back();
        implementation->pieces.emplace_back();
        implementation->fill(pack, chains, lanes[pack]);
    }
    for (const pair<int, int>& own : wide)
        implementation->addWide(chains, own.first, own.second);
    implementation->findLimits(chains);
}

/** Make a pack of its members. */
void ChainEngine::Implementation::fill(int pack, const vector<Chain>& chains, int lanes) {
    if (!members[pack].empty()) {
        packs[pack] = packed(chains, members[pack], lanes, tables);
        return;
    }
    packs[pack] = packWithoutChains<double>({2, 1, {}, {}, false, false, false, true}, lanes);
    PropertyRows<double>(2, lanes).giveTo(packs[pack], tables);
}

void ChainEngine::Implementation::addWide(const vector<Chain>& chains, int first, int last) {
    vector<int> together;
    for (int pack = first; pack < last; pack++)
        together.insert(together.end(), members[pack].begin(), members[pack].end());
    wide.emplace_back(chains, together, first, last);
}

/**
 * Find packs for chains that have changed, so that those of a pack are of similar length.
 *
 * @return the packs that have other chains, or chains that have changed, in ascending order
 */
vector<int> ChainEngine::Implementation::placeChains(const vector<Chain>& chains, const vector<int>& changed) {
    auto isLonger = [&] (int a, int b) {
        return chains[a].nodes.size() > chains[b].nodes.size();
    };
    auto areSimilar = [&] (const vector<int>& own) {
        return own.empty() || mayShareLanes(chains[own.front()], chains[own.back()], LARGEST_FILLING_OF_GROWN);
    };
    vector<char> isChanged(chains.size(), 0);
    vector<int> homeless(changed);
    for (int chain : changed)
        isChanged[chain] = 1;
    set<int> result;
    for (size_t pack = 0; pack < members.size(); pack++) {
        vector<int>& own = members[pack];
        const auto others = stable_partition(own.begin(), own.end(), [&] (int chain) {return isChanged[chain] == 0;});
        if (others == own.end())
            continue;
        result.insert(pack);
        // Those that have changed stay, unless they are too different from those that have not.
        const vector<int> back(others, own.end());
        own.erase(others, own.end());
        for (int chain : back) {
            vector<int> with = own;
            with.insert(upper_bound(with.begin(), with.end(), chain, isLonger), chain);
            if (chains[chain].nodes.empty() || !areSimilar(with))
                continue;
            own.swap(with);
            homeless.erase(find(homeless.begin(), homeless.end(), chain));
        }
    }
    for (int chain : homeless) {
        if (chains[chain].nodes.empty())
            continue;
        size_t pack = 0;
        for (; pack < members.size(); pack++) {
            vector<int> with = members[pack];
            with.insert(upper_bound(with.begin(), with.end(), chain, isLonger), chain);
            if (static_cast<int>(with.size()) <= kernels().lanes && areSimilar(with)) {
                members[pack].swap(with);
                break;
            }
        }
        if (pack == members.size()) {
            members.push_back({chain});
            packs.emplace_back();
            pieces.emplace_back();
            if (!hasRange(chains[chain].stretching)) {
                const int last = packs.size();
                if (!wide.empty() && wide.back().last == last-1 && wide.back().first == last-2)
                    wide.back().last = last;
                else
                    wide.emplace_back(chains, vector<int>(), last-1, last);
            }
        }
        result.insert(pack);
    }
    return {result.begin(), result.end()};
}

int ChainEngine::getNumPacks() const {
    return implementation->packs.size();
}

vector<int> ChainEngine::getPacksOfStep(const StepSettings& settings) const {
    vector<int> result;
    if (settings.scheme == Scheme::Modes) {
        result = implementation->modes.getPacksOfStep(settings);
        for (int& pack : result)
            pack += getNumPacks()+implementation->wide.size();
        return result;
    }
    int next = 0;
    const lock_guard<mutex> lock(implementation->making);
    for (size_t wide = 0; wide < implementation->wide.size(); wide++) {
        WidePack& pack = implementation->wide[wide];
        const ChainPieces* const pieces = pack.last == pack.first+1 ? implementation->piecesOf(pack.first) : NULL;
        const WidePack& limits = implementation->mayChange ? *implementation->limits : pack;
        if (!limits.isUsed(settings) || (pieces != NULL && pieces->isUsed(settings)))
            continue;
        pack.make(implementation->packs, implementation->wideTables);
        for (; next < pack.first; next++)
            result.push_back(next);
        result.push_back(getNumPacks()+wide);
        next = pack.last;
    }
    for (; next < getNumPacks(); next++)
        result.push_back(next);
    return result;
}

int ChainEngine::getNumMixedChains(const vector<int>& packs) const {
    int count = 0;
    for (int pack : packs)
        count += implementation->with(pack, [] (const auto&) {return 0;},
                [] (const WidePack& wide) {return wide.chains;},
                [&] (int modes) {return implementation->modes.getNumWideChains(modes);});
    return count;
}

int ChainEngine::getNumMixedChains(const vector<int>& packs, const StepSettings& settings) const {
    int count = getNumMixedChains(packs);
    for (int pack : packs) {
        ChainPieces* const pieces = implementation->piecesOf(pack);
        if (pieces != NULL && pieces->isUsed(settings) && pieces->isMixed(settings))
            count += pieces->getNumChains();
    }
    return count;
}

ChainEnergy ChainEngine::addForces(int pack, const double* positions, double* forces, const double* box,
            bool includeEnergy) const {
    return kernels().addForces(implementation->packs[pack], positions, forces, box, includeEnergy);
}

ParticleRange ChainEngine::getParticles(int pack) const {
    const ModePacks& modes = implementation->modes;
    return implementation->with(pack, [] (const ChainPack<double>& own) {return particlesOf(own);},
            [] (const WidePack& wide) {return particlesOf(*wide.pack);},
            [&] (int own) {return modes.isWide(own) ? particlesOf(modes.getWide(own).pack) :
                    particlesOf(modes.get(own).pack);});
}

void ChainEngine::clearForces(int pack, double* forces) const {
    for (int particle : getParticles(pack))
        forces[3*particle] = forces[3*particle+1] = forces[3*particle+2] = 0;
}

Instability ChainEngine::step(int pack, const double* positions, const double* forces, const double* box,
            const StepSettings& settings, double* displacements) const {
    if (implementation->isOfModes(pack) != (settings.scheme == Scheme::Modes))
        throw invalid_argument("Pack "+to_string(pack)+" is not for this scheme");
    const ModePacks& modes = implementation->modes;
    auto stepOf = [&] (auto function, const auto& own) {
        return function(own, positions, forces, box, settings, displacements);
    };
    ChainPieces* const pieces = implementation->piecesOf(pack);
    Instability result;
    if (pieces != NULL && pieces->isUsed(settings) &&
            pieces->step(positions, forces, box, settings, displacements, result))
        return result;
    return implementation->with(pack, [&] (const ChainPack<double>& own) {return stepOf(kernels().step, own);},
            [&] (const WidePack& wide) {return stepOf(kernels().wide.step, *wide.pack);},
            [&] (int own) {return modes.isWide(own) ? stepOf(kernels().wide.stepOfModes, modes.getWide(own)) :
                    stepOf(kernels().stepOfModes, modes.get(own));});
}

bool ChainEngine::isStepDivided(int pack, int lane, const StepSettings& settings) const {
    return implementation->with(pack, [&] (const auto& own) {return plannedDivision(own, settings, lane) > 0;},
            [&] (const WidePack& wide) {return plannedDivision(*wide.pack, settings, lane) > 0;},
            [] (int) {return false;});
}

unique_ptr<PackStep> ChainEngine::createStep(int pack) const {
    typedef unique_ptr<PackStep> Step;
    return implementation->with(pack, [] (const auto& own) {return Step(kernels().createStep(own));},
            [] (const WidePack& wide) {return Step(kernels().wide.createStep(*wide.pack));},
            [] (int) -> Step {throw invalid_argument("A pack of modes takes no implicit steps");});
}

const vector<int>& ChainEngine::getChainsOfLanes(int pack) const {
    typedef const vector<int>& Chains;
    const ModePacks& modes = implementation->modes;
    return implementation->with(pack, [] (const ChainPack<double>& own) -> Chains {return own.chain;},
            [] (const WidePack& wide) -> Chains {return wide.pack->chain;},
            [&] (int own) -> Chains {return modes.isWide(own) ? modes.getWide(own).pack.chain :
                    modes.get(own).pack.chain;});
}

void cylchain::drawWords(const NoiseKey& key, NoiseKind kind, uint32_t draw, const uint32_t* chains,
            const uint32_t* parts, int count, uint32_t* words) {
    kernels().drawWords(key, kind, draw, chains, parts, count, words);
}

void cylchain::drawNormals(const NoiseKey& key, NoiseKind kind, const uint32_t* chains, const uint32_t* parts,
            int count, double* normals) {
    kernels().drawNormals(key, kind, chains, parts, count, normals);
}

void cylchain::drawNormalsInSinglePrecision(const NoiseKey& key, NoiseKind kind, const uint32_t* chains,
            const uint32_t* parts, int count, double* normals) {
    kernels().wide.drawNormals(key, kind, chains, parts, count, normals);
}

void cylchain::drawFeneCoordinates(const NoiseKey& key, const uint32_t* chains, const uint32_t* segments,
            const double* stiffness, int count, double* coordinates) {
    kernels().drawFeneCoordinates(key, chains, segments, stiffness, count, coordinates);
}

void cylchain::transformCosines(int length, int count, double* values, bool inverse) {
    kernels().transformCosines(length, count, values, inverse);
}

void cylchain::transformCosinesInSinglePrecision(int length, int count, double* values, bool inverse) {
    kernels().wide.transformCosines(length, count, values, inverse);
}

string ChainEngine::getInstructionSet() {
    return kernels().instructionSet;
}
