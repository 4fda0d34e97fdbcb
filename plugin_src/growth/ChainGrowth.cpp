#include "growth/ChainGrowth.h"
#include "mechanics/PeriodicBox.h"
#include <algorithm>
#include <tuple>

using namespace cylchain;
using namespace std;

namespace {

/** After so many events of a group in a step, something is wrong with rates. */
const int MOST_EVENTS = 1000000;
/** Random numbers of growth belong to this instead of the number of a Force, so that they are not those of linkers. */
const uint32_t GROWTH = 0x80000000;

Vec3d unit(const Vec3d& v) {
    return v*(1/sqrt(v.squared()));
}

/** A unit vector across another one. */
Vec3d findAcross(const Vec3d& along) {
    const Vec3d axis = fabs(along.x) < 0.6 ? Vec3d {1, 0, 0} : Vec3d {0, 1, 0};
    return unit(along.cross(axis));
}

/** Turn a direction in its plane by an angle. */
Vec3d turnInPlane(const Vec3d& v, double angle) {
    const double c = cos(angle), s = sin(angle);
    return {c*v.x-s*v.y, s*v.x+c*v.y, v.z};
}

} // namespace

ChainGrowth::ChainGrowth(const GrowthSystem& system, const vector<BendingModel>& bending,
        const vector<StretchingModel>& stretching, const vector<char>& planar) : system(system), bending(bending),
        stretching(stretching), planar(planar), groups(system.pools.size()) {
    vector<tuple<int, BendingModel, StretchingModel, char> > known;
    for (size_t i = 0; i < system.chains.size(); i++) {
        const GrowingChain& own = system.chains[i];
        if (system.pools[own.pool].isClosed())
            groups[own.pool].push_back(i);
        else
            groups.push_back({static_cast<int>(i)});
        const auto key = make_tuple(own.table, bending[i], stretching[i], planar[i]);
        lawsOf.push_back(find(known.begin(), known.end(), key)-known.begin());
        if (lawsOf[i] == static_cast<int>(known.size()))
            known.push_back(key);
    }
    laws.resize(known.size());
}

const LengthLaw& ChainGrowth::getLengths(int index, int monomers, double kT) {
    Laws& own = laws[lawsOf[index]];
    const MonomerTable& table = system.tables[system.chains[index].table];
    if (own.kT != kT) {
        own = Laws();
        own.kT = kT;
        own.lengths.resize(table.segments.size()+1);
        own.bends.resize(table.joints.size()+2);
    }
    unique_ptr<LengthLaw>& law = own.lengths[monomers];
    if (!law)
        law = make_unique<LengthLaw>(table.getSegment(monomers), stretching[index], kT, planar[index] ? 2 : 3);
    return *law;
}

const BendLaw& ChainGrowth::getBends(int index, int monomersOfBoth, double kT) {
    getLengths(index, 1, kT);
    unique_ptr<BendLaw>& law = laws[lawsOf[index]].bends[monomersOfBoth];
    if (!law)
        law = make_unique<BendLaw>(system.tables[system.chains[index].table].getJoint(monomersOfBoth), bending[index],
                kT, planar[index]);
    return *law;
}

double ChainGrowth::getConcentration(const GrowthState& state, int pool) const {
    const MonomerPool& own = system.pools[pool];
    return own.isClosed() ? state.free[pool]/own.volume : own.concentration;
}

double ChainGrowth::getRate(const GrowthState& state, const Event& event) const {
    const GrowingChain& own = system.chains[event.index];
    const GrowingEnd& end = own.ends[event.end];
    const bool shrinks = state.shrinks[2*event.index+event.end] != 0;
    if (event.kind == EventKind::Switch)
        return shrinks ? end.rescueRate : end.catastropheRate;
    const EndRates& rates = shrinks ? end.shrinking : end;
    if (event.gains())
        return rates.onRate > 0 ? rates.onRate*getConcentration(state, own.pool) : 0;
    return state.ranges[event.index].size() > own.leastMonomers ? rates.offRate : 0;
}

int ChainGrowth::advance(GrowthState& state, const GrowthStep& step, ChainList& chains, double* positions,
        const vector<Surroundings*>& around, vector<int>& changed) {
    changed.clear();
    present.assign(system.chains.size(), Present());
    aroundIsKnown = false;
    for (size_t group = 0; group < groups.size(); group++)
        if (!groups[group].empty() && !takeTurns(state, step, groups[group], group, chains, positions, around))
            return groups[group][0];
    for (size_t i = 0; i < present.size(); i++)
        if (present[i].hasChanged) {
            setChain(state, i, chains.getChain(system.chains[i].chain), positions);
            changed.push_back(i);
        }
    state.steps++;
    return -1;
}

