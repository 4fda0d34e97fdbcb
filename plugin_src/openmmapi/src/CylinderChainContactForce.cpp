#include "openmm/CylinderChainContactForce.h"
#include "openmm/OpenMMException.h"
#include "openmm/internal/AssertionUtilities.h"
#include "openmm/internal/ContactDescription.h"
#include "openmm/internal/CylinderChainContactForceImpl.h"
#include <cmath>
#include <set>
#include <string>

using namespace OpenMM;
using namespace std;

static void checkDiameter(double value, const char* name) {
    // Written so that NaN fails.

    if (!(value > 0 && isfinite(value)))
        throw OpenMMException(string("CylinderChainContactForce: ")+name+" must be positive and finite");
}

static void checkContactStiffness(double stiffness) {
    if (!(stiffness >= 0 && isfinite(stiffness)))
        throw OpenMMException("CylinderChainContactForce: The stiffness cannot be negative and must be finite");
}

CylinderChainContactForce::CylinderChainContactForce(double stiffness) : stiffness(stiffness), usePeriodic(false) {
    checkContactStiffness(stiffness);
    setName("CylinderChainContactForce");
}

void CylinderChainContactForce::setStiffness(double stiffness) {
    checkContactStiffness(stiffness);
    this->stiffness = stiffness;
}

int CylinderChainContactForce::addChain(const vector<int>& particles, double diameter, int excludedNeighbors,
        bool closed) {
    if (particles.size() < 2)
        throw OpenMMException("CylinderChainContactForce: A chain must have at least two particles");
    if (closed && particles.size() < 3)
        throw OpenMMException("CylinderChainContactForce: A closed chain must have at least three particles");
    set<int> distinct;
    for (int particle : particles) {
        if (particle < 0)
            throw OpenMMException("CylinderChainContactForce: Illegal particle index: "+to_string(particle));
        if (!distinct.insert(particle).second)
            throw OpenMMException("CylinderChainContactForce: Particle "+to_string(particle)+
                    " appears twice in a chain");
    }
    checkDiameter(diameter, "The diameter of a chain");
    if (excludedNeighbors < 0)
        throw OpenMMException("CylinderChainContactForce: The number of excluded neighbors cannot be negative");
    bodies.chains.push_back({particles, diameter, excludedNeighbors, closed});
    return bodies.chains.size()-1;
}

const vector<int>& CylinderChainContactForce::getChainParticles(int chain) const {
    ASSERT_VALID_INDEX(chain, bodies.chains);
    return bodies.chains[chain].particles;
}

int CylinderChainContactForce::getChainExcludedNeighbors(int chain) const {
    ASSERT_VALID_INDEX(chain, bodies.chains);
    return bodies.chains[chain].excludedNeighbors;
}

bool CylinderChainContactForce::isChainClosed(int chain) const {
    ASSERT_VALID_INDEX(chain, bodies.chains);
    return bodies.chains[chain].closed;
}

double CylinderChainContactForce::getChainDiameter(int chain) const {
    ASSERT_VALID_INDEX(chain, bodies.chains);
    return bodies.chains[chain].diameter;
}

void CylinderChainContactForce::setChainDiameter(int chain, double diameter) {
    ASSERT_VALID_INDEX(chain, bodies.chains);
    checkDiameter(diameter, "The diameter of a chain");
    bodies.chains[chain].diameter = diameter;
}

int CylinderChainContactForce::addSphere(int particle, double diameter) {
    if (particle < 0)
        throw OpenMMException("CylinderChainContactForce: Illegal particle index: "+to_string(particle));
    checkDiameter(diameter, "The diameter of a sphere");
    bodies.spheres.push_back({particle, diameter});
    return bodies.spheres.size()-1;
}

int CylinderChainContactForce::getSphereParticle(int sphere) const {
    ASSERT_VALID_INDEX(sphere, bodies.spheres);
    return bodies.spheres[sphere].particle;
}

