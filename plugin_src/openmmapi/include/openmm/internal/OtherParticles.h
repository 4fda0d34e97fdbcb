#ifndef OPENMM_OTHERPARTICLES_H_
#define OPENMM_OTHERPARTICLES_H_

#include "mechanics/RigidBody.h"
#include "openmm/CylinderChainIntegrator.h"
#include "openmm/System.h"
#include "openmm/internal/CylinderChainDescription.h"
#include <vector>

namespace OpenMM {

/**
 * The particles outside chains, and rigid bodies of them.
 */
class OtherParticles {
public:
    OtherParticles(const System& system, const CylinderChainIntegrator& integrator,
            const CylinderChainDescription& chains);
    /**
     * Get all of them.
     */
    const std::vector<int>& getParticles() const {
        return particles;
    }
    /**
     * Get those that can move by themselves.
     */
    const std::vector<int>& getMobile() const {
        return mobile;
    }
    /**
     * Get the rigid bodies.
     */
    const std::vector<cylchain::RigidBody>& getBodies() const {
        return bodies;
    }
    /**
     * Whether a particle is one of a rigid body.
     */
    bool isOfBody(int particle) const {
        return ofBody[particle];
    }
    /**
     * Get the mobility of a particle.
     *
     * @param friction  the friction coefficient of particles that have none of their own, divided by their mass
     */
    double getMobility(int particle, double friction) const {
        const double own = frictions[particle];
        return 1/(own > 0 ? own : friction*masses[particle]);
    }
private:
    std::vector<int> particles, mobile;
    std::vector<cylchain::RigidBody> bodies;
    std::vector<bool> ofBody;
    // Of all particles of the System.  Those that have no friction coefficient of their own are marked by zero.

    std::vector<double> masses, frictions;
};

} // namespace OpenMM

#endif /*OPENMM_OTHERPARTICLES_H_*/
