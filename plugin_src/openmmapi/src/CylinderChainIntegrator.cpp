#include "openmm/CylinderChainIntegrator.h"
#include "dynamics/ChainEngine.h"
#include "openmm/Context.h"
#include "openmm/CylinderChainKernels.h"
#include "openmm/OpenMMException.h"
#include <algorithm>
#include "openmm/internal/CheckpointValues.h"
#include "openmm/internal/ContextImpl.h"
#include "openmm/internal/CylinderChainForceImpl.h"
#include "openmm/internal/CylinderChainStepper.h"
#include "openmm/internal/OSRngSeed.h"
#include "openmm/serialization/SerializationNode.h"
#include <cmath>
#include <istream>
#include <optional>
#include <ostream>

using namespace OpenMM;
using namespace std;

/** Of checkpoints, and of what States hold; none but these are read. */
static const int CHECKPOINT_VERSION = 9, STATE_VERSION = 8;

/**
 * How many steps are taken between looks at anything but chains.
 */
static const int STEPS_TOGETHER = 32;

static CylinderChainForceImpl& findChains(ContextImpl& context) {
    CylinderChainForceImpl* found = NULL;
    for (ForceImpl* impl : context.getForceImpls()) {
        CylinderChainForceImpl* chains = dynamic_cast<CylinderChainForceImpl*>(impl);
        if (chains != NULL) {
            if (found != NULL)
                throw OpenMMException("The System contains multiple CylinderChainForces: put all chains into one");
            found = chains;
        }
    }
    if (found == NULL)
        throw OpenMMException("The System does not contain a CylinderChainForce");
    return *found;
}

CylinderChainIntegrator::CylinderChainIntegrator(double temperature, double frictionCoeff, double stepSize) :
        scheme(Implicit), precision(Automatic), pathLevel(0), noiseLevel(0), noiseSeed(0), stepsTaken(0),
        countAfterSteps(0), dividedSteps(0), workWindow(0), explicitGroups(0), positionsHaveChanged(true),
        followsOn(false), recordsTensions(false), chains(NULL) {
    setTemperature(temperature);
    setFriction(frictionCoeff);
    setStepSize(stepSize);
    setConstraintTolerance(1e-5);
    setRandomNumberSeed(0);
}

vector<string> CylinderChainIntegrator::getSchemeNames() {
    return cylchain::namesOf<cylchain::Scheme>();
}

vector<string> CylinderChainIntegrator::getPrecisionNames() {
    return cylchain::namesOf<cylchain::Precision>();
}

void CylinderChainIntegrator::initialize(ContextImpl& contextRef) {
    if (owner != NULL && &contextRef.getOwner() != owner)
        throw OpenMMException("This Integrator is already bound to a context");
    const System& system = contextRef.getSystem();
    CylinderChainForceImpl& found = findChains(contextRef);
    checkSystem(system, found);
    // A Context that is refused here does not exist afterwards.
    stepper.reset(new CylinderChainStepper(contextRef, *this, found));
    chains = &found;
    context = &contextRef;
    owner = &contextRef.getOwner();
    chainsAreAlone = (contextRef.getForceImpls().size() == 1);
    noiseSeed = (uint32_t) (randomNumberSeed == 0 ? osrngseed() : randomNumberSeed);
    noiseLevel = pathLevel;
    stepsTaken = 0;
    countAfterSteps = 0;
    dividedSteps = 0;
}

