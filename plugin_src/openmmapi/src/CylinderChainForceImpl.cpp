#include "openmm/internal/CylinderChainForceImpl.h"
#include "openmm/CylinderChainIntegrator.h"
#include "openmm/CylinderChainKernels.h"
#include "openmm/OpenMMException.h"
#include "openmm/System.h"
#include "openmm/internal/ContextImpl.h"

using namespace OpenMM;
using namespace std;

CylinderChainForceImpl::CylinderChainForceImpl(const CylinderChainForce& owner) : StepForceImpl(owner),
        owner(owner) {
}

void CylinderChainForceImpl::initialize(ContextImpl& context) {
    const System& system = context.getSystem();
    vector<int> chainOfParticle(system.getNumParticles(), -1);
    for (int chain = 0; chain < owner.getNumChains(); chain++)
        for (int particle : owner.getChainParticles(chain)) {
            if (particle >= system.getNumParticles())
                throw OpenMMException("CylinderChainForce: Illegal particle index: "+to_string(particle));
            if (chainOfParticle[particle] != -1)
                throw OpenMMException("CylinderChainForce: Particle "+to_string(particle)+" is in two chains: "+
                        to_string(chainOfParticle[particle])+" and "+to_string(chain));
            chainOfParticle[particle] = chain;
        }
    kernel = context.getPlatform().createKernel(CalcCylinderChainForceKernel::Name(), context);
    description.reset(new CylinderChainDescription(system, owner));
    for (int chain = 0; chain < owner.getNumChains() && planar == -1; chain++)
        if (description->getList().isPlanar(chain))
            planar = chain;
    kernel.getAs<CalcCylinderChainForceKernel>().initialize(system, *description);
}

void CylinderChainForceImpl::updateContextState(ContextImpl& context, bool&) {
    if (dynamic_cast<const CylinderChainIntegrator*>(&context.getIntegrator()) != NULL)
        return;
    if (owner.getNumBodies() > 0)
        throw OpenMMException("CylinderChainForce: There are rigid bodies, which this Integrator would tear apart: "
                "use a CylinderChainIntegrator");
    if (planar == -1)
        return;
    throw OpenMMException("CylinderChainForce: "+description->getList().getName(planar)+" is planar, but this "
            "Integrator would take it out of its plane: use a CylinderChainIntegrator");
}

double CylinderChainForceImpl::calcForcesAndEnergy(ContextImpl& context, bool includeForces, bool includeEnergy,
        int groups) {
    if (isIn(groups) && !isExcluded())
        return kernel.getAs<CalcCylinderChainForceKernel>().execute(context, includeForces, includeEnergy);
    return 0.0;
}

vector<string> CylinderChainForceImpl::getKernelNames() {
    return {CalcCylinderChainForceKernel::Name()};
}

vector<pair<int, int> > CylinderChainForceImpl::getBondedParticles() const {
    // Chains are molecules.

    vector<pair<int, int> > bonds;
    for (int chain = 0; chain < owner.getNumChains(); chain++) {
        const vector<int>& particles = owner.getChainParticles(chain);
        for (size_t i = 1; i < particles.size(); i++)
            bonds.push_back(make_pair(particles[i-1], particles[i]));
        if (owner.isChainClosed(chain))
            bonds.push_back(make_pair(particles.back(), particles.front()));
    }
    return bonds;
}

void CylinderChainForceImpl::updateParametersInContext(ContextImpl& context) {
    description->update(owner);
    kernel.getAs<CalcCylinderChainForceKernel>().copyParametersToContext(context);
    context.systemChanged();
}

void CylinderChainForceImpl::haveGrown(ContextImpl& context, const vector<int>& numbers) {
    vector<int> changed(numbers);
    for (int& number : changed)
        number = description->getList().getIndex(number);
    kernel.getAs<CalcCylinderChainForceKernel>().replaceChains(context, changed);
}

void CylinderChainForceImpl::computeEnergies(ContextImpl& context, double& stretching, double& bending) {
    kernel.getAs<CalcCylinderChainForceKernel>().computeEnergies(context, stretching, bending);
}
