#include "ReferenceIntegrateCylinderChainStepKernel.h"
#include "lanes/Noise.h"
#include "mechanics/PeriodicBox.h"
#include "openmm/OpenMMException.h"
#include "openmm/reference/ReferencePlatform.h"
#include "openmm/reference/ReferenceVirtualSites.h"
#include "openmm/reference/SimTKOpenMMRealType.h"
#include <algorithm>
#include <cmath>
#include <numeric>
#include <sstream>

using namespace OpenMM;
using namespace cylchain;
using namespace std;

/**
 * Particles outside chains are given to threads in blocks of this size.
 */
static const int BLOCK_SIZE = 64;

static ReferencePlatform::PlatformData& extractData(ContextImpl& context) {
    return *reinterpret_cast<ReferencePlatform::PlatformData*>(context.getPlatformData());
}

static double norm(const Vec3& v) {
    return sqrt(v.dot(v));
}

static bool isFinite(const Vec3& v) {
    return isfinite(v[0]) && isfinite(v[1]) && isfinite(v[2]);
}

ReferenceIntegrateCylinderChainStepKernel::ReferenceIntegrateCylinderChainStepKernel(string name,
        const Platform& platform, ContextImpl& context) : IntegrateCylinderChainStepKernel(name, platform),
        loop(context), explicitWork(loop), chainKernel(NULL), periodic(false), mixedChains(0), recorded(false) {
}

void ReferenceIntegrateCylinderChainStepKernel::initialize(const System& system,
        const CylinderChainIntegrator& integrator, CalcCylinderChainForceKernel& forceKernel) {
    chainKernel = &dynamic_cast<ReferenceCalcCylinderChainForceKernel&>(forceKernel);
    periodic = system.usesPeriodicBoundaryConditions();
    const int numParticles = system.getNumParticles();
    vector<bool> isNode(numParticles, false);
    for (const Chain& chain : chainKernel->getChains())
        for (int node : chain.nodes)
            isNode[node] = true;
    outside.clear();
    others.clear();
    masses.resize(numParticles);
    for (int i = 0; i < numParticles; i++) {
        masses[i] = system.getParticleMass(i);
        if (isNode[i])
            continue;
        outside.push_back(i);
        if (masses[i] != 0.0)
            others.push_back(i);
    }

    // Particles that have no friction coefficient of their own are marked by zero.

    particleFrictions.assign(numParticles, 0.0);
    for (auto& entry : integrator.getParticleFrictions())
        particleFrictions[entry.first] = entry.second;
    vector<int> mobile = others;
    for (const Chain& chain : chainKernel->getChains())
        for (size_t node = 0; node < chain.nodes.size(); node++)
            if (!chain.fixed[node])
                mobile.push_back(chain.nodes[node]);
    sort(mobile.begin(), mobile.end());
    explicitWork.initialize(mobile);
    mixedChains = 0;
    displacements.assign(numParticles, Vec3());
    newPositions.assign(numParticles, Vec3());
}

BackgroundFlow ReferenceIntegrateCylinderChainStepKernel::flowOf(ContextImpl& context,
        const CylinderChainIntegrator& integrator) const {
    BackgroundFlow flow;
    Vec3 velocity, rows[3], origin;
    integrator.getFlow(velocity, rows[0], rows[1], rows[2], origin);
    for (int i = 0; i < 3; i++) {
        flow.velocity[i] = velocity[i];
        flow.origin[i] = origin[i];
        for (int k = 0; k < 3; k++)
            flow.gradient[3*i+k] = rows[i][k];
        flow.present |= (velocity[i] != 0 || rows[i] != Vec3());
    }
    if (periodic)
        flow.box = &extractData(context).periodicBoxVectors[0][0];
    return flow;
}

