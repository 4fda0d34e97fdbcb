#include "openmm/CylinderChainGrowthForce.h"
#include "openmm/OpenMMException.h"
#include "openmm/internal/AssertionUtilities.h"
#include "openmm/internal/CylinderChainGrowthForceImpl.h"
#include <algorithm>
#include <cmath>
#include <string>

using namespace OpenMM;
using namespace cylchain;
using namespace std;

/** The numbers of a segment in a table. */
static const size_t PER_SEGMENT = 8;
/** Of monomers: twice as many, and what is added to them, are still integers. */
static const int MOST_MONOMERS = 1000000000;

static void requireOfGrowth(bool condition, const string& message) {
    if (!condition)
        throw OpenMMException("CylinderChainGrowthForce: "+message);
}

static bool isRate(double value) {
    return value >= 0 && isfinite(value);
}

/** Get an end of a chain; a const one of a const chain. */
template <class Chain> static auto& endOf(Chain& chain, int end) {
    requireOfGrowth(end == 0 || end == 1, "An end is 0 or 1, minus or plus, but is "+to_string(end));
    return chain.ends[end];
}

CylinderChainGrowthForce::CylinderChainGrowthForce() {
    setName("CylinderChainGrowthForce");
}

int CylinderChainGrowthForce::addTable(int monomersPerSegment, const vector<double>& parameters,
        const vector<double>& loads) {
    requireOfGrowth(monomersPerSegment >= 2 && monomersPerSegment < 1000000,
            "A segment must have at least two monomers, and "
            "less than a million");
    requireOfGrowth(parameters.size() == 2*PER_SEGMENT*monomersPerSegment,
            "A table must have eight numbers for each segment "
            "of up to "+
                    to_string(2*monomersPerSegment)+" monomers");
    requireOfGrowth(loads.size() == (size_t) 3*monomersPerSegment-1,
            "A table must have the stiffness of each joint of two "
            "segments of up to "+
                    to_string(3*monomersPerSegment)+" monomers");
    MonomerTable table;
    table.monomersPerSegment = monomersPerSegment;
    for (int m = 0; m < 2*monomersPerSegment; m++) {
        const double* p = &parameters[PER_SEGMENT*m];
        const Segment segment = {p[0], p[1], p[2], p[3], p[4], p[5], p[6], p[7]};
        requireOfGrowth(
                p[0] > 0 && p[1] > 0 && isRate(p[0]) && isRate(p[1]), "Rest lengths and stiffnesses must be positive");
        requireOfGrowth(p[3] > 0 && p[4] > 0 && p[5] > 0 && p[6] > 0 && isRate(p[3]+p[4]+p[5]+p[6]),
                "Frictions of segments must be positive");
        requireOfGrowth(
                isRate(p[2]) && isfinite(p[7]), "A segment has a maximum extension or a propulsion that is not finite");
        requireOfGrowth(m == 0 || p[0] > p[0-(int) PER_SEGMENT], "Segments with more monomers must be longer");
        table.segments.push_back(segment);
    }
    for (double stiffness : loads) {
        requireOfGrowth(isRate(stiffness), "The stiffness of a joint cannot be negative and must be finite");
        table.joints.push_back(stiffness);
    }
    system.tables.push_back(table);
    return system.tables.size()-1;
}

void CylinderChainGrowthForce::getTable(int index, int& monomersPerSegment, vector<double>& parameters,
        vector<double>& loads) const {
    ASSERT_VALID_INDEX(index, system.tables);
    const MonomerTable& table = system.tables[index];
    monomersPerSegment = table.monomersPerSegment;
    parameters.clear();
    for (const Segment& segment : table.segments)
        parameters.insert(parameters.end(), {segment.restLength, segment.stiffness, segment.maximumExtension,
                segment.parallel, segment.perpendicular, segment.rotational, segment.extensional, segment.propulsion});
    loads = table.joints;
}

int CylinderChainGrowthForce::addPool(double concentration, double volume) {
    requireOfGrowth(isRate(concentration), "A concentration cannot be negative and must be finite");
    requireOfGrowth(isRate(volume), "The volume of a pool cannot be negative and must be finite");
    requireOfGrowth(concentration*volume < 1e15, "A pool has more monomers than can be counted");
    system.pools.push_back({concentration, volume});
    return system.pools.size()-1;
}

void CylinderChainGrowthForce::getPoolParameters(int pool, double& concentration, double& volume) const {
    ASSERT_VALID_INDEX(pool, system.pools);
    concentration = system.pools[pool].concentration;
    volume = system.pools[pool].volume;
}

