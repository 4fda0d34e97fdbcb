#include "CommonUpdateCylinderChainLinkersKernel.h"
#include "CommonCylinderChains.h"
#include "dynamics/ChainEngine.h"
#include "openmm/CylinderChainIntegrator.h"
#include "openmm/common/ContextSelector.h"
#include "openmm/internal/ContextImpl.h"
#include <functional>

using namespace OpenMM;
using namespace cylchain;
using namespace std;

CommonUpdateCylinderChainLinkersKernel::CommonUpdateCylinderChainLinkersKernel(string name, const Platform& platform,
        ComputeContext& cc) : UpdateCylinderChainLinkersKernel(name, platform), cc(cc), coupled(cc), periodic(false),
        nearestParticles(false) {
}

void CommonUpdateCylinderChainLinkersKernel::initialize(const LinkerSystem& system, const ChainList& chains,
        bool periodic, bool nearestParticles) {
    kinetics.reset(new LinkerKinetics(system, chains));
    this->periodic = periodic;
    this->nearestParticles = nearestParticles;
    for (int chain = 0; chain < chains.size(); chain++) {
        const vector<int>& own = chains.getParticles(chain);
        particles.insert(particles.end(), own.begin(), own.end());
    }
    for (const Place& anchor : system.anchors)
        if (!anchor.isPoint())
            particles.push_back(anchor.first);
}

void CommonUpdateCylinderChainLinkersKernel::refuseImplicitSteps(ContextImpl& context) {
    // Where no linker joins filaments yet, a step would know nothing of them.

    const CylinderChainIntegrator* integrator = dynamic_cast<const CylinderChainIntegrator*>(
            &context.getIntegrator());
    if (integrator != NULL && isImplicit(static_cast<Scheme>(integrator->getScheme())))
        CommonCylinderChains::refuseImplicitSteps(getPlatform().getName(), "filaments with linkers");
}

long long CommonUpdateCylinderChainLinkersKernel::execute(ContextImpl& context, LinkerState& state, double kT,
        double stepSize, uint32_t seed, int force, vector<Link>& links) {
    refuseImplicitSteps(context);
    ContextSelector selector(cc);
    if (positions.empty()) {
        positions.resize(cc.getNumAtoms());
        coupled.setParticles(particles);
    }
    coupled.gather();
    coupled.downloadPositions(positions);
    const double* box = coupled.getBoxNumbers().data();
    KineticStep step = {&positions[0][0], LinkBoxes(), box[0]*box[4]*box[8], stepSize, seed,
            static_cast<uint32_t>(force)};
    step.boxes.distances = periodic ? box : NULL;
    step.boxes.segments = nearestParticles ? box : NULL;
    kinetics->setTemperature(kT);
    return kinetics->advance(state, step, [] (int count, const function<void(int)>& iteration) {
        for (int i = 0; i < count; i++)
            iteration(i);
    }, &links);
}

bool CommonUpdateCylinderChainLinkersKernel::placeFree(ContextImpl& context, LinkerState& state, uint32_t seed,
        int force) {
    Vec3 box[3];
    context.getPeriodicBoxVectors(box[0], box[1], box[2]);
    KineticStep step = {NULL, LinkBoxes(), 0, 0, seed, static_cast<uint32_t>(force)};
    step.boxes.distances = periodic ? &box[0][0] : NULL;
    return kinetics->placeFree(state, step);
}

void CommonUpdateCylinderChainLinkersKernel::describe(const LinkerState& state, vector<Link>& links) {
    kinetics->describe(state, links);
}
