#include "openmm/internal/CylinderChainForceImpl.h"
#include "openmm/CylinderChainIntegrator.h"
#include "openmm/CylinderChainKernels.h"
#include "openmm/OpenMMException.h"
#include "openmm/System.h"
#include "openmm/internal/ContextImpl.h"
#include <algorithm>
#include <cmath>

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
    const vector<cylchain::Chain>& chains = description->getChains();
    for (size_t i = 0; i < chains.size() && twisted == -1; i++)
        if (chains[i].twist.isPresent())
            twisted = description->getList().getNumber(cylchain::ChainKind::StraightSegments, i);
    beginState();
    kernel.getAs<CalcCylinderChainForceKernel>().initialize(system, *description);
}

void CylinderChainForceImpl::setTwists(int index, const vector<double>& values) {
    if (values.size() != twists[index].size())
        throw OpenMMException("CylinderChainForce: A chain has "+to_string(twists[index].size())+" twists, but "+
                to_string(values.size())+" are given");
    for (double value : values)
        if (!isfinite(value))
            throw OpenMMException("CylinderChainForce: Twists must be finite");
    twists[index] = values;
}

StateColumns CylinderChainForceImpl::storeState(bool) {
    vector<int> counts;
    vector<double> angles;
    for (const vector<double>& own : twists) {
        counts.push_back(own.size());
        angles.insert(angles.end(), own.begin(), own.end());
    }
    StateColumns columns;
    columns.put("counts", counts);
    columns.put("angles", angles);
    return columns;
}

void CylinderChainForceImpl::restoreState(const StateColumns& columns) {
    const vector<int> counts = columns.get<int>("counts");
    const vector<double> angles = columns.get<double>("angles");
    size_t first = 0;
    bool fits = counts.size() == twists.size();
    for (size_t i = 0; i < counts.size() && fits; i++) {
        fits = counts[i] == (int) twists[i].size();
        first += counts[i];
    }
    if (!fits || first != angles.size())
        throw OpenMMException("CylinderChainForce: The twists of the State or checkpoint are those of other chains");
    first = 0;
    for (vector<double>& own : twists) {
        copy_n(angles.begin()+first, own.size(), own.begin());
        first += own.size();
    }
}

void CylinderChainForceImpl::beginState() {
    twists.clear();
    for (const cylchain::Chain& chain : description->getChains()) {
        vector<double> own(chain.numTwists());
        if (!own.empty())
            copy(chain.twist.rest.begin(), chain.twist.rest.end(), own.begin()+(chain.closed ? 0 : 1));
        twists.push_back(own);
    }
}

void CylinderChainForceImpl::updateContextState(ContextImpl& context, bool&) {
    if (dynamic_cast<const CylinderChainIntegrator*>(&context.getIntegrator()) != NULL)
        return;
    if (owner.getNumBodies() > 0)
        throw OpenMMException("CylinderChainForce: There are rigid bodies, which this Integrator would tear apart: "
                "use a CylinderChainIntegrator");
    if (hasTwist())
        throw OpenMMException("CylinderChainForce: "+description->getList().getName(twisted)+" has twist, which this "
                "Integrator knows nothing of: use a CylinderChainIntegrator");
    if (planar == -1)
        return;
    throw OpenMMException("CylinderChainForce: "+description->getList().getName(planar)+" is planar, but this "
            "Integrator would take it out of its plane: use a CylinderChainIntegrator");
}

double CylinderChainForceImpl::calcForcesAndEnergy(ContextImpl& context, bool includeForces, bool includeEnergy,
        int groups) {
    if (!isIn(groups) || isExcluded())
        return 0.0;
    const vector<cylchain::Chain>& chains = description->getChains();
    for (size_t i = 0; i < chains.size() && includeForces; i++)
        if (chains[i].twist.isBentAtRest())
            throw OpenMMException("CylinderChainForce: "+description->getList().getName(
                    description->getList().getNumber(cylchain::ChainKind::StraightSegments, i))+" has bends at rest. "
                    "Frames go along with its nodes in steps of a CylinderChainIntegrator alone: there are energies, "
                    "but no forces, outside of these");
    return kernel.getAs<CalcCylinderChainForceKernel>().execute(context, includeForces, includeEnergy, twists);
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
    kernel.getAs<CalcCylinderChainForceKernel>().computeEnergies(context, twists, stretching, bending);
}
