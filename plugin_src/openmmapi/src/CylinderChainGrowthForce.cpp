#include "openmm/CylinderChainGrowthForce.h"
#include "openmm/OpenMMException.h"
#include "openmm/internal/AssertionUtilities.h"
#include "openmm/internal/CylinderChainGrowthForceImpl.h"
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
        int leastMonomers, double minusOnRate, double minusOffRate, double plusOnRate, double plusOffRate) {
    requireOfGrowth(table >= 0 && table < getNumTables(), "There is no table "+to_string(table));
    requireOfGrowth(pool >= 0 && pool < getNumPools(), "There is no pool "+to_string(pool));
    requireOfGrowth(chain >= 0, "There is no chain "+to_string(chain));
    for (const GrowingChain& other : system.chains)
        requireOfGrowth(other.chain != chain, "Chain "+to_string(chain)+" grows already");
    requireOfGrowth(firstMonomer > -MOST_MONOMERS && lastMonomer < MOST_MONOMERS && firstMonomer < lastMonomer,
            "The numbers of monomers must increase along chain "+to_string(chain));
    requireOfGrowth(leastMonomers >= 2 && lastMonomer-firstMonomer >= leastMonomers, "Chain "+to_string(chain)+
            " has fewer monomers than it can have, or can have less than two");
    for (double rate : {minusOnRate, minusOffRate, plusOnRate, plusOffRate})
        requireOfGrowth(isRate(rate), "The rates of chain "+to_string(chain)+" cannot be negative and must be finite");
    GrowingChain own = {chain, table, pool, leastMonomers, {}};
    own.ends[0].onRate = minusOnRate;
    own.ends[0].offRate = minusOffRate;
    own.ends[1].onRate = plusOnRate;
    own.ends[1].offRate = plusOffRate;
    system.chains.push_back(own);
    ranges.push_back({firstMonomer, lastMonomer});
    return system.chains.size()-1;
}

void CylinderChainGrowthForce::getGrowingChainParameters(int index, int& chain, int& table, int& pool,
        int& firstMonomer, int& lastMonomer, int& leastMonomers, double& minusOnRate, double& minusOffRate,
        double& plusOnRate, double& plusOffRate) const {
    ASSERT_VALID_INDEX(index, system.chains);
    const GrowingChain& own = system.chains[index];
    chain = own.chain;
    table = own.table;
    pool = own.pool;
    firstMonomer = ranges[index].first;
    lastMonomer = ranges[index].last;
    leastMonomers = own.leastMonomers;
    minusOnRate = own.ends[0].onRate;
    minusOffRate = own.ends[0].offRate;
    plusOnRate = own.ends[1].onRate;
    plusOffRate = own.ends[1].offRate;
}

void CylinderChainGrowthForce::setDynamicInstability(int index, int end, double shrinkingOnRate,
        double shrinkingOffRate, double catastropheRate, double rescueRate) {
    ASSERT_VALID_INDEX(index, system.chains);
    requireOfGrowth(end == 0 || end == 1, "An end is 0 or 1, minus or plus, but is "+to_string(end));
    for (double rate : {shrinkingOnRate, shrinkingOffRate, catastropheRate, rescueRate})
        requireOfGrowth(isRate(rate),
                "The rates of chain "+to_string(system.chains[index].chain)+
                        " cannot be negative and "
                        "must be finite");
    GrowingEnd& own = system.chains[index].ends[end];
    own.shrinking = {shrinkingOnRate, shrinkingOffRate};
    own.catastropheRate = catastropheRate;
    own.rescueRate = rescueRate;
}

void CylinderChainGrowthForce::getDynamicInstability(int index, int end, double& shrinkingOnRate,
        double& shrinkingOffRate, double& catastropheRate, double& rescueRate) const {
    ASSERT_VALID_INDEX(index, system.chains);
    requireOfGrowth(end == 0 || end == 1, "An end is 0 or 1, minus or plus, but is "+to_string(end));
    const GrowingEnd& own = system.chains[index].ends[end];
    shrinkingOnRate = own.shrinking.onRate;
    shrinkingOffRate = own.shrinking.offRate;
    catastropheRate = own.catastropheRate;
    rescueRate = own.rescueRate;
}

GrowthState CylinderChainGrowthForce::getState() const {
    GrowthState state;
    state.ranges = ranges;
    state.events.resize(2*ranges.size());
    state.shrinks.assign(2*ranges.size(), 0);
    for (const MonomerPool& pool : system.pools)
        state.free.push_back(llround(pool.concentration*pool.volume));
    return state;
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
        requireOfGrowth(chain.tethers.empty(), name+" cannot grow: one of its nodes has a tether");
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
        const int segments = SegmentDivision(ranges[i], table.monomersPerSegment).countSegments();
        requireOfGrowth(segments < chain.numNodes(),
                name+" needs "+to_string(segments+1)+" nodes for its monomers, but has "+
                        to_string(chain.numNodes())+" particles");
        cylchain::setMonomers(chain, table, ranges[i]);
        growing.insert(own.chain);
    }
}

void CylinderChainGrowthForce::getGrowthInContext(Context& context, vector<int>& ends, vector<int>& numbers,
        vector<double>& parameters, vector<double>& loads) const {
    const CylinderChainGrowthForceImpl& impl =
            dynamic_cast<const CylinderChainGrowthForceImpl&>(getImplInContext(context));
    const GrowthState& state = impl.getState();
    ends.clear();
    parameters.clear();
    loads.clear();
    numbers.assign(state.shrinks.begin(), state.shrinks.end());
    for (const MonomerRange& range : state.ranges)
        ends.insert(ends.end(), {range.first, range.last});
    for (const EndEvents& own : state.events)
        parameters.insert(parameters.end(), {(double) own.gained, (double) own.lost, (double) own.waited,
                (double) own.catastrophes, (double) own.rescues});
    for (size_t i = 0; i < system.pools.size(); i++)
        loads.push_back(system.pools[i].isClosed() ? state.free[i]/system.pools[i].volume :
                system.pools[i].concentration);
}

void CylinderChainGrowthForce::setGrowthInContext(Context& context, const vector<int>& ends) const {
    dynamic_cast<CylinderChainGrowthForceImpl&>(getImplInContext(context)).setEnds(ends);
}

ForceImpl* CylinderChainGrowthForce::createImpl() const {
    return new CylinderChainGrowthForceImpl(*this);
}
