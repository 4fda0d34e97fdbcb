#include "CommonCouplingKernels.h"
#include "openmm/OpenMMException.h"
#include "openmm/internal/ContextImpl.h"
#include <functional>
#include <stdexcept>

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

CommonCalcCylinderChainContactForceKernel::CommonCalcCylinderChainContactForceKernel(string name,
        const Platform& platform, ComputeContext& cc) : CalcCylinderChainContactForceKernel(name, platform), host(cc),
        search(NULL), stiffness(0), periodic(false) {
}

void CommonCalcCylinderChainContactForceKernel::initialize(const System&, ContactSearch& search, double stiffness,
        bool periodic) {
    this->search = &search;
    this->stiffness = stiffness;
    this->periodic = periodic;
}

double CommonCalcCylinderChainContactForceKernel::execute(ContextImpl& context, bool includeForces, bool) {
    const vector<Capsule>& capsules = search->getSystem().capsules;
    if (capsules.empty())
        return 0;
    vector<Vec3>& positions = host.begin(context);
    vector<Vec3>& forces = host.getForces();
    Vec3 box[3];
    context.getPeriodicBoxVectors(box[0], box[1], box[2]);
    const double* x = &positions[0][0];
    try {
        search->findPairs(x, x, periodic ? &box[0][0] : NULL, 0, pairs, [] (int count,
                const function<void(int)>& iteration) {
            for (int i = 0; i < count; i++)
                iteration(i);
        });
    }
    catch (const invalid_argument& error) {
        throw OpenMMException(string("CylinderChainContactForce: ")+error.what());
    }
    double energy = 0;
    for (const ContactPair& pair : pairs) {
        Contact contacts[2];
        const int count = search->evaluate(pair, x, x, contacts, 0);
        for (int i = 0; i < count; i++) {
            const Contact& contact = contacts[i];
            const double k = contact.weight*stiffness;
            energy += 0.5*k*contact.gap*contact.gap;
            const Vec3 force = Vec3(contact.normal[0], contact.normal[1], contact.normal[2])*(-k*contact.gap);
            const Capsule &a = capsules[pair.a], &b = capsules[pair.b];
            forces[a.first] += force*(1-contact.s);
            forces[a.end()] += force*contact.s;
            forces[b.first] -= force*(1-contact.t);
            forces[b.end()] -= force*contact.t;
        }
    }
    if (includeForces)
        host.add();
    return energy;
}

void CommonCalcCylinderChainContactForceKernel::copyParametersToContext(ContextImpl&, double stiffness) {
    this->stiffness = stiffness;
}
