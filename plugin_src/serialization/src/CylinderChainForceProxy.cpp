#include "openmm/CylinderChainForce.h"
#include "openmm/OpenMMException.h"
#include "openmm/serialization/ObjectProxy.h"
#include <memory>

using namespace OpenMM;
using namespace cylchain;
using namespace std;

static void writeParticles(SerializationNode& chain, const vector<int>& indices) {
    SerializationNode& particles = chain.createChildNode("Particles");
    for (int particle : indices)
        particles.createChildNode("Particle").setIntProperty("index", particle);
}

static vector<int> readParticles(const SerializationNode& chain) {
    vector<int> particles;
    for (auto& particle : chain.getChildNode("Particles").getChildren())
        particles.push_back(particle.getIntProperty("index"));
    return particles;
}

static void writeTwist(SerializationNode& node, const ChainTwist& twist) {
    SerializationNode& joints = node.createChildNode("Joints");
    for (size_t i = 0; i < twist.stiffness.size(); i++)
        joints.createChildNode("Joint").setDoubleProperty("stiffness", twist.stiffness[i])
                .setDoubleProperty("rest", twist.rest[i]);
    for (size_t i = 0; i < twist.bends.size(); i += 2)
        joints.getChildren()[i/2].setDoubleProperty("bendX", twist.bends[i])
                .setDoubleProperty("bendY", twist.bends[i+1]);
    SerializationNode& segments = node.createChildNode("Segments");
    for (double friction : twist.friction)
        segments.createChildNode("Segment").setDoubleProperty("friction", friction);
    SerializationNode& ends = node.createChildNode("Ends");
    for (const EndFrame& frame : twist.ends)
        ends.createChildNode("End").setDoubleProperty("x", frame.direction[0])
                .setDoubleProperty("y", frame.direction[1]).setDoubleProperty("z", frame.direction[2])
                .setDoubleProperty("stiffness", frame.stiffness).setDoubleProperty("torque", frame.torque)
                .setDoubleProperty("angularVelocity", frame.angularVelocity)
                .setDoubleProperty("friction", frame.friction).setIntProperty("body", frame.body);
}

static void readTwist(const SerializationNode& node, CylinderChainForce& force, int chain) {
    vector<double> stiffness, rest, friction, bends;
    for (auto& joint : node.getChildNode("Joints").getChildren()) {
        for (const char* component : {"bendX", "bendY"})
            if (joint.hasProperty(component))
                bends.push_back(joint.getDoubleProperty(component));
        stiffness.push_back(joint.getDoubleProperty("stiffness"));
        rest.push_back(joint.getDoubleProperty("rest"));
    }
    for (auto& segment : node.getChildNode("Segments").getChildren())
        friction.push_back(segment.getDoubleProperty("friction"));
    force.setChainTwist(chain, stiffness, rest, friction);
    force.setChainRestBends(chain, bends);
    int end = 0;
    for (auto& frame : node.getChildNode("Ends").getChildren()) {
        if (!force.isChainClosed(chain)) {
            force.setEndFrame(chain, end, Vec3(frame.getDoubleProperty("x"), frame.getDoubleProperty("y"),
                    frame.getDoubleProperty("z")), frame.getDoubleProperty("stiffness"),
                    frame.getDoubleProperty("torque"), frame.getDoubleProperty("angularVelocity"),
                    frame.getDoubleProperty("friction", 0));
            force.setEndFrameBody(chain, end, frame.getIntProperty("body", -1));
        }
        end++;
    }
}

static void writeChain(SerializationNode& node, const Chain& own) {
    node.setStringProperty("bendingModel", CylinderChainForce::getBendingModelNames()[(int) own.bending])
            .setStringProperty("stretchingModel", CylinderChainForce::getStretchingModelNames()[(int) own.stretching])
            .setDoubleProperty("nodeFriction", own.nodeFriction);
    SerializationNode& segments = node.createChildNode("Segments");
    for (const Segment& segment : own.segments)
        segments.createChildNode("Segment").setDoubleProperty("restLength", segment.restLength)
                .setDoubleProperty("stiffness", segment.stiffness)
                .setDoubleProperty("maximumExtension", segment.maximumExtension)
                .setDoubleProperty("parallel", segment.parallel)
                .setDoubleProperty("perpendicular", segment.perpendicular)
                .setDoubleProperty("rotational", segment.rotational)
                .setDoubleProperty("extensional", segment.extensional)
                .setDoubleProperty("propulsion", segment.propulsion);
    SerializationNode& joints = node.createChildNode("Joints");
    for (double stiffness : own.joints)
        joints.createChildNode("Joint").setDoubleProperty("stiffness", stiffness);
    if (own.twist.isPresent())
        writeTwist(node.createChildNode("Twist"), own.twist);
}