StepSettings ReferenceIntegrateCylinderChainStepKernel::settingsOf(ContextImpl& context,
        const CylinderChainIntegrator& integrator, uint64_t seed, int level, uint64_t step) const {
    StepSettings settings;
    const bool includesChains = (integrator.getIntegrationForceGroups()&(1<<chainKernel->getForceGroup())) != 0;
    // The entries of both enumerations are those of one list.
    settings.scheme = static_cast<Scheme>(integrator.getScheme());
    if (isImplicit(settings.scheme) && !includesChains)
        settings.scheme = Scheme::Midpoint;
    settings.kT = BOLTZ*integrator.getTemperature();
    settings.stepSize = integrator.getStepSize();
    settings.seed = seed;
    settings.level = level;
    settings.step = step;
    settings.flow = flowOf(context, integrator);
    settings.precision = static_cast<Precision>(integrator.getPrecision());
    return settings;
}

void ReferenceIntegrateCylinderChainStepKernel::refuseTornChains(ContextImpl& context) const {
    if (!periodic || chainKernel->getBox(context) != NULL)
        return;
    const vector<Vec3>& positions = *extractData(context).positions;
    Vec3* box = extractData(context).periodicBoxVectors;
    const double half = 0.5*min({box[0][0], box[1][1], box[2][2]});
    const vector<Chain>& chains = chainKernel->getChains();
    for (size_t chain = 0; chain < chains.size(); chain++)
        for (size_t s = 0; s < chains[chain].segments.size(); s++) {
            const vector<int>& nodes = chains[chain].nodes;
            const Vec3 between = positions[nodes[(s+1)%nodes.size()]]-positions[nodes[s]];
            const double length = norm(between);
            if (length <= max(half, 2*chains[chain].segments[s].restLength))
                continue;
            double nearest[] = {between[0], between[1], between[2]};
            takeToNearestImage(nearest, &box[0][0]);
            const double shorter = norm(Vec3(nearest[0], nearest[1], nearest[2]));
            if (shorter < 0.999*length) {
                stringstream message;
                message << "Chain " << chain << " is torn at segment " << s << ": its ends are " << length <<
                        " nm apart, and " << shorter <<
                        " nm as nearest images. Positions were wrapped into the periodic box particle by particle: "
                        "make chains whole before setting them";
                throw OpenMMException(message.str());
            }
        }
}

/** Whether a FENE segment can have a length. NaN counts as such, because it has reasons of its own. */
static bool isInRange(const Chain& chain, int segment, double length) {
    const Segment& own = chain.segments[segment];
    return !hasRange(chain.stretching) || !(fabs(length-own.restLength) >= own.maximumExtension);
}

static string describeRange(const Segment& segment) {
    stringstream text;
    text << "its FENE potential is finite between " << max(0.0, segment.restLength-segment.maximumExtension) <<
            " and " << segment.restLength+segment.maximumExtension << " nm alone";
    return text.str();
}

void ReferenceIntegrateCylinderChainStepKernel::refuseInfiniteEnergies(ContextImpl& context) const {
    const vector<Vec3>& positions = *extractData(context).positions;
    const double* box = chainKernel->getBox(context);
    const vector<Chain>& chains = chainKernel->getChains();
    for (size_t chain = 0; chain < chains.size(); chain++) {
        if (!hasRange(chains[chain].stretching))
            continue;
        const vector<int>& nodes = chains[chain].nodes;
        for (size_t s = 0; s < chains[chain].segments.size(); s++) {
            Vec3 between = positions[nodes[(s+1)%nodes.size()]]-positions[nodes[s]];
            if (box != NULL)
                takeToNearestImage(&between[0], box);
            if (isInRange(chains[chain], s, norm(between)))
                continue;
            stringstream message;
            message << "Chain " << chain << " is out of range at segment " << s << ": it is " << norm(between) <<
                    " nm long, and " << describeRange(chains[chain].segments[s]) << ". Set other positions";
            throw OpenMMException(message.str());
        }
    }
}

