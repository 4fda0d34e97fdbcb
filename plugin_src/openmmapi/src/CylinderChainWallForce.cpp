#include "openmm/CylinderChainWallForce.h"
#include "openmm/OpenMMException.h"
#include "openmm/internal/AssertionUtilities.h"
#include "openmm/internal/CylinderChainWallForceImpl.h"
#include <algorithm>
#include <cmath>

using namespace OpenMM;
using namespace cylchain;
using namespace std;

static void requireOfWall(bool condition, const string& message) {
    if (!condition)
        throw OpenMMException("CylinderChainWallForce: "+message);
}

static void requireOneFace(const Wall& wall) {
    const string side = Names<WallSide>::ALL[static_cast<int>(wall.side)];
    requireOfWall(wall.side == WallSide::Inside || countFaces(wall) == 1, "Particles cannot be at the "+side+" of a "+
            Names<WallShape>::ALL[static_cast<int>(wall.shape)]+", which has several faces");
}

static bool isFinite(const Vec3& v) {
    return isfinite(v[0]) && isfinite(v[1]) && isfinite(v[2]);
}

CylinderChainWallForce::CylinderChainWallForce(const string& shape, const Vec3& point, const Vec3& vector,
        double length, double stiffness) {
    setName("CylinderChainWallForce");
    setRegion(shape, point, vector, length);
    setStiffness(stiffness);
}

string CylinderChainWallForce::getRegion(Vec3& point, Vec3& vector, double& length) const {
    const Wall& wall = walls.wall;
    point = Vec3(wall.point[0], wall.point[1], wall.point[2]);
    vector = Vec3(wall.vector[0], wall.vector[1], wall.vector[2]);
    length = wall.length;
    return Names<WallShape>::ALL[static_cast<int>(wall.shape)];
}

void CylinderChainWallForce::setRegion(const string& shape, const Vec3& point, const Vec3& vector, double length) {
    const std::vector<string> names = namesOf<WallShape>();
    const size_t number = find(names.begin(), names.end(), shape)-names.begin();
    requireOfWall(number < names.size(), "There is no shape '"+shape+"'");
    requireOfWall(isFinite(point) && isFinite(vector) && isfinite(length),
            "The region must be described by finite numbers");
    const WallShape kind = static_cast<WallShape>(number);
    Vec3 stored = vector;
    if (kind == WallShape::Plane || kind == WallShape::Slab || kind == WallShape::Cylinder) {
        const double size = sqrt(vector.dot(vector));
        requireOfWall(size > 0, "The direction of a "+shape+" cannot be the zero vector");
        // What is normalized already stays the same to the bit.

        if (fabs(size-1) > 1e-15)
            stored = vector/size;
    }
    if (kind == WallShape::Capsule)
        requireOfWall(vector.dot(vector) > 0, "The vector to a cap of a capsule cannot be the zero vector");
    if (kind == WallShape::Torus)
        requireOfWall(vector.dot(vector) > length*length,
                "The circle of a torus must have a larger radius than its tube");
    if (kind == WallShape::Slab || kind == WallShape::Sphere || kind == WallShape::Cylinder ||
            kind == WallShape::Capsule || kind == WallShape::Torus)
        requireOfWall(length > 0, "The length of a "+shape+" must be positive");
    if (kind == WallShape::Box)
        requireOfWall(vector[0] > point[0] && vector[1] > point[1] && vector[2] > point[2],
                "The upper corner of a box must exceed the lower one along every axis");
    if (kind == WallShape::Ellipsoid)
        requireOfWall(vector[0] > 0 && vector[1] > 0 && vector[2] > 0, "Semi-axes must be positive");
    const Wall found = {kind, walls.wall.side, {point[0], point[1], point[2]}, {stored[0], stored[1], stored[2]},
            length};
    requireOneFace(found);
    walls.wall = found;
}

string CylinderChainWallForce::getSide() const {
    return Names<WallSide>::ALL[static_cast<int>(walls.wall.side)];
}

void CylinderChainWallForce::setSide(const string& side) {
    const std::vector<string> names = namesOf<WallSide>();
    const size_t number = find(names.begin(), names.end(), side)-names.begin();
    requireOfWall(number < names.size(), "There is no side '"+side+"'");
    Wall changed = walls.wall;
    changed.side = static_cast<WallSide>(number);
    requireOneFace(changed);
    walls.wall = changed;
}

void CylinderChainWallForce::setStiffness(double stiffness) {
    requireOfWall(stiffness >= 0 && isfinite(stiffness), "The stiffness cannot be negative and must be finite");
    walls.stiffness = stiffness;
}

int CylinderChainWallForce::addParticle(int particle, double radius) {
    requireOfWall(particle >= 0, "Illegal particle index: "+to_string(particle));
    requireOfWall(radius >= 0 && isfinite(radius), "A radius cannot be negative and must be finite");
    walls.particles.push_back({particle, radius});
    return walls.particles.size()-1;
}

int CylinderChainWallForce::getParticle(int index) const {
    ASSERT_VALID_INDEX(index, walls.particles);
    return walls.particles[index].particle;
}

double CylinderChainWallForce::getParticleRadius(int index) const {
    ASSERT_VALID_INDEX(index, walls.particles);
    return walls.particles[index].radius;
}

void CylinderChainWallForce::setParticleRadius(int index, double radius) {
    ASSERT_VALID_INDEX(index, walls.particles);
    requireOfWall(radius >= 0 && isfinite(radius), "A radius cannot be negative and must be finite");
    walls.particles[index].radius = radius;
}

void CylinderChainWallForce::updateParametersInContext(Context& context) {
    dynamic_cast<CylinderChainWallForceImpl&>(getImplInContext(context)).updateParametersInContext(
            getContextImpl(context));
}

double CylinderChainWallForce::takeMeanForces(Context& context, int reader, std::vector<double>& forces,
        std::vector<int>& numbers, std::vector<double>& sums, std::vector<double>& loads) {
    return dynamic_cast<CylinderChainWallForceImpl&>(getImplInContext(context)).takeMeanForces(
            getContextImpl(context), reader, forces, numbers, sums, loads);
}

int CylinderChainWallForce::addForceReader(Context& context) {
    return dynamic_cast<CylinderChainWallForceImpl&>(getImplInContext(context)).addReader();
}

std::vector<cylchain::Place> CylinderChainWallForce::findPlaces(const PlaceResolver& resolver) const {
    std::vector<cylchain::Place> places;
    for (const WallParticle& own : walls.particles) {
        // A particle between two others is not on a chain for a wall, but one on a curve is.
        cylchain::Place alone;
        alone.first = own.particle;
        const cylchain::Place place = resolver.resolve(alone);
        places.push_back(place.isOnCurve() ? place : alone);
    }
    return places;
}

ForceImpl* CylinderChainWallForce::createImpl() const {
    return new CylinderChainWallForceImpl(*this);
}