static void writeChain(SerializationNode& node, const BeamChain& own) {
    node.setDoubleProperty("elementLength", own.elementLength)
            .setDoubleProperty("stretchingModulus", own.stretchingModulus)
            .setDoubleProperty("bendingRigidity", own.bendingRigidity).setDoubleProperty("shortening", own.shortening)
            .setDoubleProperty("parallel", own.parallelFriction)
            .setDoubleProperty("perpendicular", own.perpendicularFriction)
            .setDoubleProperty("propulsion", own.propulsion);
}

static int addBeamChain(CylinderChainForce& force, const SerializationNode& node) {
    const int chain = force.addBeamChain(readParticles(node), node.getDoubleProperty("elementLength"),
            node.getDoubleProperty("stretchingModulus"), node.getDoubleProperty("bendingRigidity"),
            node.getDoubleProperty("shortening"), node.getDoubleProperty("parallel"),
            node.getDoubleProperty("perpendicular"), false, node.getBoolProperty("closed"));
    force.setBeamChainPropulsion(chain, node.getDoubleProperty("propulsion"));
    return chain;
}

static const char* const ROTATIONAL[] = {"xx", "xy", "xz", "yy", "yz", "zz"};

static void writeBody(const CylinderChainForce& force, int index, SerializationNode& node) {
    vector<int> particles;
    vector<double> places, rotationalFriction;
    double friction;
    bool planar;
    force.getBody(index, particles, places, friction, rotationalFriction, planar);
    node.setDoubleProperty("friction", friction).setBoolProperty("planar", planar);
    SerializationNode& rotational = node.createChildNode("RotationalFriction");
    for (int i = 0; i < 6; i++)
        rotational.setDoubleProperty(ROTATIONAL[i], rotationalFriction[i]);
    for (size_t i = 0; i < particles.size(); i++)
        node.createChildNode("Particle").setIntProperty("index", particles[i]).setDoubleProperty("x", places[3*i])
                .setDoubleProperty("y", places[3*i+1]).setDoubleProperty("z", places[3*i+2]);
}

static void readBody(const SerializationNode& node, CylinderChainForce& force) {
    vector<int> particles;
    vector<double> places, rotationalFriction;
    for (const char* name : ROTATIONAL)
        rotationalFriction.push_back(node.getChildNode("RotationalFriction").getDoubleProperty(name));
    for (const SerializationNode& child : node.getChildren()) {
        if (child.getName() != "Particle")
            continue;
        particles.push_back(child.getIntProperty("index"));
        for (const char* axis : {"x", "y", "z"})
            places.push_back(child.getDoubleProperty(axis));
    }
    force.addBody(particles, places, node.getDoubleProperty("friction"), rotationalFriction,
            node.getBoolProperty("planar"));
}

static void write(const CylinderChainForce& force, SerializationNode& node) {
    node.setBoolProperty("usesPeriodic", force.usesPeriodicBoundaryConditions());
    SerializationNode& chains = node.createChildNode("Chains");
    const ChainList& list = force.getChains();
    for (int i = 0; i < list.size(); i++) {
        SerializationNode& chain = chains.createChildNode(
                list.getKind(i) == ChainKind::BeamElements ? "BeamChain" : "Chain");
        chain.setStringProperty("name", list.getName(i)).setBoolProperty("closed", list.isClosed(i))
                .setBoolProperty("planar", list.isPlanar(i));
        writeParticles(chain, list.getParticles(i));
        list.visit(i, [&] (const auto& own) {writeChain(chain, own);});
    }
    SerializationNode& tethers = node.createChildNode("Tethers");
    for (int i = 0; i < force.getNumTethers(); i++) {
        int chain, tethered;
        Vec3 point;
        double stiffness;
        force.getTetherParameters(i, chain, tethered, point, stiffness);
        tethers.createChildNode("Tether").setIntProperty("chain", chain).setIntProperty("node", tethered)
                .setDoubleProperty("x", point[0]).setDoubleProperty("y", point[1]).setDoubleProperty("z", point[2])
                .setDoubleProperty("stiffness", stiffness);
    }
    SerializationNode& bodies = node.createChildNode("Bodies");
    for (int i = 0; i < force.getNumBodies(); i++)
        writeBody(force, i, bodies.createChildNode("Body"));
}

