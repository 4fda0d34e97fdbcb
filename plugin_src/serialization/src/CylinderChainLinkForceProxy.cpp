#include "openmm/serialization/CylinderChainLinkForceProxy.h"
#include "openmm/CylinderChainLinkForce.h"
#include "openmm/OpenMMException.h"
#include "openmm/internal/LinkDescription.h"
#include "openmm/serialization/SerializationNode.h"
#include <memory>

using namespace OpenMM;
using namespace std;

CylinderChainLinkForceProxy::CylinderChainLinkForceProxy() : SerializationProxy("CylinderChainLinkForce") {
}

void CylinderChainLinkForceProxy::serialize(const void* object, SerializationNode& node) const {
    const CylinderChainLinkForce& force = *reinterpret_cast<const CylinderChainLinkForce*>(object);
    node.setIntProperty("version", 3);
    node.setBoolProperty("joinsTangents", force.getJoinsTangents());
    node.setIntProperty("forceGroup", force.getForceGroup());
    node.setStringProperty("name", force.getName());
    node.setBoolProperty("usesPeriodic", force.usesPeriodicBoundaryConditions());
    int model;
    double restLength, stiffness, maximumExtension;
    force.getDefaultLinkParameters(model, restLength, stiffness, maximumExtension);
    node.createChildNode("Defaults").setIntProperty("stretchingModel", model)
            .setDoubleProperty("restLength", restLength).setDoubleProperty("stiffness", stiffness).setDoubleProperty("maximumExtension", maximumExtension);
    storeTable(force.getTable()).write(node.createChildNode("Links"));
}

void* CylinderChainLinkForceProxy::deserialize(const SerializationNode& node) const {
    if (node.getIntProperty("version") != 3)
        throw OpenMMException("Unsupported version number");
    unique_ptr<CylinderChainLinkForce> force(new CylinderChainLinkForce());
    force->setJoinsTangents(node.getBoolProperty("joinsTangents"));
    force->setForceGroup(node.getIntProperty("forceGroup"));
    force->setName(node.getStringProperty("name"));
    force->setUsesPeriodicBoundaryConditions(node.getBoolProperty("usesPeriodic"));
    const SerializationNode& defaults = node.getChildNode("Defaults");
    force->setDefaultLinkParameters(
            (CylinderChainLinkForce::StretchingModel) defaults.getIntProperty("stretchingModel"),
            defaults.getDoubleProperty("restLength"), defaults.getDoubleProperty("stiffness"),
            defaults.getDoubleProperty("maximumExtension"));
    force->setTable(restoreTable(StateColumns::read(node.getChildNode("Links"))));
    return force.release();
}
