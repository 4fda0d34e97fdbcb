#include "ReferenceIntegrateCylinderChainStepKernel.h"
#include "lanes/Noise.h"
#include "openmm/internal/ContextImpl.h"
#include <algorithm>
#include <cmath>
#include <numeric>

using namespace OpenMM;
using namespace cylchain;
using namespace std;

/**
 * Particles outside chains are given to threads in blocks of this size.
 */
static const int PARTICLES_OF_BLOCK = 64;

static bool isFinite(const Vec3& v) {
    return isfinite(v[0]) && isfinite(v[1]) && isfinite(v[2]);
}

ReferenceIntegrateCylinderChainStepKernel::ReferenceIntegrateCylinderChainStepKernel(string name,
        const Platform& platform, shared_ptr<HostParticles> particles) :
        IntegrateCylinderChainStepKernel(name, platform), particles(particles), chainKernel(NULL),
        others(NULL), versionOfNetwork(-1), versionOfLengths(-1), mixedChains(0) {
}

void ReferenceIntegrateCylinderChainStepKernel::initialize(const System& system, const CylinderChainDescription&,
        const OtherParticles& others, CalcCylinderChainForceKernel& forceKernel) {
    // Both kernels are those of this platform, and share its engine.

    chainKernel = &dynamic_cast<ReferenceCalcCylinderChainForceKernel&>(forceKernel);
    this->others = &others;
    particles->beginSteps();
    mixedChains = 0;
    displacements.assign(system.getNumParticles(), Vec3());
    newPositions.assign(system.getNumParticles(), Vec3());
}

const vector<Vec3>& ReferenceIntegrateCylinderChainStepKernel::getForces(ContextImpl&) {
    particles->update();
    return particles->getForces();
}

StepSettings ReferenceIntegrateCylinderChainStepKernel::withTwists(StepSettings settings) {
    if (settings.twists != NULL) {
        twistChanges = *settings.twists;
        settings.twistChanges = &twistChanges;
    }
    return settings;
}

Instability ReferenceIntegrateCylinderChainStepKernel::displaceChains(ContextImpl&, const StepSettings& given) {
    const StepSettings settings = withTwists(given);
    const ChainEngine& engine = chainKernel->getEngine();
    const double* positions = &particles->getPositions()[0][0];
    const double* forces = &particles->getForces()[0][0];
    const double* box = chainKernel->getBox();
    const vector<int> packs = engine.getPacksOfStep(settings);
    const BeamEngine& beams = chainKernel->getBeamEngine();
    const int numPacks = packs.size(), numChains = chainKernel->getChains().size();
    vector<Instability> instabilities(numPacks+beams.getNumPacks());
    particles->getLoop().run(instabilities.size(), [&] (int i) {
        const bool ofBeams = i >= numPacks;
        const int pack = ofBeams ? i-numPacks : packs[i];
        instabilities[i] = ofBeams ? beams.step(pack, positions, forces, box, settings, &displacements[0][0]) :
                engine.step(pack, positions, forces, box, settings, &displacements[0][0]);
        // Beams count as further chains.
        if (ofBeams && instabilities[i].chain != -1)
            instabilities[i].chain += numChains;
        findNewPositions(ofBeams ? beams.getParticles(pack) : engine.getParticles(pack), settings.stepSize);
    });

    // Whatever the order of packs, report the first chain.

    Instability result;
    for (const Instability& instability : instabilities) {
        if (instability.chain != -1 && (result.chain == -1 || instability.chain < result.chain))
            result.chain = instability.chain;
        result.divided += instability.divided;
    }
    if (result.chain == -1)
        mixedChains = engine.getNumMixedChains(packs, settings);
    return result;
}

static void addChanges(vector<double>& twists, const vector<double>& changes) {
    for (size_t joint = 0; joint < twists.size(); joint++)
        twists[joint] += changes[joint];
}

template <class Particles> void ReferenceIntegrateCylinderChainStepKernel::findNewPositions(const Particles& own,
        double stepSize) {
    const vector<Vec3>& positions = particles->getPositions();
    vector<Vec3>& velocities = particles->getVelocities();
    for (int particle : own) {
        newPositions[particle] = positions[particle]+displacements[particle];
        velocities[particle] = displacements[particle]/stepSize;
    }
}

