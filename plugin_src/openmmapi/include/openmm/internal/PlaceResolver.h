#ifndef OPENMM_PLACERESOLVER_H_
#define OPENMM_PLACERESOLVER_H_

#include "couplings/Place.h"
#include "openmm/System.h"
#include "openmm/VirtualSite.h"
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
     * Find the place between the parents of a virtual site, or on a curve; any other place is returned unchanged.
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
        return !isControl.empty() && isControl[particle];
    }
private:
    bool findOnCurve(const VirtualSite& site, cylchain::Place& place) const;
    bool isControlOf(int particle, int node) const {
        return controls[node] >= 0 && controls[node] == particle;
    }
    const System& system;
    // The control point of each node of beam elements, the next node, or -1, and the length of its elements. Empty
    // without any.

    std::vector<int> controls, next;
    std::vector<double> elementLengths;
    std::vector<bool> isControl;
};

} // namespace OpenMM

#endif /*OPENMM_PLACERESOLVER_H_*/
