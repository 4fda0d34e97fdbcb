#include "CommonIntegrateCylinderChainStepKernel.h"
#include "ChainTables.h"
#include "CommonCylinderChainKernelSources.h"
#include "openmm/OpenMMException.h"
#include "openmm/common/ContextSelector.h"
#include "openmm/common/IntegrationUtilities.h"
#include <algorithm>
#include <cmath>
#include <limits>

using namespace OpenMM;
using namespace cylchain;
using namespace std;

CommonIntegrateCylinderChainStepKernel::CommonIntegrateCylinderChainStepKernel(string name, const Platform& platform,
        ComputeContext& cc) : IntegrateCylinderChainStepKernel(name, platform), cc(cc), chainKernel(NULL),
        others(NULL), hasArguments(false), frictionOfMobilities(-1) {
}

void CommonIntegrateCylinderChainStepKernel::HostLoop::run(int count, const function<void(int)>& iteration) {
    for (int i = 0; i < count; i++)
        iteration(i);
}

void CommonIntegrateCylinderChainStepKernel::initialize(const System& system, const CylinderChainDescription&,
        const OtherParticles& others, CalcCylinderChainForceKernel& forceKernel) {
    // Both kernels are those of this platform, and share its chains.

    chainKernel = &dynamic_cast<CommonCalcCylinderChainForceKernel&>(forceKernel);
    this->others = &others;
    if (!others.getBodies().empty())
        throw OpenMMException("On the "+getPlatform().getName()+" platform, there are no rigid bodies. Use the CPU "
                "platform");
    cc.initializeContexts();
    if (cc.getNumContexts() > 1)
        throw OpenMMException("Filaments are computed on one device: give one DeviceIndex alone");
    forces.resize(system.getNumParticles());
    displacements.resize(system.getNumParticles());
}

void CommonIntegrateCylinderChainStepKernel::refuseScheme(Scheme scheme) {
    if (scheme == Scheme::Modes)
        throw OpenMMException("On the "+getPlatform().getName()+" platform, filaments are not moved by their modes. "
                "Use another scheme, or the CPU platform");
}

void CommonIntegrateCylinderChainStepKernel::refuse(const StepSettings& settings) {
    refuseScheme(settings.scheme);
    if (settings.segmentForces != NULL)
        throw OpenMMException("On the "+getPlatform().getName()+" platform, tensions of segments are not recorded. "
                "Use the CPU platform for this");
    if (settings.precision == Precision::Mixed)
        throw OpenMMException("On the "+getPlatform().getName()+" platform, steps of filaments are in double "
                "precision. Use precision \"automatic\" or \"double\", and the platform's property Precision "
                "for all else");
}

void CommonIntegrateCylinderChainStepKernel::makeArrays() {
    const vector<int>& mobile = others->getMobile();
    particles.initialize<int>(cc, mobile.size(), "otherParticles");
    particles.upload(mobile);
    mobilities.initialize<double>(cc, mobile.size(), "mobilities");
    displacementsOfOthers.initialize<double>(cc, 3*mobile.size(), "displacementsOfOthers");
    unstable.initialize<int>(cc, mobile.size(), "unstableParticles");
    workOnOthers.initialize<double>(cc, layout::NUM_WORK_NUMBERS*mobile.size(), "workOnOthers");
    const ComputeProgram program = CommonCylinderChains::compile(cc,
            CommonCylinderChainKernelSources::particles);
    displaceKernel = program->createKernel("displaceOthers");
    moveKernel = program->createKernel("moveOthers");
}

const vector<Vec3>& CommonIntegrateCylinderChainStepKernel::getForces(ContextImpl&) {
    ContextSelector selector(cc);
    const int padded = cc.getPaddedNumAtoms();
    vector<long long> found(3*(size_t) padded);
    cc.getLongForceBuffer().download(found);
    const vector<int>& order = cc.getAtomIndex();
    for (int slot = 0; slot < cc.getNumAtoms(); slot++)
        for (int k = 0; k < 3; k++) {
            // Forces that are not finite, or too large, are the largest that platforms can add.

            const double force = found[slot+k*(size_t) padded]/(double) 0x100000000LL;
            forces[order[slot]][k] = fabs(force) < 2147483000.0 ? force : numeric_limits<double>::quiet_NaN();
        }
    return forces;
}

const vector<Vec3>& CommonIntegrateCylinderChainStepKernel::getDisplacements() {
    ContextSelector selector(cc);
    chainKernel->getChains().getDisplacements(displacements);
    if (hasArguments) {
        vector<double> found(displacementsOfOthers.getSize());
        displacementsOfOthers.download(found);
        const vector<int>& mobile = others->getMobile();
        for (size_t i = 0; i < mobile.size(); i++)
            displacements[mobile[i]] = Vec3(found[3*i], found[3*i+1], found[3*i+2]);
    }
    return displacements;
}

Instability CommonIntegrateCylinderChainStepKernel::displaceChains(ContextImpl&, const StepSettings& settings) {
    ContextSelector selector(cc);
    refuse(settings);
    CommonCylinderChains& chains = chainKernel->getChains();
    chains.gather(true, work);
    Instability result;
    long long divided;
    if (chains.advance(settings, 1, false, divided) < 1)
        result.chain = chains.getFirstUnstable();
    result.divided = divided;
    return result;
}

