#include "openmm/internal/CylinderChainDescription.h"
#include "mechanics/BeadModes.h"
#include "openmm/CylinderChainGrowthForce.h"
#include "openmm/OpenMMException.h"
#include <algorithm>
#include <utility>

using namespace std;

namespace OpenMM {

/**
 * Every node of straight segments needs some friction: its own, or that of its segments, which must be complete then.
 */
static void checkFriction(const cylchain::ChainList& chains) {
    for (size_t index = 0; index < chains.getChains().size(); index++) {
        const cylchain::Chain& chain = chains.getChains()[index];
        for (size_t i = 0; i < chain.segments.size() && chain.nodeFriction <= 0; i++) {
            const cylchain::Segment& segment = chain.segments[i];
            if (segment.parallel <= 0 || segment.perpendicular <= 0 || segment.rotational <= 0 ||
                    segment.extensional <= 0)
                throw OpenMMException("CylinderChainForce: Segment "+to_string(i)+" of chain "+
                        to_string(chains.getNumber(cylchain::ChainKind::StraightSegments, index))+
                        " lacks friction. Its four frictions must be positive unless the nodes of the chain have some");
        }
    }
}

/** What twist is not for. */
static void checkTwist(const cylchain::ChainList& chains, int numBodies) {
    for (size_t index = 0; index < chains.getChains().size(); index++) {
        const cylchain::Chain& chain = chains.getChains()[index];
        if (!chain.twist.isPresent())
            continue;
        const string& name = chains.getName(chains.getNumber(cylchain::ChainKind::StraightSegments, index));
        if (chain.planar)
            throw OpenMMException("CylinderChainForce: "+name+" is planar, and cannot have twist");
        if (chain.nodeFriction > 0 || !cylchain::isAngular(chain.bending))
            throw OpenMMException("CylinderChainForce: "+name+" is a chain of beads, and cannot have twist");
        if (chain.twist.isBentAtRest() && chain.twist.ends[0].angularVelocity != 0)
            throw OpenMMException("CylinderChainForce: "+name+" has bends at rest, which turn with the frame of its "
                    "first segment: turn the frame beyond its other end");
        for (const cylchain::EndFrame& frame : chain.twist.ends) {
            if (chain.twist.isBentAtRest() && (frame.friction > 0 || frame.body >= 0))
                throw OpenMMException("CylinderChainForce: "+name+" has bends at rest, and no end frames that turn "
                        "against a friction or with a body");
            if (frame.body >= numBodies)
                throw OpenMMException("CylinderChainForce: "+name+" has an end frame that body "+to_string(frame.body)+
                        " carries, which does not exist; the number of bodies is "+to_string(numBodies));
        }
    }
}

/** A control point alone cannot be fixed: a tangent would lead from nowhere. */
static void checkFixed(const cylchain::ChainList& chains) {
    for (size_t index = 0; index < chains.getBeams().size(); index++) {
        const int node = chains.getBeams()[index].findLoneControlPoint();
        if (node >= 0)
            throw OpenMMException("CylinderChainForce: The control point of node "+to_string(node)+" of chain "+
                    to_string(chains.getNumber(cylchain::ChainKind::BeamElements, index))+
                    " is fixed, but its position is not");
    }
}

CylinderChainDescription::CylinderChainDescription(const System& system, const CylinderChainForce& force) :
        chains(force.describeChains()), bodies(force.getBodies()), forceGroup(force.getForceGroup()),
        periodic(force.usesPeriodicBoundaryConditions()) {
    for (int number = 0; number < chains.size(); number++)
        chains.visit(number, [&] (auto& chain) {
            for (int particle : chain.getParticles())
                chain.fixed.push_back(system.getParticleMass(particle) == 0.0);
        });
    checkFixed(chains);
    for (int i = 0; i < system.getNumForces(); i++) {
        const CylinderChainGrowthForce* const growth = dynamic_cast<const CylinderChainGrowthForce*>(
                &system.getForce(i));
        if (growth != NULL)
            growth->setMonomers(chains, growing);
    }
    for (int number : growing)
        if (chains.getChain(number).twist.isPresent())
            throw OpenMMException("CylinderChainForce: "+chains.getName(number)+" has twist, and cannot grow");
    checkFriction(chains);
    checkTwist(chains, bodies.size());
    lookForModes();
}

vector<bool> findSpareNodes(const System& system) {
    vector<bool> result(system.getNumParticles(), false);
    const CylinderChainForce* force = NULL;
    bool anyGrow = false;
    for (int i = 0; i < system.getNumForces(); i++) {
        if (dynamic_cast<const CylinderChainForce*>(&system.getForce(i)) != NULL)
            force = dynamic_cast<const CylinderChainForce*>(&system.getForce(i));
        anyGrow |= dynamic_cast<const CylinderChainGrowthForce*>(&system.getForce(i)) != NULL;
    }
    if (!anyGrow || force == NULL)
        return result;
    const CylinderChainDescription description(system, *force);
    for (const cylchain::Chain& chain : description.getChains())
        for (int particle : chain.spareNodes)
            result[particle] = true;
    return result;
}

static void refuseOtherModels(const cylchain::Chain& present, const cylchain::Chain& old) {
    if (present.twist.isPresent() != old.twist.isPresent())
        throw OpenMMException("updateParametersInContext: Whether a chain has twist has changed");
    if (present.twist.isBentAtRest() != old.twist.isBentAtRest())
        throw OpenMMException("updateParametersInContext: Whether a chain has bends at rest has changed");
    if (present.bending != old.bending || present.stretching != old.stretching)
        throw OpenMMException("updateParametersInContext: The models of a chain have changed");
}

void CylinderChainDescription::update(const CylinderChainForce& force) {
    cylchain::ChainList present = force.describeChains();
    if (present.size() != chains.size())
        throw OpenMMException("updateParametersInContext: The number of chains has changed");
    for (int i = 0; i < present.size(); i++) {
        if (growing.count(i) > 0) {
            // Its first node is always the same one where it may have a tether.
            const vector<cylchain::Tether> tethers = present.getChain(i).tethers;
            if (any_of(tethers.begin(), tethers.end(), [] (const cylchain::Tether& tether) {return tether.node != 0;}))
                throw OpenMMException("updateParametersInContext: Chain "+to_string(i)+
                        " grows, and can have tethers at its first node alone");
            present.getChain(i) = chains.getChain(i);
            present.getChain(i).tethers = tethers;
            continue;
        }
        if (present.getKind(i) != chains.getKind(i) || present.getParticles(i) != chains.getParticles(i))
            throw OpenMMException("updateParametersInContext: The particles of a chain have changed");
        if (present.getKind(i) == cylchain::ChainKind::StraightSegments)
            refuseOtherModels(present.getChain(i), chains.getChain(i));
        const vector<bool> fixed = chains.visit(i, [] (const auto& chain) {return chain.fixed;});
        present.visit(i, [&] (auto& chain) {chain.fixed = fixed;});
    }
    checkFriction(present);
    checkTwist(present, bodies.size());
    chains = move(present);
    lookForModes();
}

void CylinderChainDescription::lookForModes() {
    withoutModes.clear();
    for (size_t i = 0; i < getChains().size() && withoutModes.empty(); i++) {
        string reason;
        if (!cylchain::findModes(getChains()[i], reason))
            withoutModes = chains.getNameInSentence(chains.getNumber(cylchain::ChainKind::StraightSegments, i))+": "+
                    reason;
    }
}

void CylinderChainDescription::requireModes() const {
    if (!withoutModes.empty())
        throw OpenMMException("CylinderChainIntegrator: The scheme of modes is for chains of beads alone, not for "+
                withoutModes);
}

} // namespace OpenMM
