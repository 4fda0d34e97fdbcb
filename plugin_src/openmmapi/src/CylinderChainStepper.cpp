#include "openmm/internal/CylinderChainStepper.h"
#include "beams/BeamEngine.h"
#include "mechanics/BrokenSegment.h"
#include "mechanics/PeriodicBox.h"
#include "openmm/CylinderChainException.h"
#include "openmm/CylinderChainKernels.h"
#include "openmm/internal/CylinderChainBindingForceImpl.h"
#include "openmm/reference/SimTKOpenMMRealType.h"
#include <algorithm>
#include <cmath>
#include <sstream>

using namespace OpenMM;
using namespace cylchain;
using namespace std;

static double norm(const Vec3& v) {
    return sqrt(v.dot(v));
}

/** How far particles of a rigid body may be from where they belong, as positions are set: rounded, as in a file. */
static const double LARGEST_DEFORMATION = 0.01;

static Kernel createKernel(ContextImpl& context, CylinderChainForceImpl& force, const OtherParticles& others) {
    Kernel kernel = context.getPlatform().createKernel(IntegrateCylinderChainStepKernel::Name(), context);
    kernel.getAs<IntegrateCylinderChainStepKernel>().initialize(context.getSystem(), force.getDescription(),
            others, force.getKernel().getAs<CalcCylinderChainForceKernel>());
    return kernel;
}

static vector<int> findMobileParticles(const ChainList& chains, const OtherParticles& others) {
    vector<int> mobile = others.getMobile();
    for (int number = 0; number < chains.size(); number++)
        chains.visit(number, [&] (const auto& chain) {
            for (size_t i = 0; i < chain.fixed.size(); i++)
                if (!chain.fixed[i])
                    mobile.push_back(chain.getParticles()[i]);
        });
    for (const RigidBody& body : others.getBodies())
        mobile.insert(mobile.end(), body.particles.begin(), body.particles.end());
    sort(mobile.begin(), mobile.end());
    return mobile;
}

/** Whether a System has a periodic force, or another box than the cube of 2 nm that OpenMM gives to each. */
static bool isPeriodic(const System& system) {
    Vec3 box[3];
    system.getDefaultPeriodicBoxVectors(box[0], box[1], box[2]);
    return system.usesPeriodicBoundaryConditions() || box[0] != Vec3(2, 0, 0) || box[1] != Vec3(0, 2, 0) ||
            box[2] != Vec3(0, 0, 2);
}

static const CylinderChainGrowthForceImpl* findGrowth(ContextImpl& context) {
    for (const ForceImpl* impl : context.getForceImpls())
        if (dynamic_cast<const CylinderChainGrowthForceImpl*>(impl) != NULL)
            return dynamic_cast<const CylinderChainGrowthForceImpl*>(impl);
    return NULL;
}

CylinderChainStepper::CylinderChainStepper(ContextImpl& context, const CylinderChainIntegrator& integrator,
        CylinderChainForceImpl& force) : context(context), integrator(integrator), force(force),
        chains(force.getDescription()),
        growth(findGrowth(context)), others(context.getSystem(), integrator, chains), couplings(context, others),
        kernel(createKernel(context, force, others)),
        explicitWork(getKernel().getLoop()), periodic(isPeriodic(context.getSystem())), recorded(false) {
    if (isImplicit(static_cast<Scheme>(integrator.getScheme())))
        couplings.refuseBox(chains);
    couplings.refuseChains(chains);
    explicitWork.initialize(findMobileParticles(chains.getList(), others));
}

IntegrateCylinderChainStepKernel& CylinderChainStepper::getKernel() {
    return kernel.getAs<IntegrateCylinderChainStepKernel>();
}

vector<Vec3> CylinderChainStepper::getPositions() const {
    vector<Vec3> positions;
    context.getPositions(positions);
    return positions;
}

void CylinderChainStepper::getBox(double* box) const {
    Vec3 vectors[3];
    context.getPeriodicBoxVectors(vectors[0], vectors[1], vectors[2]);
    for (int i = 0; i < 3; i++)
        for (int k = 0; k < 3; k++)
            box[3*i+k] = vectors[i][k];
}

BackgroundFlow CylinderChainStepper::describeFlow() {
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
    if (periodic && flow.present) {
        getBox(box);
        flow.box = box;
    }
    return flow;
}

int CylinderChainStepper::getCoupledGroups() const {
    const int groups = integrator.getIntegrationForceGroups();
    const bool includesChains = (groups&(1<<chains.getForceGroup())) != 0;
    const bool couples = includesChains && isImplicit(static_cast<Scheme>(integrator.getScheme()));
    return couples ? groups & ~integrator.getExplicitForceGroups() : 0;
}

