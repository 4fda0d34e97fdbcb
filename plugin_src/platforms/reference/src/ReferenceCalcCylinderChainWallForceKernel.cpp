#include "ReferenceCalcCylinderChainWallForceKernel.h"
#include "ReferenceContextData.h"
#include "openmm/internal/ContextImpl.h"

using namespace OpenMM;
using namespace cylchain;
using namespace std;

ReferenceCalcCylinderChainWallForceKernel::ReferenceCalcCylinderChainWallForceKernel(string name,
        const Platform& platform) : CalcCylinderChainWallForceKernel(name, platform) {
}

void ReferenceCalcCylinderChainWallForceKernel::initialize(const System&, const WallSystem& walls) {
    this->walls = walls;
}

double ReferenceCalcCylinderChainWallForceKernel::execute(ContextImpl& context, bool includeForces, bool) {
    const vector<Vec3>& positions = *extractData(context).positions;
    vector<Vec3>& forces = *extractData(context).forces;
    const int faces = countFaces(walls.wall);
    double energy = 0;
    for (const WallParticle& own : walls.particles)
        for (int face = 0; face < faces; face++) {
            const Vec3& position = positions[own.particle];
            const double at[] = {position[0], position[1], position[2]};
            double gradient[3];
            const double depth = findDepth(walls.wall, face, at, own.radius, gradient);
            if (!(depth > 0))
                continue;
            energy += 0.5*walls.stiffness*depth*depth;
            if (includeForces)
                forces[own.particle] -= Vec3(gradient[0], gradient[1], gradient[2])*(walls.stiffness*depth);
        }
    return energy;
}

void ReferenceCalcCylinderChainWallForceKernel::copyParametersToContext(ContextImpl&, const WallSystem& walls) {
    this->walls = walls;
}
