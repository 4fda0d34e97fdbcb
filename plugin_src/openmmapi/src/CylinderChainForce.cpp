#include "openmm/CylinderChainForce.h"
#include "openmm/OpenMMException.h"
#include "openmm/internal/AssertionUtilities.h"
#include "openmm/internal/CylinderChainForceImpl.h"
#include <algorithm>
#include <cmath>
#include <set>
#include <string>

using namespace OpenMM;
using namespace std;

static void checkPositive(double value, const char* name) {
    // Written so that NaN fails.

    if (!(value > 0 && isfinite(value)))
        throw OpenMMException(string("CylinderChainForce: ")+name+" must be positive and finite");
}

static void checkNotNegative(double value, const char* name) {
    if (!(value >= 0 && isfinite(value)))
        throw OpenMMException(string("CylinderChainForce: ")+name+" cannot be negative and must be finite");
}

static void checkStiffness(double stiffness) {
    if (!(stiffness >= 0 && isfinite(stiffness)))
        throw OpenMMException("CylinderChainForce: The stiffness of a joint cannot be negative and must be finite");
}

static void refuseParticles(const vector<int>& particles) {
    set<int> distinct;
    for (int particle : particles) {
        if (particle < 0)
            throw OpenMMException("CylinderChainForce: Illegal particle index: "+to_string(particle));
        if (!distinct.insert(particle).second)
            throw OpenMMException("CylinderChainForce: Particle "+to_string(particle)+" appears twice in a chain");
    }
}

static void checkPart(int part, int count, const char* what, int chain) {
    if (part < 0 || part >= count)
        throw OpenMMException("CylinderChainForce: Index out of range: there is no "+string(what)+" "+to_string(part)+
                " in chain "+to_string(chain));
}

static OpenMMException twoTethers(int chain, int node) {
    return OpenMMException("CylinderChainForce: Node "+to_string(node)+" of chain "+to_string(chain)+
            " cannot have two tethers");
}

CylinderChainForce::CylinderChainForce() : usePeriodic(false) {
}

vector<string> CylinderChainForce::getBendingModelNames() {
    return cylchain::namesOf<cylchain::BendingModel>();
}

vector<string> CylinderChainForce::getStretchingModelNames() {
    return cylchain::namesOf<cylchain::StretchingModel>();
}

void CylinderChainForce::checkIndex(int chain) const {
    if (chain < 0 || chain >= chains.size())
        throw OpenMMException("CylinderChainForce: Index out of range: there is no chain "+to_string(chain));
}

void CylinderChainForce::checkKind(int chain, cylchain::ChainKind kind) const {
    checkIndex(chain);
    if (chains.getKind(chain) != kind)
        throw OpenMMException("CylinderChainForce: Chain "+to_string(chain)+
                (kind == cylchain::ChainKind::BeamElements ? " has straight segments, not beam elements" :
                " has beam elements, not straight segments"));
}

const cylchain::Chain& CylinderChainForce::getChain(int chain) const {
    checkKind(chain, cylchain::ChainKind::StraightSegments);
    return chains.getChain(chain);
}

cylchain::Chain& CylinderChainForce::getChain(int chain) {
    checkKind(chain, cylchain::ChainKind::StraightSegments);
    return chains.getChain(chain);
}

const cylchain::BeamChain& CylinderChainForce::getBeam(int chain) const {
    checkKind(chain, cylchain::ChainKind::BeamElements);
    return chains.getBeam(chain);
}

static void setParameters(cylchain::Segment& segment, cylchain::StretchingModel model, double restLength,
        double stretchingStiffness, double maximumExtension, double parallelFriction, double perpendicularFriction,
        double rotationalFriction, double extensionalFriction) {
    checkPositive(restLength, "The rest length");
    checkPositive(stretchingStiffness, "The stretching stiffness");
    if (cylchain::hasRange(model))
        checkPositive(maximumExtension, "The maximum extension");
    // Nodes may have the friction that a segment lacks: CylinderChainDescription looks at both.
    checkNotNegative(parallelFriction, "The parallel friction");
    checkNotNegative(perpendicularFriction, "The perpendicular friction");
    checkNotNegative(rotationalFriction, "The rotational friction");
    checkNotNegative(extensionalFriction, "The extensional friction");
    segment = {restLength, stretchingStiffness, maximumExtension, parallelFriction, perpendicularFriction,
            rotationalFriction, extensionalFriction, segment.propulsion};
}