StepSettings CylinderChainStepper::describeStep(uint64_t seed, int level, uint64_t step) {
    StepSettings settings;
    const bool includesChains = (integrator.getIntegrationForceGroups()&(1<<chains.getForceGroup())) != 0;
    // The entries of both enumerations are those of one list.
    settings.scheme = static_cast<Scheme>(integrator.getScheme());
    if (computesChainForces(settings.scheme) && !includesChains)
        settings.scheme = Scheme::Midpoint;
    if (settings.scheme == Scheme::Modes)
        chains.requireModes();
    settings.kT = BOLTZ*integrator.getTemperature();
    refuseBeams(settings.scheme, settings.kT);
    if (!others.getBodies().empty() && settings.scheme != Scheme::Implicit)
        throw OpenMMException("CylinderChainIntegrator: Rigid bodies are for scheme Implicit alone, with the force "
                "group of the CylinderChainForce among the integration force groups");
    settings.stepSize = integrator.getStepSize();
    settings.seed = seed;
    settings.level = level;
    settings.step = step;
    settings.flow = describeFlow();
    settings.precision = static_cast<Precision>(integrator.getPrecision());
    if (force.hasTwist()) {
        if (settings.scheme != Scheme::Implicit)
            throw OpenMMException("CylinderChainIntegrator: Twist is for scheme Implicit alone, with the force group "
                    "of the CylinderChainForce among the integration force groups");
        settings.twists = &force.getTwists();
        describeTurnedPairs(settings);
    }
    return settings;
}

void CylinderChainStepper::describeTurnedPairs(StepSettings& settings) {
    turnedPairs.assign(chains.getChains().size(), {});
    for (const ForceImpl* impl : context.getForceImpls()) {
        const auto* linkers = dynamic_cast<const CylinderChainBindingForceImpl*>(impl);
        if (linkers != NULL && linkers->addTurnedPairs(turnedPairs))
            settings.turnedPairs = &turnedPairs;
    }
}

void CylinderChainStepper::refuseBeams(Scheme scheme, double kT) const {
    if (!chains.getBeams().empty() && scheme != Scheme::Implicit)
        throw OpenMMException("CylinderChainIntegrator: Chains of beam elements are for scheme Implicit alone, with "
                "their force group among the integration force groups");
    for (size_t i = 0; i < chains.getBeams().size(); i++) {
        const double lengths = kT*chains.getBeams()[i].elementLength/chains.getBeams()[i].bendingRigidity;
        if (lengths > BeamEngine::LONGEST_ELEMENT) {
            const int chain = chains.getList().getNumber(ChainKind::BeamElements, i);
            stringstream message;
            message << "The elements of " << chains.getList().getNameInSentence(chain) << " are " << lengths <<
                    " persistence lengths long, and must not be longer than " << BeamEngine::LONGEST_ELEMENT <<
                    ": divide it into more elements";
            throw CylinderChainException(CylinderChainException::ElementTooLong, {chain}, message.str());
        }
    }
}

/** How long the part of a chain that has its particle i is. */
static double getLengthAtRest(const Chain& chain, size_t i) {
    return chain.segments[i].restLength;
}

static double getLengthAtRest(const BeamChain& beam, size_t) {
    return beam.elementLength;
}

static string describePart(ChainKind kind, int part) {
    return (kind == ChainKind::BeamElements ? "element " : "segment ")+to_string(part);
}

void CylinderChainStepper::refuseTornChains() const {
    if (!periodic || chains.usesPeriodicBoundaryConditions())
        return;
    const vector<Vec3> positions = getPositions();
    double box[9];
    getBox(box);
    const double half = 0.5*min({box[0], box[4], box[8]});
    for (int number = 0; number < chains.getList().size(); number++)
        chains.getList().visit(number, [&] (const auto& chain) {
            const vector<int>& particles = chain.getParticles();
            const size_t count = particles.size(), parts = chain.closed || count == 0 ? count : count-1;
            for (size_t i = 0; i < parts; i++) {
                const Vec3 between = positions[particles[(i+1)%count]]-positions[particles[i]];
                const double length = norm(between);
                if (length <= max(half, 2*getLengthAtRest(chain, i)))
                    continue;
                double nearest[] = {between[0], between[1], between[2]};
                takeToNearestImage(nearest, box);
                const double shorter = norm(Vec3(nearest[0], nearest[1], nearest[2]));
                if (shorter >= 0.999*length)
                    continue;
                const ChainKind kind = chains.getList().getKind(number);
                const int part = kind == ChainKind::BeamElements ? i/2 : i;
                stringstream message;
                message << chains.getList().getName(number) << " is torn at " << describePart(kind, part) <<
                        ": particles of it are " << length << " nm apart, and " << shorter <<
                        " nm as nearest images. Positions were wrapped into the periodic box particle by particle: "
                        "make chains whole before setting them";
                throw CylinderChainException(CylinderChainException::TornChain, {number, part}, message.str());
            }
        });
}