double CylinderChainContactForce::getSphereDiameter(int sphere) const {
    ASSERT_VALID_INDEX(sphere, bodies.spheres);
    return bodies.spheres[sphere].diameter;
}

void CylinderChainContactForce::setSphereDiameter(int sphere, double diameter) {
    ASSERT_VALID_INDEX(sphere, bodies.spheres);
    checkDiameter(diameter, "The diameter of a sphere");
    bodies.spheres[sphere].diameter = diameter;
}

void CylinderChainContactForce::checkBody(int chain, int segment) const {
    if (chain == -1) {
        ASSERT_VALID_INDEX(segment, bodies.spheres);
        return;
    }
    ASSERT_VALID_INDEX(chain, bodies.chains);
    const int segments = bodies.chains[chain].countSegments();
    if (segment < 0 || segment >= segments)
        throw OpenMMException("CylinderChainContactForce: Chain "+to_string(chain)+" has no segment "+
                to_string(segment));
}

int CylinderChainContactForce::addExclusion(int chain1, int segment1, int chain2, int segment2) {
    checkBody(chain1, segment1);
    checkBody(chain2, segment2);
    bodies.exclusions.push_back({chain1, segment1, chain2, segment2});
    return bodies.exclusions.size()-1;
}

void CylinderChainContactForce::getExclusion(int index, int& chain1, int& segment1, int& chain2,
        int& segment2) const {
    ASSERT_VALID_INDEX(index, bodies.exclusions);
    const cylchain::ContactBodies::Exclusion& exclusion = bodies.exclusions[index];
    chain1 = exclusion.chain1;
    segment1 = exclusion.segment1;
    chain2 = exclusion.chain2;
    segment2 = exclusion.segment2;
}

void CylinderChainContactForce::updateParametersInContext(Context& context) {
    dynamic_cast<CylinderChainContactForceImpl&>(getImplInContext(context)).updateParametersInContext(
            getContextImpl(context));
}

void CylinderChainContactForce::getContacts(Context& context, vector<int>& ends, vector<double>& fractions,
        vector<double>& gaps, vector<double>& forces, vector<Vec3>& directions) {
    dynamic_cast<CylinderChainContactForceImpl&>(getImplInContext(context)).getContacts(getContextImpl(context), ends,
            fractions, gaps, forces, directions);
}

void CylinderChainContactForce::setUsesPeriodicBoundaryConditions(bool periodic) {
    usePeriodic = periodic;
}

bool CylinderChainContactForce::usesPeriodicBoundaryConditions() const {
    return usePeriodic;
}

double CylinderChainContactForce::takeMeanForces(Context& context, int reader, std::vector<double>& forces,
        std::vector<int>& numbers, std::vector<double>& sums, std::vector<double>& loads) {
    return dynamic_cast<CylinderChainContactForceImpl&>(getImplInContext(context)).takeMeanForces(
            getContextImpl(context), reader, forces, numbers, sums, loads);
}

int CylinderChainContactForce::addForceReader(Context& context) {
    return dynamic_cast<CylinderChainContactForceImpl&>(getImplInContext(context)).addReader();
}

vector<cylchain::Place> CylinderChainContactForce::findPlaces(const PlaceResolver& resolver) const {
    const vector<cylchain::Capsule> capsules = describeCapsules(bodies, resolver.getSystem()).capsules;
    vector<cylchain::Place> places(capsules.size());
    for (size_t i = 0; i < capsules.size(); i++) {
        places[i].first = capsules[i].first;
        places[i].second = capsules[i].second;
    }
    vector<cylchain::CapsuleOnCurve> onCurves;
    vector<cylchain::CurveSite> sites;
    findCurves(capsules, resolver, onCurves, sites);
    for (const cylchain::CapsuleOnCurve& own : onCurves)
        places[own.capsule] = own.first;
    return places;
}

ForceImpl* CylinderChainContactForce::createImpl() const {
    return new CylinderChainContactForceImpl(*this);
}
