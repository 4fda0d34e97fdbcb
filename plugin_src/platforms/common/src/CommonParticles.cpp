#include "CommonParticles.h"
#include "CommonCylinderChainKernelSources.h"
#include "ReferenceCylinderChainKernelFactory.h"
#include "lanes/Noise.h"
#include "openmm/OpenMMException.h"
#include "openmm/common/ComputeForceInfo.h"
#include "openmm/common/ContextSelector.h"
#include "openmm/common/IntegrationUtilities.h"
#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <mutex>
#include <utility>

using namespace OpenMM;
using namespace cylchain;
using namespace std;

namespace OpenMM {
namespace layout {
#include "../kernels/layout.cc" // NOLINT(bugprone-suspicious-include)
} // namespace layout
} // namespace OpenMM

static_assert((int) NoiseKind::Particle == layout::NOISE_PARTICLE, "");

/** The fixed-point numbers in which platforms add forces reach as far as 2^31. */
static const double LARGEST_FORCE = 2147483000.0;

/**
 * Tells OpenMM which particles it has to wrap into the periodic box as a whole. Slots are looked up, so that it may
 * give the places of equal ones to each other whatever their parameters are.
 */
class CommonParticles::Molecules : public ComputeForceInfo {
public:
    explicit Molecules(const vector<vector<int> >& molecules) : molecules(molecules) {
    }
    int getNumParticleGroups() {
        return molecules.size();
    }
    void getParticlesInGroup(int index, vector<int>& particles) {
        particles = molecules[index];
    }
    bool areGroupsIdentical(int, int) {
        return true;
    }
private:
    const vector<vector<int> > molecules;
};

KernelImpl* OpenMM::createCommonKernel(const string& name, const Platform& platform, ContextImpl& context,
        ComputeContext& cc) {
    static map<ContextImpl*, weak_ptr<HostParticles> > known;
    static mutex access;
    lock_guard<mutex> lock(access);
    shared_ptr<HostParticles> particles = known[&context].lock();
    if (!particles) {
        for (auto it = known.begin(); it != known.end();)
            it = it->second.expired() ? known.erase(it) : next(it);
        particles = make_shared<CommonParticles>(cc);
        known[&context] = particles;
    }
    return createHostKernel(name, platform, particles);
}

template <class T> static void uploadTo(ComputeContext& cc, ComputeArray& array, vector<T> values,
        const string& name) {
    // There are no empty arrays.

    if (!array.isInitialized())
        array.initialize<T>(cc, max<size_t>(1, values.size()), name);
    else if (array.getSize() < values.size())
        array.resize(values.size()+values.size()/2);
    values.resize(array.getSize());
    array.upload(values);
}

CommonParticles::CommonParticles(ComputeContext& cc) : cc(cc), loop(cc.getThreadPool()) {
}

void CommonParticles::beginSteps() {
    cc.initializeContexts();
    if (cc.getNumContexts() > 1)
        throw OpenMMException("Filaments are beside one device: give one DeviceIndex alone");
}

void CommonParticles::include(const vector<int>& present) {
    const size_t before = particles.size();
    isIncluded.resize(cc.getNumAtoms());
    indexOf.resize(cc.getNumAtoms());
    for (int particle : present)
        if (particle >= 0 && !isIncluded[particle]) {
            isIncluded[particle] = 1;
            indexOf[particle] = particles.size();
            particles.push_back(particle);
        }
    if (particles.size() > before)
        imageNumbers.clear();
}

void CommonParticles::addMolecules(const vector<vector<int> >& molecules) {
    cc.addForce(new Molecules(molecules));
}

void CommonParticles::addPositions(ComputeKernel kernel) {
    kernel->addArg(cc.getPosq());
    if (cc.getUseMixedPrecision())
        kernel->addArg(cc.getPosqCorrection());
}

/** A kernel whose first arguments are set before each execution. */
ComputeKernel CommonParticles::createKernel(ComputeProgram program, const string& name, int numValues) {
    const ComputeKernel kernel = program->createKernel(name);
    for (int i = 0; i < numValues; i++)
        kernel->addArg();
    return kernel;
}

