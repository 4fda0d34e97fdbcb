#include "growth/ChainPopulation.h"
#include "growth/Directions.h"
#include "growth/MonomerStates.h"
#include <algorithm>
#include <cmath>

using namespace cylchain;
using namespace std;

/** How often ends are drawn at a place that a plane cuts. */
static const int MOST_TRIALS = 100;

void ChainPopulation::listNucleation(const GrowthState& state, int number, vector<GrowthEvent>& events) const {
    const Nucleator& nucleator = system.nucleators[number];
    if (nucleator.chains.empty())
        return;
    const int pool = system.chains[nucleator.chains[0]].pool;
    double rate = nucleator.rate;
    if (system.pools[pool].isClosed()) {
        const double atFirst = system.countAtFirst(pool);
        for (int i = 0; i < nucleator.order; i++)
            rate *= max(0.0, (state.free[pool]-i)/atFirst);
        if (state.free[pool] < nucleator.monomers)
            rate = 0;
    }
    if (!nucleator.mothers.empty())
        rate *= countMonomers(nucleator, state);
    if (rate > 0)
        events.push_back({GrowthEvent::Nucleate, number, rate});
}

void ChainPopulation::listEvents(const GrowthState& state, int index, const ChainsInStep& chains,
        vector<GrowthEvent>& events) const {
    const GrowingChain& own = system.chains[index];
    const int monomers = state.ranges[index].size();
    if (own.vanishes && monomers <= own.leastMonomers) {
        double rate = 0;
        for (int end : {0, 1})
            rate += own.ends[end].states[state.endStates[2*index+end]].offRate+chains.findOffRate(index, end);
        if (rate > 0)
            events.push_back({GrowthEvent::Vanish, index, rate});
    }
    if (own.severing.rate > 0)
        events.push_back({GrowthEvent::Sever, index, own.severing.rate*(monomers-1)});
    chains.forHands(index, -1, [&] (const ActingHand& hand) {
        // One that is at an end, or where it has cut already, cuts no more.
        const int monomer = static_cast<int>(round(hand.position/shapes.getMonomerLength(index)));
        if (monomer <= state.ranges[index].first || monomer >= state.ranges[index].last)
            return;
        events.push_back({GrowthEvent::Sever, index, hand.rate});
        events.back().monomer = monomer;
    });
}

int ChainPopulation::apply(GrowthState& state, const GrowthStep& step, const GrowthEvent& event, double time,
        RandomNumbers& random, ChainsInStep& chains, GrowthChanges& changes) {
    if (event.kind == GrowthEvent::Nucleate)
        return nucleate(state, step, event.index, time, random, chains, changes);
    if (event.kind == GrowthEvent::Sever)
        return sever(state, step, event, time, random, chains, changes);
    vanish(state, event.index, random, chains, changes);
    return -1;
}

Vec3d ChainPopulation::drawDirection(int index, RandomNumbers& random) const {
    const double cosine = shapes.isPlanar(index) ? 0 : 2*random.uniform()-1, azimuth = 2*M_PI*random.uniform();
    return findDirection(cosine, azimuth);
}

Vec3d ChainPopulation::drawPlace(const Nucleator& nucleator, const GrowthStep& step, RandomNumbers& random) const {
    const double x = random.uniform(), y = random.uniform(), z = random.uniform();
    switch (nucleator.region) {
        case NucleationRegion::PeriodicBox: {
            const double* box = step.box;
            return Vec3d {box[0], box[1], box[2]}*x+Vec3d {box[3], box[4], box[5]}*y+Vec3d {box[6], box[7], box[8]}*z;
        }
        case NucleationRegion::Cuboid: {
            const Vec3d size = nucleator.upper-nucleator.lower;
            return nucleator.lower+Vec3d {size.x*x, size.y*y, size.z*z};
        }
        case NucleationRegion::Sphere:
            return nucleator.centre+findDirection(2*y-1, 2*M_PI*z)*(nucleator.radius*cbrt(x));
    }
    return nucleator.centre;
}

