#include "openmm/internal/CylinderChainGrowthForceImpl.h"
#include "openmm/CylinderChainException.h"
#include "openmm/CylinderChainIntegrator.h"
#include "openmm/CylinderChainKernels.h"
#include "openmm/OpenMMException.h"
#include "openmm/System.h"
#include "openmm/VirtualSite.h"
#include "openmm/internal/ContextImpl.h"
#include "openmm/internal/OSRngSeed.h"
#include "openmm/internal/StateDigest.h"
#include "openmm/reference/SimTKOpenMMRealType.h"
#include <algorithm>
#include <stdexcept>

using namespace OpenMM;
using namespace cylchain;
using namespace std;

static const char* const PARAMETER = "CylinderChainGrowth";

static void requireOfGrowing(bool condition, const string& message) {
    if (!condition)
        throw OpenMMException("CylinderChainGrowthForce: "+message);
}

static double digestOf(const GrowthState& state) {
    StateDigest digest;
    digest.mix(state.steps);
    for (const MonomerRange& range : state.ranges) {
        digest.mix((uint32_t) range.first);
        digest.mix((uint32_t) range.last);
    }
    for (char shrinks : state.shrinks)
        digest.mix(shrinks != 0 ? 1 : 0);
    return digest.get();
}

CylinderChainGrowthForceImpl::CylinderChainGrowthForceImpl(const CylinderChainGrowthForce& owner) :
        StepForceImpl(owner), owner(owner), context(NULL), chains(NULL), seed(0), hasCouplings(false) {
}

void CylinderChainGrowthForceImpl::initialize(ContextImpl& context) {
    this->context = &context;
    const System& system = context.getSystem();
    for (ForceImpl* impl : context.getForceImpls()) {
        requireOfGrowing(impl == this || dynamic_cast<CylinderChainGrowthForceImpl*>(impl) == NULL,
                "The System has two of them: let all chains grow by one");
        if (dynamic_cast<CylinderChainForceImpl*>(impl) != NULL)
            chains = dynamic_cast<CylinderChainForceImpl*>(impl);
    }
    requireOfGrowing(chains != NULL, "The System has no CylinderChainForce with chains that could grow");
    const CylinderChainIntegrator* const integrator = dynamic_cast<const CylinderChainIntegrator*>(
            &context.getIntegrator());
    requireOfGrowing(integrator != NULL && isImplicit(static_cast<Scheme>(integrator->getScheme())),
            "Chains that grow need a CylinderChainIntegrator with an implicit scheme");
    const string platform = context.getPlatform().getName();
    requireOfGrowing(platform == "Reference" || platform == "CPU",
            "Chains grow on the Reference and CPU platforms, not on "+platform);
    seed = (uint32_t) integrator->getRandomNumberSeed();
    if (seed == 0)
        seed = (uint32_t) osrngseed();
    state = owner.getState();
    growing.clear();
    for (const GrowingChain& own : owner.getSystem().chains)
        growing.push_back(own.chain);
    vector<bool> grows(system.getNumParticles(), false);
    for (int chain : growing)
        for (int particle : chains->getOwner().getChainParticles(chain))
            grows[particle] = true;
    for (int i = 0; i < system.getNumParticles(); i++)
        if (system.isVirtualSite(i))
            for (int k = 0; k < system.getVirtualSite(i).getNumParticles(); k++)
                requireOfGrowing(!grows[system.getVirtualSite(i).getParticle(k)],
                        "Virtual site "+to_string(i)+
                                " is on a chain "
                                "that grows, which moves along its particles: no attachments and beads are possible "
                                "there");
    places.reset(new PlaceResolver(system));
    kernel = context.getPlatform().createKernel(UpdateCylinderChainGrowthKernel::Name(), context);
    vector<BendingModel> bending;
    vector<StretchingModel> stretching;
    vector<char> planar;
    for (int number : growing) {
        const Chain& chain = chains->getOwner().getChains().getChain(number);
        bending.push_back(chain.bending);
        stretching.push_back(chain.stretching);
        planar.push_back(chain.planar);
    }
    kernel.getAs<UpdateCylinderChainGrowthKernel>().initialize(owner.getSystem(), bending, stretching, planar);
}

map<string, double> CylinderChainGrowthForceImpl::getDefaultParameters() {
    return {{PARAMETER, digestOf(state)}};
}

vector<string> CylinderChainGrowthForceImpl::getKernelNames() {
    return {UpdateCylinderChainGrowthKernel::Name()};
}

void CylinderChainGrowthForceImpl::follow() const {
    if (context->getParameter(PARAMETER) == digestOf(state))
        return;
    throw CylinderChainException(CylinderChainException::UnknownLinks, {}, "CylinderChainGrowthForce: How far the "
            "chains of this Context have grown is not known: it has got a State or checkpoint of another time, or of "
            "another Context, that does not say it. Tell it by setGrowthInContext(). The checkpoints of a "
            "CylinderChainIntegrator, and States that hold its parameters (getState(integratorParameters=True)), "
            "restore it themselves");
}

