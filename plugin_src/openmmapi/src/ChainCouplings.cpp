#include "openmm/internal/ChainCouplings.h"
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
        PushForceImpl* pushes = dynamic_cast<PushForceImpl*>(impl);
        if (pushes != NULL)
            pushForces.push_back(pushes);
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
            if (resolver.movesAlone(place))
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