/** Find the energy of the tethers of a chain, all of which are of its first node. */
double ChainPopulation::findTetherEnergy(int index, const Vec3d& first, const ChainsInStep& chains) const {
    double energy = 0;
    for (const Tether& tether : chains.getChain(index).tethers)
        energy += 0.5*tether.stiffness*(first-Vec3d {tether.point[0], tether.point[1], tether.point[2]}).squared();
    return energy;
}

/** Find how many monomers all mothers have that chains may be branches of. */
long long ChainPopulation::countMonomers(const Nucleator& nucleator, const GrowthState& state) const {
    long long count = 0;
    for (int mother : nucleator.mothers)
        count += state.ranges[mother].size();
    return count;
}

bool ChainPopulation::isInRegion(const Nucleator& nucleator, const Vec3d& place) const {
    if (nucleator.region == NucleationRegion::Sphere)
        return (place-nucleator.centre).squared() <= nucleator.radius*nucleator.radius;
    const Vec3d &low = nucleator.lower, &high = nucleator.upper;
    return nucleator.region == NucleationRegion::PeriodicBox || (place.x >= low.x && place.x <= high.x &&
            place.y >= low.y && place.y <= high.y && place.z >= low.z && place.z <= high.z);
}

/** Draw the angle of a branch in equilibrium: its density is sin(theta) exp(-K (theta-theta0)^2/2 k_B T). */
double ChainPopulation::drawAngle(const BranchPlace& branch, double kT, RandomNumbers& random) const {
    const double deviation = branch.stiffness > 0 ? sqrt(kT/branch.stiffness) : HUGE_VAL;
    while (true) {
        double angle = branch.angle;
        if (deviation > 1)
            angle = M_PI*random.uniform();
        else if (kT > 0)
            angle += deviation*sqrt(2*random.exponential())*cos(2*M_PI*random.uniform());
        const double off = (angle-branch.angle)/deviation;
        const double weight = deviation > 1 ? sin(angle)*exp(-0.5*off*off) : sin(angle);
        if (angle > 0 && angle < M_PI && (kT == 0 || random.uniform() < weight))
            return angle;
    }
}

/** Draw where a branch begins; false if none does there. */
bool ChainPopulation::findBranchPlace(const GrowthState& state, const GrowthStep& step, int number,
        RandomNumbers& random, ChainsInStep& chains, ChainBranch& branch, Vec3d& start, Vec3d& direction) {
    const Nucleator& nucleator = system.nucleators[number];
    long long monomer = static_cast<long long>(random.uniform()*countMonomers(nucleator, state));
    size_t chosen = 0;
    while (monomer >= state.ranges[nucleator.mothers[chosen]].size())
        monomer -= state.ranges[nucleator.mothers[chosen++]].size();
    const int mother = nucleator.mothers[chosen];
    const vector<double> along = shapes.findLengths(mother, state.ranges[mother]);
    branch = {number, -1, system.chains[mother].chain, along[0]+(monomer+random.uniform())*
            shapes.getMonomerLength(mother), 0};
    if (branch.along+nucleator.branch.beyond > along.back())
        return false;
    const vector<Vec3d>& nodes = chains.getNodes(mother);
    const SegmentPlace found = findAlong(along, branch.along);
    const Vec3d between = nodes[found.segment+1]-nodes[found.segment];
    const Vec3d place = nodes[found.segment]+between*found.fraction;
    if (!isInRegion(nucleator, place))
        return false;
    const Vec3d tangent = unit(between);
    const double azimuth = 2*M_PI*random.uniform(), angle = drawAngle(nucleator.branch, step.kT, random);
    const Vec3d across = shapes.isPlanar(mother) ? Vec3d {-tangent.y, tangent.x, 0}*(azimuth < M_PI ? 1 : -1) :
            findAcross(tangent, azimuth);
    start = place+across*nucleator.branch.distance;
    direction = tangent*cos(angle)+across*sin(angle);
    return true;
}