void ReferenceIntegrateCylinderChainStepKernel::execute(ContextImpl& context, const CylinderChainIntegrator& integrator,
        uint64_t seed, int level, uint64_t step, bool followsOn, bool records, long long& divided) {
    StepSettings settings = settingsOf(context, integrator, seed, level, step);
    recordForces(settings, records);
    explicitWork.beginStep(*extractData(context).forces, displacements, followsOn, settings.kT,
            integrator.getWorkWindow());
    displaceChains(context, settings, divided);
    displaceOthers(context, settings, integrator.getFriction());

    // Nothing has blown up, so the new positions replace the old ones.

    ReferencePlatform::PlatformData& data = extractData(context);
    for (int i : outside)
        newPositions[i] = (*data.positions)[i]+displacements[i];
    for (int i : others)
        (*data.velocities)[i] = displacements[i]/settings.stepSize;
    data.positions->swap(newPositions);
    data.virtualSites->computePositions(context.getSystem(), *data.positions, data.periodicBoxVectors);
    data.time += settings.stepSize;
    data.stepCount++;
    explicitWork.endStep();
    recorded = (settings.segmentForces != NULL);
}

void ReferenceIntegrateCylinderChainStepKernel::recordForces(StepSettings& settings, bool records) {
    recorded = false;
    if (!records || !isImplicit(settings.scheme))
        return;
    const vector<Chain>& chains = chainKernel->getChains();
    segmentForces.resize(chains.size());
    for (size_t chain = 0; chain < chains.size(); chain++)
        segmentForces[chain].resize(chains[chain].segments.size());
    settings.segmentForces = &segmentForces;
}

void ReferenceIntegrateCylinderChainStepKernel::getMeanTensions(int chain, vector<double>& tensions,
        vector<Vec3>& jointForces, vector<Vec3>& directions) const {
    if (!recorded)
        throw OpenMMException("No tensions were recorded in the last step: call setRecordsTensions(true) before it, "
                "with an implicit scheme");
    if (chain < 0 || chain >= (int) segmentForces.size())
        throw OpenMMException("CylinderChainIntegrator: Illegal chain index: "+to_string(chain));
    const vector<SegmentForces>& forces = segmentForces[chain];
    tensions.clear();
    jointForces.clear();
    directions.clear();
    for (const SegmentForces& one : forces) {
        tensions.push_back(one.tension);
        const Vec3 direction(one.direction[0], one.direction[1], one.direction[2]);
        directions.push_back(direction/norm(direction));
    }

    // Forces from outside act on both segments of a joint in equal parts, which leaves half the difference of their
    // own.

    for (size_t joint = 0; joint < chainKernel->getChains()[chain].joints.size(); joint++) {
        const double* before = forces[joint].plus;
        const double* behind = forces[(joint+1)%forces.size()].minus;
        jointForces.push_back(Vec3(behind[0]-before[0], behind[1]-before[1], behind[2]-before[2])*0.5);
    }
}

void ReferenceIntegrateCylinderChainStepKernel::takeExplicitWork(double& work, int& particle, int& steps,
        int& particles) {
    explicitWork.take(work, particle, steps, particles);
}

int ReferenceIntegrateCylinderChainStepKernel::executeTogether(ContextImpl& context,
        const CylinderChainIntegrator& integrator, uint64_t seed, int level, uint64_t step, int count, bool records,
        long long& divided) {
    if (!others.empty())
        return 0;
    explicitWork.interrupt();
    StepSettings settings = settingsOf(context, integrator, seed, level, step);
    recordForces(settings, records);
    ReferencePlatform::PlatformData& data = extractData(context);
    const vector<int> packs = chainKernel->getEngine().getPacksOfStep(settings);
    vector<int> taken(packs.size());
    vector<long long> dividedInPack(packs.size());
    auto advance = [&] (int steps) {
        loop.run(packs.size(), [&] (int i) {
            dividedInPack[i] = 0;
            taken[i] = advancePack(context, packs[i], settings, steps, dividedInPack[i]);
        });
        return *min_element(taken.begin(), taken.end());
    };

    // If a chain blows up, all of them are taken to the step before.

    int done = advance(count);
    if (done < count)
        done = advance(done);
    divided = accumulate(dividedInPack.begin(), dividedInPack.end(), divided);
    for (int particle : outside)
        newPositions[particle] = (*data.positions)[particle];
    data.positions->swap(newPositions);
    data.virtualSites->computePositions(context.getSystem(), *data.positions, data.periodicBoxVectors);
    data.time += done*settings.stepSize;
    data.stepCount += done;
    recorded = (settings.segmentForces != NULL && done == count);
    if (done > 0)
        mixedChains = chainKernel->getEngine().getNumMixedChains(packs);
    return done;
}

