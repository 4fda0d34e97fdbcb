#include "openmm/CylinderChainIntegrator.h"
#include "openmm/serialization/ObjectProxy.h"
#include <memory>
#include <string>

using namespace OpenMM;
using namespace std;

static void writeVector(SerializationNode& node, const string& name, const Vec3& vector) {
    node.createChildNode(name).setDoubleProperty("x", vector[0]).setDoubleProperty("y", vector[1])
            .setDoubleProperty("z", vector[2]);
}

static Vec3 readVector(const SerializationNode& node, const string& name) {
    const SerializationNode& child = node.getChildNode(name);
    return {child.getDoubleProperty("x"), child.getDoubleProperty("y"), child.getDoubleProperty("z")};
}

static const char* const ROTATIONAL[] = {"xx", "xy", "xz", "yy", "yz", "zz"};

static void writeBody(const CylinderChainIntegrator& integrator, int index, SerializationNode& node) {
    vector<int> particles;
    vector<double> places, rotationalFriction;
    double friction;
    bool planar;
    integrator.getBody(index, particles, places, friction, rotationalFriction, planar);
    node.setDoubleProperty("friction", friction).setBoolProperty("planar", planar);
    SerializationNode& rotational = node.createChildNode("RotationalFriction");
    for (int i = 0; i < 6; i++)
        rotational.setDoubleProperty(ROTATIONAL[i], rotationalFriction[i]);
    for (size_t i = 0; i < particles.size(); i++)
        node.createChildNode("Particle").setIntProperty("index", particles[i]).setDoubleProperty("x", places[3*i])
                .setDoubleProperty("y", places[3*i+1]).setDoubleProperty("z", places[3*i+2]);
}

static void readBody(const SerializationNode& node, CylinderChainIntegrator& integrator) {
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
    integrator.addBody(particles, places, node.getDoubleProperty("friction"), rotationalFriction,
            node.getBoolProperty("planar"));
}

static void write(const CylinderChainIntegrator& integrator, SerializationNode& node) {
    node.setDoubleProperty("stepSize", integrator.getStepSize());
    node.setDoubleProperty("constraintTolerance", integrator.getConstraintTolerance());
    node.setDoubleProperty("temperature", integrator.getTemperature());
    node.setDoubleProperty("friction", integrator.getFriction());
    node.setIntProperty("scheme", integrator.getScheme());
    node.setIntProperty("precision", integrator.getPrecision());
    node.setIntProperty("pathLevel", integrator.getPathLevel());
    node.setIntProperty("workWindow", integrator.getWorkWindow());
    node.setBoolProperty("recordsTensions", integrator.getRecordsTensions());
    node.setIntProperty("randomSeed", integrator.getRandomNumberSeed());
    node.setIntProperty("integrationForceGroups", integrator.getIntegrationForceGroups());
    Vec3 velocity, gradientX, gradientY, gradientZ, origin;
    integrator.getFlow(velocity, gradientX, gradientY, gradientZ, origin);
    SerializationNode& flow = node.createChildNode("Flow");
    writeVector(flow, "Velocity", velocity);
    writeVector(flow, "GradientX", gradientX);
    writeVector(flow, "GradientY", gradientY);
    writeVector(flow, "GradientZ", gradientZ);
    writeVector(flow, "Origin", origin);
    SerializationNode& frictions = node.createChildNode("ParticleFrictions");
    for (auto& entry : integrator.getParticleFrictions())
        frictions.createChildNode("Particle").setIntProperty("index", entry.first)
                .setDoubleProperty("friction", entry.second);
    SerializationNode& bodies = node.createChildNode("Bodies");
    for (int i = 0; i < integrator.getNumBodies(); i++)
        writeBody(integrator, i, bodies.createChildNode("Body"));
}

static unique_ptr<CylinderChainIntegrator> readIntegrator(const SerializationNode& node) {
    unique_ptr<CylinderChainIntegrator> integrator(new CylinderChainIntegrator(node.getDoubleProperty("temperature"),
            node.getDoubleProperty("friction"), node.getDoubleProperty("stepSize")));
    integrator->setConstraintTolerance(node.getDoubleProperty("constraintTolerance"));
    integrator->setScheme((CylinderChainIntegrator::Scheme) node.getIntProperty("scheme"));
    integrator->setPrecision((CylinderChainIntegrator::Precision) node.getIntProperty("precision"));
    integrator->setRandomNumberSeed(node.getIntProperty("randomSeed"));
    integrator->setPathLevel(node.getIntProperty("pathLevel"));
    integrator->setWorkWindow(node.getIntProperty("workWindow"));
    integrator->setRecordsTensions(node.getBoolProperty("recordsTensions"));
    integrator->setIntegrationForceGroups(node.getIntProperty("integrationForceGroups"));
    const SerializationNode& flow = node.getChildNode("Flow");
    integrator->setFlow(readVector(flow, "Velocity"), readVector(flow, "GradientX"), readVector(flow, "GradientY"),
            readVector(flow, "GradientZ"), readVector(flow, "Origin"));
    for (auto& particle : node.getChildNode("ParticleFrictions").getChildren())
        integrator->setParticleFriction(particle.getIntProperty("index"), particle.getDoubleProperty("friction"));
    for (auto& body : node.getChildNode("Bodies").getChildren())
        readBody(body, *integrator);
    return integrator;
}

static const bool isIntegratorRegistered =
        registerProxy<CylinderChainIntegrator>("CylinderChainIntegrator", 5, write, readIntegrator);
