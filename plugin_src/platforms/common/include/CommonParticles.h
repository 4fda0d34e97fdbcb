#ifndef OPENMM_COMMONPARTICLES_H_
#define OPENMM_COMMONPARTICLES_H_

#include "HostParticles.h"
#include "openmm/common/ComputeArray.h"
#include "openmm/KernelImpl.h"
#include "openmm/common/ComputeContext.h"
#include "openmm/internal/ContextImpl.h"
#include <cstdint>
#include <string>
#include <vector>

namespace OpenMM {

/**
 * The particles of a Context on a platform for GPUs.
 *
 * Those that kernels of ours need are copied to the processor, which takes the same steps with them as on the CPU
 * platform, and back. Particles outside filaments that nothing of ours touches never leave the device.
 *
 * Positions here are those that particles would have if OpenMM did not wrap molecules into the periodic box: what
 * couples two molecules must not depend on which image of each OpenMM keeps.
 */
class CommonParticles : public HostParticles {
public:
    explicit CommonParticles(ComputeContext& cc);
    void beginSteps();
    ReferenceParallelLoop& getLoop() {
        return loop;
    }
    void include(const std::vector<int>& present);
    bool includes(int particle) const {
        return isIncluded[particle];
    }
    bool areCopies() const {
        return true;
    }
    int getVersion() const {
        return particles.size();
    }
    void addMolecules(const std::vector<std::vector<int> >& molecules);
    void update();
    std::vector<Vec3>& getPositions() {
        return positions;
    }
    std::vector<Vec3>& getForces() {
        return forces;
    }
    std::vector<Vec3>& getVelocities() {
        return velocities;
    }
    Vec3* getBox();
    Vec3 store(int particle, const Vec3& position) const;
    std::vector<Vec3>& beginForces();
    void endForces();
    void writePositions();
    bool sumsWork() const {
        return true;
    }
    void beginWork(const StepWork& work);
    void getWork(std::vector<WorkSums>& sums);
    void displaceOthers(const OtherParticles& others, const cylchain::StepSettings& settings, double friction);
    int findUnstable();
    void move(std::vector<Vec3>& newPositions, double stepSize, int steps);
private:
    class Molecules;
    void makeArrays();
    bool areImagesValid() const;
    void updateImages();
    void updateSlots();
    void updateBox();
    void addPositions(ComputeKernel kernel);
    ComputeKernel createKernel(ComputeProgram program, const std::string& name, int numValues);
    void sendPositions(const std::vector<Vec3>& newPositions, double stepSize);
    void findOthers(const OtherParticles& present, double friction);
    Vec3 offsetOf(size_t index) const;
    ComputeContext& cc;
    ReferenceParallelLoop loop;
    /** Those that the processor sees, in the order in which they were included. */
    std::vector<int> particles;
    std::vector<char> isIncluded;
    std::vector<int> indexOf;
    std::vector<Vec3> positions, forces, velocities, added;
    Vec3 box[3];
    /** Which particle is in each slot, and where each particle is. */
    std::vector<int> order, slotOf;
    std::vector<int> imageNumbers;
    std::vector<double> numbers, boxNumbers, flowNumbers;
    /** The others that move, and for how many included particles and which friction they were found. */
    std::vector<int> others;
    int versionOfOthers = -1;
    double frictionOfOthers = -1;
    std::uint64_t unstableBefore = 0;
    ComputeArray images, exchanged, included, slots, boxArray, flow, displacements, work, otherParticles, mobilities,
            unstable;
    ComputeKernel copyToProcessor, addForces, copyFromProcessor, sumWork, displaceParticles, moveParticles;
};

/**
 * Create a kernel of ours for a Context. Those of one Context share its particles.
 */
KernelImpl* createCommonKernel(const std::string& name, const Platform& platform, ContextImpl& context,
        ComputeContext& cc);

} // namespace OpenMM

#endif /*OPENMM_COMMONPARTICLES_H_*/