int ChainPopulation::nucleate(GrowthState& state, const GrowthStep& step, int number, double time,
        RandomNumbers& random, ChainsInStep& chains, GrowthChanges& changes) {
    const Nucleator& nucleator = system.nucleators[number];
    ChainBranch branch = {number, -1, -1, 0, 0};
    Vec3d start, direction = nucleator.direction;
    if (!nucleator.mothers.empty()) {
        if (!findBranchPlace(state, step, number, random, chains, branch, start, direction))
            return -1;
    }
    else
        start = drawPlace(nucleator, step, random);
    const auto found = find_if(nucleator.chains.begin(), nucleator.chains.end(), [&] (int index) {
        return state.ranges[index].size() == 0;
    });
    if (found == nucleator.chains.end()) {
        state.population.waited++;
        return -1;
    }
    const int index = *found;
    const GrowingChain& own = system.chains[index];
    const MonomerRange range = {0, nucleator.monomers};
    const vector<Vec3d> before = {start};
    if (direction.squared() == 0)
        direction = drawDirection(index, random);
    const vector<Vec3d> nodes = shapes.draw(index, range, before[0], direction, step.kT, random);
    const vector<double> alongBefore = {0}, alongAfter = shapes.findLengths(index, range);
    const EndChange change = {own.chain, 1, before, nodes, 0, static_cast<int>(nodes.size())-1, alongBefore,
            alongAfter, 1};
    if (!chains.isTaken(chains.findChange(change)+findTetherEnergy(index, nodes[0], chains), random))
        return -1;
    chains.show(index, nodes, alongAfter);
    chains.set(index, nodes);
    state.ranges[index] = range;
    returnMonomers(state, index, -nucleator.monomers);
    // Its monomers are new.
    state.endStates[2*index] = state.endStates[2*index+1] = 0;
    state.phases[2*index] = state.phases[2*index+1] = 0;
    if (own.monomersHaveStates)
        state.monomers[index].assign(range.size(), {time, 0});
    state.identities[index] = state.nextIdentity++;
    state.parents[index] = -1;
    state.population.nucleated++;
    if (branch.mother >= 0) {
        branch.chain = own.chain;
        branch.cutsBefore = changes.cuts.size();
        changes.branches.push_back(branch);
    }
    return index;
}

void ChainPopulation::vanish(GrowthState& state, int index, RandomNumbers& random, ChainsInStep& chains,
        GrowthChanges& changes) {
    const vector<Vec3d>& nodes = chains.getNodes(index);
    const int segments = nodes.size()-1;
    if (chains.isAnyFixed(index, 0, nodes.size()))
        return;
    const MonomerRange range = state.ranges[index];
    const vector<Vec3d> after = {nodes[0]};
    const vector<double> alongBefore = shapes.findLengths(index, range), alongAfter = {alongBefore[0]};
    const EndChange change = {system.chains[index].chain, 1, nodes, after, segments, 0, alongBefore, alongAfter, 1};
    if (!chains.isTaken(chains.findChange(change)-findTetherEnergy(index, nodes[0], chains), random))
        return;
    returnMonomers(state, index, range.size());
    clear(state, index, chains, changes);
    state.population.vanished++;
}

/** Let a chain have no monomers any more. */
void ChainPopulation::clear(GrowthState& state, int index, ChainsInStep& chains, GrowthChanges& changes) const {
    const vector<Vec3d> first(1, chains.getNodes(index)[0]);
    chains.show(index, first, vector<double>(1, shapes.findLengths(index, state.ranges[index])[0]));
    chains.set(index, first);
    chains.addCut({system.chains[index].chain, -1, -HUGE_VAL}, changes);
    state.ranges[index] = {};
    state.monomers[index].clear();
    state.identities[index] = state.parents[index] = -1;
}

/** Let a chain return monomers to its pool, or take some if there are less than none. */
void ChainPopulation::returnMonomers(GrowthState& state, int index, long long count) const {
    const int pool = system.chains[index].pool;
    if (system.pools[pool].isClosed())
        state.free[pool] += count;
}

/** Whether a chain is cut before a monomer, which depends on its state. */
bool ChainPopulation::mayCut(GrowthState& state, int index, int monomer, double time, RandomNumbers& random) const {
    const GrowingChain& own = system.chains[index];
    if (!own.monomersHaveStates || own.severing.shares.empty())
        return true;
    MonomersOfChain monomers(state.monomers[index], own.ends[1].states);
    const int number = monomer-state.ranges[index].first;
    const int found = number == state.ranges[index].size()-1 ? state.endStates[2*index+1] :
            monomers.revealAt(number, time, random);
    return random.uniform() < own.severing.shares[found];
}

