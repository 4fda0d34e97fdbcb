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
    for (int own : state.endStates)
        digest.mix(own);
    digest.mix(state.nextIdentity);
    return digest.get();
}

CylinderChainGrowthForceImpl::CylinderChainGrowthForceImpl(const CylinderChainGrowthForce& owner) :
        StepForceImpl(owner), owner(owner), context(NULL), chains(NULL), seed(0), hasCouplings(false),
        hasOtherForces(false) {
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
    seed = (uint32_t) integrator->getRandomNumberSeed();
    if (seed == 0)
        seed = (uint32_t) osrngseed();
    state = owner.getState();
    isSpare = findSpareNodes(system);
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
        hasOtherForces |= dynamic_cast<StepForceImpl*>(impl) == NULL;
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
        // A first node stays where it is if its end does not grow.

        vector<bool> comesAndGoes(context->getSystem().getNumParticles(), false);
        for (size_t i = 0; i < growing.size(); i++) {
            const GrowingChain& own = owner.getSystem().chains[i];
            const vector<int>& particles = chains->getOwner().getChainParticles(growing[i]);
            for (int particle : particles)
                comesAndGoes[particle] = true;
            const bool mayBegin = owner.getRanges()[i].size() == 0;
            comesAndGoes[particles[0]] = own.ends[0].grows() || own.vanishes || mayBegin;
        }
        for (const Place& place : other.first->findPlaces(*places))
            for (int particle : {place.fraction == 1 ? -1 : place.first, place.fraction == 0 ? -1 : place.second})
                requireOfGrowing(particle < 0 || !comesAndGoes[particle],
                        other.first->getOwner().getName()+" acts on particle "+to_string(particle)+
                                " of a chain that grows, which is not possible yet: walls, contacts "
                                "and linkers of this plugin alone are");
        other.second = version;
    }
}

/** Let ends be in the states to which what is bound there changes them, and back in others when it is not. */
void CylinderChainGrowthForceImpl::changeEnds() {
    vector<HeldEnd> changes, held;
    for (CouplingForceImpl* coupling : couplings)
        coupling->findChangesOfEnds(changes);
    if (changes.empty())
        return;
    for (CouplingForceImpl* coupling : couplings)
        coupling->findHeldEnds(held);
    const int count = growing.size();
    vector<int> indexOf(chains->getDescription().getList().size(), -1);
    for (int i = 0; i < count; i++)
        indexOf[growing[i]] = i;
    auto isOne = [&] (int i, const HeldEnd& change) {
        const int states = owner.getSystem().chains[i].ends[change.end].states.size();
        return change.freeState < states && change.heldState < states;
    };
    vector<char> isHeld(2*count, 0);
    for (const HeldEnd& own : held) {
        const int i = indexOf[own.chain];
        if (i < 0 || !isOne(i, own))
            continue;
        int& now = state.endStates[2*i+own.end];
        if (now == own.freeState)
            now = own.heldState;
        if (now == own.heldState)
            isHeld[2*i+own.end] = 1;
    }
    for (const HeldEnd& change : changes) {
        const int i = indexOf[change.chain];
        if (i >= 0 && isOne(i, change) && isHeld[2*i+change.end] == 0 &&
                state.endStates[2*i+change.end] == change.heldState)
            state.endStates[2*i+change.end] = change.freeState;
    }
    accept();
}

void CylinderChainGrowthForceImpl::updateContextState(ContextImpl& context, bool& forcesInvalid) {
    follow();
    findCouplings();
    refusePlaces();
    changeEnds();
    const double size = context.getIntegrator().getStepSize();
    if (!(size > 0))
        return;
    GrowthStep step = {getThermalEnergy(), size, seed};
    for (CouplingForceImpl* coupling : couplings)
        coupling->findActingHands(step.hands);
    forcesInvalid |= !grow(step).chains.empty();
}

int CylinderChainGrowthForceImpl::cut(const CuttingPlane& plane) {
    follow();
    findCouplings();
    refusePlaces();
    GrowthStep step = {getThermalEnergy(), 0, seed};
    step.plane = &plane;
    return grow(step).crossings;
}

double CylinderChainGrowthForceImpl::getThermalEnergy() const {
    return BOLTZ*dynamic_cast<const CylinderChainIntegrator&>(context->getIntegrator()).getTemperature();
}

