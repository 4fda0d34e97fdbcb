#include "CoupledParticles.h"
#include "ChainTables.h"
#include "CommonCylinderChainKernelSources.h"
#include "CommonCylinderChains.h"
#include <algorithm>
#include <numeric>

using namespace OpenMM;
using namespace std;

double OpenMM::sumOfValues(ComputeArray& array, int count) {
    vector<double> found(array.getSize());
    array.download(found);
    return accumulate(found.begin(), found.begin()+count, 0.0);
}

CoupledParticles::CoupledParticles(ComputeContext& cc) : cc(cc), boxNumbers(9) {
}

void CoupledParticles::setParticles(vector<int> present) {
    sort(present.begin(), present.end());
    present.erase(unique(present.begin(), present.end()), present.end());
    particles = present;
    imageNumbers.clear();
    uploadTo(cc, positions, vector<double>(3*particles.size()), "positionsOfCoupledParticles");
    uploadTo(cc, marks, vector<int>(particles.size()), "marksOfCoupledParticles");
    uploadTo(cc, images, vector<int>(layout::NUM_PARTICLE_NUMBERS*particles.size()), "imagesOfCoupledParticles");
    if (!box.isInitialized())
        uploadTo(cc, box, boxNumbers, "boxOfCoupledParticles");
}

int CoupledParticles::numberOf(int particle) const {
    return particle < 0 ? -1 : lower_bound(particles.begin(), particles.end(), particle)-particles.begin();
}

ComputeKernel CoupledParticles::createKernel(const string& name) {
    if (!program)
        program = CommonCylinderChains::compile(cc, string(CommonCylinderChainKernelSources::couplings)+
                CommonCylinderChainKernelSources::contacts);
    return program->createKernel(name);
}

bool CoupledParticles::areImagesValid() const {
    if (imageNumbers.empty())
        return false;
    const vector<int>& order = cc.getAtomIndex();
    const vector<mm_int4>& cells = cc.getPosCellOffsets();
    for (size_t i = 0; i < particles.size(); i++) {
        const int* own = &imageNumbers[i*layout::NUM_PARTICLE_NUMBERS];
        const int slot = own[layout::PARTICLE_SLOT];
        if (order[slot] != particles[i] || cells[slot].x != own[layout::PARTICLE_CELLS] ||
                cells[slot].y != own[layout::PARTICLE_CELLS+1] || cells[slot].z != own[layout::PARTICLE_CELLS+2])
            return false;
    }
    return true;
}

void CoupledParticles::updateImages() {
    // OpenMM changes these where it sorts or wraps particles, and where positions, a checkpoint or a barostat set them.

    if (areImagesValid())
        return;
    const vector<int>& order = cc.getAtomIndex();
    vector<int> slots(cc.getNumAtoms());
    for (int slot = 0; slot < cc.getNumAtoms(); slot++)
        slots[order[slot]] = slot;
    imageNumbers.clear();
    for (int particle : particles) {
        const mm_int4 cells = cc.getPosCellOffsets()[slots[particle]];
        imageNumbers.insert(imageNumbers.end(), {slots[particle], cells.x, cells.y, cells.z});
    }
    uploadTo(cc, images, imageNumbers, "imagesOfCoupledParticles");
}

void CoupledParticles::updateBox() {
    Vec3 vectors[3];
    cc.getPeriodicBoxVectors(vectors[0], vectors[1], vectors[2]);
    vector<double> present;
    for (const Vec3& vector : vectors)
        present.insert(present.end(), {vector[0], vector[1], vector[2]});
    if (present != boxNumbers) {
        boxNumbers = present;
        box.upload(boxNumbers);
    }
}

void CoupledParticles::gather() {
    updateBox();
    updateImages();
    if (!gatherKernel) {
        gatherKernel = createKernel("gatherParticles");
        gatherKernel->addArg();
        gatherKernel->addArg(cc.getPosq());
        if (cc.getUseMixedPrecision())
            gatherKernel->addArg(cc.getPosqCorrection());
        for (ComputeArray* array : {&images, &box, &positions})
            gatherKernel->addArg(*array);
    }
    gatherKernel->setArg(0, (int) particles.size());
    gatherKernel->execute(particles.size());
}

void CoupledParticles::downloadPositions(vector<Vec3>& result) {
    vector<double> found(positions.getSize());
    positions.download(found);
    for (size_t i = 0; i < particles.size(); i++)
        result[particles[i]] = Vec3(found[3*i], found[3*i+1], found[3*i+2]);
}

void CoupledParticles::addArguments(ComputeKernel kernel) {
    kernel->addArg(cc.getPaddedNumAtoms());
    kernel->addArg(cc.getLongForceBuffer());
    for (ComputeArray* array : {&images, &marks, &positions})
        kernel->addArg(*array);
}

void CoupledParticles::finishForces() {
    if (!finishKernel) {
        finishKernel = createKernel("finishForces");
        finishKernel->addArg();
        finishKernel->addArg(cc.getPaddedNumAtoms());
        finishKernel->addArg(cc.getLongForceBuffer());
        for (ComputeArray* array : {&images, &marks})
            finishKernel->addArg(*array);
    }
    finishKernel->setArg(0, (int) particles.size());
    finishKernel->execute(particles.size());
}
