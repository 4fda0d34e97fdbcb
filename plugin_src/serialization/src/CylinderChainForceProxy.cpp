#include "openmm/serialization/CylinderChainForceProxy.h"
#include "openmm/CylinderChainForce.h"
#include "openmm/OpenMMException.h"
#include "openmm/serialization/SerializationNode.h"
#include <memory>

using namespace OpenMM;
using namespace std;

CylinderChainForceProxy::CylinderChainForceProxy() : SerializationProxy("CylinderChainForce") {
}

static double propulsionOf(const CylinderChainForce& force, int beam) {
    double propulsion;
    force.getBeamChainPropulsion(beam, propulsion);
    return propulsion;
}

static void serializeBeams(const CylinderChainForce& force, SerializationNode& node) {
    for (int i = 0; i < force.getNumBeamChains(); i++) {
        double length, modulus, rigidity, shortening, parallel, perpendicular;
        force.getBeamChainParameters(i, length, modulus, rigidity, shortening, parallel, perpendicular);
        SerializationNode& beam = node.createChildNode("Beam");
        beam.setDoubleProperty("elementLength", length).setDoubleProperty("stretchingModulus", modulus)
                .setDoubleProperty("bendingRigidity", rigidity).setDoubleProperty("shortening", shortening)
                .setDoubleProperty("parallel", parallel).setDoubleProperty("perpendicular", perpendicular)
                .setBoolProperty("planar", force.isBeamChainPlanar(i));
        if (propulsionOf(force, i) != 0)
            beam.setDoubleProperty("propulsion", propulsionOf(force, i));
        if (force.isBeamChainClosed(i))
            beam.setBoolProperty("closed", true);
        SerializationNode& particles = beam.createChildNode("Particles");
        for (int particle : force.getBeamChainParticles(i))
            particles.createChildNode("Particle").setIntProperty("index", particle);
    }
}

static void addBeam(CylinderChainForce& force, const SerializationNode& node) {
    vector<int> particles;
    for (auto& particle : node.getChildNode("Particles").getChildren())
        particles.push_back(particle.getIntProperty("index"));
    const int chain = force.addBeamChain(particles, node.getDoubleProperty("elementLength"),
            node.getDoubleProperty("stretchingModulus"), node.getDoubleProperty("bendingRigidity"),
            node.getDoubleProperty("shortening"), node.getDoubleProperty("parallel"),
            node.getDoubleProperty("perpendicular"), node.getBoolProperty("planar"),
            node.getBoolProperty("closed", false));
    force.setBeamChainPropulsion(chain, node.getDoubleProperty("propulsion", 0));
}

static void writeTether(SerializationNode& node, int chain, int tethered, const Vec3& point, double stiffness) {
    node.createChildNode("Tether").setIntProperty("chain", chain).setIntProperty("node", tethered)
            .setDoubleProperty("x", point[0]).setDoubleProperty("y", point[1]).setDoubleProperty("z", point[2])
            .setDoubleProperty("stiffness", stiffness);
}

static Vec3 pointOf(const SerializationNode& tether) {
    return Vec3(tether.getDoubleProperty("x"), tether.getDoubleProperty("y"), tether.getDoubleProperty("z"));
}

/** The first one that knows what a Force has. */
static int versionOf(const CylinderChainForce& force) {
    for (int i = 0; i < force.getNumBeamChains(); i++)
        if (force.isBeamChainClosed(i))
            return 8;
    for (int i = 0; i < force.getNumBeamChains(); i++)
        if (propulsionOf(force, i) != 0)
            return 7;
    return force.getNumBeamTethers() > 0 ? 6 : force.getNumBeamChains() > 0 ? 5 : 4;
}

void CylinderChainForceProxy::serialize(const void* object, SerializationNode& node) const {
    const CylinderChainForce& force = *reinterpret_cast<const CylinderChainForce*>(object);
    node.setIntProperty("version", versionOf(force));
    node.setIntProperty("forceGroup", force.getForceGroup());
    node.setStringProperty("name", force.getName());
    node.setBoolProperty("usesPeriodic", force.usesPeriodicBoundaryConditions());
    SerializationNode& chains = node.createChildNode("Chains");
    for (int i = 0; i < force.getNumChains(); i++) {
        int bendingModel, stretchingModel;
        force.getChainModels(i, bendingModel, stretchingModel);
        SerializationNode& chain = chains.createChildNode("Chain");
        chain.setStringProperty("bendingModel", CylinderChainForce::getBendingModelNames()[bendingModel])
                .setStringProperty("stretchingModel", CylinderChainForce::getStretchingModelNames()[stretchingModel])
                .setBoolProperty("closed", force.isChainClosed(i)).setBoolProperty("planar", force.isChainPlanar(i))
                .setDoubleProperty("nodeFriction", force.getChainNodeFriction(i));
        SerializationNode& particles = chain.createChildNode("Particles");
        for (int particle : force.getChainParticles(i))
            particles.createChildNode("Particle").setIntProperty("index", particle);
        SerializationNode& segments = chain.createChildNode("Segments");
        for (int j = 0; j < force.getNumSegments(i); j++) {
            double restLength, stiffness, maximumExtension, parallel, perpendicular, rotational, extensional,
                    propulsion;
            force.getSegmentParameters(i, j, restLength, stiffness, maximumExtension, parallel, perpendicular,
                    rotational, extensional);
            force.getSegmentPropulsion(i, j, propulsion);
            segments.createChildNode("Segment").setDoubleProperty("restLength", restLength)
                    .setDoubleProperty("stiffness", stiffness).setDoubleProperty("maximumExtension", maximumExtension)
                    .setDoubleProperty("parallel", parallel).setDoubleProperty("perpendicular", perpendicular)
                    .setDoubleProperty("rotational", rotational).setDoubleProperty("extensional", extensional)
                    .setDoubleProperty("propulsion", propulsion);
        }
        SerializationNode& joints = chain.createChildNode("Joints");
        for (int j = 0; j < force.getNumJoints(i); j++) {
            double stiffness;
            force.getJointParameters(i, j, stiffness);
            joints.createChildNode("Joint").setDoubleProperty("stiffness", stiffness);
        }
    }
    // Versions before 5 have none, and are what is written of a Force without any.

    if (force.getNumBeamChains() > 0)
        serializeBeams(force, node.createChildNode("Beams"));
    int chain, tethered;
    Vec3 point;
    double stiffness;
    SerializationNode& tethers = node.createChildNode("Tethers");
    for (int i = 0; i < force.getNumTethers(); i++) {
        force.getTetherParameters(i, chain, tethered, point, stiffness);
        writeTether(tethers, chain, tethered, point, stiffness);
    }
    // Versions before 6 have none.

    if (versionOf(force) < 6)
        return;
    SerializationNode& ofBeams = node.createChildNode("BeamTethers");
    for (int i = 0; i < force.getNumBeamTethers(); i++) {
        force.getBeamTetherParameters(i, chain, tethered, point, stiffness);
        writeTether(ofBeams, chain, tethered, point, stiffness);
    }
}