static void setParameters(cylchain::BeamChain& beam, double elementLength, double stretchingModulus,
        double bendingRigidity, double shortening, double parallelFriction, double perpendicularFriction) {
    checkPositive(elementLength, "The length of an element");
    checkPositive(stretchingModulus, "The stretching modulus of a chain of beam elements");
    checkPositive(bendingRigidity, "The bending rigidity of a chain of beam elements");
    checkNotNegative(shortening, "The shortening of an element");
    checkPositive(parallelFriction, "The friction along beam elements");
    checkPositive(perpendicularFriction, "The friction across beam elements");
    beam.elementLength = elementLength;
    beam.stretchingModulus = stretchingModulus;
    beam.bendingRigidity = bendingRigidity;
    beam.shortening = shortening;
    beam.parallelFriction = parallelFriction;
    beam.perpendicularFriction = perpendicularFriction;
}

int CylinderChainForce::addChain(const vector<int>& particles, BendingModel bendingModel,
        StretchingModel stretchingModel, double restLength, double stretchingStiffness, double maximumExtension,
        double jointStiffness, double parallelFriction, double perpendicularFriction, double rotationalFriction,
        double extensionalFriction, bool closed) {
    if (particles.size() < 2)
        throw OpenMMException("CylinderChainForce: A chain must have at least two particles");
    if (closed && particles.size() < 4)
        throw OpenMMException("CylinderChainForce: A closed chain must have at least four particles");
    refuseParticles(particles);
    if (!cylchain::isEntry<cylchain::BendingModel>(bendingModel))
        throw OpenMMException("CylinderChainForce: Illegal bending model: "+to_string((int) bendingModel));
    if (!cylchain::isEntry<cylchain::StretchingModel>(stretchingModel))
        throw OpenMMException("CylinderChainForce: Illegal stretching model: "+to_string((int) stretchingModel));
    checkStiffness(jointStiffness);
    cylchain::Chain chain;
    chain.nodes = particles;
    // The entries of both enumerations are those of one list.
    chain.bending = static_cast<cylchain::BendingModel>(bendingModel);
    chain.stretching = static_cast<cylchain::StretchingModel>(stretchingModel);
    chain.closed = closed;
    cylchain::Segment segment;
    setParameters(segment, chain.stretching, restLength, stretchingStiffness, maximumExtension, parallelFriction,
            perpendicularFriction, rotationalFriction, extensionalFriction);
    chain.segments.assign(closed ? particles.size() : particles.size()-1, segment);
    chain.joints.assign(closed ? particles.size() : particles.size()-2, jointStiffness);
    return chains.add(chain);
}

int CylinderChainForce::addBeamChain(const vector<int>& particles, double elementLength, double stretchingModulus,
        double bendingRigidity, double shortening, double parallelFriction, double perpendicularFriction,
        bool planar, bool closed) {
    if (closed && particles.size() < 6)
        throw OpenMMException("CylinderChainForce: A closed chain of beam elements must have at least three nodes");
    if (particles.size() < 4 || particles.size()%2 != 0)
        throw OpenMMException("CylinderChainForce: A chain of beam elements must have two particles for each of at "
                "least two nodes");
    refuseParticles(particles);
    cylchain::BeamChain beam;
    beam.particles = particles;
    beam.planar = planar;
    beam.closed = closed;
    setParameters(beam, elementLength, stretchingModulus, bendingRigidity, shortening, parallelFriction,
            perpendicularFriction);
    return chains.add(beam);
}

int CylinderChainForce::getChainKind(int chain) const {
    checkIndex(chain);
    return static_cast<int>(chains.getKind(chain));
}

const string& CylinderChainForce::getChainName(int chain) const {
    checkIndex(chain);
    return chains.getName(chain);
}

void CylinderChainForce::setChainName(int chain, const string& name) {
    checkIndex(chain);
    chains.setName(chain, name);
}

const vector<int>& CylinderChainForce::getChainParticles(int chain) const {
    checkIndex(chain);
    return chains.getParticles(chain);
}

bool CylinderChainForce::isChainClosed(int chain) const {
    checkIndex(chain);
    return chains.isClosed(chain);
}