int CylinderChainGrowthForce::addGrowingChain(int chain, int table, int pool, int firstMonomer, int lastMonomer,
        int leastMonomers, bool vanishes) {
    requireOfGrowth(table >= 0 && table < getNumTables(), "There is no table "+to_string(table));
    requireOfGrowth(pool >= 0 && pool < getNumPools(), "There is no pool "+to_string(pool));
    requireOfGrowth(chain >= 0, "There is no chain "+to_string(chain));
    for (const GrowingChain& other : system.chains)
        requireOfGrowth(other.chain != chain, "Chain "+to_string(chain)+" grows already");
    const bool isEmpty = firstMonomer == 0 && lastMonomer == 0;
    requireOfGrowth(firstMonomer > -MOST_MONOMERS && lastMonomer < MOST_MONOMERS &&
            (isEmpty || firstMonomer < lastMonomer), "The numbers of monomers must increase along chain "+
            to_string(chain));
    requireOfGrowth(leastMonomers >= 2 && (isEmpty || lastMonomer-firstMonomer >= leastMonomers), "Chain "+
            to_string(chain)+" has fewer monomers than it can have, or can have less than two");
    GrowingChain own;
    own.chain = chain;
    own.table = table;
    own.pool = pool;
    own.leastMonomers = leastMonomers;
    own.vanishes = vanishes;
    system.chains.push_back(own);
    ranges.push_back({firstMonomer, lastMonomer});
    return system.chains.size()-1;
}

void CylinderChainGrowthForce::getGrowingChainParameters(int index, int& chain, int& table, int& pool,
        int& firstMonomer, int& lastMonomer, int& leastMonomers, bool& vanishes) const {
    const GrowingChain& own = getOwn(index);
    chain = own.chain;
    table = own.table;
    pool = own.pool;
    firstMonomer = ranges[index].first;
    lastMonomer = ranges[index].last;
    leastMonomers = own.leastMonomers;
    vanishes = own.vanishes;
}

GrowingChain& CylinderChainGrowthForce::getOwn(int index) {
    ASSERT_VALID_INDEX(index, system.chains);
    return system.chains[index];
}

const GrowingChain& CylinderChainGrowthForce::getOwn(int index) const {
    ASSERT_VALID_INDEX(index, system.chains);
    return system.chains[index];
}

void CylinderChainGrowthForce::setEndStates(int index, int end, int initialState, const vector<double>& parameters,
        const vector<int>& numbers, const vector<double>& loads) {
    GrowingChain& chain = getOwn(index);
    GrowingEnd& before = endOf(chain, end);
    const size_t count = parameters.size()/2;
    requireOfGrowth(count >= 1 && parameters.size() == 2*count && numbers.size() == 2*count &&
            loads.size() == count*count, "There must be two rates and two numbers for each state of an end, and a rate "
            "from each to each");
    auto isState = [&] (int state) {
        return state >= 0 && state < static_cast<int>(count);
    };
    requireOfGrowth(isState(initialState) && all_of(numbers.begin(), numbers.end(), isState),
            "An end of chain "+to_string(chain.chain)+" has no such state");
    for (const vector<double>* rates : {&parameters, &loads})
        requireOfGrowth(all_of(rates->begin(), rates->end(), isRate), "The rates of chain "+to_string(chain.chain)+
                " cannot be negative and must be finite");
    GrowingEnd own;
    own.states.clear();
    own.timing = before.timing;
    own.initialState = initialState;
    for (size_t i = 0; i < count; i++) {
        vector<double> rates(loads.begin()+i*count, loads.begin()+(i+1)*count);
        requireOfGrowth(rates[i] == 0, "No state can change to itself");
        own.states.push_back({parameters[2*i], parameters[2*i+1], numbers[2*i], numbers[2*i+1], rates, {}, 0});
    }
    before = move(own);
}

void CylinderChainGrowthForce::getEndStates(int index, int end, int& initialState, vector<double>& parameters,
        vector<int>& numbers, vector<double>& loads) const {
    const GrowingEnd& own = endOf(getOwn(index), end);
    initialState = own.initialState;
    parameters.clear();
    numbers.clear();
    loads.clear();
    for (const EndState& state : own.states) {
        parameters.insert(parameters.end(), {state.onRate, state.offRate});
        numbers.insert(numbers.end(), {state.afterGain, state.afterLoss});
        loads.insert(loads.end(), state.switchRates.begin(), state.switchRates.end());
        loads.resize(numbers.size()/2*own.states.size(), 0);
    }
}

