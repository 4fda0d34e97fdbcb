#include "openmm/CylinderChainBindingForce.h"
#include "openmm/internal/LinkerDescription.h"
#include "openmm/serialization/ObjectProxy.h"
#include <memory>

using namespace OpenMM;
using namespace std;

static void write(const CylinderChainBindingForce& force, SerializationNode& node) {
    node.setDoubleProperty("temperature", force.getTemperature()).setIntProperty("randomSeed",
            force.getRandomNumberSeed()).setBoolProperty("usesPeriodic", force.usesPeriodicBoundaryConditions());
    SerializationNode& hands = node.createChildNode("Hands");
    for (int i = 0; i < force.getNumHands(); i++) {
        const cylchain::Hand& hand = force.getHand(i);
        SerializationNode& child = hands.createChildNode("Hand");
        child.setDoubleProperty("bindingRate", hand.bindingRate).setDoubleProperty("reach", hand.reach)
                .setDoubleProperty("unbindingRate", hand.unbindingRate)
                .setDoubleProperty("strainShare", hand.strainShare)
                .setDoubleProperty("unbindingForce", hand.unbindingForce)
                .setDoubleProperty("catchRate", hand.catchRate).setDoubleProperty("catchForce", hand.catchForce)
                .setDoubleProperty("speed", hand.speed).setDoubleProperty("stallForce", hand.stallForce)
                .setBoolProperty("walksBackward", hand.walksBackward)
                .setBoolProperty("holdsAtEnds", hand.holdsAtEnds).setDoubleProperty("siteSpacing", hand.siteSpacing)
                .setDoubleProperty("severingRate", hand.severingRate)
                .setDoubleProperty("pitch", hand.helix.pitch)
                .setDoubleProperty("turningFriction", hand.helix.friction)
                .setDoubleProperty("stallTorque", hand.helix.stallTorque)
                .setDoubleProperty("rangeOfTorque", hand.helix.range);
        const cylchain::HandAtEnd& atEnd = hand.atEnd;
        child.setIntProperty("end", atEnd.end).setDoubleProperty("endRange", atEnd.range)
                .setBoolProperty("bindsAtEnd", atEnd.bindsThere).setBoolProperty("tracksEnd", atEnd.tracks)
                .setIntProperty("freeState", atEnd.freeState).setIntProperty("heldState", atEnd.heldState)
                .setDoubleProperty("offRate", atEnd.offRate).setIntProperty("sitesAtEnd", atEnd.sites)
                .setDoubleProperty("unbindingRateAtEnd", atEnd.unbindingRate);
        child.setDoubleProperty("slidingFriction", hand.slidingFriction)
                .setIntProperty("rangeEnd", hand.bindingRange.end)
                .setDoubleProperty("bindingRange", hand.bindingRange.range)
                .setBoolProperty("rangeExcluded", hand.bindingRange.excluded);
        for (int chain : atEnd.changes)
            child.createChildNode("ChainWithEnd").setIntProperty("index", chain);
        for (int chain : hand.chains)
            child.createChildNode("Chain").setIntProperty("index", chain);
    }
    SerializationNode& types = node.createChildNode("LinkerTypes");
    for (int i = 0; i < force.getNumLinkerTypes(); i++) {
        const cylchain::LinkerType& type = force.getLinkerType(i);
        SerializationNode& child = types.createChildNode("LinkerType");
        for (int wall = 0; wall < force.getNumLinkerTypeWalls(i); wall++) {
            Vec3 point, vector;
            double length;
            const string shape = force.getLinkerTypeWall(i, wall, point, vector, length);
            child.createChildNode("Wall").setStringProperty("shape", shape).setDoubleProperty("x", point[0])
                    .setDoubleProperty("y", point[1]).setDoubleProperty("z", point[2])
                    .setDoubleProperty("vx", vector[0]).setDoubleProperty("vy", vector[1])
                    .setDoubleProperty("vz", vector[2]).setDoubleProperty("length", length);
        }
        child.setIntProperty("hand1", type.hands[0])
                .setIntProperty("hand2", type.hands[1]).setDoubleProperty("restLength", type.restLength)
                .setDoubleProperty("stiffness", type.stiffness).setBoolProperty("sameChain", type.sameChain)
                .setDoubleProperty("volume", type.volume).setDoubleProperty("concentration", type.concentration)
                .setDoubleProperty("diffusion", type.diffusion).setBoolProperty("planar", type.planar);
        child.setDoubleProperty("loadingDistance", type.loadingDistance)
                .setDoubleProperty("leastCosine", type.leastCosine)
                .setDoubleProperty("largestCosine", type.largestCosine)
                .setBoolProperty("transActivated", type.transActivated).setBoolProperty("reversible", type.reversible);
    }
    SerializationNode& barriers = node.createChildNode("Barriers");
    for (const cylchain::Barrier& barrier : force.getBarriers())
        barriers.createChildNode("Barrier").setIntProperty("chain", barrier.chain)
                .setDoubleProperty("position", barrier.position).setIntProperty("direction", barrier.direction)
                .setDoubleProperty("captureProbability", barrier.captureProbability)
                .setDoubleProperty("releaseRate", barrier.releaseRate);
    SerializationNode& anchors = node.createChildNode("Anchors");
    for (int i = 0; i < force.getNumAnchors(); i++) {
        int particle;
        Vec3 point;
        force.getAnchor(i, particle, point);
        anchors.createChildNode("Anchor").setIntProperty("particle", particle).setDoubleProperty("x", point[0])
                .setDoubleProperty("y", point[1]).setDoubleProperty("z", point[2]);
    }
    SerializationNode& joints = node.createChildNode("BranchJoints");
    for (int i = 0; i < force.getNumBranchJoints(); i++) {
        const cylchain::BranchJoint& joint = force.getBranchJoint(i);
        StateColumns columns;
        columns.put("nucleator", joint.nucleator);
        columns.put("types", joint.types);
        columns.put("onMother", joint.onMother);
        columns.put("onBranch", joint.onBranch);
        columns.write(joints.createChildNode("BranchJoint"));
    }
    storeLinkers(force.getState()).write(node.createChildNode("Linkers"));
}