bool CylinderChainForce::isChainPlanar(int chain) const {
    checkIndex(chain);
    return chains.isPlanar(chain);
}

void CylinderChainForce::setChainPlanar(int chain, bool planar) {
    checkIndex(chain);
    chains.visit(chain, [&] (auto& own) {own.planar = planar;});
}

void CylinderChainForce::getBeamChainPropulsion(int chain, double& propulsion) const {
    propulsion = getBeam(chain).propulsion;
}

void CylinderChainForce::setBeamChainPropulsion(int chain, double propulsion) {
    checkKind(chain, cylchain::ChainKind::BeamElements);
    if (!isfinite(propulsion))
        throw OpenMMException("CylinderChainForce: The propulsion of a chain of beam elements must be finite");
    chains.getBeam(chain).propulsion = propulsion;
}

void CylinderChainForce::getBeamChainParameters(int chain, double& elementLength, double& stretchingModulus,
        double& bendingRigidity, double& shortening, double& parallelFriction, double& perpendicularFriction) const {
    const cylchain::BeamChain& beam = getBeam(chain);
    elementLength = beam.elementLength;
    stretchingModulus = beam.stretchingModulus;
    bendingRigidity = beam.bendingRigidity;
    shortening = beam.shortening;
    parallelFriction = beam.parallelFriction;
    perpendicularFriction = beam.perpendicularFriction;
}

void CylinderChainForce::setBeamChainParameters(int chain, double elementLength, double stretchingModulus,
        double bendingRigidity, double shortening, double parallelFriction, double perpendicularFriction) {
    checkKind(chain, cylchain::ChainKind::BeamElements);
    setParameters(chains.getBeam(chain), elementLength, stretchingModulus, bendingRigidity, shortening,
            parallelFriction, perpendicularFriction);
}

void CylinderChainForce::getChainModels(int chain, int& bendingModel, int& stretchingModel) const {
    bendingModel = static_cast<int>(getChain(chain).bending);
    stretchingModel = static_cast<int>(getChain(chain).stretching);
}

double CylinderChainForce::getChainNodeFriction(int chain) const {
    return getChain(chain).nodeFriction;
}

void CylinderChainForce::setChainNodeFriction(int chain, double friction) {
    checkNotNegative(friction, "The friction of nodes");
    getChain(chain).nodeFriction = friction;
}

int CylinderChainForce::getNumSegments(int chain) const {
    return getChain(chain).segments.size();
}

int CylinderChainForce::getNumJoints(int chain) const {
    return getChain(chain).joints.size();
}

void CylinderChainForce::getSegmentParameters(int chain, int segment, double& restLength, double& stretchingStiffness,
        double& maximumExtension, double& parallelFriction, double& perpendicularFriction, double& rotationalFriction,
        double& extensionalFriction) const {
    checkPart(segment, getNumSegments(chain), "segment", chain);
    const cylchain::Segment& own = getChain(chain).segments[segment];
    restLength = own.restLength;
    stretchingStiffness = own.stiffness;
    maximumExtension = own.maximumExtension;
    parallelFriction = own.parallel;
    perpendicularFriction = own.perpendicular;
    rotationalFriction = own.rotational;
    extensionalFriction = own.extensional;
}

void CylinderChainForce::setSegmentParameters(int chain, int segment, double restLength, double stretchingStiffness,
        double maximumExtension, double parallelFriction, double perpendicularFriction, double rotationalFriction,
        double extensionalFriction) {
    checkPart(segment, getNumSegments(chain), "segment", chain);
    cylchain::Chain& own = getChain(chain);
    setParameters(own.segments[segment], own.stretching, restLength, stretchingStiffness, maximumExtension,
            parallelFriction, perpendicularFriction, rotationalFriction, extensionalFriction);
}

void CylinderChainForce::getSegmentPropulsion(int chain, int segment, double& propulsion) const {
    checkPart(segment, getNumSegments(chain), "segment", chain);
    propulsion = getChain(chain).segments[segment].propulsion;
}

void CylinderChainForce::setSegmentPropulsion(int chain, int segment, double propulsion) {
    checkPart(segment, getNumSegments(chain), "segment", chain);
    if (!isfinite(propulsion))
        throw OpenMMException("CylinderChainForce: The propulsion of a segment must be finite");
    getChain(chain).segments[segment].propulsion = propulsion;
}