/** Let chains grow in a step, and tell all that needs to know: what has changed. */
GrowthChanges CylinderChainGrowthForceImpl::grow(const GrowthStep& step) {
    vector<Surroundings*> felt;
    felt.reserve(around.size());
    for (const Felt& own : around)
        felt.push_back(own.surroundings.get());
    ChainList& list = chains->getGrowingList();
    vector<int> numNodes;
    numNodes.reserve(growing.size());
    for (int chain : growing)
        numNodes.push_back(list.getNumNodes(chain));
    GrowthChanges changes;
    try {
        changes = kernel.getAs<UpdateCylinderChainGrowthKernel>().execute(*context, state, step,
                chains->getDescription().usesPeriodicBoundaryConditions(), list, felt);
    }
    catch (const invalid_argument& error) {
        throw OpenMMException(string("CylinderChainContactForce: ")+error.what());
    }
    accept();
    requireOfGrowing(changes.failed == -1, "More than a million monomers or chains come and go within a step, among "
            "them those of chain "+to_string(changes.failed == -1 ? -1 : growing[changes.failed])+": use a smaller "
            "step, or look at the rates");
    if (changes.chains.empty())
        return changes;
    vector<int> numbers(changes.chains);
    for (int& number : numbers)
        number = growing[number];
    chains->haveGrown(*context, numbers);
    for (CouplingForceImpl* coupling : couplings)
        coupling->chainsHaveGrown(*context, list, changes);
    const bool otherNodes = any_of(changes.chains.begin(), changes.chains.end(), [&] (int i) {
        return list.getNumNodes(growing[i]) != numNodes[i];
    });
    if (otherNodes)
        setSpareNodes(numbers);
    return changes;
}

double CylinderChainGrowthForceImpl::calcForcesAndEnergy(ContextImpl& context, bool, bool, int) {
    follow();
    // Whoever has moved nodes, such as a minimizer, has left spare ones behind.

    kernel.getAs<UpdateCylinderChainGrowthKernel>().placeSpareNodes(context, chains->getDescription().getChains());
    return 0.0;
}

/** Tell all what are no nodes of some of the chains that grow. */
void CylinderChainGrowthForceImpl::setSpareNodes(const vector<int>& changed) {
    isSpare.resize(context->getSystem().getNumParticles(), false);
    for (int number : changed) {
        const Chain& chain = chains->getDescription().getList().getChain(number);
        for (int particle : chain.nodes)
            isSpare[particle] = false;
        for (int particle : chain.spareNodes)
            isSpare[particle] = true;
    }
    findCouplings();
    for (CouplingForceImpl* coupling : couplings)
        coupling->setSpareNodes(*context, isSpare);
}

void CylinderChainGrowthForceImpl::refuseForces(const vector<Vec3>& forces) const {
    if (!hasOtherForces)
        return;
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
    const size_t count = growing.size();
    requireOfGrowing(replaced.ranges.size() == count && replaced.events.size() == 2*count &&
            replaced.endStates.size() == 2*count && replaced.phases.size() == 2*count &&
            replaced.monomers.size() == count &&
            replaced.identities.size() == count && replaced.parents.size() == count &&
            replaced.free.size() == system.pools.size(), "A State or checkpoint has the growth of another number of "
            "chains or pools");
    ChainList& list = chains->getGrowingList();
    for (size_t i = 0; i < count; i++) {
        const MonomerRange& range = replaced.ranges[i];
        const GrowingChain& own = system.chains[i];
        const Chain& chain = list.getChain(growing[i]);
        const int most = chain.nodes.size()+chain.spareNodes.size();
        const bool isNone = range.first == 0 && range.last == 0 && chain.tethers.empty();
        requireOfGrowing(isNone || (range.first < range.last && range.size() >= own.leastMonomers &&
                SegmentDivision(range, system.tables[own.table].monomersPerSegment).countSegments() < most), "Chain "+
                to_string(growing[i])+" cannot have monomers "+to_string(range.first)+" to "+to_string(range.last)+
                ": it has "+to_string(most)+" particles, and needs "+to_string(own.leastMonomers)+" monomers");
        for (int end : {0, 1}) {
            const int number = replaced.endStates[2*i+end], states = own.ends[end].states.size();
            requireOfGrowing(number >= 0 && number < states &&
                    replaced.events[2*i+end].switches.size() == own.ends[end].states.size(), "An end of chain "+
                    to_string(growing[i])+" has no such state");
            for (const MonomerState& monomer : replaced.monomers[i])
                requireOfGrowing(monomer.state >= 0 && monomer.state < states, "A monomer of chain "+
                        to_string(growing[i])+" has no such state");
        }
        requireOfGrowing(replaced.monomers[i].size() == (own.monomersHaveStates ? (size_t) range.size() : 0), "Chain "+
                to_string(growing[i])+" has another number of monomers than states of these");
    }
    state = replaced;
    for (size_t i = 0; i < growing.size(); i++)
        cylchain::setMonomers(list.getChain(growing[i]), system.tables[system.chains[i].table], state.ranges[i]);
    chains->haveGrown(*context, growing);
    setSpareNodes(growing);
    for (CouplingForceImpl* coupling : couplings)
        coupling->chainsHaveGrown(*context, list, {});
    accept();
}