void CylinderChainStepper::refuseDeformedBodies() const {
    if (others.getBodies().empty())
        return;
    vector<Vec3> positions = getPositions();
    for (size_t i = 0; i < others.getBodies().size(); i++) {
        const RigidBody& body = others.getBodies()[i];
        const double deformation = findDeformation(body, RigidFrameFinder(body).find(body, &positions[0][0]),
                &positions[0][0]);
        if (deformation < LARGEST_DEFORMATION*body.findRadius())
            continue;
        stringstream message;
        message << "Body " << i << " is deformed: a particle of it is " << deformation << " nm from where it belongs. "
                "Set positions of all its particles as they are moved and turned together, not wrapped into a "
                "periodic box one by one";
        throw OpenMMException(message.str());
    }
}

/** Whether a segment can have a length. NaN counts as such, because it has reasons of its own. */
static bool isInRange(const Segment& segment, double length) {
    return !(fabs(length-segment.restLength) >= segment.maximumExtension);
}

static string describeRange(const Segment& segment) {
    stringstream text;
    text << "its FENE potential is finite between " << max(0.0, segment.restLength-segment.maximumExtension) <<
            " and " << segment.restLength+segment.maximumExtension << " nm alone";
    return text.str();
}

static bool anyHasRange(const vector<Chain>& chains) {
    return any_of(chains.begin(), chains.end(), [] (const Chain& chain) {return hasRange(chain.stretching);});
}

void CylinderChainStepper::refuseInfiniteEnergies() const {
    if (!anyHasRange(chains.getChains()))
        return;
    const vector<Vec3> positions = getPositions();
    double box[9];
    getBox(box);
    for (size_t chain = 0; chain < chains.getChains().size(); chain++) {
        const Chain& own = chains.getChains()[chain];
        for (size_t s = 0; s < own.segments.size() && hasRange(own.stretching); s++) {
            Vec3 between = positions[own.nodes[(s+1)%own.nodes.size()]]-positions[own.nodes[s]];
            if (chains.usesPeriodicBoundaryConditions())
                takeToNearestImage(&between[0], box);
            if (isInRange(own.segments[s], norm(between)))
                continue;
            const int number = chains.getList().getNumber(ChainKind::StraightSegments, chain);
            stringstream message;
            message << chains.getList().getName(number) << " is out of range at segment " << s << ": it is " <<
                    norm(between) << " nm long, and " << describeRange(own.segments[s]) << ". Set other positions";
            throw CylinderChainException(CylinderChainException::LengthOutOfRange, {number, (int) s}, message.str());
        }
    }
}

void CylinderChainStepper::takeNoteOfForces(const StepSettings& settings, bool followsOn) {
    const int window = integrator.getWorkWindow();
    const bool watched = (window > 0 && settings.kT > 0);
    workOfStep = (watched && getKernel().sumsWork() ? explicitWork.beginStep(followsOn, settings.kT, window) :
            StepWork());
    getKernel().beginWork(workOfStep);
    if (workOfStep.watched)
        return;
    if (watched)
        explicitWork.beginStep(getKernel().getForces(context), getKernel().getDisplacements(), followsOn, settings.kT,
                window);
    else
        explicitWork.stop();
}

void CylinderChainStepper::step(uint64_t seed, int level, uint64_t step, bool followsOn, bool records,
        long long& divided) {
    StepSettings settings = describeStep(seed, level, step);
    recordForces(settings, records);
    takeNoteOfForces(settings, followsOn);
    if (growth != NULL)
        growth->refuseForces(getKernel().getForces(context));
    const CoupledForces& coupled = couplings.describe(getCoupledGroups(), integrator.getFriction());
    getKernel().displaceOthers(context, settings, integrator.getFriction());
    if (settings.scheme == Scheme::ImplicitSecondOrder)
        couplings.refuseTwoStages(getCoupledGroups());
    const bool moveAlone = coupled.empty() && others.getBodies().empty();
    const Instability found = moveAlone ? getKernel().displaceChains(context, settings) :
            getKernel().displaceCoupledChains(context, settings, coupled);
    if (found.body != -1)
        reportTwist(chains.getList().getNumberOfStep(found.chain), found.body, settings);
    if (found.chain != -1 && found.coupling.force != -1 && areForcesFinite())
        reportCoupling(found.coupling, coupled, settings);
    if (found.chain >= chains.getList().size())
        reportParticle(particleOf(found.chain, coupled), settings);
    if (found.chain != -1)
        reportInstability(chains.getList().getNumberOfStep(found.chain), settings);
    divided += found.divided;
    const int particle = getKernel().findUnstableParticle();
    if (particle != -1)
        reportParticle(particle, settings);

    // Nothing has blown up, so the new positions replace the old ones.

    if (workOfStep.endsWindow) {
        vector<WorkSums> sums;
        getKernel().getWork(sums);
        explicitWork.finish(sums);
    }
    getKernel().move(context, settings);
    couplings.finishStep(getCoupledGroups(), integrator.getIntegrationForceGroups(), settings.stepSize);
    explicitWork.endStep();
    recorded = (settings.segmentForces != NULL);
}