void CommonParticles::makeArrays() {
    if (!positions.empty())
        return;
    if (!cc.getSupportsDoublePrecision())
        throw OpenMMException("Filaments need a device that computes in double precision, and this one does not. "
                "Use the CPU platform, or another device");
    const size_t numAtoms = cc.getNumAtoms();
    isIncluded.resize(numAtoms);
    for (vector<Vec3>* all : {&positions, &forces, &velocities, &added})
        all->assign(numAtoms, Vec3());
    uploadTo(cc, slots, vector<int>(numAtoms), "slotsOfParticles");
    uploadTo(cc, boxArray, vector<double>(9), "boxOfParticles");
    uploadTo(cc, flow, vector<double>(layout::NUM_FLOW_NUMBERS), "flow");
    uploadTo(cc, displacements, vector<double>(3*numAtoms), "displacements");
    uploadTo(cc, unstable, vector<uint64_t>(1), "unstableParticles");
    uploadTo(cc, images, vector<int>(), "imagesOfParticles");
    uploadTo(cc, included, vector<int>(), "includedParticles");
    uploadTo(cc, exchanged, vector<double>(), "exchangedNumbers");
    uploadTo(cc, work, vector<double>(), "workOnParticles");
    uploadTo(cc, otherParticles, vector<int>(), "otherParticles");
    uploadTo(cc, mobilities, vector<double>(), "mobilities");

    typedef CommonCylinderChainKernelSources Sources;
    const ComputeProgram program = cc.compileProgram(string(Sources::layout)+Sources::noise+Sources::particles);
    const auto addArrays = [] (ComputeKernel kernel, const vector<ComputeArray*>& arrays) {
        for (ComputeArray* array : arrays)
            kernel->addArg(*array);
    };
    copyToProcessor = createKernel(program, "copyToProcessor", 2);
    addPositions(copyToProcessor);
    copyToProcessor->addArg(cc.getLongForceBuffer());
    addArrays(copyToProcessor, {&images, &boxArray, &exchanged});
    addForces = createKernel(program, "addForces", 2);
    addForces->addArg(cc.getLongForceBuffer());
    addArrays(addForces, {&images, &exchanged});
    copyFromProcessor = createKernel(program, "copyFromProcessor", 2);
    addPositions(copyFromProcessor);
    copyFromProcessor->addArg(cc.getVelm());
    addArrays(copyFromProcessor, {&images, &included, &exchanged, &displacements});
    sumWork = createKernel(program, "sumWork", 4);
    sumWork->addArg(cc.getLongForceBuffer());
    addArrays(sumWork, {&slots, &displacements, &work});
    displaceParticles = createKernel(program, "displaceParticles", 8);
    addPositions(displaceParticles);
    displaceParticles->addArg(cc.getLongForceBuffer());
    addArrays(displaceParticles, {&otherParticles, &slots, &mobilities, &flow, &boxArray, &displacements, &unstable});
    moveParticles = createKernel(program, "moveParticles", 2);
    addPositions(moveParticles);
    moveParticles->addArg(cc.getVelm());
    addArrays(moveParticles, {&otherParticles, &slots, &displacements});
}

bool CommonParticles::areImagesValid() const {
    if (imageNumbers.size() != layout::NUM_IMAGE_NUMBERS*particles.size())
        return false;
    const vector<int>& present = cc.getAtomIndex();
    const vector<mm_int4>& cells = cc.getPosCellOffsets();
    for (size_t i = 0; i < particles.size(); i++) {
        const int* own = &imageNumbers[layout::NUM_IMAGE_NUMBERS*i];
        const mm_int4& offset = cells[own[layout::IMAGE_SLOT]];
        if (present[own[layout::IMAGE_SLOT]] != particles[i] || offset.x != own[layout::IMAGE_CELLS] ||
                offset.y != own[layout::IMAGE_CELLS+1] || offset.z != own[layout::IMAGE_CELLS+2])
            return false;
    }
    return true;
}

void CommonParticles::updateSlots() {
    if (order == cc.getAtomIndex())
        return;
    order = cc.getAtomIndex();
    slotOf.resize(order.size());
    for (int slot = 0; slot < cc.getNumAtoms(); slot++)
        slotOf[order[slot]] = slot;
    uploadTo(cc, slots, slotOf, "slotsOfParticles");
}

void CommonParticles::updateImages() {
    // OpenMM changes these where it sorts or wraps particles, and where positions, a checkpoint or a barostat set them.

    if (areImagesValid())
        return;
    updateSlots();
    imageNumbers.clear();
    for (int particle : particles) {
        const mm_int4 cells = cc.getPosCellOffsets()[slotOf[particle]];
        imageNumbers.insert(imageNumbers.end(), {slotOf[particle], cells.x, cells.y, cells.z});
    }
    uploadTo(cc, images, imageNumbers, "imagesOfParticles");
    uploadTo(cc, included, particles, "includedParticles");
    numbers.resize(layout::NUM_EXCHANGED*particles.size());
    uploadTo(cc, exchanged, numbers, "exchangedNumbers");
}