void CylinderChainGrowthForceImpl::setEnds(const vector<int>& ends) {
    requireOfGrowing(ends.size() == 2*growing.size(), "There must be two numbers for each chain that grows");
    const GrowthSystem& system = owner.getSystem();
    GrowthState replaced = state;
    for (size_t i = 0; i < growing.size(); i++) {
        const MonomerRange range = {ends[2*i], ends[2*i+1]};
        const GrowingChain& own = system.chains[i];
        replaced.ranges[i] = range;
        replaced.free[own.pool] -= range.size()-state.ranges[i].size();
        if (range.first == state.ranges[i].first && range.last == state.ranges[i].last)
            continue;
        if (own.monomersHaveStates && range.size() >= 0)
            replaced.monomers[i].assign(range.size(), {state.time, own.ends[1].initialState});
        for (int end : {0, 1})
            replaced.endStates[2*i+end] = own.ends[end].initialState;
        if (range.size() == 0 || state.ranges[i].size() == 0) {
            replaced.identities[i] = range.size() == 0 ? -1 : replaced.nextIdentity++;
            replaced.parents[i] = -1;
        }
    }
    for (size_t pool = 0; pool < replaced.free.size(); pool++)
        requireOfGrowing(!system.pools[pool].isClosed() || replaced.free[pool] >= 0, "Pool "+to_string(pool)+
                " has not so many monomers");
    setState(replaced);
}

StateColumns CylinderChainGrowthForceImpl::storeState(bool inCheckpoint) {
    const GrowthState& now = getState();
    StateColumns columns;
    vector<int> ends, states;
    vector<long long> events, switches;
    vector<double> times;
    for (const MonomerRange& range : now.ranges)
        ends.insert(ends.end(), {range.first, range.last});
    for (const EndEvents& own : now.events) {
        events.insert(events.end(), {own.gained, own.lost, own.waited});
        switches.insert(switches.end(), own.switches.begin(), own.switches.end());
    }
    for (const deque<MonomerState>& monomers : now.monomers)
        for (const MonomerState& monomer : monomers) {
            times.push_back(monomer.time);
            states.push_back(monomer.state);
        }
    const PopulationEvents& all = now.population;
    columns.put("ends", ends);
    columns.put("events", events);
    columns.put("switches", switches);
    columns.put("endStates", now.endStates);
    columns.put("phases", now.phases);
    columns.put("monomerTimes", times);
    columns.put("monomerStates", states);
    columns.put("free", now.free);
    columns.put("identities", now.identities);
    columns.put("parents", now.parents);
    columns.put("population", vector<long long> {now.nextIdentity, all.nucleated, all.vanished, all.severed,
            all.waited});
    columns.put("steps", now.steps);
    columns.put("time", now.time);
    columns.put("packs", chains->getKernel().getAs<CalcCylinderChainForceKernel>().getArrangement());
    if (inCheckpoint)
        columns.put("seed", seed);
    return columns;
}

void CylinderChainGrowthForceImpl::restoreState(const StateColumns& columns) {
    const GrowthSystem& system = owner.getSystem();
    const vector<int> ends = columns.get<int>("ends"), states = columns.get<int>("monomerStates");
    const vector<long long> events = columns.get<long long>("events"), switches = columns.get<long long>("switches"),
            population = columns.get<long long>("population");
    const vector<double> times = columns.get<double>("monomerTimes");
    requireOfGrowing(ends.size() == 2*growing.size() && events.size() == 3*ends.size() && population.size() == 5 &&
            times.size() == states.size(), "A State or checkpoint has the growth of another number of chains");
    vector<MonomerRange> ranges;
    ranges.reserve(growing.size());
    for (size_t i = 0; i < growing.size(); i++)
        ranges.push_back({ends[2*i], ends[2*i+1]});
    GrowthState replaced(system, ranges);
    replaced.steps = columns.getOne<uint64_t>("steps");
    replaced.time = columns.getOne<double>("time");
    replaced.free = columns.get<long long>("free");
    replaced.endStates = columns.get<int>("endStates");
    replaced.phases = columns.get<double>("phases");
    replaced.identities = columns.get<long long>("identities");
    replaced.parents = columns.get<long long>("parents");
    replaced.nextIdentity = population[0];
    replaced.population = {population[1], population[2], population[3], population[4]};
    size_t nextSwitch = 0, nextMonomer = 0;
    for (size_t i = 0; i < replaced.events.size(); i++) {
        EndEvents& own = replaced.events[i];
        own.gained = events[3*i];
        own.lost = events[3*i+1];
        own.waited = events[3*i+2];
        for (long long& count : own.switches) {
            requireOfGrowing(nextSwitch < switches.size(), "A State or checkpoint has other states of ends");
            count = switches[nextSwitch++];
        }
    }
    for (deque<MonomerState>& monomers : replaced.monomers)
        for (MonomerState& monomer : monomers) {
            requireOfGrowing(nextMonomer < times.size(), "A State or checkpoint has the states of other monomers");
            monomer = {times[nextMonomer], states[nextMonomer]};
            nextMonomer++;
        }
    setState(replaced);
    if (columns.has("packs"))
        chains->getKernel().getAs<CalcCylinderChainForceKernel>().setArrangement(columns.get<int>("packs"));
    if (columns.has("seed"))
        seed = columns.getOne<uint32_t>("seed");
}