Instability ReferenceIntegrateCylinderChainStepKernel::displaceCoupledChains(ContextImpl& context,
        const StepSettings& given, const CoupledForces& coupled) {
    const StepSettings settings = withTwists(given);
    const ChainEngine& engine = chainKernel->getEngine();
    const BeamEngine& beams = chainKernel->getBeamEngine();
    if (!network || versionOfNetwork != chainKernel->getEngineVersion()) {
        network.reset(new NetworkStep(engine, chainKernel->getChains(), beams, chainKernel->getBeams(),
                others->getBodies(), context.getSystem().getNumParticles()));
        versionOfNetwork = chainKernel->getEngineVersion();
    }
    else if (versionOfLengths != chainKernel->getVersionOfLengths())
        network->updateLengths();
    versionOfLengths = chainKernel->getVersionOfLengths();
    network->setForces(coupled);
    Instability result;
    particles->getLoop().runMany([&] (const Loop& loops) {
        result = network->step(&particles->getPositions()[0][0], &particles->getForces()[0][0], chainKernel->getBox(),
                settings, &displacements[0][0], loops);
    });
    if (result.chain != -1)
        return result;
    const vector<int> packs = engine.getPacksOfStep(settings);
    for (int pack : packs)
        findNewPositions(engine.getParticles(pack), settings.stepSize);
    for (int pack = 0; pack < beams.getNumPacks(); pack++)
        findNewPositions(beams.getParticles(pack), settings.stepSize);
    for (const RigidBody& body : others->getBodies())
        findNewPositions(body.particles, settings.stepSize);
    mixedChains = engine.getNumMixedChains(packs);
    return result;
}

void ReferenceIntegrateCylinderChainStepKernel::displaceOthers(ContextImpl&, const StepSettings& settings,
        double friction) {
    particles->update();
    if (versionOfMobile != particles->getVersion()) {
        mobile.clear();
        for (int particle : others->getMobile())
            if (particles->includes(particle))
                mobile.push_back(particle);
        versionOfMobile = particles->getVersion();
    }
    particles->displaceOthers(*others, settings, friction);
    const int numBlocks = (mobile.size()+PARTICLES_OF_BLOCK-1)/PARTICLES_OF_BLOCK;
    particles->getLoop().run(numBlocks, [&] (int block) {
        displaceBlock(block, settings, friction);
    });
    const auto found = find_if(mobile.begin(), mobile.end(), [&] (int particle) {
        return !isFinite(displacements[particle]);
    });
    unstableParticle = (found == mobile.end() ? particles->findUnstable() : *found);
}

static Vec3 velocityOf(const BackgroundFlow& flow, const Vec3& x) {
    const double position[] = {x[0], x[1], x[2]};
    double velocity[3];
    flow.getVelocity(position, velocity);
    return {velocity[0], velocity[1], velocity[2]};
}

void ReferenceIntegrateCylinderChainStepKernel::displaceBlock(int block, const StepSettings& settings,
        double friction) {
    const vector<Vec3>& positions = particles->getPositions();
    const vector<Vec3>& forces = particles->getForces();
    const int start = block*PARTICLES_OF_BLOCK;
    const int end = min((int) mobile.size(), start+PARTICLES_OF_BLOCK);
    const uint32_t noChains[PARTICLES_OF_BLOCK] = {};
    uint32_t numbers[PARTICLES_OF_BLOCK];
    double gaussian[4*PARTICLES_OF_BLOCK];
    copy(mobile.begin()+start, mobile.begin()+end, numbers);
    drawNormals({(uint32_t) settings.seed, (uint32_t) settings.level, settings.step}, NoiseKind::Particle, noChains,
            numbers, end-start, gaussian);
    for (int i = start; i < end; i++) {
        const int particle = mobile[i];
        const double mobility = others->getMobility(particle, friction);
        const double noise = sqrt(2*settings.kT*settings.stepSize*mobility);
        const double* g = &gaussian[4*(i-start)];
        displacements[particle] = forces[particle]*(settings.stepSize*mobility)+Vec3(g[0], g[1], g[2])*noise;
        if (settings.flow.present) {
            // The velocity half-way, so that particles keep to closed streamlines.
            const Vec3 halfway = positions[particle]+
                    velocityOf(settings.flow, positions[particle])*(0.5*settings.stepSize);
            displacements[particle] += velocityOf(settings.flow, halfway)*settings.stepSize;
        }
    }
}

