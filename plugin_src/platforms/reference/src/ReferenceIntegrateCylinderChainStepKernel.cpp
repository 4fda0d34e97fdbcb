#include "ReferenceIntegrateCylinderChainStepKernel.h"
#include "ReferenceContextData.h"
#include "lanes/Noise.h"
#include "openmm/reference/ReferenceVirtualSites.h"
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
        const Platform& platform, ContextImpl& context) : IntegrateCylinderChainStepKernel(name, platform),
        loop(context), chainKernel(NULL), others(NULL), versionOfNetwork(-1), versionOfLengths(-1), mixedChains(0) {
}

void ReferenceIntegrateCylinderChainStepKernel::initialize(const System& system, const CylinderChainDescription&,
        const OtherParticles& others, CalcCylinderChainForceKernel& forceKernel) {
    // Both kernels are those of this platform, and share its engine.

    chainKernel = &dynamic_cast<ReferenceCalcCylinderChainForceKernel&>(forceKernel);
    this->others = &others;
    mixedChains = 0;
    displacements.assign(system.getNumParticles(), Vec3());
    newPositions.assign(system.getNumParticles(), Vec3());
}

const vector<Vec3>& ReferenceIntegrateCylinderChainStepKernel::getForces(ContextImpl& context) {
    return *extractData(context).forces;
}