void CylinderChainGrowthForceImpl::accept() {
    context->setParameter(PARAMETER, digestOf(state));
}

/** Find what ends feel. Other Forces may be initialized after this one. */
void CylinderChainGrowthForceImpl::findCouplings() {
    const ChainList& list = chains->getDescription().getList();
    for (Felt& own : around)
        if (own.version != own.coupling->getVersionOfSurroundings()) {
            own.surroundings = own.coupling->describeSurroundings(list, growing);
            own.version = own.coupling->getVersionOfSurroundings();
        }
    if (hasCouplings)
        return;
    for (ForceImpl* impl : context->getForceImpls()) {
        CouplingForceImpl* const coupling = dynamic_cast<CouplingForceImpl*>(impl);
        if (coupling == NULL)
            continue;
        couplings.push_back(coupling);
        unique_ptr<Surroundings> found = coupling->describeSurroundings(list, growing);
        if (found)
            around.push_back({coupling, move(found), coupling->getVersionOfSurroundings()});
        else
            others.push_back({coupling, -1});
    }
    hasCouplings = true;
}

/** Throw an exception if a coupling that ends do not feel acts on chains that grow. */
void CylinderChainGrowthForceImpl::refusePlaces() {
    for (auto& other : others) {
        const long long version = other.first->getVersion();
        if (version == other.second)
            continue;
        vector<bool> grows(context->getSystem().getNumParticles(), false);
        for (int chain : growing)
            for (int particle : chains->getOwner().getChainParticles(chain))
                grows[particle] = true;
        for (const Place& place : other.first->findPlaces(*places))
            for (int particle : {place.first, place.second})
                requireOfGrowing(particle < 0 || !grows[particle],
                        other.first->getOwner().getName()+" acts on particle "+to_string(particle)+
                                " of a chain that grows, which is not possible yet: walls, contacts "
                                "and linkers of this plugin alone are");
        other.second = version;
    }
}

void CylinderChainGrowthForceImpl::updateContextState(ContextImpl& context, bool& forcesInvalid) {
    follow();
    findCouplings();
    refusePlaces();
    const double size = context.getIntegrator().getStepSize();
    if (!(size > 0))
        return;
    const CylinderChainIntegrator& integrator = dynamic_cast<const CylinderChainIntegrator&>(context.getIntegrator());
    GrowthStep step = {BOLTZ*integrator.getTemperature(), size, seed};
    vector<Surroundings*> felt;
    felt.reserve(around.size());
    for (const Felt& own : around)
        felt.push_back(own.surroundings.get());
    ChainList& list = chains->getGrowingList();
    vector<int> numNodes, changed;
    numNodes.reserve(growing.size());
    for (int chain : growing)
        numNodes.push_back(list.getNumNodes(chain));
    int failed = -1;
    try {
        failed = kernel.getAs<UpdateCylinderChainGrowthKernel>().execute(context, state, step,
                chains->getDescription().usesPeriodicBoundaryConditions(), list, felt, changed);
    }
    catch (const invalid_argument& error) {
        throw OpenMMException(string("CylinderChainContactForce: ")+error.what());
    }
    accept();
    requireOfGrowing(failed == -1, "Chains gain and lose more than a million monomers within a step, among them chain "+
            to_string(failed == -1 ? -1 : growing[failed])+": use a smaller step, or look at the rates");
    if (changed.empty())
        return;
    vector<int> numbers(changed);
    for (int& number : numbers)
        number = growing[number];
    chains->haveGrown(context, numbers);
    for (CouplingForceImpl* coupling : couplings)
        coupling->chainsHaveGrown(context, list);
    const bool otherNodes = any_of(changed.begin(), changed.end(), [&] (int i) {
        return list.getNumNodes(growing[i]) != numNodes[i];
    });
    if (otherNodes)
        setSpareNodes();
    forcesInvalid = true;
}

double CylinderChainGrowthForceImpl::calcForcesAndEnergy(ContextImpl& context, bool, bool, int) {
    follow();
    // Whoever has moved nodes, such as a minimizer, has left spare ones behind.

    kernel.getAs<UpdateCylinderChainGrowthKernel>().placeSpareNodes(context, chains->getDescription().getChains());
    return 0.0;
}

void CylinderChainGrowthForceImpl::setSpareNodes() {
    vector<bool> isSpare(context->getSystem().getNumParticles(), false);
    for (int chain : growing)
        for (int particle : chains->getDescription().getList().getChain(chain).spareNodes)
            isSpare[particle] = true;
    findCouplings();
    for (CouplingForceImpl* coupling : couplings)
        coupling->setSpareNodes(*context, isSpare);
}

