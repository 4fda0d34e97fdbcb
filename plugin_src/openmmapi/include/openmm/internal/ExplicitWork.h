#ifndef OPENMM_EXPLICITWORK_H_
#define OPENMM_EXPLICITWORK_H_

#include "openmm/Vec3.h"
#include "openmm/internal/ParallelLoop.h"
#include <vector>

namespace OpenMM {

/**
 * Sums over the steps of a window, for one particle: the changes of forces over kT, displacements, and products of
 * them.
 */
struct WorkSums {
    Vec3 change, way;
    double work = 0;
};

/**
 * What a platform that sums up work itself does in a step.
 */
struct StepWork {
    /** Whether forces at the start of the step are taken note of. */
    bool watched = false;
    /** Whether the step follows on from one that was watched, whose sums are added to those of the window. */
    bool followsOn = false;
    /** Whether these sums are the first of the window. */
    bool beginsWindow = false;
    /** Whether they are the last ones. */
    bool endsWindow = false;
    /** 1/kT. */
    double perEnergy = 0;
};

/**
 * The work that forces do because they are those of the start of a step.  With the forces f on a particle before and
 * after a step that moves it by dx, this is w = -(f(after)-f(before)).dx.  Its means over windows of steps are those of
 * CylinderChainIntegrator::setWorkWindow().
 *
 * Of dx and of the changes of forces, their means over the window are taken off: a filament that is dragged along
 * steadily while its tension turns is no sign of a step that is too long.
 */
class ExplicitWork {
public:
    explicit ExplicitWork(ParallelLoop& loop);
    /**
     * Begin with the particles that can move.
     */
    void initialize(const std::vector<int>& particles);
    /**
     * Take note of the forces at the start of a step.
     *
     * @param forces     the forces on all particles
     * @param moves      the displacements of all particles in the step before
     * @param followsOn  whether nothing else than that step has changed positions and forces
     * @param kT         a temperature, which is not zero
     * @param window     the number of steps to average over
     */
    void beginStep(const std::vector<Vec3>& forces, const std::vector<Vec3>& moves, bool followsOn, double kT,
            int window);
    /**
     * Begin a step whose work the platform sums up.
     *
     * @param followsOn  as above
     * @param kT         as above
     * @param window     as above
     */
    StepWork beginStep(bool followsOn, double kT, int window);
    /**
     * Finish a window with the sums of all particles, which the platform has summed up.
     */
    void finish(const std::vector<WorkSums>& sumsOfParticles);
    /**
     * Measure nothing in this step, and begin anew after it.
     */
    void stop();
    /**
     * Take note that particles have moved by the displacements of the step.
     */
    void endStep();
    /**
     * Take note of steps that nothing is known of.
     */
    void interrupt();
    /**
     * Get the largest mean of the last window that has been finished, over kT, once.
     *
     * @param[out] work       the largest mean
     * @param[out] particle   the particle that has it
     * @param[out] steps      the number of steps in the window, or zero if none has been finished since the last call
     * @param[out] particles  the number of particles of which it is the largest: those whose means are not zero
     */
    void take(double& work, int& particle, int& steps, int& particles);
private:
    void add(int particle, const Vec3& force, const Vec3& move, double perEnergy);
    void finish();
    ParallelLoop& loop;
    std::vector<int> particles;
    // At the start of the step before.
    std::vector<Vec3> forcesBefore;
    // Nothing until two steps have followed on each other: those of filaments alone are taken many at a time.
    std::vector<WorkSums> sums;
    bool known;
    int count;
    double largest;
    int worst, finishedSteps, active;
};

} // namespace OpenMM

#endif /*OPENMM_EXPLICITWORK_H_*/