int ReferenceIntegrateCylinderChainStepKernel::advancePack(ContextImpl& context, int pack, StepSettings settings,
        int count, long long& divided) {
    ReferencePlatform::PlatformData& data = extractData(context);
    const ChainEngine& engine = chainKernel->getEngine();
    const double* box = chainKernel->getBox(context);
    double* forces = &(*data.forces)[0][0];
    const ParticleRange particles = engine.getParticles(pack);
    for (int particle : particles)
        if (particle >= 0)
            newPositions[particle] = (*data.positions)[particle];
    vector<vector<SegmentForces> >* const segmentForces = settings.segmentForces;
    for (int done = 0; done < count; done++, settings.step++) {
        settings.segmentForces = (done == count-1 ? segmentForces : NULL);
        const double* positions = &newPositions[0][0];
        engine.clearForces(pack, forces);
        if (!isImplicit(settings.scheme))
            engine.addForces(pack, positions, forces, box, false);
        const Instability instability = engine.step(pack, positions, forces, box, settings, &displacements[0][0]);
        if (instability.chain != -1)
            return done;
        divided += instability.divided;
        for (int particle : particles)
            if (particle >= 0)
                newPositions[particle] += displacements[particle];
    }
    for (int particle : particles)
        if (particle >= 0 && count > 0)
            (*data.velocities)[particle] = displacements[particle]/settings.stepSize;
    return count;
}

void ReferenceIntegrateCylinderChainStepKernel::displaceChains(ContextImpl& context, const StepSettings& settings,
        long long& divided) {
    ReferencePlatform::PlatformData& data = extractData(context);
    const ChainEngine& engine = chainKernel->getEngine();
    const double* positions = &(*data.positions)[0][0];
    const double* forces = &(*data.forces)[0][0];
    const double* box = chainKernel->getBox(context);
    const vector<int> packs = engine.getPacksOfStep(settings);
    vector<Instability> instabilities(packs.size());
    loop.run(packs.size(), [&] (int i) {
        instabilities[i] = engine.step(packs[i], positions, forces, box, settings, &displacements[0][0]);
        for (int particle : engine.getParticles(packs[i]))
            if (particle >= 0) {
                newPositions[particle] = (*data.positions)[particle]+displacements[particle];
                (*data.velocities)[particle] = displacements[particle]/settings.stepSize;
            }
    });

    // Whatever the order of packs, report the first chain.

    Instability first;
    for (const Instability& instability : instabilities)
        if (instability.chain != -1 && (first.chain == -1 || instability.chain < first.chain))
            first = instability;
    if (first.chain != -1)
        reportInstability(context, first, settings);
    for (const Instability& instability : instabilities)
        divided += instability.divided;
    mixedChains = engine.getNumMixedChains(packs);
}

