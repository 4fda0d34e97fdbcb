#ifndef OPENMM_HOSTFORCES_H_
#define OPENMM_HOSTFORCES_H_

#include "openmm/Vec3.h"
#include "openmm/common/ComputeContext.h"
#include <vector>

namespace OpenMM {

class ContextImpl;

/**
 * Forces that the processor computes for a device: positions come from there, and forces go there.
 */
class HostForces {
public:
    explicit HostForces(ComputeContext& cc);
    /**
     * Get the positions of all particles from the device, and set all forces to zero.
     */
    std::vector<Vec3>& begin(ContextImpl& context);
    /**
     * Get the forces of all particles, to be added to.
     */
    std::vector<Vec3>& getForces() {
        return forces;
    }
    /**
     * Add the forces to those on the device.
     */
    void add();
private:
    ComputeContext& cc;
    std::vector<Vec3> positions, forces;
    std::vector<long long> numbers;
};

} // namespace OpenMM

#endif /*OPENMM_HOSTFORCES_H_*/
