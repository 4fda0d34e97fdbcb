#include "ReferenceCalcCylinderChainWallForceKernel.h"
#include "openmm/internal/ContextImpl.h"

using namespace OpenMM;
using namespace cylchain;
using namespace std;

ReferenceCalcCylinderChainWallForceKernel::ReferenceCalcCylinderChainWallForceKernel(string name,
        const Platform& platform, shared_ptr<HostParticles> particles) :
        CalcCylinderChainWallForceKernel(name, platform), host(particles), noted(NULL) {
}

void ReferenceCalcCylinderChainWallForceKernel::initialize(const System&, const WallSystem& walls) {
    this->walls = walls;
    vector<int> particles;
    particles.reserve(walls.particles.size());
    for (const WallParticle& one : walls.particles)
        particles.push_back(one.particle);
    host->include(particles);
}

double ReferenceCalcCylinderChainWallForceKernel::execute(ContextImpl&, bool includeForces, bool) {
    host->update();
    vector<Push> found;
    const double energy = findPushes(walls, &host->getPositions()[0][0], found);
    if (!includeForces)
        return energy;
    vector<Vec3>& forces = host->beginForces();
    for (const Push& push : found)
        forces[push.particles[0]] += Vec3(push.force[0], push.force[1], push.force[2]);
    host->endForces();
    if (noted != NULL)
        noted->swap(found);
    return energy;
}

void ReferenceCalcCylinderChainWallForceKernel::notePushes(vector<Push>& pushes) {
    noted = &pushes;
}

void ReferenceCalcCylinderChainWallForceKernel::copyParametersToContext(ContextImpl& context, const WallSystem& walls) {
    initialize(context.getSystem(), walls);
}

ImplicitCouplings* ReferenceCalcCylinderChainWallForceKernel::getEquations(CouplingImpulses& impulses) {
    if (walls.wall.side == WallSide::Surface) {
        surface.setWalls(&walls, &impulses);
        return &surface;
    }
    equations.setWalls(&walls, &impulses);
    return &equations;
}