/** Of joints; segments may turn by less than a right angle in a step. */
static const double LARGEST_REST_BEND = 1.0;

void CylinderChainForce::setChainTwist(int chain, const vector<double>& stiffness, const vector<double>& rest,
        const vector<double>& friction) {
    cylchain::Chain& own = getChain(chain);
    if (friction.empty() && stiffness.empty() && rest.empty()) {
        own.twist = cylchain::ChainTwist();
        return;
    }
    if (friction.size() != own.segments.size() || stiffness.size() != own.joints.size() ||
            rest.size() != own.joints.size())
        throw OpenMMException("CylinderChainForce: Twist needs a stiffness and a rest angle of each joint, and a "
                "friction of each segment");
    for (double value : stiffness)
        if (!(value > 0 && isfinite(value)))
            throw OpenMMException("CylinderChainForce: The stiffness of a joint against twist must be positive");
    for (double value : friction)
        if (!(value > 0 && isfinite(value)))
            throw OpenMMException("CylinderChainForce: The friction of a segment against turning about itself must be "
                    "positive");
    for (double value : rest)
        if (!isfinite(value))
            throw OpenMMException("CylinderChainForce: The twist at rest must be finite");
    own.twist.stiffness = stiffness;
    own.twist.rest = rest;
    own.twist.friction = friction;
}

void CylinderChainForce::getChainTwist(int chain, vector<double>& stiffness, vector<double>& rest,
        vector<double>& friction) const {
    const cylchain::ChainTwist& twist = getChain(chain).twist;
    stiffness = twist.stiffness;
    rest = twist.rest;
    friction = twist.friction;
}

void CylinderChainForce::setChainRestBends(int chain, const vector<double>& bends) {
    cylchain::Chain& own = getChain(chain);
    if (!own.twist.isPresent() && !bends.empty())
        throw OpenMMException("CylinderChainForce: Bends at rest are those of frames, which chains without twist lack");
    if (!bends.empty() && bends.size() != 2*own.joints.size())
        throw OpenMMException("CylinderChainForce: Bends at rest need two components of each joint");
    for (size_t joint = 0; 2*joint < bends.size(); joint++) {
        const double size = hypot(bends[2*joint], bends[2*joint+1]);
        if (!(size <= LARGEST_REST_BEND))
            throw OpenMMException("CylinderChainForce: The bend of a joint at rest must be finite, and not exceed "+
                    to_string(LARGEST_REST_BEND));
    }
    own.twist.bends = bends;
}

void CylinderChainForce::getChainRestBends(int chain, vector<double>& bends) const {
    bends = getChain(chain).twist.bends;
}

static void checkEnd(const cylchain::Chain& chain, int end) {
    if (end != 0 && end != 1)
        throw OpenMMException("CylinderChainForce: The end of a chain must be 0 or 1");
    if (!chain.twist.isPresent() || chain.closed)
        throw OpenMMException("CylinderChainForce: Frames are beyond ends of open chains with twist alone");
}

static OpenMMException onlyHeldFrames() {
    return OpenMMException("CylinderChainForce: A body can carry only an end frame that is held: one with a stiffness, "
            "and without a friction or a torque");
}

void CylinderChainForce::setEndFrame(int chain, int end, const Vec3& direction, double stiffness, double torque,
        double angularVelocity, double friction) {
    cylchain::Chain& own = getChain(chain);
    checkEnd(own, end);
    const double length = sqrt(direction.dot(direction));
    if (!isfinite(length) || !(stiffness >= 0 && isfinite(stiffness)) || !isfinite(torque) ||
            !isfinite(angularVelocity) || !(friction >= 0 && isfinite(friction)))
        throw OpenMMException("CylinderChainForce: The direction, torque and angular velocity of an end frame must be "
                "finite, and its stiffness and friction not negative");
    if (length == 0 && (stiffness > 0 || torque != 0))
        throw OpenMMException("CylinderChainForce: An end frame that is held, or has a torque, needs a direction");
    const bool isHeld = stiffness > 0 && friction == 0;
    if (isHeld ? torque != 0 : angularVelocity != 0)
        throw OpenMMException("CylinderChainForce: An end frame has an angular velocity if it is held, and a torque if "
                "it is not");
    if (friction > 0 && stiffness == 0)
        throw OpenMMException("CylinderChainForce: An end frame that turns against a friction needs a stiffness");
    cylchain::EndFrame& frame = own.twist.ends[end];
    if (frame.body >= 0 && !isHeld)
        throw onlyHeldFrames();
    for (int k = 0; k < 3; k++)
        frame.direction[k] = length > 0 ? direction[k]/length : 0.0;
    frame.stiffness = stiffness;
    frame.torque = torque;
    frame.angularVelocity = angularVelocity;
    frame.friction = friction;
}