void CylinderChainGrowthForceImpl::refuseForces(const vector<Vec3>& forces) const {
    const ChainList& list = chains->getDescription().getList();
    for (int number : growing)
        for (const vector<int>* particles : {&list.getChain(number).nodes, &list.getChain(number).spareNodes})
            for (int particle : *particles)
                if (forces[particle] != Vec3())
                    throw OpenMMException("CylinderChainGrowthForce: A Force acts on particle "+to_string(particle)+
                            " of "+list.getNameInSentence(number)+", which grows, without being in the equations of "
                            "steps: growth cannot take it into account. Walls, contacts and linkers of this plugin "
                            "alone may act on chains that grow");
}

void CylinderChainGrowthForceImpl::setState(const GrowthState& replaced) {
    const GrowthSystem& system = owner.getSystem();
    requireOfGrowing(replaced.ranges.size() == growing.size() && replaced.events.size() == 2*growing.size() &&
                    replaced.shrinks.size() == 2*growing.size() && replaced.free.size() == system.pools.size(),
            "A State or checkpoint has the growth of another number of "
            "chains or pools");
    ChainList& list = chains->getGrowingList();
    for (size_t i = 0; i < growing.size(); i++) {
        const MonomerRange& range = replaced.ranges[i];
        const Chain& chain = list.getChain(growing[i]);
        const int most = chain.nodes.size()+chain.spareNodes.size();
        requireOfGrowing(range.first < range.last && range.size() >= system.chains[i].leastMonomers &&
                SegmentDivision(range, system.tables[system.chains[i].table].monomersPerSegment).countSegments() <
                most, "Chain "+to_string(growing[i])+" cannot have monomers "+to_string(range.first)+" to "+
                to_string(range.last)+": it has "+to_string(most)+" particles, and needs "+
                to_string(system.chains[i].leastMonomers)+" monomers");
    }
    state = replaced;
    for (size_t i = 0; i < growing.size(); i++)
        cylchain::setMonomers(list.getChain(growing[i]), system.tables[system.chains[i].table], state.ranges[i]);
    chains->haveGrown(*context, growing);
    setSpareNodes();
    for (CouplingForceImpl* coupling : couplings)
        coupling->chainsHaveGrown(*context, list);
    accept();
}

void CylinderChainGrowthForceImpl::setEnds(const vector<int>& ends) {
    requireOfGrowing(ends.size() == 2*growing.size(), "There must be two numbers for each chain that grows");
    GrowthState replaced = state;
    for (size_t i = 0; i < growing.size(); i++) {
        replaced.ranges[i] = {ends[2*i], ends[2*i+1]};
        replaced.free[owner.getSystem().chains[i].pool] -= replaced.ranges[i].size()-state.ranges[i].size();
    }
    for (size_t pool = 0; pool < replaced.free.size(); pool++)
        requireOfGrowing(!owner.getSystem().pools[pool].isClosed() || replaced.free[pool] >= 0, "Pool "+to_string(pool)+
                " has not so many monomers");
    setState(replaced);
}

StateColumns CylinderChainGrowthForceImpl::storeState(bool inCheckpoint) {
    const GrowthState& now = getState();
    StateColumns columns;
    vector<int> ends;
    vector<long long> events;
    for (const MonomerRange& range : now.ranges)
        ends.insert(ends.end(), {range.first, range.last});
    for (const EndEvents& own : now.events)
        events.insert(events.end(), {own.gained, own.lost, own.waited, own.catastrophes, own.rescues});
    columns.put("ends", ends);
    columns.put("events", events);
    columns.put("shrinks", vector<int>(now.shrinks.begin(), now.shrinks.end()));
    columns.put("free", now.free);
    columns.put("steps", now.steps);
    if (inCheckpoint)
        columns.put("seed", seed);
    return columns;
}

void CylinderChainGrowthForceImpl::restoreState(const StateColumns& columns) {
    const vector<int> ends = columns.get<int>("ends");
    const vector<long long> events = columns.get<long long>("events");
    GrowthState replaced;
    replaced.steps = columns.getOne<uint64_t>("steps");
    replaced.free = columns.get<long long>("free");
    for (size_t i = 0; i+1 < ends.size(); i += 2)
        replaced.ranges.push_back({ends[i], ends[i+1]});
    for (size_t i = 0; i+4 < events.size(); i += 5)
        replaced.events.push_back({events[i], events[i+1], events[i+2], events[i+3], events[i+4]});
    for (int one : columns.get<int>("shrinks"))
        replaced.shrinks.push_back(one != 0);
    setState(replaced);
    if (columns.has("seed"))
        seed = columns.getOne<uint32_t>("seed");
}