/** Set rates of the states of an end, from each to each, in one of their vectors, which is empty if all are zero. */
static void setRates(vector<EndState>& states, vector<double> EndState::*own, const vector<double>& rates) {
    const size_t count = states.size();
    requireOfGrowth(rates.size() == count*count, "There must be a rate from each state of an end to each");
    requireOfGrowth(all_of(rates.begin(), rates.end(), isRate), "Rates of ends cannot be negative and must be finite");
    for (size_t i = 0; i < count; i++) {
        requireOfGrowth(rates[i*count+i] == 0, "No state can change to itself");
        vector<double>& values = states[i].*own;
        values.assign(rates.begin()+i*count, rates.begin()+(i+1)*count);
        if (all_of(values.begin(), values.end(), [] (double rate) {return rate == 0;}))
            values.clear();
    }
}

static void getRates(const vector<EndState>& states, vector<double> EndState::*own, vector<double>& rates) {
    rates.clear();
    for (size_t i = 0; i < states.size(); i++) {
        const vector<double>& values = states[i].*own;
        rates.insert(rates.end(), values.begin(), values.end());
        rates.resize((i+1)*states.size(), 0);
    }
}

void CylinderChainGrowthForce::setEndSwitching(int index, int end, const vector<double>& lengths,
        const vector<double>& rates) {
    vector<EndState>& states = endOf(getOwn(index), end).states;
    requireOfGrowth(lengths.size() == states.size() && all_of(lengths.begin(), lengths.end(), isRate),
            "There must be a length for each state of an end, which cannot be negative and must be finite");
    setRates(states, &EndState::blockedRates, rates);
    for (size_t i = 0; i < states.size(); i++)
        states[i].lengthOfRates = lengths[i];
}

void CylinderChainGrowthForce::getEndSwitching(int index, int end, vector<double>& lengths,
        vector<double>& rates) const {
    const vector<EndState>& states = endOf(getOwn(index), end).states;
    lengths.clear();
    for (const EndState& state : states)
        lengths.push_back(state.lengthOfRates);
    getRates(states, &EndState::blockedRates, rates);
}

void CylinderChainGrowthForce::setSwitchingOfShortest(int index, int end, const vector<double>& rates) {
    setRates(endOf(getOwn(index), end).states, &EndState::ratesOfShortest, rates);
}

void CylinderChainGrowthForce::getSwitchingOfShortest(int index, int end, vector<double>& rates) const {
    getRates(endOf(getOwn(index), end).states, &EndState::ratesOfShortest, rates);
}

void CylinderChainGrowthForce::setEndTiming(int index, int end, bool isRegular, double energy) {
    requireOfGrowth(isRate(energy), "The energy of loads cannot be negative and must be finite");
    endOf(getOwn(index), end).timing = {isRegular, energy};
}

void CylinderChainGrowthForce::getEndTiming(int index, int end, bool& isRegular, double& energy) const {
    const EndTiming& own = endOf(getOwn(index), end).timing;
    isRegular = own.isRegular;
    energy = own.energyOfLoad;
}

void CylinderChainGrowthForce::setMonomersHaveStates(int index, bool monomersHaveStates) {
    getOwn(index).monomersHaveStates = monomersHaveStates;
}

bool CylinderChainGrowthForce::getMonomersHaveStates(int index) const {
    return getOwn(index).monomersHaveStates;
}

void CylinderChainGrowthForce::setSevering(int index, double rate, int minusState, int plusState,
        const vector<double>& parameters) {
    GrowingChain& own = getOwn(index);
    requireOfGrowth(isRate(rate), "The rate of cutting chain "+to_string(own.chain)+" cannot be negative and must be "
            "finite");
    requireOfGrowth(all_of(parameters.begin(), parameters.end(), [] (double share) {return share >= 0 && share <= 1;}),
            "Shares are between 0 and 1");
    own.severing = {rate, parameters, minusState, plusState};
}

void CylinderChainGrowthForce::getSevering(int index, double& rate, int& minusState, int& plusState,
        vector<double>& parameters) const {
    const ChainSevering& own = getOwn(index).severing;
    rate = own.rate;
    minusState = own.minusState;
    plusState = own.plusState;
    parameters = own.shares;
}

