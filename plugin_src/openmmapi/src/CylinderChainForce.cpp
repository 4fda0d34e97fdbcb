#include "openmm/CylinderChainForce.h"
#include "openmm/OpenMMException.h"
#include "openmm/internal/AssertionUtilities.h"
#include "openmm/internal/CylinderChainForceImpl.h"
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

static string twoTethers(int chain, int node) {
    return "CylinderChainForce: Node "+to_string(node)+" of chain "+to_string(chain)+" cannot have two tethers";
}

CylinderChainForce::CylinderChainForce() : usePeriodic(false) {
}

vector<string> CylinderChainForce::getBendingModelNames() {
    return cylchain::namesOf<cylchain::BendingModel>();
}

vector<string> CylinderChainForce::getStretchingModelNames() {
    return cylchain::namesOf<cylchain::StretchingModel>();
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
    ChainInfo chain;
    chain.particles = particles;
    chain.bendingModel = bendingModel;
    chain.stretchingModel = stretchingModel;
    chain.closed = closed;
    chain.planar = false;
    chain.nodeFriction = 0;
    chain.segments.resize(closed ? particles.size() : particles.size()-1);
    chain.joints.assign(closed ? particles.size() : particles.size()-2, jointStiffness);
    chains.push_back(chain);
    const int index = chains.size()-1;
    try {
        for (int segment = 0; segment < getNumSegments(index); segment++)
            setSegmentParameters(index, segment, restLength, stretchingStiffness, maximumExtension, parallelFriction,
                    perpendicularFriction, rotationalFriction, extensionalFriction);
    }
    catch (...) {
        chains.pop_back();
        throw;
    }
    return index;
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
    beams.push_back({particles, 0, 0, 0, 0, 0, 0, planar, closed, 0});
    const int index = beams.size()-1;
    try {
        setBeamChainParameters(index, elementLength, stretchingModulus, bendingRigidity, shortening, parallelFriction,
                perpendicularFriction);
    }
    catch (...) {
        beams.pop_back();
        throw;
    }
    return index;
}

const vector<int>& CylinderChainForce::getBeamChainParticles(int chain) const {
    ASSERT_VALID_INDEX(chain, beams);
    return beams[chain].particles;
}

bool CylinderChainForce::isBeamChainClosed(int chain) const {
    ASSERT_VALID_INDEX(chain, beams);
    return beams[chain].closed;
}

bool CylinderChainForce::isBeamChainPlanar(int chain) const {
    ASSERT_VALID_INDEX(chain, beams);
    return beams[chain].planar;
}

void CylinderChainForce::getBeamChainPropulsion(int chain, double& propulsion) const {
    ASSERT_VALID_INDEX(chain, beams);
    propulsion = beams[chain].propulsion;
}

void CylinderChainForce::setBeamChainPropulsion(int chain, double propulsion) {
    ASSERT_VALID_INDEX(chain, beams);
    if (!isfinite(propulsion))
        throw OpenMMException("CylinderChainForce: The propulsion of a chain of beam elements must be finite");
    beams[chain].propulsion = propulsion;
}

void CylinderChainForce::getBeamChainParameters(int chain, double& elementLength, double& stretchingModulus,
        double& bendingRigidity, double& shortening, double& parallelFriction, double& perpendicularFriction) const {
    ASSERT_VALID_INDEX(chain, beams);
    const BeamInfo& beam = beams[chain];
    elementLength = beam.elementLength;
    stretchingModulus = beam.stretchingModulus;
    bendingRigidity = beam.bendingRigidity;
    shortening = beam.shortening;
    parallelFriction = beam.parallelFriction;
    perpendicularFriction = beam.perpendicularFriction;
}

