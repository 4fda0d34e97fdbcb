#include "ReferenceCalcCylinderChainForceKernel.h"
#include "openmm/internal/ContextImpl.h"

using namespace OpenMM;
using namespace cylchain;
using namespace std;

ReferenceCalcCylinderChainForceKernel::ReferenceCalcCylinderChainForceKernel(string name, const Platform& platform,
        shared_ptr<HostParticles> particles) : CalcCylinderChainForceKernel(name, platform), particles(particles),
        chains(NULL) {
}

void ReferenceCalcCylinderChainForceKernel::initialize(const System&, const CylinderChainDescription& chains) {
    this->chains = &chains;
    createEngines();
    vector<vector<int> > molecules;
    molecules.reserve(chains.getList().size());
    for (int chain = 0; chain < chains.getList().size(); chain++)
        molecules.push_back(chains.getList().getParticles(chain));
    for (size_t i = 0; i < chains.getChains().size(); i++) {
        const vector<int>& spare = chains.getChains()[i].spareNodes;
        vector<int>& own = molecules[chains.getList().getNumber(ChainKind::StraightSegments, i)];
        own.insert(own.end(), spare.begin(), spare.end());
    }
    for (const RigidBody& body : chains.getBodies())
        molecules.push_back(body.particles);
    for (const vector<int>& molecule : molecules)
        particles->include(molecule);
    particles->addMolecules(molecules);
}

void ReferenceCalcCylinderChainForceKernel::createEngines() {
    engine.reset(new ChainEngine(chains->getChains(), chains->anyGrow()));
    beamEngine.reset(new BeamEngine(chains->getBeams(), chains->getChains().size()));
}

const double* ReferenceCalcCylinderChainForceKernel::getBox() const {
    return chains->usesPeriodicBoundaryConditions() ? &particles->getBox()[0][0] : NULL;
}

ChainEnergy ReferenceCalcCylinderChainForceKernel::addForces(vector<Vec3>& forces, bool includeEnergy,
        const vector<vector<double> >& twists) {
    const double* positions = &particles->getPositions()[0][0];
    const double* box = getBox();
    const int numPacks = engine->getNumPacks();
    vector<ChainEnergy> energies(numPacks+beamEngine->getNumPacks());
    particles->getLoop().run(energies.size(), [&] (int pack) {
        energies[pack] = pack < numPacks ? engine->addForces(pack, positions, &forces[0][0], box, includeEnergy,
                &twists) :
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

double ReferenceCalcCylinderChainForceKernel::execute(ContextImpl& context, bool includeForces, bool includeEnergy,
        const vector<vector<double> >& twists) {
    particles->update();
    vector<Vec3> unused;
    if (!includeForces)
        unused.resize(context.getSystem().getNumParticles());
    const ChainEnergy energy = addForces(includeForces ? particles->beginForces() : unused, includeEnergy, twists);
    if (includeForces)
        particles->endForces();
    return energy.stretching+energy.bending+energy.tethers;
}

void ReferenceCalcCylinderChainForceKernel::computeEnergies(ContextImpl& context,
        const vector<vector<double> >& twists, double& stretching, double& bending) {
    particles->update();
    vector<Vec3> unused(context.getSystem().getNumParticles());
    const ChainEnergy energy = addForces(unused, true, twists);
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