int CylinderChainGrowthForce::addNucleator(double rate, int order, int monomers, int region,
        const vector<double>& parameters, const Vec3& direction, const vector<int>& numbers) {
    requireOfGrowth(isRate(rate), "The rate of a nucleator cannot be negative and must be finite");
    requireOfGrowth(order >= 0 && order <= 100, "The order of a nucleator must be from 0 to 100");
    requireOfGrowth(region >= 0 && region <= 2, "There is no region "+to_string(region));
    const size_t sizes[] = {0, 6, 4};
    requireOfGrowth(parameters.size() == sizes[region], "A region needs "+to_string(sizes[region])+" numbers, but has "+
            to_string(parameters.size()));
    requireOfGrowth(all_of(parameters.begin(), parameters.end(), [] (double x) {return isfinite(x);}),
            "A region must be finite");
    Nucleator own;
    own.rate = rate;
    own.order = order;
    own.monomers = monomers;
    own.region = static_cast<NucleationRegion>(region);
    const double* p = parameters.data();
    if (region == 1) {
        own.lower = {p[0], p[1], p[2]};
        own.upper = {p[3], p[4], p[5]};
    }
    if (region == 2) {
        own.centre = {p[0], p[1], p[2]};
        own.radius = p[3];
        requireOfGrowth(own.radius >= 0, "The radius of a sphere cannot be negative");
    }
    const double length = sqrt(direction.dot(direction));
    requireOfGrowth(isfinite(length), "A direction must be finite");
    if (length > 0)
        own.direction = {direction[0]/length, direction[1]/length, direction[2]/length};
    for (int index : numbers) {
        const GrowingChain& chain = getOwn(index);
        const GrowingChain& first = getOwn(numbers[0]);
        requireOfGrowth(monomers >= chain.leastMonomers, "Chain "+to_string(chain.chain)+" cannot begin with "+
                to_string(monomers)+" monomers");
        requireOfGrowth(chain.table == first.table && chain.pool == first.pool,
                "The chains of a nucleator must be made of the same, and have one pool");
    }
    own.chains = numbers;
    system.nucleators.push_back(own);
    return system.nucleators.size()-1;
}

void CylinderChainGrowthForce::setBranching(int index, double angle, double stiffness, double distance, double beyond,
        const vector<int>& numbers) {
    ASSERT_VALID_INDEX(index, system.nucleators);
    requireOfGrowth(angle >= 0 && angle <= M_PI, "The angle of branches must be from 0 to pi");
    for (double value : {stiffness, distance, beyond})
        requireOfGrowth(isRate(value), "The stiffness and lengths of branches cannot be negative and must be finite");
    for (int number : numbers)
        getOwn(number);
    system.nucleators[index].mothers = numbers;
    system.nucleators[index].branch = {angle, stiffness, distance, beyond};
}

void CylinderChainGrowthForce::getBranching(int index, double& angle, double& stiffness, double& distance,
        double& beyond, vector<int>& numbers) const {
    ASSERT_VALID_INDEX(index, system.nucleators);
    const Nucleator& own = system.nucleators[index];
    angle = own.branch.angle;
    stiffness = own.branch.stiffness;
    distance = own.branch.distance;
    beyond = own.branch.beyond;
    numbers = own.mothers;
}

void CylinderChainGrowthForce::getNucleatorParameters(int index, double& rate, int& order, int& monomers, int& region,
        vector<double>& parameters, Vec3& direction, vector<int>& numbers) const {
    ASSERT_VALID_INDEX(index, system.nucleators);
    const Nucleator& own = system.nucleators[index];
    rate = own.rate;
    order = own.order;
    monomers = own.monomers;
    region = static_cast<int>(own.region);
    parameters.clear();
    if (own.region == NucleationRegion::Cuboid)
        for (const Vec3d& corner : {own.lower, own.upper})
            parameters.insert(parameters.end(), {corner.x, corner.y, corner.z});
    if (own.region == NucleationRegion::Sphere)
        parameters = {own.centre.x, own.centre.y, own.centre.z, own.radius};
    direction = Vec3(own.direction.x, own.direction.y, own.direction.z);
    numbers = own.chains;
}