static void addSegment(CylinderChainForce& force, int chain, int segment, const SerializationNode& node) {
    force.setSegmentParameters(chain, segment, node.getDoubleProperty("restLength"),
            node.getDoubleProperty("stiffness"), node.getDoubleProperty("maximumExtension"),
            node.getDoubleProperty("parallel"), node.getDoubleProperty("perpendicular"),
            node.getDoubleProperty("rotational"), node.getDoubleProperty("extensional"));
    force.setSegmentPropulsion(chain, segment, node.getDoubleProperty("propulsion"));
}

/** The number of a model, whose name is stored. */
static int findModel(const SerializationNode& node, const string& property, const vector<string>& names) {
    const string name = node.getStringProperty(property);
    for (size_t i = 0; i < names.size(); i++)
        if (names[i] == name)
            return i;
    throw OpenMMException("CylinderChainForce: There is no "+property+" "+name);
}

static int addChain(CylinderChainForce& force, const SerializationNode& node) {
    const vector<int> particles = readParticles(node);
    auto& segments = node.getChildNode("Segments").getChildren();
    auto& joints = node.getChildNode("Joints").getChildren();
    const bool closed = node.getBoolProperty("closed");
    if (particles.size() < 2 || segments.size()+(closed ? 0 : 1) != particles.size() ||
            joints.size()+(closed ? 0 : 2) != particles.size())
        throw OpenMMException("CylinderChainForce: A chain has the wrong number of segments or joints");

    // Add a chain of placeholders, and then set the parameters.

    const int bending = findModel(node, "bendingModel", CylinderChainForce::getBendingModelNames());
    const int stretching = findModel(node, "stretchingModel", CylinderChainForce::getStretchingModelNames());
    const int chain = force.addChain(particles, (CylinderChainForce::BendingModel) bending,
            (CylinderChainForce::StretchingModel) stretching, 1, 1, 1, 0, 1, 1, 1, 1, closed);
    force.setChainNodeFriction(chain, node.getDoubleProperty("nodeFriction"));
    for (size_t j = 0; j < segments.size(); j++)
        addSegment(force, chain, j, segments[j]);
    for (size_t j = 0; j < joints.size(); j++)
        force.setJointParameters(chain, j, joints[j].getDoubleProperty("stiffness"));
    for (auto& child : node.getChildren())
        if (child.getName() == "Twist")
            readTwist(child, force, chain);
    return chain;
}

static unique_ptr<CylinderChainForce> readForce(const SerializationNode& node) {
    unique_ptr<CylinderChainForce> force(new CylinderChainForce());
    force->setUsesPeriodicBoundaryConditions(node.getBoolProperty("usesPeriodic"));
    for (auto& chain : node.getChildNode("Chains").getChildren()) {
        const int number = chain.getName() == "BeamChain" ? addBeamChain(*force, chain) : addChain(*force, chain);
        force->setChainName(number, chain.getStringProperty("name"));
        force->setChainPlanar(number, chain.getBoolProperty("planar"));
    }
    for (auto& tether : node.getChildNode("Tethers").getChildren())
        force->addTether(tether.getIntProperty("chain"), tether.getIntProperty("node"),
                Vec3(tether.getDoubleProperty("x"), tether.getDoubleProperty("y"), tether.getDoubleProperty("z")),
                tether.getDoubleProperty("stiffness"));
    for (auto& body : node.getChildNode("Bodies").getChildren())
        readBody(body, *force);
    return force;
}

static const bool isForceRegistered =
        registerProxy<CylinderChainForce>("CylinderChainForce", 11, write, readForce);