/** Let the chains of a group grow, by Gillespie's method; false if they do so too often. */
bool ChainGrowth::takeTurns(GrowthState& state, const GrowthStep& step, const vector<int>& members, uint32_t number,
        ChainList& chains, double* positions, const vector<Surroundings*>& around) {
    RandomNumbers random({step.seed, 0, state.steps}, GROWTH, number);
    double time = 0;
    for (int events = 0; events < MOST_EVENTS; events++) {
        double total = 0;
        auto forEvents = [&] (auto function) {
            for (int index : members)
                for (int end : {0, 1})
                    for (EventKind kind : {EventKind::Lose, EventKind::Gain, EventKind::Switch})
                        if (function(Event {index, end, kind}))
                            return;
        };
        forEvents([&] (const Event& event) {
            total += getRate(state, event);
            return false;
        });
        if (total <= 0)
            return true;
        time += random.exponential()/total;
        if (time >= step.stepSize)
            return true;
        double chosen = random.uniform()*total;
        Event next = {members[0], 0, EventKind::Lose};
        forEvents([&] (const Event& event) {
            const double rate = getRate(state, event);
            if (rate > 0)
                next = event;
            chosen -= rate;
            return chosen < 0;
        });
        if (next.kind == EventKind::Switch)
            switchEnd(state, next);
        else
            apply(state, step, next, random, chains, positions, around);
    }
    return false;
}

/** Find the monomers of a chain after an event. */
MonomerRange ChainGrowth::findRange(const GrowthState& state, const Event& event) const {
    MonomerRange range = state.ranges[event.index];
    const int change = event.gains() ? 1 : -1;
    if (event.end == 1)
        range.last += change;
    else
        range.first -= change;
    return range;
}

/** Let an end begin to shrink, or to grow again. */
void ChainGrowth::switchEnd(GrowthState& state, const Event& event) const {
    const size_t end = 2*event.index+event.end;
    EndEvents& events = state.events[end];
    (state.shrinks[end] != 0 ? events.rescues : events.catastrophes)++;
    state.shrinks[end] = state.shrinks[end] == 0;
}

/** Let an event happen, unless energies or a lack of nodes are against it. */
void ChainGrowth::apply(GrowthState& state, const GrowthStep& step, const Event& event, RandomNumbers& random,
        ChainList& chains, const double* positions, const vector<Surroundings*>& around) {
    const GrowingChain& own = system.chains[event.index];
    const Chain& chain = chains.getChain(own.chain);
    Present& known = present[event.index];
    if (!aroundIsKnown)
        for (Surroundings* all : around)
            all->begin(positions, chains, step.box);
    aroundIsKnown = true;
    EndEvents& events = state.events[2*event.index+event.end];
    if (!known.isKnown) {
        known.isKnown = true;
        for (size_t i = 0; i < chain.nodes.size(); i++) {
            const double* x = positions+3*(size_t) chain.nodes[i];
            Vec3d node = {x[0], x[1], x[2]};
            if (i > 0 && step.takesNearestImages) {
                const Vec3d& last = known.nodes.back();
                double along[] = {node.x-last.x, node.y-last.y, node.z-last.z};
                takeToNearestImage(along, step.box);
                node = last+Vec3d {along[0], along[1], along[2]};
            }
            known.nodes.push_back(node);
        }
    }
    vector<Vec3d> after;
    int segments[2];
    double joint = 1;
    if (!propose(state, step, event, random, known.nodes, after, segments, joint))
        return;
    if (after.size() > chain.nodes.size()+chain.spareNodes.size()) {
        events.waited++;
        return;
    }
    // Nodes that are fixed neither move nor come or go. They are at the minus end, or the chain is as it was added.
    const int moved = segments[0], count = known.nodes.size();
    for (int i = 0; i < moved; i++) {
        const size_t node = event.end == 1 ? count-1-i : i;
        if (node < chain.fixed.size() && chain.fixed[node])
            return;
    }
    const MonomerRange range = findRange(state, event);
    vector<double> alongBefore, alongAfter;
    if (!around.empty()) {
        alongBefore = findLengths(event.index, state.ranges[event.index]);
        alongAfter = findLengths(event.index, range);
    }
    const EndChange change = {own.chain, event.end, known.nodes, after, segments[0], segments[1], alongBefore,
            alongAfter, joint};
    double difference = 0;
    for (Surroundings* all : around)
        difference += all->findChange(change);
    if (!(difference <= 0) && !(log(random.uniform())*step.kT < -difference))
        return;
    for (Surroundings* all : around)
        all->accept(change);
    state.ranges[event.index] = range;
    if (system.pools[own.pool].isClosed())
        state.free[own.pool] += event.gains() ? -1 : 1;
    (event.gains() ? events.gained : events.lost)++;
    known.nodes.swap(after);
    known.hasChanged = true;
}

/** Find the lengths along a chain at which its nodes are. */
vector<double> ChainGrowth::findLengths(int index, const MonomerRange& range) const {
    const SegmentDivision division(range, system.tables[system.chains[index].table].monomersPerSegment);
    const double length = restLengthOf(index, 1);
    int monomer = range.first;
    vector<double> result(1, monomer*length);
    for (int s = 0; s < division.countSegments(); s++) {
        monomer += division.getMonomers(s);
        result.push_back(monomer*length);
    }
    return result;
}