void CylinderChainIntegrator::checkSystem(const System& system, const CylinderChainForceImpl& chains) const {
    if (!(getStepSize() > 0 && isfinite(getStepSize())))
        throw OpenMMException("CylinderChainIntegrator: The step size must be positive");
    if (system.getNumConstraints() > 0) {
        int particle1, particle2;
        double distance;
        system.getConstraintParameters(0, particle1, particle2, distance);
        throw OpenMMException("CylinderChainIntegrator does not support constraints, but there is one between "
                "particles "+to_string(particle1)+" and "+to_string(particle2));
    }
    const CylinderChainForce& force = chains.getOwner();
    vector<bool> isNode(system.getNumParticles(), false);
    for (int chain = 0; chain < force.getNumChains(); chain++) {
        bool mobile = false;
        for (int particle : force.getChainParticles(chain)) {
            if (system.isVirtualSite(particle))
                throw OpenMMException("Particle "+to_string(particle)+" is a node of chain "+to_string(chain)+
                        " and cannot be a virtual site");
            isNode[particle] = true;
            mobile = (mobile || system.getParticleMass(particle) != 0.0);
        }
        if (!mobile)
            throw OpenMMException("All nodes of chain "+to_string(chain)+" are massless: "
                    "at least one must be free to move");
    }
    for (auto& entry : particleFrictions) {
        if (entry.first < 0 || entry.first >= system.getNumParticles())
            throw OpenMMException("CylinderChainIntegrator: Illegal particle index: "+to_string(entry.first));
        if (isNode[entry.first])
            throw OpenMMException("Particle "+to_string(entry.first)+
                    " is a node of a chain and cannot have a friction coefficient of its own");
    }
    checkBodies(system, force.getBodies(), isNode);
    vector<bool> ofBody(system.getNumParticles(), false);
    for (const cylchain::RigidBody& body : force.getBodies())
        for (int particle : body.particles)
            ofBody[particle] = true;
    for (int particle = 0; particle < system.getNumParticles() && friction == 0; particle++)
        if (!isNode[particle] && !ofBody[particle] && system.getParticleMass(particle) != 0.0 &&
                particleFrictions.count(particle) == 0)
            throw OpenMMException("CylinderChainIntegrator: Particle "+to_string(particle)+" is outside chains and can "
                    "move, but has no friction coefficient. If it was added, or was given a mass, after "
                    "Filaments.create_integrator, call that when the System is complete, with its particle_friction");
}

void CylinderChainIntegrator::checkBodies(const System& system, const vector<cylchain::RigidBody>& bodies,
        const vector<bool>& isNode) const {
    for (size_t i = 0; i < bodies.size(); i++)
        for (int particle : bodies[i].particles) {
            const string name = "Particle "+to_string(particle)+" of body "+to_string(i);
            if (particle >= system.getNumParticles())
                throw OpenMMException("CylinderChainIntegrator: Illegal particle index: "+to_string(particle));
            if (isNode[particle])
                throw OpenMMException(name+" is a node of a chain");
            if (system.isVirtualSite(particle) || system.getParticleMass(particle) == 0.0)
                throw OpenMMException(name+" cannot move: give it a mass, and no virtual site");
            if (particleFrictions.count(particle) != 0)
                throw OpenMMException(name+" cannot have a friction coefficient of its own");
        }
}

void CylinderChainIntegrator::setTemperature(double temp) {
    if (!(temp >= 0 && isfinite(temp)))
        throw OpenMMException("Temperature cannot be negative");
    temperature = temp;
}

void CylinderChainIntegrator::setFriction(double coeff) {
    if (!(coeff >= 0 && isfinite(coeff)))
        throw OpenMMException("Friction cannot be negative");
    friction = coeff;
}

void CylinderChainIntegrator::setParticleFriction(int particle, double coeff) {
    if (particle < 0)
        throw OpenMMException("CylinderChainIntegrator: Illegal particle index: "+to_string(particle));
    if (!(coeff > 0 && isfinite(coeff)))
        throw OpenMMException("Friction must be positive");
    particleFrictions[particle] = coeff;
}

void CylinderChainIntegrator::setScheme(Scheme scheme) {
    if (!cylchain::isEntry<cylchain::Scheme>(scheme))
        throw OpenMMException("CylinderChainIntegrator: Illegal scheme: "+to_string((int) scheme));
    this->scheme = scheme;
}

void CylinderChainIntegrator::setPrecision(Precision precision) {
    if (!cylchain::isEntry<cylchain::Precision>(precision))
        throw OpenMMException("CylinderChainIntegrator: Illegal precision: "+to_string((int) precision));
    this->precision = precision;
}

int CylinderChainIntegrator::getNumMixedPrecisionChains() const {
    if (context == NULL)
        throw OpenMMException("This Integrator is not bound to a context!");
    return stepper->getNumMixedPrecisionChains();
}

int CylinderChainIntegrator::getLargestPathLevel() {
    return cylchain::LARGEST_LEVEL;
}

