#include "openmm/internal/SpringForceImpl.h"
#include "openmm/CylinderChainForce.h"
#include "openmm/CylinderChainKernels.h"
#include <algorithm>
#include <cmath>
#include <sstream>

using namespace OpenMM;
using namespace cylchain;
using namespace std;

void SpringForceImpl::initializeLinks(ContextImpl& context, bool periodic) {
    this->context = &context;
    this->periodic = periodic;
    const System& system = context.getSystem();
    nearestParticles = false;
    for (int i = 0; i < system.getNumForces(); i++) {
        const CylinderChainForce* chains = dynamic_cast<const CylinderChainForce*>(&system.getForce(i));
        nearestParticles |= chains != NULL && chains->usesPeriodicBoundaryConditions();
    }
    linkKernel = context.getPlatform().createKernel(CalcCylinderChainLinkForceKernel::Name(), context);
    linkKernel.getAs<CalcCylinderChainLinkForceKernel>().initialize(system, periodic, nearestParticles);
}

vector<string> SpringForceImpl::getKernelNames() {
    return {CalcCylinderChainLinkForceKernel::Name()};
}

double SpringForceImpl::computeLinks(bool includeForces, bool includeEnergy, int& outOfRange) {
    return linkKernel.getAs<CalcCylinderChainLinkForceKernel>().execute(*context, getLinks(), includeForces,
            includeEnergy, outOfRange);
}

ImplicitCouplings* SpringForceImpl::getEquations(ContextImpl& context) {
    return linkKernel.getAs<CalcCylinderChainLinkForceKernel>().getEquations(context, getLinks());
}

LinkPull SpringForceImpl::findPull(long long number) {
    vector<Vec3> positions, box(3);
    context->getPositions(positions);
    context->getPeriodicBoxVectors(box[0], box[1], box[2]);
    const LinkBoxes boxes = {periodic ? &box[0][0] : NULL, nearestParticles ? &box[0][0] : NULL};
    const vector<Link>& links = getLinks();
    const auto link = find_if(links.begin(), links.end(), [&] (const Link& one) {return one.number == number;});
    return computePull(*link, &positions[0][0], boxes);
}

string SpringForceImpl::describeFailure(const BrokenCoupling& coupling, const string& other) {
    const LinkPull pull = findPull(coupling.link);
    const Vec3 force(pull.force[0], pull.force[1], pull.force[2]);
    stringstream text;
    text.precision(3);
    text << "link " << coupling.link << " to " << other << (coupling.reason == BrokenCoupling::LeavesRange ?
            " would leave the range of its potential" : " cannot be solved") << ". It is " << pull.length <<
            " nm long and has a force of " << sqrt(force.dot(force)) << " kJ/mol/nm";
    return text.str();
}