/** Draw where the nodes of a chain are after an event. */
bool ChainGrowth::propose(const GrowthState& state, const GrowthStep& step, const Event& event, RandomNumbers& random,
        const vector<Vec3d>& nodes, vector<Vec3d>& after, int* segments, double& joint) {
    const int index = event.index, end = event.end, perSegment =
            system.tables[system.chains[index].table].monomersPerSegment;
    const bool flat = planar[index];
    const double kT = step.kT;
    const SegmentDivision old(state.ranges[index], perSegment);
    const MonomerRange range = findRange(state, event);
    if (range.size() < 1)
        return false;
    const SegmentDivision next(range, perSegment);
    const int come = next.countSegments()-old.countSegments();
    segments[0] = come < 0 ? 2 : 1;
    segments[1] = come > 0 ? 2 : 1;

    // Outwards, from the node that stays.

    const int count = nodes.size(), staying = count-1-segments[0];
    auto at = [&] (int i) -> const Vec3d& {
        return nodes[end == 1 ? i : count-1-i];
    };
    const Vec3d along = at(staying+1)-at(staying);
    const double length = sqrt(along.squared());
    const int innerBefore = old.getMonomersFrom(end, segments[0]-1), inner = next.getMonomersFrom(end, segments[1]-1);
    Vec3d direction = along*(1/length);
    if (staying > 0) {
        const int behind = old.getMonomersFrom(end, segments[0]);
        direction = turn(unit(at(staying)-at(staying-1)), direction, flat, getBends(index, behind+innerBefore, kT),
                getBends(index, behind+inner, kT), random);
    }
    double extension;
    if (come == 0)
        extension = carry(getLengths(index, innerBefore, kT), getLengths(index, inner, kT),
                length-restLengthOf(index, innerBefore), random);
    else
        extension = getLengths(index, inner, kT).draw(random);
    vector<Vec3d> outer = {at(staying)+direction*(restLengthOf(index, inner)+extension)};
    if (come > 0) {
        const int last = next.getMonomersFrom(end, 0);
        const Vec3d further = bendFrom(direction, flat, getBends(index, inner+last, kT), random);
        outer.push_back(outer[0]+further*(restLengthOf(index, last)+getLengths(index, last, kT).draw(random)));
    }
    if (come != 0) {
        const int innerOfTwo = come > 0 ? inner : innerBefore;
        joint = static_cast<double>(innerOfTwo)/(come > 0 ? innerBefore : inner);
        joint = min(joint, 1.0);
    }
    after.clear();
    for (int i = 0; i <= staying; i++)
        after.push_back(at(i));
    after.insert(after.end(), outer.begin(), outer.end());
    if (end == 0)
        reverse(after.begin(), after.end());
    return true;
}

/** Turn a segment to where its bend against the one behind it is carried: in the plane of both. */
Vec3d ChainGrowth::turn(const Vec3d& along, const Vec3d& direction, bool flat, const BendLaw& from, const BendLaw& to,
        RandomNumbers& random) const {
    if (flat) {
        const double bend = atan2(along.x*direction.y-along.y*direction.x, along.dot(direction));
        const double carried = carry(from, to, bend, random);
        return carried == bend ? direction : turnInPlane(along, carried);
    }
    const double cosine = max(-1.0, min(1.0, along.dot(direction))), carried = carry(from, to, cosine, random);
    if (carried == cosine)
        return direction;
    Vec3d across = direction-along*cosine;
    across = across.squared() > 1e-20 ? unit(across) : findAcross(along);
    return along*carried+across*sqrt(max(0.0, (1-carried)*(1+carried)));
}

/** Draw the direction of a segment that is new. */
Vec3d ChainGrowth::bendFrom(const Vec3d& along, bool flat, const BendLaw& law, RandomNumbers& random) const {
    const double bend = law.draw(random);
    if (flat)
        return turnInPlane(along, bend);
    const Vec3d first = findAcross(along), second = along.cross(first);
    const double azimuth = 2*M_PI*random.uniform(), sine = sqrt(max(0.0, (1-bend)*(1+bend)));
    return along*bend+(first*cos(azimuth)+second*sin(azimuth))*sine;
}

/** Let a chain be what it has become. */
void ChainGrowth::setChain(const GrowthState& state, int index, Chain& chain, double* positions) const {
    setMonomers(chain, system.tables[system.chains[index].table], state.ranges[index]);
    const vector<Vec3d>& nodes = present[index].nodes;
    auto put = [&] (int particle, const Vec3d& x) {
        double* to = positions+3*(size_t) particle;
        to[0] = x.x;
        to[1] = x.y;
        to[2] = x.z;
    };
    for (size_t i = 0; i < nodes.size(); i++)
        put(chain.nodes[i], nodes[i]);
    for (int spare : chain.spareNodes)
        put(spare, nodes.back());
}
