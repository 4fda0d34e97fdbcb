#ifndef OPENMM_REFERENCEPARTICLES_H_
#define OPENMM_REFERENCEPARTICLES_H_

#include "HostParticles.h"
#include "openmm/internal/ContextImpl.h"
#include "openmm/reference/ReferencePlatform.h"

namespace OpenMM {

/**
 * The particles of a Context on the Reference or the CPU platform.
 */
class ReferenceParticles : public HostParticles {
public:
    explicit ReferenceParticles(ContextImpl& context) : context(context), loop(context),
            data(*reinterpret_cast<ReferencePlatform::PlatformData*>(context.getPlatformData())) {
    }
    ReferenceParallelLoop& getLoop() {
        return loop;
    }
    std::vector<Vec3>& getPositions() {
        return *data.positions;
    }
    std::vector<Vec3>& getForces() {
        return *data.forces;
    }
    std::vector<Vec3>& getVelocities() {
        return *data.velocities;
    }
    Vec3* getBox() {
        return data.periodicBoxVectors;
    }
    std::vector<Vec3>& beginForces() {
        return *data.forces;
    }
    void move(std::vector<Vec3>& newPositions, double stepSize, int steps);
private:
    ContextImpl& context;
    ReferenceParallelLoop loop;
    ReferencePlatform::PlatformData& data;
};

} // namespace OpenMM

#endif /*OPENMM_REFERENCEPARTICLES_H_*/
