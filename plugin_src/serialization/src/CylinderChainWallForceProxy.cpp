#include "openmm/CylinderChainWallForce.h"
#include "openmm/serialization/ObjectProxy.h"
#include <memory>

using namespace OpenMM;
using namespace std;

static void addVector(SerializationNode& node, const char* name, const Vec3& vector) {
    node.createChildNode(name).setDoubleProperty("x", vector[0]).setDoubleProperty("y", vector[1])
            .setDoubleProperty("z", vector[2]);
}

static Vec3 getVector(const SerializationNode& node, const char* name) {
    const SerializationNode& child = node.getChildNode(name);
    return Vec3(child.getDoubleProperty("x"), child.getDoubleProperty("y"), child.getDoubleProperty("z"));
}

static void write(const CylinderChainWallForce& force, SerializationNode& node) {
    Vec3 point, vector;
    double length;
    const string shape = force.getRegion(point, vector, length);
    node.setStringProperty("shape", shape).setDoubleProperty("length", length)
            .setDoubleProperty("stiffness", force.getStiffness()).setStringProperty("side", force.getSide());
    addVector(node, "Point", point);
    addVector(node, "Vector", vector);
    SerializationNode& particles = node.createChildNode("Particles");
    for (int i = 0; i < force.getNumParticles(); i++)
        particles.createChildNode("Particle").setIntProperty("index", force.getParticle(i))
                .setDoubleProperty("radius", force.getParticleRadius(i));
}

static unique_ptr<CylinderChainWallForce> readWallForce(const SerializationNode& node) {
    unique_ptr<CylinderChainWallForce> force(new CylinderChainWallForce(node.getStringProperty("shape"),
            getVector(node, "Point"), getVector(node, "Vector"), node.getDoubleProperty("length"),
            node.getDoubleProperty("stiffness")));
    force->setSide(node.getStringProperty("side", "inside"));
    for (auto& particle : node.getChildNode("Particles").getChildren())
        force->addParticle(particle.getIntProperty("index"), particle.getDoubleProperty("radius"));
    return force;
}

static const bool isWallForceRegistered =
        registerProxy<CylinderChainWallForce>("CylinderChainWallForce", 1, write, readWallForce);