void ChainPopulation::cutByPlane(GrowthState& state, const GrowthStep& step, int index, RandomNumbers& random,
        ChainsInStep& chains, GrowthChanges& changes) {
    const vector<Vec3d> nodes = chains.getNodes(index);
    const vector<double> along = shapes.findLengths(index, state.ranges[index]);
    auto findHeight = [&] (size_t node) {
        return (nodes[node]-step.plane->point).dot(step.plane->normal);
    };
    // From its plus end on: what is before a cut stays this chain.
    for (size_t segment = nodes.size()-1; segment-- > 0;) {
        const double first = findHeight(segment), second = findHeight(segment+1);
        if ((first < 0) == (second < 0))
            continue;
        const double place = along[segment]+(along[segment+1]-along[segment])*first/(first-second);
        GrowthEvent cut = {GrowthEvent::Sever, index, 0};
        cut.monomer = static_cast<int>(round(place/shapes.getMonomerLength(index)));
        if (cut.monomer <= state.ranges[index].first || cut.monomer >= state.ranges[index].last)
            continue;
        changes.crossings++;
        // Energies are those of what is around the ends that are drawn there.
        const PopulationEvents before = state.population;
        for (int trial = 0; trial < MOST_TRIALS && state.population.severed == before.severed &&
                state.population.waited == before.waited; trial++)
            sever(state, step, cut, state.time, random, chains, changes);
    }
}

int ChainPopulation::sever(GrowthState& state, const GrowthStep& step, const GrowthEvent& event, double time,
        RandomNumbers& random, ChainsInStep& chains, GrowthChanges& changes) {
    const int index = event.index;
    const GrowingChain& own = system.chains[index];
    const MonomerRange before = state.ranges[index];
    int monomer = event.monomer;
    if (monomer == GrowthEvent::ANY_MONOMER) {
        monomer = before.first+1+min(before.size()-2, static_cast<int>(random.uniform()*(before.size()-1)));
        if (!mayCut(state, index, monomer, time, random))
            return -1;
    }
    const MonomerRange ranges[] = {{before.first, monomer}, {monomer, before.last}};
    bool stays[2] = {};
    for (int side : {0, 1}) {
        stays[side] = ranges[side].size() >= own.leastMonomers;
        if (!stays[side] && !own.vanishes)
            return -1;
    }
    if (!stays[0] && !chains.getChain(index).tethers.empty())
        return -1;
    int part = index;
    if (stays[0] && stays[1]) {
        // Any that is made of the same will do.
        for (part = 0; part < static_cast<int>(system.chains.size()); part++)
            if (state.ranges[part].size() == 0 && shapes.areAlike(part, index) &&
                    system.chains[part].pool == own.pool && chains.getChain(part).tethers.empty())
                break;
        if (part == static_cast<int>(system.chains.size())) {
            state.population.waited++;
            return -1;
        }
    }

    // Each side is first what was cut, and then what its monomers make it.

    const vector<Vec3d> nodes = chains.getNodes(index);
    const vector<double> along = shapes.findLengths(index, before);
    const double cut = along[0]+(monomer-before.first)*(along.back()-along[0])/before.size();
    const int targets[] = {index, part};
    CutSide sides[2];
    for (int side : {0, 1})
        if (stays[side])
            sides[side] = cutSide(index, side, cut, nodes, along, before, ranges[side], step.kT, random);
    // What is fixed is at the minus end.
    const int first = stays[0] ? sides[0].carried.nodes.size()-1 : 0;
    if (chains.isAnyFixed(index, first, nodes.size()-first))
        return -1;
    const vector<double> none = {along[0]};
    if (part != index)
        chains.move(index, part, cut);
    for (int side : {0, 1})
        if (stays[side])
            chains.show(targets[side], sides[side].nodes, sides[side].along);
    bool isTaken = true;
    for (int side : {0, 1}) {
        if (!stays[side] || !isTaken)
            continue;
        const CutSide& own = sides[side];
        const EndChange change = {system.chains[targets[side]].chain, 1-side, own.nodes, own.carried.nodes,
                own.segments, 1, own.along, own.alongAfter, own.segments == 2 ? own.carried.joint : 1};
        isTaken = chains.isTaken(chains.findChange(change), random);
        if (isTaken)
            chains.show(targets[side], own.carried.nodes, own.alongAfter);
    }
    if (!isTaken) {
        if (part != index) {
            chains.show(part, {nodes[0]}, none);
            chains.move(part, index, -HUGE_VAL);
        }
        chains.show(index, nodes, along);
        return -1;
    }
    for (int side : {0, 1}) {
        if (stays[side])
            chains.set(targets[side], sides[side].carried.nodes);
        else {
            returnMonomers(state, index, ranges[side].size());
            state.population.vanished++;
        }
    }
    if (!stays[0] && !stays[1])
        clear(state, index, chains, changes);
    else
        setParts(state, index, part, monomer, stays, time, random);
    if (part != index)
        chains.addCut({own.chain, system.chains[part].chain, cut}, changes);
    state.population.severed++;
    return part == index ? -1 : part;
}

