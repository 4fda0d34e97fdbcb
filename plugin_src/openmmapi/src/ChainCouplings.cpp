#include "openmm/internal/ChainCouplings.h"
#include "openmm/OpenMMException.h"
#include "openmm/internal/CheckpointValues.h"
#include "openmm/serialization/SerializationNode.h"
#include <algorithm>

using namespace OpenMM;
using namespace cylchain;
using namespace std;

ChainCouplings::ChainCouplings(ContextImpl& context, const OtherParticles& others) : context(context), others(others),
        resolver(context.getSystem()) {
    for (ForceImpl* impl : context.getForceImpls()) {
        CouplingForceImpl* force = dynamic_cast<CouplingForceImpl*>(impl);
        if (force != NULL)
            couplings.push_back({force, false, {}, -1});
    }
    stable_sort(couplings.begin(), couplings.end(), [] (const Coupling& a, const Coupling& b) {
        return a.force->getOrder() < b.force->getOrder();
    });
    update();
}

void ChainCouplings::update() {
    for (Coupling& own : couplings) {
        const long long version = own.force->getVersion();
        if (version == own.version)
            continue;
        const vector<Place> places = own.force->findPlaces(resolver);
        own.taken = resolver.whyExplicit(places).empty();
        own.particles.clear();
        for (const Place& place : places)
            if (resolver.movesAlone(place) && !others.isOfBody(place.first))
                own.particles.push_back(place.first);
        own.version = own.force->getVersion();
    }
}

void ChainCouplings::refuseChains(const CylinderChainDescription& chains) const {
    for (const Coupling& own : couplings)
        own.force->refuseChains(chains);
}

void ChainCouplings::refuseBox(const CylinderChainDescription& chains) const {
    for (const Coupling& own : couplings)
        if (own.taken)
            own.force->refuseBox(context, chains);
}

void ChainCouplings::refuseTwoStages(int groups) const {
    for (const Coupling& own : couplings)
        if (own.isTaken(groups) && own.force->hasForces())
            own.force->refuseTwoStages();
}

ChainCouplings::Exclusion::Exclusion(ChainCouplings& couplings, int groups) {
    if (groups == 0)
        return;
    couplings.update();
    for (const Coupling& own : couplings.couplings)
        if (own.isTaken(groups))
            exclusions.emplace_back(new StepForceImpl::Exclusion(*own.force));
}

const CoupledForces& ChainCouplings::describe(int groups, double friction) {
    update();
    forces.couplings.clear();
    forces.particles.clear();
    owners.clear();
    vector<int> particles;
    for (const Coupling& own : couplings) {
        own.force->beginStep();
        if (!own.isTaken(groups) || !own.force->hasForces())
            continue;
        forces.couplings.push_back(own.force->getEquations(context));
        owners.push_back(own.force);
        particles.insert(particles.end(), own.particles.begin(), own.particles.end());
    }
    sort(particles.begin(), particles.end());
    particles.erase(unique(particles.begin(), particles.end()), particles.end());
    for (int particle : particles)
        forces.particles.push_back({particle, 1/others.getMobility(particle, friction)});
    return forces;
}

void ChainCouplings::finishStep(int groups, int integration, double stepSize) {
    for (const Coupling& own : couplings)
        own.force->finishStep(own.isTaken(groups), own.force->isIn(integration), stepSize);
}

/** The Forces that have a state of each name. */
map<string, vector<StepForceImpl*> > ChainCouplings::findStates() const {
    map<string, vector<StepForceImpl*> > forces;
    for (ForceImpl* impl : context.getForceImpls()) {
        StepForceImpl* const force = dynamic_cast<StepForceImpl*>(impl);
        if (force != NULL && !force->getStateName().empty())
            forces[force->getStateName()].push_back(force);
    }
    return forces;
}

static void restore(const string& name, const vector<StateColumns>& states, const vector<StepForceImpl*>& forces) {
    const bool areSame = states.size() == forces.size();
    if (!areSame && (forces.empty() || !forces[0]->isStateOfCheckpoints()))
        throw OpenMMException("CylinderChainIntegrator: The State or checkpoint has the "+name+" of "+
                to_string(states.size())+" Forces, but the System has "+to_string(forces.size()));
    for (size_t i = 0; i < forces.size(); i++)
        if (areSame)
            forces[i]->restoreState(states[i]);
        else
            forces[i]->beginState();
}

void ChainCouplings::writeStates(ostream& stream) const {
    vector<pair<string, StateColumns> > states;
    for (const auto& entry : findStates())
        for (StepForceImpl* force : entry.second)
            states.push_back({entry.first, force->storeState(true)});
    writeValue(stream, (int) states.size());
    for (const auto& state : states) {
        writeText(stream, state.first);
        state.second.write(stream);
    }
}

void ChainCouplings::readStates(istream& stream) const {
    map<string, vector<StateColumns> > states;
    for (int i = readValue<int>(stream, "the states of Forces"); i > 0; i--) {
        const string name = readText(stream, "the states of Forces");
        states[name].push_back(StateColumns::read(stream));
    }
    map<string, vector<StepForceImpl*> > forces = findStates();
    for (const auto& entry : states)
        forces[entry.first];
    for (const auto& entry : forces)
        restore(entry.first, states[entry.first], entry.second);
}

void ChainCouplings::writeStates(SerializationNode& node) const {
    for (const auto& entry : findStates())
        for (StepForceImpl* force : entry.second)
            if (!force->isStateOfCheckpoints())
                force->storeState(false).write(node.createChildNode(entry.first));
}

void ChainCouplings::readStates(const SerializationNode& node) const {
    for (const auto& entry : findStates()) {
        vector<StateColumns> states;
        for (const SerializationNode& child : node.getChildren())
            if (child.getName() == entry.first)
                states.push_back(StateColumns::read(child));
        if (!states.empty())
            restore(entry.first, states, entry.second);
    }
}