void ReferenceIntegrateCylinderChainStepKernel::move(ContextImpl&, const StepSettings& settings) {
    const vector<Vec3>& positions = particles->getPositions();
    for (int particle : others->getParticles())
        newPositions[particle] = positions[particle]+displacements[particle];
    vector<Vec3>& velocities = particles->getVelocities();
    for (int particle : mobile)
        velocities[particle] = displacements[particle]/settings.stepSize;
    for (size_t chain = 0; settings.twists != NULL && chain < settings.twists->size(); chain++)
        addChanges((*settings.twists)[chain], twistChanges[chain]);
    finishSteps(settings.stepSize, 1);
}

void ReferenceIntegrateCylinderChainStepKernel::finishSteps(double stepSize, int steps) {
    for (const Chain& chain : chainKernel->getChains())
        for (int spare : chain.spareNodes)
            newPositions[spare] = chain.nodes.empty() ? particles->getPositions()[spare] :
                    newPositions[chain.nodes.back()];
    particles->move(newPositions, stepSize, steps);
}

int ReferenceIntegrateCylinderChainStepKernel::advanceChains(ContextImpl&, const StepSettings& given, int count,
        long long& divided) {
    particles->update();
    StepSettings settings = withTwists(given);
    if (settings.twists != NULL) {
        newTwists = *settings.twists;
        settings.twists = &newTwists;
    }
    const ChainEngine& engine = chainKernel->getEngine();
    const BeamEngine& beams = chainKernel->getBeamEngine();
    const vector<int> packs = engine.getPacksOfStep(settings);
    const int numPacks = packs.size();
    vector<int> taken(numPacks+beams.getNumPacks());
    vector<long long> dividedInPack(taken.size());
    particles->getLoop().run(taken.size(), [&] (int i) {
        taken[i] = i < numPacks ? advancePack(engine, packs[i], settings, count, dividedInPack[i]) :
                advancePack(beams, i-numPacks, settings, count, dividedInPack[i]);
    });
    divided = accumulate(dividedInPack.begin(), dividedInPack.end(), 0LL);
    return *min_element(taken.begin(), taken.end());
}

static void addTwistChanges(const BeamEngine&, int, const StepSettings&) {
    // Beams have no twist.
}

static void addTwistChanges(const ChainEngine& engine, int pack, const StepSettings& settings) {
    for (int chain : engine.getChainsOfLanes(pack))
        if (chain >= 0)
            addChanges((*settings.twists)[chain], (*settings.twistChanges)[chain]);
}

template <class Engine> int ReferenceIntegrateCylinderChainStepKernel::advancePack(const Engine& engine, int pack,
        StepSettings settings, int count, long long& divided) {
    const double* box = chainKernel->getBox();
    double* forces = &particles->getForces()[0][0];
    const ParticleRange own = engine.getParticles(pack);
    const vector<Vec3>& positionsBefore = particles->getPositions();
    for (int particle : own)
        newPositions[particle] = positionsBefore[particle];
    engine.clearForces(pack, forces);
    vector<vector<SegmentForces> >* const segmentForces = settings.segmentForces;
    for (int done = 0; done < count; done++, settings.step++) {
        settings.segmentForces = (done == count-1 ? segmentForces : NULL);
        const double* positions = &newPositions[0][0];
        if (!computesChainForces(settings.scheme)) {
            engine.clearForces(pack, forces);
            engine.addForces(pack, positions, forces, box, false);
        }
        const Instability instability = engine.step(pack, positions, forces, box, settings, &displacements[0][0]);
        if (instability.chain != -1)
            return done;
        divided += instability.divided;
        for (int particle : own)
            newPositions[particle] += displacements[particle];
        if (settings.twists != NULL)
            addTwistChanges(engine, pack, settings);
        if (particles->areCopies())
            for (int particle : own)
                newPositions[particle] = particles->store(particle, newPositions[particle]);
    }
    vector<Vec3>& velocities = particles->getVelocities();
    for (int particle : own)
        if (count > 0)
            velocities[particle] = displacements[particle]/settings.stepSize;
    return count;
}

void ReferenceIntegrateCylinderChainStepKernel::moveAdvanced(ContextImpl&, const StepSettings& settings, int count) {
    const vector<Vec3>& positions = particles->getPositions();
    for (int particle : others->getParticles())
        newPositions[particle] = positions[particle];
    if (settings.twists != NULL)
        *settings.twists = newTwists;
    finishSteps(settings.stepSize, count);
    const ChainEngine& engine = chainKernel->getEngine();
    if (count > 0)
        mixedChains = engine.getNumMixedChains(engine.getPacksOfStep(settings), settings);
}