void CylinderChainForce::getEndFrame(int chain, int end, Vec3& direction, double& stiffness, double& torque,
        double& angularVelocity, double& friction) const {
    checkEnd(getChain(chain), end);
    const cylchain::EndFrame& frame = getChain(chain).twist.ends[end];
    direction = Vec3(frame.direction[0], frame.direction[1], frame.direction[2]);
    stiffness = frame.stiffness;
    torque = frame.torque;
    angularVelocity = frame.angularVelocity;
    friction = frame.friction;
}

void CylinderChainForce::setEndFrameBody(int chain, int end, int body) {
    cylchain::Chain& own = getChain(chain);
    checkEnd(own, end);
    cylchain::EndFrame& frame = own.twist.ends[end];
    if (body < -1)
        throw OpenMMException("CylinderChainForce: There is no body "+to_string(body));
    if (body >= 0 && (frame.stiffness == 0 || frame.friction > 0))
        throw onlyHeldFrames();
    frame.body = body;
}

int CylinderChainForce::getEndFrameBody(int chain, int end) const {
    checkEnd(getChain(chain), end);
    return getChain(chain).twist.ends[end].body;
}

void CylinderChainForce::getTwists(Context& context, int chain, vector<double>& twists) const {
    getChain(chain);
    twists = dynamic_cast<CylinderChainForceImpl&>(getImplInContext(context)).getTwists()[chains.getIndex(chain)];
}

void CylinderChainForce::setTwists(Context& context, int chain, const vector<double>& twists) const {
    getChain(chain);
    dynamic_cast<CylinderChainForceImpl&>(getImplInContext(context)).setTwists(chains.getIndex(chain), twists);
}

void CylinderChainForce::getJointParameters(int chain, int joint, double& stiffness) const {
    checkPart(joint, getNumJoints(chain), "joint", chain);
    stiffness = getChain(chain).joints[joint];
}

void CylinderChainForce::setJointParameters(int chain, int joint, double stiffness) {
    checkPart(joint, getNumJoints(chain), "joint", chain);
    checkStiffness(stiffness);
    getChain(chain).joints[joint] = stiffness;
}

static cylchain::Tether makeTether(int node, const Vec3& point, double stiffness) {
    return {node, {point[0], point[1], point[2]}, stiffness};
}

void CylinderChainForce::checkTether(const TetherInfo& info) const {
    checkIndex(info.chain);
    checkPart(info.tether.node, chains.getNumNodes(info.chain), "node", info.chain);
    for (double coordinate : info.tether.point)
        if (!isfinite(coordinate))
            throw OpenMMException("CylinderChainForce: The point of a tether must be finite");
    if (!(info.tether.stiffness >= 0 && isfinite(info.tether.stiffness)))
        throw OpenMMException("CylinderChainForce: The stiffness of a tether cannot be negative and must be finite");
}