Vec3* CommonParticles::getBox() {
    cc.getPeriodicBoxVectors(box[0], box[1], box[2]);
    return box;
}

void CommonParticles::updateBox() {
    getBox();
    const vector<double> present(&box[0][0], &box[0][0]+9);
    if (present != boxNumbers) {
        boxNumbers = present;
        boxArray.upload(boxNumbers);
    }
}

/** By how much OpenMM has moved an included particle to where it stores it. */
Vec3 CommonParticles::offsetOf(size_t index) const {
    const int* cells = &imageNumbers[layout::NUM_IMAGE_NUMBERS*index+layout::IMAGE_CELLS];
    return box[0]*cells[0]+box[1]*cells[1]+box[2]*cells[2];
}

void CommonParticles::update() {
    ContextSelector selector(cc);
    makeArrays();
    updateBox();
    updateImages();
    if (particles.empty())
        return;
    copyToProcessor->setArg(0, (int) particles.size());
    copyToProcessor->setArg(1, cc.getPaddedNumAtoms());
    copyToProcessor->execute(particles.size());
    numbers.resize(exchanged.getSize());
    exchanged.download(numbers);
    for (size_t i = 0; i < particles.size(); i++) {
        const double* own = &numbers[layout::NUM_EXCHANGED*i];
        for (int k = 0; k < 3; k++) {
            positions[particles[i]][k] = own[layout::EXCHANGED_POSITION+k];
            const double force = own[layout::EXCHANGED_FORCE+k];
            forces[particles[i]][k] = fabs(force) < LARGEST_FORCE ? force : numeric_limits<double>::quiet_NaN();
        }
    }
}

Vec3 CommonParticles::store(int particle, const Vec3& position) const {
    if (cc.getUseDoublePrecision())
        return position;
    const Vec3 offset = offsetOf(indexOf[particle]);
    Vec3 stored = position+offset;
    for (int k = 0; k < 3; k++) {
        const double rest = cc.getUseMixedPrecision() ? (float) (stored[k]-(float) stored[k]) : 0;
        stored[k] = (float) stored[k]+rest;
    }
    return stored-offset;
}

vector<Vec3>& CommonParticles::beginForces() {
    for (int particle : particles)
        added[particle] = Vec3();
    return added;
}

void CommonParticles::endForces() {
    if (particles.empty())
        return;
    ContextSelector selector(cc);
    for (size_t i = 0; i < particles.size(); i++)
        for (int k = 0; k < 3; k++)
            numbers[layout::NUM_EXCHANGED*i+layout::EXCHANGED_FORCE+k] = added[particles[i]][k];
    exchanged.upload(numbers);
    addForces->setArg(0, (int) particles.size());
    addForces->setArg(1, cc.getPaddedNumAtoms());
    addForces->execute(particles.size());
}

void CommonParticles::sendPositions(const vector<Vec3>& newPositions, double stepSize) {
    if (particles.empty())
        return;
    for (size_t i = 0; i < particles.size(); i++) {
        const Vec3 stored = newPositions[particles[i]]+offsetOf(i);
        double* own = &numbers[layout::NUM_EXCHANGED*i];
        for (int k = 0; k < 3; k++) {
            own[layout::EXCHANGED_POSITION+k] = stored[k];
            own[layout::EXCHANGED_VELOCITY+k] = velocities[particles[i]][k];
        }
    }
    exchanged.upload(numbers);
    copyFromProcessor->setArg(0, (int) particles.size());
    copyFromProcessor->setArg(1, stepSize);
    copyFromProcessor->execute(particles.size());
}

void CommonParticles::writePositions() {
    ContextSelector selector(cc);
    sendPositions(positions, 0);
}

void CommonParticles::beginWork(const StepWork& present) {
    if (!present.watched)
        return;
    ContextSelector selector(cc);
    makeArrays();
    updateSlots();
    const int numAtoms = cc.getNumAtoms();
    if (work.getSize() < (size_t) layout::NUM_WORK_NUMBERS*numAtoms)
        uploadTo(cc, work, vector<double>((size_t) layout::NUM_WORK_NUMBERS*numAtoms), "workOnParticles");
    sumWork->setArg(0, numAtoms);
    sumWork->setArg(1, cc.getPaddedNumAtoms());
    sumWork->setArg(2, (present.followsOn ? layout::FOLLOWS_ON : 0) | (present.beginsWindow ?
            layout::BEGINS_WINDOW : 0));
    sumWork->setArg(3, present.perEnergy);
    sumWork->execute(numAtoms);
}

