#ifndef OPENMM_COUPLEDPARTICLES_H_
#define OPENMM_COUPLEDPARTICLES_H_

#include "openmm/Vec3.h"
#include "openmm/common/ComputeArray.h"
#include "openmm/common/ComputeContext.h"
#include <string>
#include <vector>

namespace OpenMM {

/**
 * The particles that a force between filaments acts on, in the memory of the device, and the programs of such forces.
 *
 * Their positions are doubles, and those that they would have if OpenMM did not wrap molecules into the periodic box:
 * what couples two molecules must not depend on which image of each OpenMM keeps.
 */
class CoupledParticles {
public:
    explicit CoupledParticles(ComputeContext& cc);
    /**
     * Set which particles these are.
     *
     * @param particles  numbers of particles, in any order, which may come several times
     */
    void setParticles(std::vector<int> particles);
    /**
     * Get the number of a particle among these, or -1 for a number below zero.
     */
    int numberOf(int particle) const;
    int getNumParticles() const {
        return particles.size();
    }
    /**
     * Create a kernel of couplings.cc or contacts.cc.
     */
    ComputeKernel createKernel(const std::string& name);
    /**
     * Find the positions of the particles now.
     */
    void gather();
    ComputeArray& getPositions() {
        return positions;
    }
    /**
     * Copy the positions that were gathered to where those of all particles are.
     */
    void downloadPositions(std::vector<Vec3>& positions);
    /**
     * Add the arguments of a kernel with which it knows the particles and adds to their forces.
     */
    void addArguments(ComputeKernel kernel);
    /**
     * Give particles the largest force whose force is too large, or not finite. Call this once forces have been added.
     */
    void finishForces();
    /**
     * Get the vectors of the periodic box (nine numbers), as they were when positions were gathered.
     */
    ComputeArray& getBox() {
        return box;
    }
    const std::vector<double>& getBoxNumbers() const {
        return boxNumbers;
    }
private:
    /** Get whether particles are where they were, and as many boxes away. */
    bool areImagesValid() const;
    void updateImages();
    void updateBox();
    ComputeContext& cc;
    std::vector<int> particles;
    std::vector<double> boxNumbers;
    std::vector<int> imageNumbers;
    ComputeProgram program;
    ComputeArray images, positions, marks, box;
    ComputeKernel gatherKernel, finishKernel;
};

/**
 * Write values into an array of the device, which grows if they are more than it has room for.
 */
template <class T> void uploadTo(ComputeContext& cc, ComputeArray& array, std::vector<T> values,
        const std::string& name) {
    // There are no empty arrays.

    if (!array.isInitialized())
        array.initialize<T>(cc, values.empty() ? 1 : values.size(), name);
    else if (array.getSize() < values.size())
        array.resize(values.size()+values.size()/2);
    values.resize(array.getSize());
    array.upload(values);
}

/**
 * Get the sum of the first values of an array of doubles.
 */
double sumOfValues(ComputeArray& array, int count);

} // namespace OpenMM

#endif /*OPENMM_COUPLEDPARTICLES_H_*/