void CylinderChainIntegrator::setPathLevel(int level) {
    if (level < 0 || level > getLargestPathLevel())
        throw OpenMMException("CylinderChainIntegrator: The path level must be between 0 and "+
                to_string(getLargestPathLevel())+", but is "+to_string(level));
    pathLevel = level;
}

void CylinderChainIntegrator::getFlow(Vec3& velocity, Vec3& gradientX, Vec3& gradientY, Vec3& gradientZ,
        Vec3& origin) const {
    velocity = flowVelocity;
    gradientX = flowGradient[0];
    gradientY = flowGradient[1];
    gradientZ = flowGradient[2];
    origin = flowOrigin;
}

void CylinderChainIntegrator::setFlow(const Vec3& velocity, const Vec3& gradientX, const Vec3& gradientY,
        const Vec3& gradientZ, const Vec3& origin) {
    for (const Vec3& vector : {velocity, gradientX, gradientY, gradientZ, origin})
        for (int i = 0; i < 3; i++)
            if (!isfinite(vector[i]))
                throw OpenMMException("CylinderChainIntegrator: The flow must be finite");
    flowVelocity = velocity;
    flowGradient[0] = gradientX;
    flowGradient[1] = gradientY;
    flowGradient[2] = gradientZ;
    flowOrigin = origin;
}

void CylinderChainIntegrator::setWorkWindow(int steps) {
    if (steps < 0)
        throw OpenMMException("CylinderChainIntegrator: The window for the work of forces must not be negative, "
                "but is "+to_string(steps));
    workWindow = steps;
}

void CylinderChainIntegrator::takeExplicitWork(double& work, int& particle, int& steps, int& particles) {
    if (context == NULL)
        throw OpenMMException("This Integrator is not bound to a context!");
    stepper->takeExplicitWork(work, particle, steps, particles);
}

void CylinderChainIntegrator::getMeanTensions(int chain, vector<double>& tensions, vector<Vec3>& jointForces,
        vector<Vec3>& directions) const {
    if (context == NULL)
        throw OpenMMException("This Integrator is not bound to a context!");
    stepper->getMeanTensions(chain, tensions, jointForces, directions);
}

void CylinderChainIntegrator::stateChanged(State::DataType changed) {
    followsOn = false;
    if (changed == State::Positions)
        positionsHaveChanged = true;
}

void CylinderChainIntegrator::cleanup() {
    stepper.reset();
}

vector<string> CylinderChainIntegrator::getKernelNames() {
    return {IntegrateCylinderChainStepKernel::Name()};
}

double CylinderChainIntegrator::computeKineticEnergy() {
    return 0.0;
}

bool CylinderChainIntegrator::kineticEnergyRequiresForce() const {
    return false;
}

void CylinderChainIntegrator::step(int steps) {
    if (context == NULL)
        throw OpenMMException("This Integrator is not bound to a context!");
    if (positionsHaveChanged) {
        stepper->refuseTornChains();
        stepper->refuseDeformedBodies();
        stepper->refuseInfiniteEnergies();
        positionsHaveChanged = false;
    }
    stepsTaken = findNextStep();
    countAfterSteps = context->getStepCount();
    const bool includesChains = (getIntegrationForceGroups()&(1<<chains->getOwner().getForceGroup())) != 0;
    for (int done = 0; done < steps;) {
        // A parameter of the Context counts the steps of linkers: that alone changes nothing.

        const bool follows = followsOn;
        followsOn = !context->updateContextState() && follows;

        // Where there are only chains, several steps are taken at once.  The first one is not among them, because
        // OpenMM checks that positions have been set, nor is one that blows up.

        if (done > 0 && chainsAreAlone && includesChains) {
            const int count = min(steps-done, STEPS_TOGETHER);
            const int taken = stepper->stepTogether(noiseSeed, noiseLevel, stepsTaken, count,
                    recordsTensions && done+count == steps, dividedSteps);
            stepsTaken += taken;
            countAfterSteps = context->getStepCount();
            done += taken;
            if (taken == count)
                continue;
        }
        {
            // Most schemes compute the forces of the chains themselves, and implicit ones those of links and contacts.

            optional<StepForceImpl::Exclusion> exclusion;
            if (computesChainForces(static_cast<cylchain::Scheme>(scheme)))
                exclusion.emplace(*chains);
            ChainCouplings::Exclusion couplings(stepper->getCouplings(), stepper->getCoupledGroups());
            context->calcForcesAndEnergy(true, false, getIntegrationForceGroups());
        }
        stepper->step(noiseSeed, noiseLevel, stepsTaken, followsOn, recordsTensions && done == steps-1, dividedSteps);
        followsOn = true;
        stepsTaken++;
        countAfterSteps = context->getStepCount();
        done++;
    }
}