void CommonParticles::getWork(vector<WorkSums>& sums) {
    ContextSelector selector(cc);
    vector<double> found(work.getSize());
    work.download(found);
    sums.resize(cc.getNumAtoms());
    for (size_t i = 0; i < sums.size(); i++) {
        const double* own = &found[layout::NUM_WORK_NUMBERS*i];
        for (int k = 0; k < 3; k++) {
            sums[i].change[k] = own[layout::WORK_CHANGE+k];
            sums[i].way[k] = own[layout::WORK_WAY+k];
        }
        sums[i].work = own[layout::WORK_DONE];
    }
}

void CommonParticles::findOthers(const OtherParticles& present, double friction) {
    if (versionOfOthers == getVersion() && frictionOfOthers == friction)
        return;
    others.clear();
    vector<double> values;
    for (int particle : present.getMobile())
        if (!isIncluded[particle]) {
            others.push_back(particle);
            values.push_back(present.getMobility(particle, friction));
        }
    uploadTo(cc, otherParticles, others, "otherParticles");
    uploadTo(cc, mobilities, values, "mobilities");
    versionOfOthers = getVersion();
    frictionOfOthers = friction;
}

void CommonParticles::displaceOthers(const OtherParticles& present, const StepSettings& settings, double friction) {
    ContextSelector selector(cc);
    findOthers(present, friction);
    if (others.empty())
        return;
    updateSlots();
    vector<double> ofFlow(layout::NUM_FLOW_NUMBERS);
    copy(settings.flow.velocity, settings.flow.velocity+3, ofFlow.begin()+layout::FLOW_VELOCITY);
    copy(settings.flow.gradient, settings.flow.gradient+9, ofFlow.begin()+layout::FLOW_GRADIENT);
    copy(settings.flow.origin, settings.flow.origin+3, ofFlow.begin()+layout::FLOW_ORIGIN);
    if (ofFlow != flowNumbers) {
        flowNumbers = std::move(ofFlow);
        flow.upload(flowNumbers);
    }
    displaceParticles->setArg(0, (int) others.size());
    displaceParticles->setArg(1, cc.getPaddedNumAtoms());
    displaceParticles->setArg(2, (settings.flow.present ? layout::HAS_FLOW : 0) |
            (settings.flow.box != NULL ? layout::FLOW_IS_PERIODIC : 0));
    displaceParticles->setArg(3, settings.stepSize);
    displaceParticles->setArg(4, settings.kT);
    displaceParticles->setArg(5, (uint32_t) settings.seed);
    displaceParticles->setArg(6, (uint32_t) settings.level);
    displaceParticles->setArg(7, settings.step);
    displaceParticles->execute(others.size());
}

int CommonParticles::findUnstable() {
    if (others.empty())
        return -1;
    ContextSelector selector(cc);
    // The kernel counts on and on, so that nothing has to be set to zero in a step.
    vector<uint64_t> count(1);
    unstable.download(count);
    const bool any = count[0] > unstableBefore;
    unstableBefore = count[0];
    if (!any)
        return -1;
    vector<long long> found(3*(size_t) cc.getPaddedNumAtoms());
    cc.getLongForceBuffer().download(found);
    vector<double> moved(displacements.getSize());
    displacements.download(moved);
    for (int particle : others)
        for (int k = 0; k < 3; k++) {
            const double force = found[slotOf[particle]+k*(size_t) cc.getPaddedNumAtoms()]/4294967296.0;
            if (!(fabs(force) < LARGEST_FORCE && fabs(moved[3*(size_t) particle+k]) < 1e300))
                return particle;
        }
    return others[0];
}

void CommonParticles::move(vector<Vec3>& newPositions, double stepSize, int steps) {
    ContextSelector selector(cc);
    sendPositions(newPositions, stepSize);
    if (!others.empty()) {
        updateSlots();
        moveParticles->setArg(0, (int) others.size());
        moveParticles->setArg(1, 1/stepSize);
        moveParticles->execute(others.size());
    }
    cc.getIntegrationUtilities().computeVirtualSites();
    cc.setTime(cc.getTime()+steps*stepSize);
    cc.setStepCount(cc.getStepCount()+steps);
    cc.reorderAtoms();
}
