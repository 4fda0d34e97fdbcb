#ifndef OPENMM_PLACERESOLVER_H_
#define OPENMM_PLACERESOLVER_H_

#include "couplings/Place.h"
#include "mechanics/ChainList.h"
#include "openmm/System.h"
#include "openmm/VirtualSite.h"
#include <string>
#include <vector>

namespace OpenMM {

/**
 * Finds what moves the places of a System: one between the two nodes of a beam element is on its curve, and one at a
 * virtual site of a segment or of such a curve is there.
 */
class PlaceResolver {
public:
    explicit PlaceResolver(const System& system);
    /**
     * Find the place between the parents of a virtual site, or on a curve; any other place is returned unchanged.  An
     * exception is thrown for particles that do not exist.
     */
    cylchain::Place resolve(const cylchain::Place& place) const;
    /**
     * Find what is meant by a place of links that join tangents: the tangent at a place on a curve, or a point, which
     * is returned unchanged.  Any other place is no tangent then.
     */
    cylchain::Place resolveTangent(const cylchain::Place& place) const;
    const System& getSystem() const {
        return system;
    }
    /**
     * Get whether a particle is the control point of a node of beam elements.
     */
    bool isControlPoint(int particle) const {
        return isControl[particle];
    }
    /**
     * Get whether a particle that a place is at is moved by steps of its own, as those outside chains are.
     */
    bool movesAlone(const cylchain::Place& place) const {
        return !place.isPoint() && !place.isOnSegment() && !isOfChain[place.first] &&
                system.getParticleMass(place.first) != 0.0;
    }
    /**
     * Find the first of some places that implicit steps do not move, in words; nothing is returned if there is none.
     */
    std::string whyExplicit(const std::vector<cylchain::Place>& places) const;
private:
    void add(const cylchain::Chain& chain);
    void add(const cylchain::BeamChain& chain);
    void checkParticles(const cylchain::Place& place) const;
    bool isMovedBySteps(const cylchain::Place& place) const;
    bool findOnCurve(const VirtualSite& site, cylchain::Place& place) const;
    bool isControlOf(int particle, int node) const {
        return controls[node] >= 0 && controls[node] == particle;
    }
    const System& system;
    // For each particle: the node behind it in its chain, or -1, and whether it is one of a chain. For nodes of beam
    // elements their control points, or -1, and the lengths of elements.

    std::vector<int> next, controls;
    std::vector<double> elementLengths;
    std::vector<bool> isOfChain, isControl;
};

} // namespace OpenMM

#endif /*OPENMM_PLACERESOLVER_H_*/