Instability ReferenceIntegrateCylinderChainStepKernel::displaceChains(ContextImpl& context,
        const StepSettings& settings) {
    ReferencePlatform::PlatformData& data = extractData(context);
    const ChainEngine& engine = chainKernel->getEngine();
    const double* positions = &(*data.positions)[0][0];
    const double* forces = &(*data.forces)[0][0];
    const double* box = chainKernel->getBox(context);
    const vector<int> packs = engine.getPacksOfStep(settings);
    const BeamEngine& beams = chainKernel->getBeamEngine();
    const int numPacks = packs.size(), numChains = chainKernel->getChains().size();
    vector<Instability> instabilities(numPacks+beams.getNumPacks());
    loop.run(instabilities.size(), [&] (int i) {
        const bool ofBeams = i >= numPacks;
        const int pack = ofBeams ? i-numPacks : packs[i];
        instabilities[i] = ofBeams ? beams.step(pack, positions, forces, box, settings, &displacements[0][0]) :
                engine.step(pack, positions, forces, box, settings, &displacements[0][0]);
        // Beams count as further chains.
        if (ofBeams && instabilities[i].chain != -1)
            instabilities[i].chain += numChains;
        for (int particle : ofBeams ? beams.getParticles(pack) : engine.getParticles(pack))
            findNewPosition(context, particle, settings.stepSize);
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

void ReferenceIntegrateCylinderChainStepKernel::findNewPosition(ContextImpl& context, int particle, double stepSize) {
    ReferencePlatform::PlatformData& data = extractData(context);
    newPositions[particle] = (*data.positions)[particle]+displacements[particle];
    (*data.velocities)[particle] = displacements[particle]/stepSize;
}

Instability ReferenceIntegrateCylinderChainStepKernel::displaceCoupledChains(ContextImpl& context,
        const StepSettings& settings, const CoupledForces& coupled) {
    ReferencePlatform::PlatformData& data = extractData(context);
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
    loop.runMany([&] (const Loop& loops) {
        result = network->step(&(*data.positions)[0][0], &(*data.forces)[0][0], chainKernel->getBox(context), settings,
                &displacements[0][0], loops);
    });
    if (result.chain != -1)
        return result;
    const vector<int> packs = engine.getPacksOfStep(settings);
    for (int pack : packs)
        for (int particle : engine.getParticles(pack))
            findNewPosition(context, particle, settings.stepSize);
    for (int pack = 0; pack < beams.getNumPacks(); pack++)
        for (int particle : beams.getParticles(pack))
            findNewPosition(context, particle, settings.stepSize);
    for (const RigidBody& body : others->getBodies())
        for (int particle : body.particles)
            findNewPosition(context, particle, settings.stepSize);
    mixedChains = engine.getNumMixedChains(packs);
    return result;
}

void ReferenceIntegrateCylinderChainStepKernel::displaceOthers(ContextImpl& context, const StepSettings& settings,
        double friction) {
    const vector<int>& mobile = others->getMobile();
    const vector<Vec3>& forces = *extractData(context).forces;
    const int numBlocks = (mobile.size()+PARTICLES_OF_BLOCK-1)/PARTICLES_OF_BLOCK;
    loop.run(numBlocks, [&] (int block) {
        displaceBlock(block, *extractData(context).positions, forces, settings, friction);
    });
    const auto found = find_if(mobile.begin(), mobile.end(), [&] (int particle) {
        return !isFinite(displacements[particle]);
    });
    unstableParticle = (found == mobile.end() ? -1 : *found);
}

static Vec3 velocityOf(const BackgroundFlow& flow, const Vec3& x) {
    const double position[] = {x[0], x[1], x[2]};
    double velocity[3];
    flow.getVelocity(position, velocity);
    return {velocity[0], velocity[1], velocity[2]};
}

void ReferenceIntegrateCylinderChainStepKernel::displaceBlock(int block, const vector<Vec3>& positions,
        const vector<Vec3>& forces, const StepSettings& settings, double friction) {
    const vector<int>& mobile = others->getMobile();
    const int start = block*PARTICLES_OF_BLOCK;
    const int end = min((int) mobile.size(), start+PARTICLES_OF_BLOCK);
    const uint32_t noChains[PARTICLES_OF_BLOCK] = {};
    uint32_t particles[PARTICLES_OF_BLOCK];
    double gaussian[4*PARTICLES_OF_BLOCK];
    copy(mobile.begin()+start, mobile.begin()+end, particles);
    drawNormals({(uint32_t) settings.seed, (uint32_t) settings.level, settings.step}, NoiseKind::Particle, noChains,
            particles, end-start, gaussian);
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

void ReferenceIntegrateCylinderChainStepKernel::move(ContextImpl& context, const StepSettings& settings) {
    ReferencePlatform::PlatformData& data = extractData(context);
    for (int particle : others->getParticles())
        newPositions[particle] = (*data.positions)[particle]+displacements[particle];
    for (int particle : others->getMobile())
        (*data.velocities)[particle] = displacements[particle]/settings.stepSize;
    exchangePositions(context, settings.stepSize, 1);
}

void ReferenceIntegrateCylinderChainStepKernel::exchangePositions(ContextImpl& context, double time, int steps) {
    ReferencePlatform::PlatformData& data = extractData(context);
    for (const Chain& chain : chainKernel->getChains())
        for (int spare : chain.spareNodes)
            newPositions[spare] = chain.nodes.empty() ? (*data.positions)[spare] : newPositions[chain.nodes.back()];
    data.positions->swap(newPositions);
#if CYLCHAIN_OPENMM_VERSION >= 804
    data.virtualSites->computePositions(context.getSystem(), *data.positions, data.periodicBoxVectors);
#else
    data.virtualSites->computePositions(context.getSystem(), *data.positions);
#endif
    data.time += time;
    data.stepCount += steps;
}

int ReferenceIntegrateCylinderChainStepKernel::advanceChains(ContextImpl& context, const StepSettings& settings,
        int count, long long& divided) {
    const ChainEngine& engine = chainKernel->getEngine();
    const BeamEngine& beams = chainKernel->getBeamEngine();
    const vector<int> packs = engine.getPacksOfStep(settings);
    const int numPacks = packs.size();
    vector<int> taken(numPacks+beams.getNumPacks());
    vector<long long> dividedInPack(taken.size());
    loop.run(taken.size(), [&] (int i) {
        taken[i] = i < numPacks ? advancePack(context, engine, packs[i], settings, count, dividedInPack[i]) :
                advancePack(context, beams, i-numPacks, settings, count, dividedInPack[i]);
    });
    divided = accumulate(dividedInPack.begin(), dividedInPack.end(), 0LL);
    return *min_element(taken.begin(), taken.end());
}

template <class Engine> int ReferenceIntegrateCylinderChainStepKernel::advancePack(ContextImpl& context,
        const Engine& engine, int pack, StepSettings settings, int count, long long& divided) {
    ReferencePlatform::PlatformData& data = extractData(context);
    const double* box = chainKernel->getBox(context);
    double* forces = &(*data.forces)[0][0];
    const ParticleRange particles = engine.getParticles(pack);
    for (int particle : particles)
        newPositions[particle] = (*data.positions)[particle];
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
        for (int particle : particles)
            newPositions[particle] += displacements[particle];
    }
    for (int particle : particles)
        if (count > 0)
            (*data.velocities)[particle] = displacements[particle]/settings.stepSize;
    return count;
}

void ReferenceIntegrateCylinderChainStepKernel::moveAdvanced(ContextImpl& context, const StepSettings& settings,
        int count) {
    ReferencePlatform::PlatformData& data = extractData(context);
    for (int particle : others->getParticles())
        newPositions[particle] = (*data.positions)[particle];
    exchangePositions(context, count*settings.stepSize, count);
    const ChainEngine& engine = chainKernel->getEngine();
    if (count > 0)
        mixedChains = engine.getNumMixedChains(engine.getPacksOfStep(settings), settings);
}
