#include "ReferenceUpdateCylinderChainLinkersKernel.h"

using namespace OpenMM;
using namespace cylchain;
using namespace std;

ReferenceUpdateCylinderChainLinkersKernel::ReferenceUpdateCylinderChainLinkersKernel(string name,
        const Platform& platform, shared_ptr<HostParticles> particles) :
        UpdateCylinderChainLinkersKernel(name, platform), particles(particles), periodic(false),
        nearestParticles(false) {
}

void ReferenceUpdateCylinderChainLinkersKernel::initialize(const LinkerSystem& system, const ChainList& chains,
        bool periodic, bool nearestParticles) {
    kinetics.reset(new LinkerKinetics(system, chains));
    vector<int> anchors;
    for (const Place& anchor : system.anchors)
        addParticles(anchor, anchors);
    particles->include(anchors);
    this->periodic = periodic;
    this->nearestParticles = nearestParticles;
}

KineticStep ReferenceUpdateCylinderChainLinkersKernel::describeStep(double stepSize, uint32_t seed,
        int force) const {
    particles->update();
    Vec3* const box = particles->getBox();
    KineticStep step = {&particles->getPositions()[0][0], LinkBoxes(), box[0][0]*box[1][1]*box[2][2], stepSize, seed,
            static_cast<uint32_t>(force)};
    step.boxes.distances = periodic ? &box[0][0] : NULL;
    step.boxes.segments = nearestParticles ? &box[0][0] : NULL;
    return step;
}

long long ReferenceUpdateCylinderChainLinkersKernel::execute(ContextImpl&, LinkerState& state,
        double kT, double stepSize, uint32_t seed, int force, const TorqueOnHand& torque, vector<Link>& links) {
    kinetics->setTemperature(kT);
    KineticStep step = describeStep(stepSize, seed, force);
    step.torqueOnHand = torque;
    return kinetics->advance(state, step, [&] (int count, const function<void(int)>& iteration) {
        particles->getLoop().run(count, iteration);
    }, &links);
}

void ReferenceUpdateCylinderChainLinkersKernel::describe(const LinkerState& state, vector<Link>& links) {
    kinetics->describe(state, links);
}