int CylinderChainStepper::stepTogether(uint64_t seed, int level, uint64_t step, int count, bool records,
        long long& divided) {
    if (!others.getMobile().empty() || !others.getBodies().empty())
        return 0;
    explicitWork.interrupt();
    StepSettings settings = describeStep(seed, level, step);
    recordForces(settings, records);

    // If a chain blows up, all of them are taken to the step before.

    long long parts = 0;
    int done = getKernel().advanceChains(context, settings, count, parts);
    if (done < count)
        done = getKernel().advanceChains(context, settings, done, parts);
    divided += parts;
    getKernel().moveAdvanced(context, settings, done);
    recorded = (settings.segmentForces != NULL && done == count);
    return done;
}

void CylinderChainStepper::recordForces(StepSettings& settings, bool records) {
    recorded = false;
    if (!records || !isImplicit(settings.scheme))
        return;
    if (force.hasTwist())
        throw OpenMMException("CylinderChainIntegrator: Tensions of chains with twist are not recorded");
    segmentForces.resize(chains.getChains().size());
    for (size_t chain = 0; chain < segmentForces.size(); chain++)
        segmentForces[chain].resize(chains.getChains()[chain].segments.size());
    settings.segmentForces = &segmentForces;
}

void CylinderChainStepper::getMeanTensions(int chain, vector<double>& tensions, vector<Vec3>& jointForces,
        vector<Vec3>& directions) const {
    if (!recorded)
        throw CylinderChainException(CylinderChainException::NothingRecorded, {chain},
                "No tensions were recorded in the last step: call setRecordsTensions(true) before it, "
                "with an implicit scheme");
    if (chain < 0 || chain >= chains.getList().size() ||
            chains.getList().getKind(chain) != ChainKind::StraightSegments)
        throw OpenMMException("CylinderChainIntegrator: There is no chain of straight segments "+to_string(chain));
    const vector<SegmentForces>& forces = segmentForces[chains.getList().getIndex(chain)];
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

    for (size_t joint = 0; joint < chains.getList().getChain(chain).joints.size(); joint++) {
        const double* before = forces[joint].plus;
        const double* behind = forces[(joint+1)%forces.size()].minus;
        jointForces.push_back(Vec3(behind[0]-before[0], behind[1]-before[1], behind[2]-before[2])*0.5);
    }
}

void CylinderChainStepper::takeExplicitWork(double& work, int& particle, int& steps, int& particles) {
    explicitWork.take(work, particle, steps, particles);
}

int CylinderChainStepper::getNumMixedPrecisionChains() const {
    return kernel.getAs<IntegrateCylinderChainStepKernel>().getNumMixedPrecisionChains();
}

void CylinderChainStepper::reportInstability(int chain, const StepSettings& settings) {
    const long long step = settings.step+1;
    if (chains.getList().getKind(chain) == ChainKind::BeamElements)
        throw CylinderChainException(CylinderChainException::UnstableChain, {chain, -1, -1, step},
                chains.getList().getName(chain)+" has blown up in step "+to_string(step)+": its equations cannot be "
                "solved. Positions are those before this step. Use a smaller time step, or look for excessive forces.");
    const Chain& culprit = chains.getList().getChain(chain);
    vector<Vec3> positions = getPositions(), forces = getKernel().getForces(context);
    vector<Vec3> displacements = getKernel().getDisplacements();
    double box[9];
    getBox(box);
    const BrokenSegment broken = findBrokenSegment(culprit, &positions[0][0], &forces[0][0], &displacements[0][0],
            chains.usesPeriodicBoundaryConditions() ? box : NULL, isImplicit(settings.scheme));
    stringstream message;
    message << chains.getList().getName(chain) << " has blown up at segment " << broken.segment << " in step " <<
            step << ": ";
    switch (broken.reason) {
        case BrokenSegment::NotFinite:
            message << "the force on it, or its position, is not finite";
            break;
        case BrokenSegment::NotSolved:
            message << "the equations of the implicit scheme cannot be solved";
            break;
        case BrokenSegment::LeavesRange:
            message << "it would be " << broken.value << " nm long after it, and " <<
                    describeRange(culprit.segments[broken.segment]);
            break;
        case BrokenSegment::MovesTooFar:
            message.precision(3);
            message << "its ends would move by " << broken.value << " nm against each other in one step";
            break;
    }
    message << ". Positions are those before this step. "
            "Use a smaller time step, or look for overlapping particles or excessive forces.";
    throw CylinderChainException(CylinderChainException::UnstableChain, {chain, broken.segment, -1, step},
            message.str());
}