uint64_t CylinderChainIntegrator::findNextStep() const {
    if (context == NULL || countAfterSteps == -1 || countAfterSteps == context->getStepCount())
        return stepsTaken;

    // The step count was set, by itself or with a State that has no parameters of an Integrator. No noise may come
    // twice.

    return max(stepsTaken, (uint64_t) max(0LL, context->getStepCount()));
}

void CylinderChainIntegrator::createCheckpoint(ostream& stream) const {
    const int version = CHECKPOINT_VERSION;
    stream.write((const char*) &version, sizeof(version));
    stream.write((const char*) &noiseLevel, sizeof(noiseLevel));
    stream.write((const char*) &noiseSeed, sizeof(noiseSeed));
    const uint64_t steps = findNextStep();
    stream.write((const char*) &steps, sizeof(steps));
    const Vec3 flow[] = {flowVelocity, flowGradient[0], flowGradient[1], flowGradient[2], flowOrigin};
    stream.write((const char*) flow, sizeof(flow));
    stepper->getCouplings().writeStates(stream);
}

void CylinderChainIntegrator::loadCheckpoint(istream& stream) {
    int version = 0, level = 0;
    uint64_t seed = 0, steps = 0;
    stream.read((char*) &version, sizeof(version));
    stream.read((char*) &level, sizeof(level));
    stream.read((char*) &seed, sizeof(seed));
    stream.read((char*) &steps, sizeof(steps));
    Vec3 flow[5];
    stream.read((char*) flow, sizeof(flow));
    if (!stream || version != CHECKPOINT_VERSION || level < 0 || level > getLargestPathLevel())
        throw OpenMMException("loadCheckpoint: Checkpoint was not created with this version of "
                "CylinderChainIntegrator");
    stepper->getCouplings().readStates(stream);
    setFlow(flow[0], flow[1], flow[2], flow[3], flow[4]);
    noiseLevel = level;
    noiseSeed = seed;
    stepsTaken = steps;
    countAfterSteps = -1;
}

void CylinderChainIntegrator::serializeParameters(SerializationNode& node) const {
    node.setIntProperty("version", STATE_VERSION);
    node.setIntProperty("pathLevel", noiseLevel);
    node.setLongProperty("stepsTaken", findNextStep());
    const Vec3 flow[] = {flowVelocity, flowGradient[0], flowGradient[1], flowGradient[2], flowOrigin};
    for (const Vec3& vector : flow)
        node.createChildNode("Flow").setDoubleProperty("x", vector[0]).setDoubleProperty("y", vector[1])
                .setDoubleProperty("z", vector[2]);
    if (context != NULL)
        stepper->getCouplings().writeStates(node);
}

void CylinderChainIntegrator::deserializeParameters(const SerializationNode& node) {
    if (node.getIntProperty("version") != STATE_VERSION)
        throw OpenMMException("Unsupported version number");

    // The same time on the path, or the next step after it.

    const int level = node.getIntProperty("pathLevel");
    if (level < 0 || level > getLargestPathLevel())
        throw OpenMMException("Illegal path level: "+to_string(level));
    if (context != NULL)
        stepper->getCouplings().readStates(node);
    stepsTaken = node.getLongProperty("stepsTaken");
    countAfterSteps = -1;
    if (noiseLevel >= level)
        stepsTaken <<= noiseLevel-level;
    else
        stepsTaken = (stepsTaken+(1ULL<<(level-noiseLevel))-1)>>(level-noiseLevel);
    vector<Vec3> flow;
    for (const SerializationNode& child : node.getChildren())
        if (child.getName() == "Flow")
            flow.push_back(Vec3(child.getDoubleProperty("x"), child.getDoubleProperty("y"),
                    child.getDoubleProperty("z")));
    if (flow.size() == 5)
        setFlow(flow[0], flow[1], flow[2], flow[3], flow[4]);
}
