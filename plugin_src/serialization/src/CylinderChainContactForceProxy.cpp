#include "openmm/CylinderChainContactForce.h"
#include "openmm/serialization/ObjectProxy.h"
#include <memory>

using namespace OpenMM;
using namespace std;

static void write(const CylinderChainContactForce& force, SerializationNode& node) {
    node.setBoolProperty("usesPeriodic", force.usesPeriodicBoundaryConditions());
    node.setDoubleProperty("stiffness", force.getStiffness());
    SerializationNode& chains = node.createChildNode("Chains");
    for (int i = 0; i < force.getNumChains(); i++) {
        SerializationNode& chain = chains.createChildNode("Chain");
        chain.setDoubleProperty("diameter", force.getChainDiameter(i))
                .setIntProperty("excludedNeighbors", force.getChainExcludedNeighbors(i))
                .setBoolProperty("closed", force.isChainClosed(i));
        SerializationNode& particles = chain.createChildNode("Particles");
        for (int particle : force.getChainParticles(i))
            particles.createChildNode("Particle").setIntProperty("index", particle);
    }
    SerializationNode& spheres = node.createChildNode("Spheres");
    for (int i = 0; i < force.getNumSpheres(); i++)
        spheres.createChildNode("Sphere").setIntProperty("particle", force.getSphereParticle(i))
                .setDoubleProperty("diameter", force.getSphereDiameter(i));
    SerializationNode& exclusions = node.createChildNode("Exclusions");
    for (int i = 0; i < force.getNumExclusions(); i++) {
        int chain1, segment1, chain2, segment2;
        force.getExclusion(i, chain1, segment1, chain2, segment2);
        exclusions.createChildNode("Exclusion").setIntProperty("chain1", chain1).setIntProperty("segment1", segment1)
                .setIntProperty("chain2", chain2).setIntProperty("segment2", segment2);
    }
}

static unique_ptr<CylinderChainContactForce> readContactForce(const SerializationNode& node) {
    unique_ptr<CylinderChainContactForce> force(new CylinderChainContactForce(node.getDoubleProperty("stiffness")));
    force->setUsesPeriodicBoundaryConditions(node.getBoolProperty("usesPeriodic"));
    for (auto& chain : node.getChildNode("Chains").getChildren()) {
        vector<int> particles;
        for (auto& particle : chain.getChildNode("Particles").getChildren())
            particles.push_back(particle.getIntProperty("index"));
        force->addChain(particles, chain.getDoubleProperty("diameter"), chain.getIntProperty("excludedNeighbors"),
                chain.getBoolProperty("closed"));
    }
    for (auto& sphere : node.getChildNode("Spheres").getChildren())
        force->addSphere(sphere.getIntProperty("particle"), sphere.getDoubleProperty("diameter"));
    for (auto& exclusion : node.getChildNode("Exclusions").getChildren())
        force->addExclusion(exclusion.getIntProperty("chain1"), exclusion.getIntProperty("segment1"),
                exclusion.getIntProperty("chain2"), exclusion.getIntProperty("segment2"));
    return force;
}

static const bool isContactForceRegistered =
        registerProxy<CylinderChainContactForce>("CylinderChainContactForce", 1, write, readContactForce);
