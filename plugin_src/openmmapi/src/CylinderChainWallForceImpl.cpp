#include "openmm/internal/CylinderChainWallForceImpl.h"
#include "openmm/CylinderChainKernels.h"
#include "openmm/OpenMMException.h"
#include "openmm/System.h"
#include "openmm/internal/ContextImpl.h"
#include <algorithm>

using namespace OpenMM;
using namespace cylchain;
using namespace std;

CylinderChainWallForceImpl::CylinderChainWallForceImpl(const CylinderChainWallForce& owner) : PushForceImpl(owner),
        owner(owner) {
}

WallSystem CylinderChainWallForceImpl::describe() const {
    WallSystem result = owner.getWalls();
    const vector<Place> found = owner.findPlaces(*places);
    for (size_t i = 0; i < found.size(); i++) {
        WallParticle& own = result.particles[i];
        if (found[i].isOnCurve())
            own.onCurve = found[i];
        if (!(own.radius < getRoom(result.wall)))
            throw OpenMMException("CylinderChainWallForce: Particle "+to_string(own.particle)+
                    " with its radius does not fit into the "+Names<WallShape>::ALL[(int) result.wall.shape]);
    }
    return result;
}

void CylinderChainWallForceImpl::initialize(ContextImpl& context) {
    const System& system = context.getSystem();
    for (int i = 0; i < owner.getNumParticles(); i++)
        if (owner.getParticle(i) >= system.getNumParticles())
            throw OpenMMException("CylinderChainWallForce: Illegal particle index: "+to_string(owner.getParticle(i)));
    places.reset(new PlaceResolver(system));
    walls = describe();
    kernel = context.getPlatform().createKernel(CalcCylinderChainWallForceKernel::Name(), context);
    kernel.getAs<CalcCylinderChainWallForceKernel>().initialize(context.getSystem(), walls);
    beginSums(system.getNumParticles());
    notesPushes = kernel.getAs<CalcCylinderChainWallForceKernel>().notePushes(present);
}

void CylinderChainWallForceImpl::findPushes(ContextImpl& context, vector<Push>& pushes) const {
    vector<Vec3> positions;
    context.getPositions(positions);
    cylchain::findPushes(walls, &positions[0][0], pushes);
}

double CylinderChainWallForceImpl::calcForcesAndEnergy(ContextImpl& context, bool includeForces, bool includeEnergy,
        int groups) {
    if (isIn(groups) && !isExcluded())
        return kernel.getAs<CalcCylinderChainWallForceKernel>().execute(context, includeForces, includeEnergy);
    return 0.0;
}

vector<string> CylinderChainWallForceImpl::getKernelNames() {
    return {CalcCylinderChainWallForceKernel::Name()};
}

void CylinderChainWallForceImpl::updateParametersInContext(ContextImpl& context) {
    const WallSystem present = describe();
    const bool same = equal(walls.particles.begin(), walls.particles.end(), present.particles.begin(),
            present.particles.end(), [] (const WallParticle& a, const WallParticle& b) {
                return a.particle == b.particle;
            });
    if (!same)
        throw OpenMMException("CylinderChainWallForce: Particles cannot be added to a Context");
    walls = present;
    kernel.getAs<CalcCylinderChainWallForceKernel>().copyParametersToContext(context, walls);
    context.systemChanged();
}

ImplicitCouplings* CylinderChainWallForceImpl::getEquations(ContextImpl&) {
    return kernel.getAs<CalcCylinderChainWallForceKernel>().getEquations(getImpulses());
}

string CylinderChainWallForceImpl::describeFailure(const BrokenCoupling&, const string&) {
    return "a wall cannot hold it";
}