int CylinderChainForce::addBody(const vector<int>& particles, const vector<double>& places, double friction,
        const vector<double>& rotationalFriction, bool planar) {
    const string name = "Body "+to_string(bodies.size());
    if (particles.size() < 3 || places.size() != 3*particles.size())
        throw OpenMMException(name+" must have three particles or more, and three numbers for the place of each");
    if (rotationalFriction.size() != 6)
        throw OpenMMException(name+" must have six entries of its friction against turning, but has "+
                to_string(rotationalFriction.size()));
    for (int particle : particles) {
        if (particle < 0)
            throw OpenMMException("CylinderChainForce: Illegal particle index: "+to_string(particle));
        if (count(particles.begin(), particles.end(), particle) > 1)
            throw OpenMMException("Particle "+to_string(particle)+" is in "+name+" twice");
        for (const cylchain::RigidBody& other : bodies)
            if (find(other.particles.begin(), other.particles.end(), particle) != other.particles.end())
                throw OpenMMException("Particle "+to_string(particle)+" is in another body than "+name+" already");
    }
    for (double number : places)
        if (!isfinite(number))
            throw OpenMMException(name+" has a place that is not finite");
    if (!(friction > 0 && isfinite(friction)))
        throw OpenMMException("The friction of "+name+" must be positive");
    cylchain::RigidBody body;
    body.particles = particles;
    body.places = places;
    body.friction = friction;
    body.planar = planar;
    copy(rotationalFriction.begin(), rotationalFriction.end(), body.rotationalFriction);
    const double* const z = body.rotationalFriction;
    const double minor = z[0]*z[3]-z[1]*z[1];
    const double determinant = z[5]*minor-z[4]*(z[0]*z[4]-z[1]*z[2])+z[2]*(z[1]*z[4]-z[3]*z[2]);
    if (!(z[0] > 0 && minor > 0 && determinant > 0 && isfinite(determinant)))
        throw OpenMMException("The friction of "+name+" against turning must be positive definite");
    if (cylchain::RigidFrameFinder(body).isOnLine())
        throw OpenMMException("The particles of "+name+" must not all be on one line, which does not tell how it is "
                "turned: add one beside it");
    bodies.push_back(body);
    return bodies.size()-1;
}

void CylinderChainForce::getBody(int index, vector<int>& particles, vector<double>& places, double& friction,
        vector<double>& rotationalFriction, bool& planar) const {
    if (index < 0 || index >= (int) bodies.size())
        throw OpenMMException("CylinderChainForce: There is no body "+to_string(index));
    const cylchain::RigidBody& body = bodies[index];
    particles = body.particles;
    places = body.places;
    friction = body.friction;
    rotationalFriction.assign(body.rotationalFriction, body.rotationalFriction+6);
    planar = body.planar;
}

int CylinderChainForce::addTether(int chain, int node, const Vec3& point, double stiffness) {
    const TetherInfo added = {chain, makeTether(node, point, stiffness)};
    checkTether(added);
    if (!tetheredNodes.insert({chain, node}).second)
        throw twoTethers(chain, node);
    tethers.push_back(added);
    return tethers.size()-1;
}

void CylinderChainForce::getTetherParameters(int index, int& chain, int& node, Vec3& point, double& stiffness) const {
    ASSERT_VALID_INDEX(index, tethers);
    const cylchain::Tether& tether = tethers[index].tether;
    chain = tethers[index].chain;
    node = tether.node;
    point = Vec3(tether.point[0], tether.point[1], tether.point[2]);
    stiffness = tether.stiffness;
}

void CylinderChainForce::setTetherParameters(int index, int chain, int node, const Vec3& point, double stiffness) {
    ASSERT_VALID_INDEX(index, tethers);
    const TetherInfo changed = {chain, makeTether(node, point, stiffness)};
    checkTether(changed);
    TetherInfo& old = tethers[index];
    if (old.chain != chain || old.tether.node != node) {
        if (!tetheredNodes.insert({chain, node}).second)
            throw twoTethers(chain, node);
        tetheredNodes.erase({old.chain, old.tether.node});
    }
    old = changed;
}

cylchain::ChainList CylinderChainForce::describeChains() const {
    cylchain::ChainList described = chains;
    for (const TetherInfo& info : tethers)
        described.visit(info.chain, [&] (auto& chain) {chain.tethers.push_back(info.tether);});
    return described;
}

void CylinderChainForce::updateParametersInContext(Context& context) {
    dynamic_cast<CylinderChainForceImpl&>(getImplInContext(context)).updateParametersInContext(getContextImpl(context));
}

void CylinderChainForce::computeEnergies(Context& context, double& stretching, double& bending) const {
    dynamic_cast<CylinderChainForceImpl&>(getImplInContext(context)).computeEnergies(getContextImpl(context),
            stretching, bending);
}

void CylinderChainForce::setUsesPeriodicBoundaryConditions(bool periodic) {
    usePeriodic = periodic;
}

bool CylinderChainForce::usesPeriodicBoundaryConditions() const {
    return usePeriodic;
}

ForceImpl* CylinderChainForce::createImpl() const {
    return new CylinderChainForceImpl(*this);
}
