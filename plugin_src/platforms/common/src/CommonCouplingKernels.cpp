#include "CommonCouplingKernels.h"
#include "openmm/internal/ContextImpl.h"

using namespace OpenMM;
using namespace cylchain;
using namespace std;

CommonCalcCylinderChainLinkForceKernel::CommonCalcCylinderChainLinkForceKernel(string name, const Platform& platform,
        ComputeContext& cc) : CalcCylinderChainLinkForceKernel(name, platform), host(cc), periodic(false),
        nearestParticles(false) {
}

void CommonCalcCylinderChainLinkForceKernel::initialize(const System&, bool periodic, bool nearestParticles) {
    this->periodic = periodic;
    this->nearestParticles = nearestParticles;
}

double CommonCalcCylinderChainLinkForceKernel::execute(ContextImpl& context, const vector<Link>& links,
        bool includeForces, bool, int& outOfRange) {
    outOfRange = -1;
    if (links.empty())
        return 0;
    vector<Vec3>& positions = host.begin(context);
    Vec3 box[3];
    context.getPeriodicBoxVectors(box[0], box[1], box[2]);
    LinkBoxes boxes;
    boxes.distances = periodic ? &box[0][0] : NULL;
    boxes.segments = nearestParticles ? &box[0][0] : NULL;
    double* forces = &host.getForces()[0][0];
    double energy = 0;
    for (size_t i = 0; i < links.size(); i++) {
        const LinkPull pull = computePull(links[i], &positions[0][0], boxes);
        if (!pull.inRange && outOfRange == -1)
            outOfRange = i;
        energy += pull.energy;
        addForce(links[i].first, pull.force, -1, forces);
        addForce(links[i].second, pull.force, 1, forces);
    }
    if (includeForces)
        host.add();
    return energy;
}

CommonCalcCylinderChainWallForceKernel::CommonCalcCylinderChainWallForceKernel(string name, const Platform& platform,
        ComputeContext& cc) : CalcCylinderChainWallForceKernel(name, platform), host(cc) {
}

void CommonCalcCylinderChainWallForceKernel::initialize(const System&, const WallSystem& walls) {
    this->walls = walls;
}

double CommonCalcCylinderChainWallForceKernel::execute(ContextImpl& context, bool includeForces, bool) {
    const vector<Vec3>& positions = host.begin(context);
    vector<Vec3>& forces = host.getForces();
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
            forces[own.particle] -= Vec3(gradient[0], gradient[1], gradient[2])*(walls.stiffness*depth);
        }
    if (includeForces)
        host.add();
    return energy;
}

void CommonCalcCylinderChainWallForceKernel::copyParametersToContext(ContextImpl&, const WallSystem& walls) {
    this->walls = walls;
}