void ReferenceIntegrateCylinderChainStepKernel::reportInstability(ContextImpl& context, const Instability& found,
        const StepSettings& settings) const {
    const vector<Vec3>& positions = *extractData(context).positions;
    const vector<Vec3>& forces = *extractData(context).forces;
    const Chain& culprit = chainKernel->getChains()[found.chain];
    const vector<int>& nodes = culprit.nodes;
    stringstream message;
    message << "Chain " << found.chain << " has blown up at segment ";
    message.precision(3);

    // A force that is not finite spoils the whole chain, so look for where it acts.

    int segment = 0;
    while (segment < (int) nodes.size() && isFinite(positions[nodes[segment]]) && isFinite(forces[nodes[segment]]))
        segment++;
    if (segment < (int) nodes.size()) {
        message << max(segment-1, 0) << " in step " << settings.step+1 <<
                ": the force on it, or its position, is not finite";
    }
    else {
        // An excessive force moves its neighbors as well, so choose the segment with the greatest.

        double greatest = -1, change = 0;
        for (int i = 0; i < (int) culprit.segments.size(); i++) {
            const int first = nodes[i], second = nodes[(i+1)%nodes.size()];
            const double length = norm(displacements[second]-displacements[first]);
            const double force = norm(forces[first])+norm(forces[second]);
            if (!(length < culprit.segments[i].restLength) && force > greatest) {
                greatest = force;
                segment = i;
                change = length;
            }
        }
        // Where no segment changes that much, one leaves the range of its FENE potential.

        const bool leavesRange = (greatest < 0 && !isImplicit(settings.scheme));
        if (leavesRange)
            segment = found.segment;
        message << segment << " in step " << settings.step+1 << ": ";
        if (isImplicit(settings.scheme))
            message << "the equations of the implicit scheme cannot be solved";
        else if (leavesRange) {
            const int first = nodes[segment], second = nodes[(segment+1)%nodes.size()];
            Vec3 between = positions[second]-positions[first];
            const double* box = chainKernel->getBox(context);
            if (box != NULL)
                takeToNearestImage(&between[0], box);
            message.precision(6);
            message << "it would be " << norm(between+displacements[second]-displacements[first]) <<
                    " nm long after it, and " << describeRange(culprit.segments[segment]);
        }
        else
            message << "its ends would move by " << change << " nm against each other in one step";
    }
    message << ". Positions are those before this step. "
            "Use a smaller time step, or look for overlapping particles or excessive forces.";
    throw OpenMMException(message.str());
}

void ReferenceIntegrateCylinderChainStepKernel::displaceOthers(ContextImpl& context, const StepSettings& settings,
        double friction) {
    const vector<Vec3>& forces = *extractData(context).forces;
    const int numBlocks = (others.size()+BLOCK_SIZE-1)/BLOCK_SIZE;
    loop.run(numBlocks, [&] (int block) {
        displaceBlock(block, *extractData(context).positions, forces, settings, friction);
    });
    checkOthers(settings.step);
}

static Vec3 velocityOf(const BackgroundFlow& flow, const Vec3& x) {
    const double position[] = {x[0], x[1], x[2]};
    double velocity[3];
    flow.getVelocity(position, velocity);
    return {velocity[0], velocity[1], velocity[2]};
}

void ReferenceIntegrateCylinderChainStepKernel::displaceBlock(int block, const vector<Vec3>& positions,
        const vector<Vec3>& forces, const StepSettings& settings, double friction) {
    const int start = block*BLOCK_SIZE;
    const int end = min((int) others.size(), start+BLOCK_SIZE);
    const uint32_t noChains[BLOCK_SIZE] = {};
    uint32_t particles[BLOCK_SIZE];
    double gaussian[4*BLOCK_SIZE];
    copy(others.begin()+start, others.begin()+end, particles);
    drawNormals({(uint32_t) settings.seed, (uint32_t) settings.level, settings.step}, NoiseKind::Particle, noChains,
            particles, end-start, gaussian);
    for (int i = start; i < end; i++) {
        const int particle = others[i];
        const double own = particleFrictions[particle];
        const double mobility = 1/(own > 0 ? own : friction*masses[particle]);
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

void ReferenceIntegrateCylinderChainStepKernel::checkOthers(uint64_t step) const {
    for (int particle : others)
        if (!isFinite(displacements[particle]))
            throw OpenMMException("Particle "+to_string(particle)+", outside chains, has blown up in step "+
                    to_string(step+1)+": the force on it is not finite. Positions are those before this step. "
                    "Use a smaller time step, or look for overlapping particles.");
}
