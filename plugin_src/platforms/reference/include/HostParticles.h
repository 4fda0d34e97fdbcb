#ifndef OPENMM_HOSTPARTICLES_H_
#define OPENMM_HOSTPARTICLES_H_

#include "ReferenceParallelLoop.h"
#include "dynamics/ChainEngine.h"
#include "openmm/Vec3.h"
#include "openmm/internal/ExplicitWork.h"
#include "openmm/internal/OtherParticles.h"
#include <vector>

namespace OpenMM {

/**
 * The particles of a Context as the processor sees and moves them.
 *
 * On the Reference and CPU platforms these are the particles themselves. Platforms for GPUs have theirs elsewhere:
 * there, those that were asked for are copied to the processor and back, and vectors have no meaning for others.
 */
class HostParticles {
public:
    virtual ~HostParticles() {
    }
    /** Steps are going to be taken, and all Forces have been added to the Context. */
    virtual void beginSteps() {
    }
    /** The threads of the processor. */
    virtual ReferenceParallelLoop& getLoop() = 0;
    /** From now on, see and move these, too. */
    virtual void include(const std::vector<int>&) {
    }
    virtual bool includes(int) const {
        return true;
    }
    /** Whether these are copies, and what was not included is missing. */
    virtual bool areCopies() const {
        return false;
    }
    /** A number that increases when others are included. */
    virtual int getVersion() const {
        return 0;
    }
    /** Say which particles belong together: OpenMM may wrap those of each list into the box, as a whole. */
    virtual void addMolecules(const std::vector<std::vector<int> >&) {
    }
    /** Bring positions, and forces as they were last computed, up to date. */
    virtual void update() {
    }
    virtual std::vector<Vec3>& getPositions() = 0;
    virtual std::vector<Vec3>& getForces() = 0;
    virtual std::vector<Vec3>& getVelocities() = 0;
    virtual Vec3* getBox() = 0;
    /** A position as it is when it has been stored. */
    virtual Vec3 store(int, const Vec3& position) const {
        return position;
    }
    /** Where to add forces; endForces() gives them to the platform. */
    virtual std::vector<Vec3>& beginForces() = 0;
    virtual void endForces() {
    }
    /** Positions have been changed outside of a step. */
    virtual void writePositions() {
    }
    /** See IntegrateCylinderChainStepKernel. */
    virtual bool sumsWork() const {
        return false;
    }
    virtual void beginWork(const StepWork&) {
    }
    virtual void getWork(std::vector<WorkSums>&) {
    }
    /** Find the displacements of those that the processor does not see. */
    virtual void displaceOthers(const OtherParticles&, const cylchain::StepSettings&, double) {
    }
    /** The first of them whose displacement is not finite, or -1. */
    virtual int findUnstable() {
        return -1;
    }
    /**
     * Take particles to new positions, with the velocities that getVelocities() has now, and advance the time.
     *
     * @param newPositions  may be exchanged for the positions that were there
     * @param stepSize      of each step
     */
    virtual void move(std::vector<Vec3>& newPositions, double stepSize, int steps) = 0;
};

} // namespace OpenMM

#endif /*OPENMM_HOSTPARTICLES_H_*/
