#include "openmm/CylinderChainLinkForce.h"
#include "openmm/internal/LinkDescription.h"
#include "openmm/serialization/ObjectProxy.h"
#include <memory>

using namespace OpenMM;
using namespace std;

static void write(const CylinderChainLinkForce& force, SerializationNode& node) {
    node.setBoolProperty("joinsTangents", force.getJoinsTangents());
    node.setBoolProperty("usesPeriodic", force.usesPeriodicBoundaryConditions());
    int model;
    double restLength, stiffness, maximumExtension;
    force.getDefaultLinkParameters(model, restLength, stiffness, maximumExtension);
    node.createChildNode("Defaults").setIntProperty("stretchingModel", model)
            .setDoubleProperty("restLength", restLength).setDoubleProperty("stiffness", stiffness)
            .setDoubleProperty("maximumExtension", maximumExtension);
    storeTable(force.getTable()).write(node.createChildNode("Links"));
}

static unique_ptr<CylinderChainLinkForce> readLinkForce(const SerializationNode& node) {
    unique_ptr<CylinderChainLinkForce> force(new CylinderChainLinkForce());
    force->setJoinsTangents(node.getBoolProperty("joinsTangents"));
    force->setUsesPeriodicBoundaryConditions(node.getBoolProperty("usesPeriodic"));
    const SerializationNode& defaults = node.getChildNode("Defaults");
    force->setDefaultLinkParameters(
            (CylinderChainLinkForce::StretchingModel) defaults.getIntProperty("stretchingModel"),
            defaults.getDoubleProperty("restLength"), defaults.getDoubleProperty("stiffness"),
            defaults.getDoubleProperty("maximumExtension"));
    force->setTable(restoreTable(StateColumns::read(node.getChildNode("Links"))));
    return force;
}

static const bool isLinkForceRegistered =
        registerProxy<CylinderChainLinkForce>("CylinderChainLinkForce", 3, write, readLinkForce);
