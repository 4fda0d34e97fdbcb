#include "openmm/serialization/CylinderChainIntegratorProxy.h"
#include "openmm/CylinderChainIntegrator.h"
#include "openmm/OpenMMException.h"
#include "openmm/serialization/SerializationNode.h"
#include <memory>

using namespace OpenMM;
using namespace std;

CylinderChainIntegratorProxy::CylinderChainIntegratorProxy() : SerializationProxy("CylinderChainIntegrator") {
}

void CylinderChainIntegratorProxy::serialize(const void* object, SerializationNode& node) const {
    node.setIntProperty("version", 1);
    const CylinderChainIntegrator& integrator = *reinterpret_cast<const CylinderChainIntegrator*>(object);
    node.setDoubleProperty("stepSize", integrator.getStepSize());
    node.setDoubleProperty("constraintTolerance", integrator.getConstraintTolerance());
    node.setDoubleProperty("temperature", integrator.getTemperature());
    node.setDoubleProperty("friction", integrator.getFriction());
    node.setIntProperty("scheme", integrator.getScheme());
    node.setIntProperty("randomSeed", integrator.getRandomNumberSeed());
    node.setIntProperty("integrationForceGroups", integrator.getIntegrationForceGroups());
    SerializationNode& frictions = node.createChildNode("ParticleFrictions");
    for (auto& entry : integrator.getParticleFrictions())
        frictions.createChildNode("Particle").setIntProperty("index", entry.first)
                .setDoubleProperty("friction", entry.second);
}

void* CylinderChainIntegratorProxy::deserialize(const SerializationNode& node) const {
    if (node.getIntProperty("version") != 1)
        throw OpenMMException("Unsupported version number");
    unique_ptr<CylinderChainIntegrator> integrator(new CylinderChainIntegrator(node.getDoubleProperty("temperature"),
            node.getDoubleProperty("friction"), node.getDoubleProperty("stepSize")));
    integrator->setConstraintTolerance(node.getDoubleProperty("constraintTolerance"));
    integrator->setScheme((CylinderChainIntegrator::Scheme) node.getIntProperty("scheme"));
    integrator->setRandomNumberSeed(node.getIntProperty("randomSeed"));
    integrator->setIntegrationForceGroups(node.getIntProperty("integrationForceGroups"));
    for (auto& particle : node.getChildNode("ParticleFrictions").getChildren())
        integrator->setParticleFriction(particle.getIntProperty("index"), particle.getDoubleProperty("friction"));
    return integrator.release();
}
