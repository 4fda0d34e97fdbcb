#include "CommonCouplingKernels.h"
#include "ChainTables.h"
#include "openmm/common/ContextSelector.h"
#include <algorithm>

using namespace OpenMM;
using namespace cylchain;
using namespace std;

// Kernels know shapes by these numbers.

static_assert((int) WallShape::Plane == layout::WALL_PLANE && (int) WallShape::Slab == layout::WALL_SLAB &&
        (int) WallShape::Sphere == layout::WALL_SPHERE && (int) WallShape::Cylinder == layout::WALL_CYLINDER &&
        (int) WallShape::Box == layout::WALL_BOX && (int) WallShape::Ellipsoid == layout::WALL_ELLIPSOID &&
        (int) WallShape::Capsule == layout::WALL_CAPSULE, "");
static_assert((int) WallSide::Inside == layout::WALL_INSIDE && (int) WallSide::Outside == layout::WALL_OUTSIDE &&
        (int) WallSide::Surface == layout::WALL_SURFACE, "");

CommonCalcCylinderChainLinkForceKernel::CommonCalcCylinderChainLinkForceKernel(string name, const Platform& platform,
        ComputeContext& cc) : CalcCylinderChainLinkForceKernel(name, platform), cc(cc), coupled(cc), flags(0),
        anyRange(false) {
}

void CommonCalcCylinderChainLinkForceKernel::initialize(const System&, bool periodic, bool nearestParticles) {
    flags = (periodic ? layout::LINKS_ARE_PERIODIC : 0) | (nearestParticles ? layout::PLACES_ARE_PERIODIC : 0);
}

static bool areEqual(const Place& a, const Place& b) {
    return a.first == b.first && a.second == b.second && a.fraction == b.fraction &&
            equal(a.point, a.point+3, b.point);
}

static bool areEqual(const Link& a, const Link& b) {
    return areEqual(a.first, b.first) && areEqual(a.second, b.second) && a.model == b.model &&
            a.stiffness == b.stiffness && a.restLength == b.restLength && a.maximumExtension == b.maximumExtension;
}

void CommonCalcCylinderChainLinkForceKernel::upload(const vector<Link>& present) {
    vector<int> particles, endNumbers;
    for (const Link& link : present)
        for (int particle : {link.first.first, link.first.second, link.second.first, link.second.second})
            if (particle >= 0)
                particles.push_back(particle);
    coupled.setParticles(particles);
    vector<double> values;
    anyRange = false;
    for (const Link& link : present) {
        for (const Place* place : {&link.first, &link.second})
            endNumbers.insert(endNumbers.end(), {coupled.numberOf(place->first), coupled.numberOf(place->second)});
        values.insert(values.end(), {link.first.fraction, link.second.fraction});
        for (const Place* place : {&link.first, &link.second})
            values.insert(values.end(), place->point, place->point+3);
        const bool range = hasRange(link.model);
        anyRange = anyRange || range;
        values.insert(values.end(), {link.stiffness, link.restLength, range ? 1/link.maximumExtension : 0});
    }
    uploadTo(cc, ends, endNumbers, "endsOfLinks");
    uploadTo(cc, numbers, values, "numbersOfLinks");
    uploadTo(cc, energies, vector<double>(present.size()), "energiesOfLinks");
    uploadTo(cc, outOfRange, vector<int>(present.size()), "linksOutOfRange");
    links = present;
}

double CommonCalcCylinderChainLinkForceKernel::execute(ContextImpl&, const vector<Link>& present, bool includeForces,
        bool includeEnergy, int& firstOutOfRange) {
    firstOutOfRange = -1;
    if (present.empty())
        return 0;
    ContextSelector selector(cc);
    if (present.size() != links.size() || !equal(present.begin(), present.end(), links.begin(),
            [] (const Link& a, const Link& b) {return areEqual(a, b);}))
        upload(present);
    if (!kernel) {
        uploadTo(cc, summary, vector<uint64_t>(1), "summaryOfLinks");
        kernel = coupled.createKernel("computeLinks");
        kernel->addArg();
        kernel->addArg(flags);
        kernel->addArg();
        coupled.addArguments(kernel);
        for (ComputeArray* array : {&coupled.getBox(), &ends, &numbers, &energies, &outOfRange, &summary})
            kernel->addArg(*array);
    }
    coupled.gather();
    if (anyRange)
        cc.clearBuffer(summary);
    kernel->setArg(0, (int) links.size());
    kernel->setArg(2, (int) includeForces);
    kernel->execute(links.size());
    if (includeForces)
        coupled.finishForces();
    if (anyRange) {
        vector<uint64_t> count(1);
        summary.download(count);
        vector<int> found(outOfRange.getSize());
        if (count[0] > 0) {
            outOfRange.download(found);
            firstOutOfRange = find(found.begin(), found.end(), 1)-found.begin();
        }
    }
    return includeEnergy ? sumOfValues(energies, links.size()) : 0;
}

CommonCalcCylinderChainWallForceKernel::CommonCalcCylinderChainWallForceKernel(string name, const Platform& platform,
        ComputeContext& cc) : CalcCylinderChainWallForceKernel(name, platform), cc(cc), coupled(cc), upToDate(false) {
}

void CommonCalcCylinderChainWallForceKernel::initialize(const System&, const WallSystem& walls) {
    this->walls = walls;
    upToDate = false;
}

void CommonCalcCylinderChainWallForceKernel::upload() {
    const Wall& wall = walls.wall;
    vector<double> values(wall.point, wall.point+3), radiusNumbers;
    values.insert(values.end(), wall.vector, wall.vector+3);
    values.insert(values.end(), {wall.length, walls.stiffness});
    vector<int> own, particleNumbers;
    for (const WallParticle& particle : walls.particles)
        own.push_back(particle.particle);
    coupled.setParticles(own);
    for (const WallParticle& particle : walls.particles) {
        particleNumbers.push_back(coupled.numberOf(particle.particle));
        radiusNumbers.push_back(particle.radius);
    }
    uploadTo(cc, particles, particleNumbers, "particlesAtWall");
    uploadTo(cc, radii, radiusNumbers, "radiiAtWall");
    uploadTo(cc, numbers, values, "numbersOfWall");
    uploadTo(cc, energies, vector<double>(own.size()), "energiesOfWall");
    upToDate = true;
}

double CommonCalcCylinderChainWallForceKernel::execute(ContextImpl&, bool includeForces, bool includeEnergy) {
    if (walls.particles.empty())
        return 0;
    ContextSelector selector(cc);
    if (!upToDate)
        upload();
    if (!kernel) {
        kernel = coupled.createKernel("computeWalls");
        kernel->addArg((int) walls.particles.size());
        for (int i = 0; i < 4; i++)
            kernel->addArg();
        coupled.addArguments(kernel);
        for (ComputeArray* array : {&particles, &radii, &numbers, &energies})
            kernel->addArg(*array);
    }
    coupled.gather();
    kernel->setArg(1, (int) walls.wall.shape);
    kernel->setArg(2, (int) walls.wall.side);
    kernel->setArg(3, countFaces(walls.wall));
    kernel->setArg(4, (int) includeForces);
    kernel->execute(walls.particles.size());
    if (includeForces)
        coupled.finishForces();
    return includeEnergy ? sumOfValues(energies, walls.particles.size()) : 0;
}

void CommonCalcCylinderChainWallForceKernel::copyParametersToContext(ContextImpl&, const WallSystem& walls) {
    this->walls = walls;
    upToDate = false;
}
