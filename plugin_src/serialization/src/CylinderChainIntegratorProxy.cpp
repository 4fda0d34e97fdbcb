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
    node.setIntProperty("explicitForceGroups", integrator.getExplicitForceGroups());
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
    integrator->setExplicitForceGroups(node.getIntProperty("explicitForceGroups", 0));
    const SerializationNode& flow = node.getChildNode("Flow");
    integrator->setFlow(readVector(flow, "Velocity"), readVector(flow, "GradientX"), readVector(flow, "GradientY"),
            readVector(flow, "GradientZ"), readVector(flow, "Origin"));
    for (auto& particle : node.getChildNode("ParticleFrictions").getChildren())
        integrator->setParticleFriction(particle.getIntProperty("index"), particle.getDoubleProperty("friction"));
    return integrator;
}

static const bool isIntegratorRegistered =
        registerProxy<CylinderChainIntegrator>("CylinderChainIntegrator", 4, write, readIntegrator);