Instability CommonIntegrateCylinderChainStepKernel::displaceCoupledChains(ContextImpl&, const StepSettings&,
        const CoupledForces&) {
    CommonCylinderChains::refuseImplicitSteps(getPlatform().getName(), "filaments with links, contacts or walls");
}

void CommonIntegrateCylinderChainStepKernel::displaceOthers(ContextImpl&, const StepSettings& settings,
        double friction) {
    const vector<int>& mobile = others->getMobile();
    if (mobile.empty())
        return;
    ContextSelector selector(cc);
    CommonCylinderChains& chains = chainKernel->getChains();
    if (!hasArguments)
        makeArrays();
    if (friction != frictionOfMobilities) {
        vector<double> present;
        for (int particle : mobile)
            present.push_back(others->getMobility(particle, friction));
        mobilities.upload(present);
        frictionOfMobilities = friction;
    }
    const int flags = chains.describeStep(settings);
    if (!hasArguments) {
        hasArguments = true;
        displaceKernel->addArg((int) mobile.size());
        displaceKernel->addArg(cc.getPaddedNumAtoms());
        for (int i = 0; i < 8; i++)
            displaceKernel->addArg();
        displaceKernel->addArg(cc.getPosq());
        if (cc.getUseMixedPrecision())
            displaceKernel->addArg(cc.getPosqCorrection());
        displaceKernel->addArg(cc.getLongForceBuffer());
        for (ComputeArray* array : {&particles, &chains.getSlots(), &mobilities, &chains.getFlow(), &chains.getBox(),
                &displacementsOfOthers, &unstable, &chains.getSummary(), &workOnOthers})
            displaceKernel->addArg(*array);
        moveKernel->addArg((int) mobile.size());
        moveKernel->addArg();
        moveKernel->addArg(cc.getPosq());
        if (cc.getUseMixedPrecision())
            moveKernel->addArg(cc.getPosqCorrection());
        moveKernel->addArg(cc.getVelm());
        for (ComputeArray* array : {&particles, &chains.getSlots(), &displacementsOfOthers})
            moveKernel->addArg(*array);
    }
    chains.getSlots();
    displaceKernel->setArg(2, flags);
    displaceKernel->setArg(3, settings.stepSize);
    displaceKernel->setArg(4, settings.kT);
    displaceKernel->setArg(5, (uint32_t) settings.seed);
    displaceKernel->setArg(6, (uint32_t) settings.level);
    displaceKernel->setArg(7, settings.step);
    displaceKernel->setArg(8, CommonCylinderChains::flagsOf(work));
    displaceKernel->setArg(9, work.perEnergy);
    displaceKernel->execute(mobile.size());
}

int CommonIntegrateCylinderChainStepKernel::findUnstableParticle() {
    const vector<int>& mobile = others->getMobile();
    if (mobile.empty() || chainKernel->getChains().getCount(layout::NUM_UNSTABLE_PARTICLES) == 0)
        return -1;
    ContextSelector selector(cc);
    vector<int> found(mobile.size());
    unstable.download(found);
    return mobile[find(found.begin(), found.end(), 1)-found.begin()];
}

void CommonIntegrateCylinderChainStepKernel::getWork(vector<WorkSums>& sums) {
    ContextSelector selector(cc);
    sums.resize(cc.getNumAtoms());
    chainKernel->getChains().getWork(sums);
    if (hasArguments)
        CommonCylinderChains::copyWork(workOnOthers, others->getMobile(), sums);
}

void CommonIntegrateCylinderChainStepKernel::moveOthers(double stepSize) {
    if (others->getMobile().empty())
        return;
    chainKernel->getChains().getSlots();
    moveKernel->setArg(1, 1/stepSize);
    moveKernel->execute(others->getMobile().size());
}

void CommonIntegrateCylinderChainStepKernel::finishSteps(double time, int steps) {
    cc.getIntegrationUtilities().computeVirtualSites();
    cc.setTime(cc.getTime()+time);
    cc.setStepCount(cc.getStepCount()+steps);
    cc.reorderAtoms();
}

void CommonIntegrateCylinderChainStepKernel::move(ContextImpl&, const StepSettings& settings) {
    ContextSelector selector(cc);
    chainKernel->getChains().moveNodes(settings.stepSize);
    moveOthers(settings.stepSize);
    finishSteps(settings.stepSize, 1);
}

int CommonIntegrateCylinderChainStepKernel::advanceChains(ContextImpl&, const StepSettings& settings, int count,
        long long& divided) {
    ContextSelector selector(cc);
    refuse(settings);
    CommonCylinderChains& chains = chainKernel->getChains();
    chains.gather(false);
    return chains.advance(settings, count, !computesChainForces(settings.scheme), divided);
}

void CommonIntegrateCylinderChainStepKernel::moveAdvanced(ContextImpl&, const StepSettings& settings, int count) {
    if (count == 0)
        return;
    ContextSelector selector(cc);
    chainKernel->getChains().moveNodes(settings.stepSize);
    finishSteps(count*settings.stepSize, count);
}
