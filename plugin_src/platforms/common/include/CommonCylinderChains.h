#ifndef OPENMM_COMMONCYLINDERCHAINS_H_
#define OPENMM_COMMONCYLINDERCHAINS_H_

#include "WorkItemGroups.h"
#include "dynamics/ChainEngine.h"
#include "openmm/Vec3.h"
#include "openmm/common/ComputeArray.h"
#include "openmm/common/ComputeContext.h"
#include "openmm/internal/CylinderChainDescription.h"
#include "openmm/internal/ExplicitWork.h"
#include <cstdint>
#include <map>
#include <memory>
#include <string>
#include <vector>

namespace OpenMM {

/**
 * The chains of a Context in the memory of its device, and the programs that compute them there.
 *
 * Chains that use the same models and have similar lengths make a batch: one kernel computes them, with a work-item for
 * each, or, at implicit steps of few chains, with several for each.  The nodes of all chains follow on each other;
 * their positions and forces are doubles, and gather() brings them from where OpenMM keeps its particles.
 */
class CommonCylinderChains {
public:
    CommonCylinderChains(ComputeContext& cc, const WorkItemGroups& groups,
            const CylinderChainDescription& description);
    ~CommonCylinderChains();
    /**
     * Throw what says that filaments of some kind take explicit steps on a platform.
     */
    [[noreturn]] static void refuseImplicitSteps(const std::string& platform, const std::string& filaments);
    /**
     * Take over the parameters of the chains, which have changed.
     */
    void update();
    /**
     * Bring the positions of nodes, and the forces on them unless they are to be zero, into the order of chains.
     *
     * @param work   what is summed up of the work of these forces
     */
    void gather(bool withForces, const StepWork& work = {});
    /**
     * Get what kernels need to know of the sums of work.
     */
    static int flagsOf(const StepWork& work);
    /**
     * Copy sums of work, as kernels have them, to those of particles.
     */
    static void copyWork(const ComputeArray& work, const std::vector<int>& particles, std::vector<WorkSums>& sums);
    /**
     * Copy the sums of work of nodes to those of all particles.
     */
    void getWork(std::vector<WorkSums>& sums);
    /**
     * Find the forces and energies of chains at the positions that were gathered, and add the forces to those of the
     * platform.
     *
     * @param[out] energy   the energies of all chains, unless that is NULL
     */
    void addForces(bool includeForces, cylchain::ChainEnergy* energy);
    /**
     * Advance the nodes from the positions that were gathered, or reached before, without moving particles.
     *
     * @param findsForces   whether to find the forces of chains at the start of each step, and to have none besides
     * @param[out] divided  the number of steps of a chain that were divided
     * @return the number of steps that all chains could take
     */
    int advance(const cylchain::StepSettings& settings, int count, bool findsForces, long long& divided);
    /**
     * Get the first chain that could take the least number of steps in the last call of advance().
     */
    int getFirstUnstable() const;
    /**
     * Move particles to where nodes have been advanced.
     */
    void moveNodes(double stepSize);
    /**
     * Copy the displacements of the last step of each chain to those of all particles.
     */
    void getDisplacements(std::vector<Vec3>& displacements);
    /**
     * Get where each particle is in the arrays of the platform, see ComputeContext::getAtomIndex().
     */
    ComputeArray& getSlots();
    /**
     * Get the flow and the periodic box of a step, as kernels need them, and what is true of the step.
     */
    ComputeArray& getFlow() {
        return flow;
    }
    ComputeArray& getBox() {
        return box;
    }
    int describeStep(const cylchain::StepSettings& settings);
    /**
     * Get the counts of what went wrong in all steps, which kernels add to.
     */
    ComputeArray& getSummary() {
        return summary;
    }
    /**
     * Get a count of what went wrong in the steps of the last call of advance(), and in kernels since the one before.
     */
    std::uint64_t getCount(int number) const {
        return counts[number];
    }
    /**
     * Compile kernels that have no chains.
     */
    static ComputeProgram compile(ComputeContext& cc, const std::string& source);
private:
    class ReorderListener;
    struct Batch;
    struct Arrays;
    const std::vector<std::unique_ptr<Batch> >& getBatches(int items);
    std::unique_ptr<Batch> makeBatch(const std::vector<int>& members, int items);
    ComputeProgram programFor(const cylchain::Chain& chain, const Batch& batch);
    void uploadTethers();
    void readSummary();
    void updateBox();
    void updateShifts();
    ComputeContext& cc;
    const CylinderChainDescription& description;
    std::map<std::string, ComputeProgram> programs;
    const WorkItemGroups groups;
    const int itemsOfSteps;
    std::map<int, std::vector<std::unique_ptr<Batch> > > batches;
    std::unique_ptr<Arrays> arrays;
    std::vector<int> particleOfNode, slotOfParticle, firstNodes, stepsTaken;
    std::vector<std::uint64_t> counts, countsBefore;
    std::vector<double> flowNumbers, boxNumbers, shiftNumbers;
    bool slotsAreValid, gatherHasArguments = false, scatterHasArguments = false, moveHasArguments = false;
    ComputeArray slots, particles, positions, forces, displacements, shifts, energies, flow, box, taken, summary,
            work;
    ComputeKernel gatherKernel, scatterKernel, moveKernel;
};

} // namespace OpenMM

#endif /*OPENMM_COMMONCYLINDERCHAINS_H_*/