static unique_ptr<CylinderChainBindingForce> readBindingForce(const SerializationNode& node) {
    unique_ptr<CylinderChainBindingForce> force(new CylinderChainBindingForce(node.getDoubleProperty("temperature")));
    force->setRandomNumberSeed(node.getIntProperty("randomSeed"));
    force->setUsesPeriodicBoundaryConditions(node.getBoolProperty("usesPeriodic"));
    for (auto& hand : node.getChildNode("Hands").getChildren()) {
        vector<int> chains, withEnds;
        for (auto& chain : hand.getChildren())
            (chain.getName() == "Chain" ? chains : withEnds).push_back(chain.getIntProperty("index"));
        const int number = force->addHand(hand.getDoubleProperty("bindingRate"), hand.getDoubleProperty("reach"),
                hand.getDoubleProperty("unbindingRate"), chains);
        force->setHandUnbinding(number, hand.getDoubleProperty("strainShare"),
                hand.getDoubleProperty("unbindingForce"), hand.getDoubleProperty("catchRate"),
                hand.getDoubleProperty("catchForce"));
        force->setHandWalking(number, hand.getDoubleProperty("speed"), hand.getDoubleProperty("stallForce"),
                hand.getBoolProperty("walksBackward"), hand.getBoolProperty("holdsAtEnds"));
        force->setHandAtEnd(number, hand.getIntProperty("end"), hand.getDoubleProperty("endRange"),
                hand.getBoolProperty("bindsAtEnd"), hand.getBoolProperty("tracksEnd"),
                hand.getIntProperty("freeState"), hand.getIntProperty("heldState"), withEnds);
        force->setHandRemoval(number, hand.getDoubleProperty("offRate"), hand.getIntProperty("sitesAtEnd"),
                hand.getDoubleProperty("unbindingRateAtEnd"));
        force->setHandSliding(number, hand.getDoubleProperty("slidingFriction"));
        force->setHandBindingRange(number, hand.getIntProperty("rangeEnd"), hand.getDoubleProperty("bindingRange"),
                hand.getBoolProperty("rangeExcluded"));
        force->setHandSiteSpacing(number, hand.getDoubleProperty("siteSpacing"));
        force->setHandSevering(number, hand.getDoubleProperty("severingRate"));
        force->setHandOnHelix(number, hand.getDoubleProperty("pitch"), hand.getDoubleProperty("turningFriction"),
                hand.getDoubleProperty("stallTorque"), hand.getDoubleProperty("rangeOfTorque"));
    }
    for (auto& type : node.getChildNode("LinkerTypes").getChildren()) {
        const int number = force->addLinkerType(type.getIntProperty("hand1"), type.getIntProperty("hand2"),
                type.getDoubleProperty("restLength"), type.getDoubleProperty("stiffness"),
                type.getBoolProperty("sameChain"));
        force->setLinkerTypeReservoir(number, type.getDoubleProperty("volume"),
                type.getDoubleProperty("concentration"));
        force->setLinkerTypeDiffusion(number, type.getDoubleProperty("diffusion"), type.getBoolProperty("planar"));
        force->setLinkerTypeRules(number, type.getDoubleProperty("leastCosine"),
                type.getDoubleProperty("largestCosine"), type.getBoolProperty("transActivated"),
                type.getBoolProperty("reversible"));
        force->setLinkerTypeLoading(number, type.getDoubleProperty("loadingDistance"));
        for (auto& wall : type.getChildren())
            force->addLinkerTypeWall(number, wall.getStringProperty("shape"), Vec3(wall.getDoubleProperty("x"),
                    wall.getDoubleProperty("y"), wall.getDoubleProperty("z")), Vec3(wall.getDoubleProperty("vx"),
                    wall.getDoubleProperty("vy"), wall.getDoubleProperty("vz")), wall.getDoubleProperty("length"));
    }
    for (auto& barrier : node.getChildNode("Barriers").getChildren())
        force->addBarrier(barrier.getIntProperty("chain"), barrier.getDoubleProperty("position"),
                barrier.getIntProperty("direction"), barrier.getDoubleProperty("captureProbability"),
                barrier.getDoubleProperty("releaseRate"));
    for (auto& anchor : node.getChildNode("Anchors").getChildren()) {
        const int particle = anchor.getIntProperty("particle");
        if (particle >= 0)
            force->addParticleAnchor(particle);
        else
            force->addPointAnchor(Vec3(anchor.getDoubleProperty("x"), anchor.getDoubleProperty("y"),
                    anchor.getDoubleProperty("z")));
    }
    for (auto& joint : node.getChildNode("BranchJoints").getChildren()) {
        const StateColumns columns = StateColumns::read(joint);
        force->addBranchJoint(columns.getOne<int>("nucleator"), columns.get<int>("types"),
                columns.get<double>("onMother"), columns.get<double>("onBranch"));
    }
    const cylchain::LinkerState state = restoreLinkers(StateColumns::read(node.getChildNode("Linkers")));
    const LinkerColumns linkers(state);
    force->setLinkers(linkers.numbers, linkers.types, linkers.anchors, linkers.chains, linkers.places,
            linkers.nextNumber);
    const FreeColumns unbound(state);
    force->setUnboundPositions(unbound.numbers, unbound.places);
    return force;
}

static const bool isBindingForceRegistered =
        registerProxy<CylinderChainBindingForce>("CylinderChainBindingForce", 4, write, readBindingForce);
