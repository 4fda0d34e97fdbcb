#include "openmm/internal/CylinderChainDescription.h"
#include "mechanics/BeadModes.h"
#include "openmm/OpenMMException.h"

using namespace std;

namespace OpenMM {

/**
 * Every node needs some friction: its own, or that of its segments, which must be complete then.
 */
static void checkFriction(const cylchain::Chain& chain, int index) {
    if (chain.nodeFriction > 0)
        return;
    for (size_t i = 0; i < chain.segments.size(); i++) {
        const cylchain::Segment& segment = chain.segments[i];
        if (segment.parallel <= 0 || segment.perpendicular <= 0 || segment.rotational <= 0 || segment.extensional <= 0)
            throw OpenMMException("CylinderChainForce: Segment "+to_string(i)+" of chain "+to_string(index)+
                    " lacks friction. Its four frictions must be positive unless the nodes of the chain have some");
    }
}

static void copyParameters(const CylinderChainForce& force, int index, cylchain::Chain& chain) {
    for (size_t i = 0; i < chain.segments.size(); i++) {
        cylchain::Segment& segment = chain.segments[i];
        force.getSegmentParameters(index, i, segment.restLength, segment.stiffness, segment.maximumExtension,
                segment.parallel, segment.perpendicular, segment.rotational, segment.extensional);
        force.getSegmentPropulsion(index, i, segment.propulsion);
    }
    for (size_t i = 0; i < chain.joints.size(); i++)
        force.getJointParameters(index, i, chain.joints[i]);
    chain.planar = force.isChainPlanar(index);
    chain.nodeFriction = force.getChainNodeFriction(index);
    checkFriction(chain, index);
}

static cylchain::Chain describeTopology(const CylinderChainForce& force, int index) {
    cylchain::Chain chain;
    int bending, stretching;
    force.getChainModels(index, bending, stretching);
    // The entries of both enumerations are those of one list.
    chain.bending = static_cast<cylchain::BendingModel>(bending);
    chain.stretching = static_cast<cylchain::StretchingModel>(stretching);
    chain.nodes = force.getChainParticles(index);
    chain.closed = force.isChainClosed(index);
    chain.segments.resize(force.getNumSegments(index));
    chain.joints.resize(force.getNumJoints(index));
    return chain;
}

/** Copy tethers to their chains, given how many there are and what gives the parameters of one. */
template <class OwnChain, class Getter> static void copyTethers(int count, Getter getParameters,
        vector<OwnChain>& chains) {
    for (OwnChain& chain : chains)
        chain.tethers.clear();
    for (int i = 0; i < count; i++) {
        int chain;
        cylchain::Tether tether;
        Vec3 point;
        getParameters(i, chain, tether.node, point, tether.stiffness);
        for (int k = 0; k < 3; k++)
            tether.point[k] = point[k];
        chains[chain].tethers.push_back(tether);
    }
}

static void copyTethers(const CylinderChainForce& force, vector<cylchain::Chain>& chains,
        vector<cylchain::BeamChain>& beams) {
    copyTethers(force.getNumTethers(), [&] (int i, int& chain, int& node, Vec3& point, double& stiffness) {
        force.getTetherParameters(i, chain, node, point, stiffness);
    }, chains);
    copyTethers(force.getNumBeamTethers(), [&] (int i, int& chain, int& node, Vec3& point, double& stiffness) {
        force.getBeamTetherParameters(i, chain, node, point, stiffness);
    }, beams);
}

static cylchain::BeamChain describeBeam(const CylinderChainForce& force, int index) {
    cylchain::BeamChain beam;
    beam.particles = force.getBeamChainParticles(index);
    force.getBeamChainParameters(index, beam.elementLength, beam.stretchingModulus, beam.bendingRigidity,
            beam.shortening, beam.parallelFriction, beam.perpendicularFriction);
    beam.planar = force.isBeamChainPlanar(index);
    beam.closed = force.isBeamChainClosed(index);
    force.getBeamChainPropulsion(index, beam.propulsion);
    return beam;
}

CylinderChainDescription::CylinderChainDescription(const System& system, const CylinderChainForce& force) :
        forceGroup(force.getForceGroup()), periodic(force.usesPeriodicBoundaryConditions()) {
    for (int i = 0; i < force.getNumChains(); i++) {
        cylchain::Chain chain = describeTopology(force, i);
        for (int node : chain.nodes)
            chain.fixed.push_back(system.getParticleMass(node) == 0.0);
        copyParameters(force, i, chain);
        chains.push_back(chain);
    }
    for (int i = 0; i < force.getNumBeamChains(); i++) {
        cylchain::BeamChain beam = describeBeam(force, i);
        for (int particle : beam.particles)
            beam.fixed.push_back(system.getParticleMass(particle) == 0.0);
        beams.push_back(beam);
    }
    copyTethers(force, chains, beams);
    lookForModes();
}

void CylinderChainDescription::update(const CylinderChainForce& force) {
    if (force.getNumChains() != (int) chains.size() || force.getNumBeamChains() != (int) beams.size())
        throw OpenMMException("updateParametersInContext: The number of chains has changed");
    for (int i = 0; i < force.getNumChains(); i++) {
        const cylchain::Chain present = describeTopology(force, i);
        if (present.nodes != chains[i].nodes)
            throw OpenMMException("updateParametersInContext: The particles of a chain have changed");
        if (present.bending != chains[i].bending || present.stretching != chains[i].stretching)
            throw OpenMMException("updateParametersInContext: The models of a chain have changed");
        copyParameters(force, i, chains[i]);
    }
    for (int i = 0; i < force.getNumBeamChains(); i++) {
        cylchain::BeamChain beam = describeBeam(force, i);
        if (beam.particles != beams[i].particles)
            throw OpenMMException("updateParametersInContext: The particles of a chain have changed");
        beam.fixed = beams[i].fixed;
        beams[i] = beam;
    }
    copyTethers(force, chains, beams);
    lookForModes();
}

void CylinderChainDescription::lookForModes() {
    withoutModes.clear();
    for (size_t i = 0; i < chains.size() && withoutModes.empty(); i++) {
        string reason;
        if (!cylchain::findModes(chains[i], reason))
            withoutModes = "chain "+to_string(i)+": "+reason;
    }
}

void CylinderChainDescription::requireModes() const {
    if (!withoutModes.empty())
        throw OpenMMException("CylinderChainIntegrator: The scheme of modes is for chains of beads alone, not for "+
                withoutModes);
}

} // namespace OpenMM