/** Cut a chain at a length along it, and draw one of the sides with the segments of its monomers. */
ChainPopulation::CutSide ChainPopulation::cutSide(int index, int side, double cut, const vector<Vec3d>& nodes,
        const vector<double>& along, MonomerRange before, MonomerRange range, double kT, RandomNumbers& random) const {
    // Rounding does not make segments of almost no length.
    const double least = 0.1*shapes.getMonomerLength(index);
    int segment = 0;
    while (along[segment+1] < cut-least)
        segment++;
    const bool isAtNode = along[segment+1] < cut+least;
    const double fraction = isAtNode ? 1 : (cut-along[segment])/(along[segment+1]-along[segment]);
    CutSide result;
    if (side == 0) {
        result.nodes.assign(nodes.begin(), nodes.begin()+segment+1);
        result.along.assign(along.begin(), along.begin()+segment+1);
    }
    result.nodes.push_back(nodes[segment]+(nodes[segment+1]-nodes[segment])*fraction);
    result.along.push_back(cut);
    if (side == 1) {
        const int next = segment+(isAtNode ? 2 : 1);
        result.nodes.insert(result.nodes.end(), nodes.begin()+next, nodes.end());
        result.along.insert(result.along.end(), along.begin()+next, along.end());
    }
    result.carried = shapes.carryEnd(index, before, range, 1-side, nodes, kT, random);
    result.alongAfter = shapes.findLengths(index, range);
    result.segments = static_cast<int>(result.nodes.size())-static_cast<int>(result.carried.nodes.size())+1;
    return result;
}

/** Let both parts of a chain that was cut before a monomer have their monomers, and these their states. */
void ChainPopulation::setParts(GrowthState& state, int index, int part, int monomer, const bool* stays, double time,
        RandomNumbers& random) const {
    const GrowingChain& own = system.chains[index];
    const MonomerRange before = state.ranges[index];
    const int plusState = state.endStates[2*index+1], number = monomer-before.first;
    int ofMinus = own.severing.minusState, ofPlus = own.severing.plusState;
    deque<MonomerState> all;
    all.swap(state.monomers[index]);
    if (own.monomersHaveStates) {
        MonomersOfChain monomers(all, own.ends[1].states);
        monomers.set(0, {time, state.endStates[2*index]});
        monomers.set(1, {time, plusState});
        ofMinus = monomers.revealAt(number, time, random);
        ofPlus = monomers.revealAt(number-1, time, random);
    }
    auto setPart = [&] (int target, MonomerRange range) {
        state.ranges[target] = range;
        if (own.monomersHaveStates)
            state.monomers[target].assign(all.begin()+range.first-before.first, all.begin()+range.last-before.first);
    };
    if (stays[0]) {
        setPart(index, {before.first, monomer});
        state.endStates[2*index+1] = ofPlus;
    }
    if (stays[1]) {
        setPart(part, {monomer, before.last});
        state.endStates[2*part] = ofMinus;
        state.endStates[2*part+1] = plusState;
        state.phases[2*part+1] = state.phases[2*index+1];
        state.phases[2*part] = 0;
    }
    if (part != index) {
        state.parents[part] = state.identities[index];
        state.identities[part] = state.nextIdentity++;
    }
}
