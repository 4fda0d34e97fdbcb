#include "openmm/serialization/CylinderChainWallForceProxy.h"
#include "openmm/CylinderChainWallForce.h"
#include "openmm/OpenMMException.h"
#include "openmm/serialization/SerializationNode.h"
#include <memory>

using namespace OpenMM;
using namespace std;

CylinderChainWallForceProxy::CylinderChainWallForceProxy() : SerializationProxy("CylinderChainWallForce") {
}

static void addVector(SerializationNode& node, const char* name, const Vec3& vector) {
    node.createChildNode(name).setDoubleProperty("x", vector[0]).setDoubleProperty("y", vector[1])
            .setDoubleProperty("z", vector[2]);
}

static Vec3 getVector(const SerializationNode& node, const char* name) {
    const SerializationNode& child = node.getChildNode(name);
    return Vec3(child.getDoubleProperty("x"), child.getDoubleProperty("y"), child.getDoubleProperty("z"));
}

void CylinderChainWallForceProxy::serialize(const void* object, SerializationNode& node) const {
    node.setIntProperty("version", 1);
    const CylinderChainWallForce& force = *reinterpret_cast<const CylinderChainWallForce*>(object);
    node.setIntProperty("forceGroup", force.getForceGroup());
    node.setStringProperty("name", force.getName());
    Vec3 point, vector;
    double length;
    const string shape = force.getRegion(point, vector, length);
    node.setStringProperty("shape", shape).setDoubleProperty("length", length)
            .setDoubleProperty("stiffness", force.getStiffness());
    addVector(node, "Point", point);
    addVector(node, "Vector", vector);
    SerializationNode& particles = node.createChildNode("Particles");
    for (int i = 0; i < force.getNumParticles(); i++)
        particles.createChildNode("Particle").setIntProperty("index", force.getParticle(i))
                .setDoubleProperty("radius", force.getParticleRadius(i));
}

void* CylinderChainWallForceProxy::deserialize(const SerializationNode& node) const {
    if (node.getIntProperty("version") != 1)
        throw OpenMMException("Unsupported version number");
    unique_ptr<CylinderChainWallForce> force(new CylinderChainWallForce(node.getStringProperty("shape"),
            getVector(node, "Point"), getVector(node, "Vector"), node.getDoubleProperty("length"),
            node.getDoubleProperty("stiffness")));
    force->setForceGroup(node.getIntProperty("forceGroup"));
    force->setName(node.getStringProperty("name"));
    for (auto& particle : node.getChildNode("Particles").getChildren())
        force->addParticle(particle.getIntProperty("index"), particle.getDoubleProperty("radius"));
    return force.release();
}