void CylinderChainGrowthForce::setMonomers(ChainList& chains, set<int>& growing) const {
    for (size_t i = 0; i < system.chains.size(); i++) {
        const GrowingChain& own = system.chains[i];
        const string name = "Chain "+to_string(own.chain);
        requireOfGrowth(own.chain < chains.size() && chains.getKind(own.chain) == ChainKind::StraightSegments &&
                !chains.isClosed(own.chain), name+" cannot grow: it is no open chain of straight segments");
        Chain& chain = chains.getChain(own.chain);
        requireOfGrowth(
                isAngular(chain.bending) && chain.nodeFriction == 0, name+" cannot grow: it is a chain of beads");
        for (const Tether& tether : chain.tethers)
            requireOfGrowth(tether.node == 0 && !own.ends[0].grows(), name+" cannot grow: node "+
                    to_string(tether.node)+" has a tether. The first one may have some, of a minus end that does not "
                    "grow");
        const MonomerTable& table = system.tables[own.table];
        if (hasRange(chain.stretching))
            for (const Segment& segment : table.segments)
                requireOfGrowth(
                        segment.maximumExtension > 0, name+" cannot grow: its segments have no maximum extension");
        for (size_t node = 0; node < chain.fixed.size(); node++)
            requireOfGrowth(!chain.fixed[node] || (!own.ends[0].grows() &&
                    node < (size_t) SegmentDivision(ranges[i], table.monomersPerSegment).countSegments()),
                    name+" cannot grow: particle "+to_string(chain.nodes[node])+" has no mass. Nodes may be fixed "
                    "beside a minus end that does not grow");
        const bool isAnyFixed = any_of(chain.fixed.begin(), chain.fixed.end(), [] (bool fixed) {return fixed;});
        requireOfGrowth(!isAnyFixed || (ranges[i].size() > 0 && !own.vanishes),
                name+" has nodes without mass, so it cannot begin or vanish");
        for (const Nucleator& nucleator : system.nucleators)
            if (find(nucleator.chains.begin(), nucleator.chains.end(), static_cast<int>(i)) != nucleator.chains.end())
                requireOfGrowth(SegmentDivision({0, nucleator.monomers}, table.monomersPerSegment).countSegments() <
                        chain.numNodes(), name+" cannot begin with "+to_string(nucleator.monomers)+" monomers: it has "+
                        to_string(chain.numNodes())+" particles");
        for (int end : {0, 1}) {
            const int cut = end == 0 ? own.severing.minusState : own.severing.plusState;
            requireOfGrowth(cut >= 0 && cut < static_cast<int>(own.ends[end].states.size()), name+" has no state "+
                    to_string(cut)+" of ends at which it is cut");
        }
        requireOfGrowth(!own.monomersHaveStates || (own.ends[0].states.size() == own.ends[1].states.size() &&
                (own.severing.shares.empty() || own.severing.shares.size() == own.ends[1].states.size())),
                name+" needs as many states of its minus end, and shares of its severing, as of its plus end");
        const int segments = ranges[i].size() == 0 ? 0 :
                SegmentDivision(ranges[i], table.monomersPerSegment).countSegments();
        requireOfGrowth(segments < chain.numNodes(),
                name+" needs "+to_string(segments+1)+" nodes for its monomers, but has "+
                        to_string(chain.numNodes())+" particles");
        cylchain::setMonomers(chain, table, ranges[i]);
        growing.insert(own.chain);
    }
}

void CylinderChainGrowthForce::getGrowthInContext(Context& context, vector<int>& ends, vector<int>& numbers,
        vector<double>& parameters, vector<double>& loads) const {
    const GrowthState& state = dynamic_cast<const CylinderChainGrowthForceImpl&>(getImplInContext(context)).getState();
    ends.clear();
    parameters.clear();
    loads.clear();
    numbers = state.endStates;
    for (const MonomerRange& range : state.ranges)
        ends.insert(ends.end(), {range.first, range.last});
    for (const EndEvents& own : state.events) {
        parameters.insert(parameters.end(), {(double) own.gained, (double) own.lost, (double) own.waited});
        parameters.insert(parameters.end(), own.switches.begin(), own.switches.end());
    }
    for (size_t i = 0; i < system.pools.size(); i++)
        loads.push_back(system.pools[i].isClosed() ? state.free[i]/system.pools[i].volume :
                system.pools[i].concentration);
}

void CylinderChainGrowthForce::getPopulationInContext(Context& context, vector<double>& parameters,
        vector<double>& sums) const {
    const GrowthState& state = dynamic_cast<const CylinderChainGrowthForceImpl&>(getImplInContext(context)).getState();
    parameters.clear();
    for (size_t i = 0; i < state.ranges.size(); i++)
        parameters.insert(parameters.end(), {(double) state.identities[i], (double) state.parents[i]});
    const PopulationEvents& own = state.population;
    sums = {(double) own.nucleated, (double) own.vanished, (double) own.severed, (double) own.waited};
}

void CylinderChainGrowthForce::setGrowthInContext(Context& context, const vector<int>& ends) const {
    dynamic_cast<CylinderChainGrowthForceImpl&>(getImplInContext(context)).setEnds(ends);
}

int CylinderChainGrowthForce::cutInContext(Context& context, const Vec3& point, const Vec3& vector,
        const std::vector<int>& numbers) const {
    for (int index : numbers)
        getOwn(index);
    return dynamic_cast<CylinderChainGrowthForceImpl&>(getImplInContext(context)).cut({{point[0], point[1], point[2]},
            {vector[0], vector[1], vector[2]}, numbers});
}

ForceImpl* CylinderChainGrowthForce::createImpl() const {
    return new CylinderChainGrowthForceImpl(*this);
}
