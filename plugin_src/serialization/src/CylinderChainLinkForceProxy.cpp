#include "openmm/serialization/CylinderChainLinkForceProxy.h"
#include "openmm/CylinderChainLinkForce.h"
#include "openmm/OpenMMException.h"
#include "openmm/internal/LinkStorage.h"
#include "openmm/serialization/SerializationNode.h"
#include <memory>

using namespace OpenMM;
using namespace std;

CylinderChainLinkForceProxy::CylinderChainLinkForceProxy() : SerializationProxy("CylinderChainLinkForce") {
}

void CylinderChainLinkForceProxy::serialize(const void* object, SerializationNode& node) const {
    const CylinderChainLinkForce& force = *reinterpret_cast<const CylinderChainLinkForce*>(object);
    // Version 2 is that of links between tangents.

    node.setIntProperty("version", force.getJoinsTangents() ? 2 : 1);
    node.setIntProperty("forceGroup", force.getForceGroup());
    node.setStringProperty("name", force.getName());
    node.setBoolProperty("usesPeriodic", force.usesPeriodicBoundaryConditions());
    int model;
    double restLength, stiffness, maximumExtension;
    force.getDefaultLinkParameters(model, restLength, stiffness, maximumExtension);
    node.createChildNode("Defaults").setStringProperty("stretchingModel",
            CylinderChainLinkForce::getStretchingModelNames()[model]).setDoubleProperty("restLength", restLength)
            .setDoubleProperty("stiffness", stiffness).setDoubleProperty("maximumExtension", maximumExtension);
    writeTable(node.createChildNode("Links"), force.getTable());
}

void* CylinderChainLinkForceProxy::deserialize(const SerializationNode& node) const {
    const int version = node.getIntProperty("version");
    if (version != 1 && version != 2)
        throw OpenMMException("Unsupported version number");
    unique_ptr<CylinderChainLinkForce> force(new CylinderChainLinkForce());
    force->setJoinsTangents(version == 2);
    force->setForceGroup(node.getIntProperty("forceGroup"));
    force->setName(node.getStringProperty("name"));
    force->setUsesPeriodicBoundaryConditions(node.getBoolProperty("usesPeriodic"));
    const SerializationNode& defaults = node.getChildNode("Defaults");
    const int model = findStretchingModel(defaults.getStringProperty("stretchingModel"));
    force->setDefaultLinkParameters((CylinderChainLinkForce::StretchingModel) model,
            defaults.getDoubleProperty("restLength"), defaults.getDoubleProperty("stiffness"),
            defaults.getDoubleProperty("maximumExtension"));
    force->setTable(readTable(node.getChildNode("Links")));
    return force.release();
}
