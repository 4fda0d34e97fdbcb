#include "ReferenceCalcCylinderChainForceKernel.h"
#include "ReferenceContextData.h"

using namespace OpenMM;
using namespace cylchain;
using namespace std;

ReferenceCalcCylinderChainForceKernel::ReferenceCalcCylinderChainForceKernel(string name, const Platform& platform,
        ContextImpl& context) : CalcCylinderChainForceKernel(name, platform), loop(context), chains(NULL) {
}

void ReferenceCalcCylinderChainForceKernel::initialize(const System&, const CylinderChainDescription& chains) {
    this->chains = &chains;
    createEngines();
}

void ReferenceCalcCylinderChainForceKernel::createEngines() {
    engine.reset(new ChainEngine(chains->getChains(), chains->anyGrow()));
    beamEngine.reset(new BeamEngine(chains->getBeams(), chains->getChains().size()));
}

const double* ReferenceCalcCylinderChainForceKernel::getBox(ContextImpl& context) const {
    return chains->usesPeriodicBoundaryConditions() ? &extractData(context).periodicBoxVectors[0][0] : NULL;
}

ChainEnergy ReferenceCalcCylinderChainForceKernel::addForces(ContextImpl& context, vector<Vec3>& forces,
        bool includeEnergy) {
    const double* positions = &(*extractData(context).positions)[0][0];
    const double* box = getBox(context);
    const int numPacks = engine->getNumPacks();
    vector<ChainEnergy> energies(numPacks+beamEngine->getNumPacks());
    loop.run(energies.size(), [&] (int pack) {
        energies[pack] = pack < numPacks ? engine->addForces(pack, positions, &forces[0][0], box, includeEnergy) :
                beamEngine->addForces(pack-numPacks, positions, &forces[0][0], box, includeEnergy);
    });

    // The sum does not depend on the order in which threads have finished.

    ChainEnergy total;
    for (const ChainEnergy& energy : energies) {
        total.stretching += energy.stretching;
        total.bending += energy.bending;
        total.tethers += energy.tethers;
    }
    return total;
}

double ReferenceCalcCylinderChainForceKernel::execute(ContextImpl& context, bool includeForces, bool includeEnergy) {
    vector<Vec3> unused;
    if (!includeForces)
        unused.resize(context.getSystem().getNumParticles());
    ChainEnergy energy = addForces(context, includeForces ? *extractData(context).forces : unused, includeEnergy);
    return energy.stretching+energy.bending+energy.tethers;
}

void ReferenceCalcCylinderChainForceKernel::computeEnergies(ContextImpl& context, double& stretching, double& bending) {
    vector<Vec3> unused(context.getSystem().getNumParticles());
    ChainEnergy energy = addForces(context, unused, true);
    stretching = energy.stretching;
    bending = energy.bending;
}

void ReferenceCalcCylinderChainForceKernel::replaceChains(ContextImpl&, const vector<int>& changed) {
    const Replacement replacement = engine->replaceChains(chains->getChains(), changed);
    if (replacement == Replacement::Impossible)
        engine.reset(new ChainEngine(chains->getChains(), true));
    (replacement == Replacement::SameNodes ? versionOfLengths : version)++;
}

vector<int> ReferenceCalcCylinderChainForceKernel::getArrangement() {
    return engine->getArrangement();
}

void ReferenceCalcCylinderChainForceKernel::setArrangement(const vector<int>& arrangement) {
    engine->setArrangement(chains->getChains(), arrangement);
    version++;
}

void ReferenceCalcCylinderChainForceKernel::copyParametersToContext(ContextImpl&) {
    createEngines();
    version++;
}