void CylinderChainForce::setBeamChainParameters(int chain, double elementLength, double stretchingModulus,
        double bendingRigidity, double shortening, double parallelFriction, double perpendicularFriction) {
    ASSERT_VALID_INDEX(chain, beams);
    checkPositive(elementLength, "The length of an element");
    checkPositive(stretchingModulus, "The stretching modulus of a chain of beam elements");
    checkPositive(bendingRigidity, "The bending rigidity of a chain of beam elements");
    checkNotNegative(shortening, "The shortening of an element");
    checkPositive(parallelFriction, "The friction along beam elements");
    checkPositive(perpendicularFriction, "The friction across beam elements");
    BeamInfo& beam = beams[chain];
    beam.elementLength = elementLength;
    beam.stretchingModulus = stretchingModulus;
    beam.bendingRigidity = bendingRigidity;
    beam.shortening = shortening;
    beam.parallelFriction = parallelFriction;
    beam.perpendicularFriction = perpendicularFriction;
}

const CylinderChainForce::ChainInfo& CylinderChainForce::getChain(int chain) const {
    ASSERT_VALID_INDEX(chain, chains);
    return chains[chain];
}

CylinderChainForce::ChainInfo& CylinderChainForce::getChain(int chain) {
    ASSERT_VALID_INDEX(chain, chains);
    return chains[chain];
}

const vector<int>& CylinderChainForce::getChainParticles(int chain) const {
    return getChain(chain).particles;
}

void CylinderChainForce::getChainModels(int chain, int& bendingModel, int& stretchingModel) const {
    bendingModel = getChain(chain).bendingModel;
    stretchingModel = getChain(chain).stretchingModel;
}

bool CylinderChainForce::isChainClosed(int chain) const {
    return getChain(chain).closed;
}

bool CylinderChainForce::isChainPlanar(int chain) const {
    return getChain(chain).planar;
}

void CylinderChainForce::setChainPlanar(int chain, bool planar) {
    getChain(chain).planar = planar;
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
    const vector<SegmentInfo>& segments = getChain(chain).segments;
    ASSERT_VALID_INDEX(segment, segments);
    const SegmentInfo& info = segments[segment];
    restLength = info.restLength;
    stretchingStiffness = info.stretchingStiffness;
    maximumExtension = info.maximumExtension;
    parallelFriction = info.parallelFriction;
    perpendicularFriction = info.perpendicularFriction;
    rotationalFriction = info.rotationalFriction;
    extensionalFriction = info.extensionalFriction;
}

void CylinderChainForce::setSegmentParameters(int chain, int segment, double restLength, double stretchingStiffness,
        double maximumExtension, double parallelFriction, double perpendicularFriction, double rotationalFriction,
        double extensionalFriction) {
    vector<SegmentInfo>& segments = getChain(chain).segments;
    ASSERT_VALID_INDEX(segment, segments);
    checkPositive(restLength, "The rest length");
    checkPositive(stretchingStiffness, "The stretching stiffness");
    if (cylchain::hasRange(static_cast<cylchain::StretchingModel>(getChain(chain).stretchingModel)))
        checkPositive(maximumExtension, "The maximum extension");
    // Nodes may have the friction that a segment lacks: CylinderChainForceImpl looks at both.
    checkNotNegative(parallelFriction, "The parallel friction");
    checkNotNegative(perpendicularFriction, "The perpendicular friction");
    checkNotNegative(rotationalFriction, "The rotational friction");
    checkNotNegative(extensionalFriction, "The extensional friction");
    segments[segment] = {restLength, stretchingStiffness, maximumExtension, parallelFriction, perpendicularFriction,
            rotationalFriction, extensionalFriction, segments[segment].propulsion};
}

void CylinderChainForce::getSegmentPropulsion(int chain, int segment, double& propulsion) const {
    const vector<SegmentInfo>& segments = getChain(chain).segments;
    ASSERT_VALID_INDEX(segment, segments);
    propulsion = segments[segment].propulsion;
}

void CylinderChainForce::setSegmentPropulsion(int chain, int segment, double propulsion) {
    vector<SegmentInfo>& segments = getChain(chain).segments;
    ASSERT_VALID_INDEX(segment, segments);
    if (!isfinite(propulsion))
        throw OpenMMException("CylinderChainForce: The propulsion of a segment must be finite");
    segments[segment].propulsion = propulsion;
}

void CylinderChainForce::getJointParameters(int chain, int joint, double& stiffness) const {
    const vector<double>& joints = getChain(chain).joints;
    ASSERT_VALID_INDEX(joint, joints);
    stiffness = joints[joint];
}