static void addSegment(CylinderChainForce& force, int chain, int segment, const SerializationNode& node) {
    force.setSegmentParameters(chain, segment, node.getDoubleProperty("restLength"),
            node.getDoubleProperty("stiffness"), node.getDoubleProperty("maximumExtension"),
            node.getDoubleProperty("parallel"), node.getDoubleProperty("perpendicular"),
            node.getDoubleProperty("rotational"), node.getDoubleProperty("extensional"));
    force.setSegmentPropulsion(chain, segment, node.getDoubleProperty("propulsion", 0));
}

/**
 * The number of a model. Since version 4, its name is stored; before, it was the number.
 */
static int findModel(const SerializationNode& node, const string& property, const vector<string>& names, int version) {
    if (version < 4)
        return node.getIntProperty(property);
    const string name = node.getStringProperty(property);
    for (size_t i = 0; i < names.size(); i++)
        if (names[i] == name)
            return i;
    throw OpenMMException("CylinderChainForce: There is no "+property+" "+name);
}

static void addChain(CylinderChainForce& force, const SerializationNode& node, int version) {
    vector<int> particles;
    for (auto& particle : node.getChildNode("Particles").getChildren())
        particles.push_back(particle.getIntProperty("index"));
    auto& segments = node.getChildNode("Segments").getChildren();
    auto& joints = node.getChildNode("Joints").getChildren();
    const bool closed = node.getBoolProperty("closed", false);
    if (particles.size() < 2 || segments.size()+(closed ? 0 : 1) != particles.size() ||
            joints.size()+(closed ? 0 : 2) != particles.size())
        throw OpenMMException("CylinderChainForce: A chain has the wrong number of segments or joints");

    // Add a chain of placeholders, and then set the parameters.

    const int bending = findModel(node, "bendingModel", CylinderChainForce::getBendingModelNames(), version);
    const int stretching = findModel(node, "stretchingModel", CylinderChainForce::getStretchingModelNames(), version);
    const int chain = force.addChain(particles, (CylinderChainForce::BendingModel) bending,
            (CylinderChainForce::StretchingModel) stretching, 1, 1, 1, 0, 1, 1, 1, 1, closed);
    force.setChainNodeFriction(chain, node.getDoubleProperty("nodeFriction", 0));
    force.setChainPlanar(chain, node.getBoolProperty("planar", false));
    for (size_t j = 0; j < segments.size(); j++)
        addSegment(force, chain, j, segments[j]);
    for (size_t j = 0; j < joints.size(); j++)
        force.setJointParameters(chain, j, joints[j].getDoubleProperty("stiffness"));
}

void* CylinderChainForceProxy::deserialize(const SerializationNode& node) const {
    const int version = node.getIntProperty("version");
    if (version < 1 || version > 8)
        throw OpenMMException("Unsupported version number");
    unique_ptr<CylinderChainForce> force(new CylinderChainForce());
    force->setForceGroup(node.getIntProperty("forceGroup"));
    force->setName(node.getStringProperty("name"));
    force->setUsesPeriodicBoundaryConditions(node.getBoolProperty("usesPeriodic"));
    for (auto& chain : node.getChildNode("Chains").getChildren())
        addChain(*force, chain, version);
    if (version > 1)
        for (auto& tether : node.getChildNode("Tethers").getChildren())
            force->addTether(tether.getIntProperty("chain"), tether.getIntProperty("node"), pointOf(tether),
                    tether.getDoubleProperty("stiffness"));
    if (version > 4)
        for (auto& beam : node.getChildNode("Beams").getChildren())
            addBeam(*force, beam);
    if (version > 5)
        for (auto& tether : node.getChildNode("BeamTethers").getChildren())
            force->addBeamTether(tether.getIntProperty("chain"), tether.getIntProperty("node"), pointOf(tether),
                    tether.getDoubleProperty("stiffness"));
    return force.release();
}