void CylinderChainStepper::reportTwist(int chain, int body, const StepSettings& settings) {
    const long long step = settings.step+1;
    stringstream message;
    message << "The twist of " << chains.getList().getName(chain) << " would turn body " << body <<
            ", which carries the frame at its end, by more than a hundred times itself in step " << step <<
            " of " << settings.stepSize << " ps. Use a shorter step: recommended_time_step knows how short.";
    throw CylinderChainException(CylinderChainException::UnstableChain, {chain, -1, -1, step}, message.str());
}

bool CylinderChainStepper::areForcesFinite() {
    const vector<Vec3>& forces = getKernel().getForces(context);
    return all_of(forces.begin(), forces.end(), [] (const Vec3& force) {return isfinite(norm(force));});
}

/** The particle, or the first one of the rigid body, that is counted behind chains. */
int CylinderChainStepper::particleOf(int number, const CoupledForces& coupled) const {
    const int behind = number-chains.getList().size(), numBodies = others.getBodies().size();
    return behind < numBodies ? others.getBodies()[behind].particles[0] : coupled.particles[behind-numBodies].particle;
}

void CylinderChainStepper::reportCoupling(const BrokenCoupling& coupling, const CoupledForces& coupled,
        const StepSettings& settings) {
    const ChainList& list = chains.getList();
    auto isPart = [&] (const BrokenCoupling::Place& place) {return place.chain >= 0 && place.chain < list.size();};
    auto particleAt = [&] (const BrokenCoupling::Place& place) {
        return place.chain < list.size() ? -1 : particleOf(place.chain, coupled);
    };
    auto describe = [&] (const BrokenCoupling::Place& place) {
        if (!isPart(place)) {
            const int particle = particleAt(place);
            return particle < 0 ? string("what does not move") : "particle "+to_string(particle);
        }
        const int chain = list.getNumberOfStep(place.chain);
        return describePart(list.getKind(chain), place.segment)+" of "+list.getNameInSentence(chain);
    };

    // The first one is a segment, or at least a particle.

    BrokenCoupling::Place first = coupling.places[0], second = coupling.places[1];
    if (!isPart(first) && (isPart(second) || first.chain < 0))
        swap(first, second);
    CylinderChainException::Place place;
    place.step = settings.step+1;
    place.particle = particleAt(isPart(first) ? second : first);
    stringstream message;
    if (isPart(first)) {
        place.chain = list.getNumberOfStep(first.chain);
        place.segment = first.segment;
        message << list.getName(place.chain) << " has blown up at " <<
                describePart(list.getKind(place.chain), place.segment);
    }
    else
        message << "Particle " << place.particle << ", outside filaments, has blown up";
    if (isPart(second)) {
        place.otherChain = list.getNumberOfStep(second.chain);
        place.otherSegment = second.segment;
    }
    message << " in step " << place.step << ": ";
    CouplingForceImpl& force = couplings.getForce(coupling);
    message << force.describeFailure(coupling, describe(second));
    place.link = coupling.link;
    message << " (" << force.getOwner().getName() << "). Positions are those before this step. "
            "Use a smaller time step, or look for overlapping particles or excessive forces.";
    throw CylinderChainException(place.chain >= 0 ? CylinderChainException::UnstableChain :
            CylinderChainException::UnstableParticle, place, message.str());
}

void CylinderChainStepper::reportParticle(int particle, const StepSettings& settings) const {
    const long long step = settings.step+1;
    throw CylinderChainException(CylinderChainException::UnstableParticle, {-1, -1, particle, step},
            "Particle "+to_string(particle)+", outside filaments, has blown up in step "+to_string(step)+
            ": the force on it is not finite. Positions are those before this step. "
            "Use a smaller time step, or look for overlapping particles.");
}