void CylinderChainForce::setJointParameters(int chain, int joint, double stiffness) {
    vector<double>& joints = getChain(chain).joints;
    ASSERT_VALID_INDEX(joint, joints);
    checkStiffness(stiffness);
    joints[joint] = stiffness;
}

void CylinderChainForce::checkTether(const TetherInfo& tether, int numNodes) const {
    if (tether.node < 0 || tether.node >= numNodes)
        throw OpenMMException("CylinderChainForce: Index out of range: there is no node "+to_string(tether.node)+
                " in chain "+to_string(tether.chain));
    for (int i = 0; i < 3; i++)
        if (!isfinite(tether.point[i]))
            throw OpenMMException("CylinderChainForce: The point of a tether must be finite");
    if (!(tether.stiffness >= 0 && isfinite(tether.stiffness)))
        throw OpenMMException("CylinderChainForce: The stiffness of a tether cannot be negative and must be finite");
}

int CylinderChainForce::numNodesOfBeam(int chain) const {
    return getBeamChainParticles(chain).size()/2;
}

/** Add a tether that has been checked to a list. */
template <class Info> static int addTetherTo(vector<Info>& tethers, set<pair<int, int> >& nodes, const Info& tether) {
    if (!nodes.insert({tether.chain, tether.node}).second)
        throw OpenMMException(twoTethers(tether.chain, tether.node));
    tethers.push_back(tether);
    return tethers.size()-1;
}

/** Replace a tether of a list by one that has been checked. */
template <class Info> static void replaceTether(Info& old, set<pair<int, int> >& nodes, const Info& tether) {
    if (old.chain != tether.chain || old.node != tether.node) {
        if (!nodes.insert({tether.chain, tether.node}).second)
            throw OpenMMException(twoTethers(tether.chain, tether.node));
        nodes.erase({old.chain, old.node});
    }
    old = tether;
}

/** Give the parameters of a tether of a list. */
template <class Info> static void giveTether(const vector<Info>& tethers, int index, int& chain, int& node, Vec3& point,
        double& stiffness) {
    ASSERT_VALID_INDEX(index, tethers);
    chain = tethers[index].chain;
    node = tethers[index].node;
    point = tethers[index].point;
    stiffness = tethers[index].stiffness;
}

int CylinderChainForce::addTether(int chain, int node, const Vec3& point, double stiffness) {
    const TetherInfo tether = {chain, node, point, stiffness};
    checkTether(tether, getChain(chain).particles.size());
    return addTetherTo(tethers, tetheredNodes, tether);
}

void CylinderChainForce::getTetherParameters(int index, int& chain, int& node, Vec3& point, double& stiffness) const {
    giveTether(tethers, index, chain, node, point, stiffness);
}

void CylinderChainForce::setTetherParameters(int index, int chain, int node, const Vec3& point, double stiffness) {
    ASSERT_VALID_INDEX(index, tethers);
    const TetherInfo tether = {chain, node, point, stiffness};
    checkTether(tether, getChain(chain).particles.size());
    replaceTether(tethers[index], tetheredNodes, tether);
}

int CylinderChainForce::addBeamTether(int chain, int node, const Vec3& point, double stiffness) {
    const TetherInfo tether = {chain, node, point, stiffness};
    checkTether(tether, numNodesOfBeam(chain));
    return addTetherTo(beamTethers, tetheredNodesOfBeams, tether);
}

void CylinderChainForce::getBeamTetherParameters(int index, int& chain, int& node, Vec3& point,
        double& stiffness) const {
    giveTether(beamTethers, index, chain, node, point, stiffness);
}

void CylinderChainForce::setBeamTetherParameters(int index, int chain, int node, const Vec3& point, double stiffness) {
    ASSERT_VALID_INDEX(index, beamTethers);
    const TetherInfo tether = {chain, node, point, stiffness};
    checkTether(tether, numNodesOfBeam(chain));
    replaceTether(beamTethers[index], tetheredNodesOfBeams, tether);
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
