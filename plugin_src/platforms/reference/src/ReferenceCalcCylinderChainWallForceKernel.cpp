#include "ReferenceCalcCylinderChainWallForceKernel.h"
#include "ReferenceContextData.h"
#include "openmm/internal/ContextImpl.h"

using namespace OpenMM;
using namespace cylchain;
using namespace std;

ReferenceCalcCylinderChainWallForceKernel::ReferenceCalcCylinderChainWallForceKernel(string name,
        const Platform& platform) : CalcCylinderChainWallForceKernel(name, platform), noted(NULL) {
}

void ReferenceCalcCylinderChainWallForceKernel::initialize(const System&, const WallSystem& walls) {
    this->walls = walls;
}

double ReferenceCalcCylinderChainWallForceKernel::execute(ContextImpl& context, bool includeForces, bool) {
    vector<Vec3>& positions = *extractData(context).positions;
    vector<Push> found;
    const double energy = findPushes(walls, &positions[0][0], found);
    if (!includeForces)
        return energy;
    vector<Vec3>& forces = *extractData(context).forces;
    for (const Push& push : found)
        forces[push.particles[0]] += Vec3(push.force[0], push.force[1], push.force[2]);
    if (noted != NULL)
        noted->swap(found);
    return energy;
}

bool ReferenceCalcCylinderChainWallForceKernel::notePushes(vector<Push>& pushes) {
    noted = &pushes;
    return true;
}

void ReferenceCalcCylinderChainWallForceKernel::copyParametersToContext(ContextImpl&, const WallSystem& walls) {
    this->walls = walls;
}

ImplicitCouplings* ReferenceCalcCylinderChainWallForceKernel::getEquations(CouplingImpulses& impulses) {
    if (walls.wall.side == WallSide::Surface) {
        surface.setWalls(&walls, &impulses);
        return &surface;
    }
    equations.setWalls(&walls, &impulses);
    return &equations;
}
