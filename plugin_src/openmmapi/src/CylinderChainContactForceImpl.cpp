#include "openmm/internal/CylinderChainContactForceImpl.h"
#include "openmm/CylinderChainKernels.h"
#include "openmm/OpenMMException.h"
#include "openmm/System.h"
#include "openmm/internal/ContextImpl.h"
#include "openmm/internal/PlaceResolver.h"
#include <cmath>
#include <set>

using namespace OpenMM;
using namespace cylchain;
using namespace std;

/** Parameters of curves that differ by less are the same. */
static const double SAME_PLACE = 1e-9;

CylinderChainContactForceImpl::CylinderChainContactForceImpl(const CylinderChainContactForce& owner) :
        PushForceImpl(owner), owner(owner), stiffness(owner.getStiffness()),
        periodic(owner.usesPeriodicBoundaryConditions()) {
}

int CylinderChainContactForceImpl::getNumSegments(int chain) const {
    return owner.getChainParticles(chain).size()-(owner.isChainClosed(chain) ? 0 : 1);
}

void CylinderChainContactForceImpl::initialize(ContextImpl& context) {
    const int numParticles = context.getSystem().getNumParticles();
    auto checkParticle = [&] (int particle) {
        if (particle >= numParticles)
            throw OpenMMException("CylinderChainContactForce: Illegal particle index: "+to_string(particle));
    };
    CapsuleSystem capsules;
    vector<int> firstOfChain;
    for (int chain = 0; chain < owner.getNumChains(); chain++) {
        const vector<int>& particles = owner.getChainParticles(chain);
        for (int particle : particles)
            checkParticle(particle);
        const int segments = getNumSegments(chain);
        firstOfChain.push_back(capsules.capsules.size());
        for (int segment = 0; segment < segments; segment++)
            capsules.capsules.push_back({particles[segment], particles[(segment+1)%particles.size()],
                    0.5*owner.getChainDiameter(chain), chain, segment});
        capsules.chains.push_back({segments, owner.isChainClosed(chain), owner.getChainExcludedNeighbors(chain)});
    }
    firstOfChain.push_back(capsules.capsules.size());
    for (int sphere = 0; sphere < owner.getNumSpheres(); sphere++) {
        checkParticle(owner.getSphereParticle(sphere));
        capsules.capsules.push_back({owner.getSphereParticle(sphere), -1, 0.5*owner.getSphereDiameter(sphere), -1,
                sphere});
    }
    for (int exclusion = 0; exclusion < owner.getNumExclusions(); exclusion++) {
        int chain1, segment1, chain2, segment2;
        owner.getExclusion(exclusion, chain1, segment1, chain2, segment2);
        // Spheres come after the segments of all chains.

        const int first = firstOfChain[chain1 == -1 ? owner.getNumChains() : chain1]+segment1;
        const int second = firstOfChain[chain2 == -1 ? owner.getNumChains() : chain2]+segment2;
        capsules.exclusions.push_back({first, second});
    }
    search.reset(new ContactSearch(capsules));
    findCurves(context.getSystem());
    kernel = context.getPlatform().createKernel(CalcCylinderChainContactForceKernel::Name(), context);
    kernel.getAs<CalcCylinderChainContactForceKernel>().initialize(context.getSystem(), *search, stiffness, periodic);
    beginSums(numParticles);
    notesPushes = kernel.getAs<CalcCylinderChainContactForceKernel>().notePushes(present);
}

/**
 * Find capsules that are straight pieces of beam elements: between virtual sites at neighbouring ones of places at
 * equal distances along the curve of an element, its nodes among them.
 */
void CylinderChainContactForceImpl::findCurves(const System& system) {
    const PlaceResolver places(system);
    const vector<Capsule>& capsules = search->getSystem().capsules;
    set<int> known;
    for (size_t i = 0; i < capsules.size(); i++) {
        const Capsule& capsule = capsules[i];
        if (capsule.second < 0 || !system.isVirtualSite(capsule.first) ||
                !system.isVirtualSite(capsule.second))
            continue;
        Place ends[2];
        ends[0].first = capsule.first;
        ends[1].first = capsule.second;
        for (Place& end : ends)
            end = places.resolve(end);
        if (!ends[0].isOnCurve() || !ends[1].isOnCurve())
            continue;
        for (int side = 0; side < 2; side++) {
            const int particle = side == 0 ? capsule.first : capsule.second;
            if (known.insert(particle).second)
                sites.push_back({particle, ends[side]});
        }
        // A site at a node is on both of its elements.

        for (int side = 0; side < 2; side++) {
            Place &one = ends[side], &other = ends[1-side];
            if (one.first == other.first)
                continue;
            if (one.second == other.first && fabs(one.fraction-1) < SAME_PLACE) {
                one = other;
                one.fraction = 0;
            }
            else if (one.first == other.second && fabs(one.fraction) < SAME_PLACE) {
                one = other;
                one.fraction = 1;
            }
        }
        const double length = fabs(ends[1].fraction-ends[0].fraction), pieces = round(1/max(length, SAME_PLACE));
        const double first = ends[0].fraction*pieces;
        if (ends[0].first != ends[1].first || fabs(length*pieces-1) > SAME_PLACE ||
                fabs(first-round(first)) > SAME_PLACE)
            continue;
        onCurves.push_back({(int) i, ends[0], (int) pieces, ends[1].fraction > ends[0].fraction});
    }
}

double CylinderChainContactForceImpl::calcForcesAndEnergy(ContextImpl& context, bool includeForces,
        bool includeEnergy, int groups) {
    if (isIn(groups) && !isExcluded())
        return kernel.getAs<CalcCylinderChainContactForceKernel>().execute(context, includeForces, includeEnergy);
    return 0.0;
}

vector<string> CylinderChainContactForceImpl::getKernelNames() {
    return {CalcCylinderChainContactForceKernel::Name()};
}

void CylinderChainContactForceImpl::updateParametersInContext(ContextImpl& context) {
    int capsules = owner.getNumSpheres();
    for (int chain = 0; chain < owner.getNumChains(); chain++)
        capsules += getNumSegments(chain);
    if (capsules != (int) search->getSystem().capsules.size())
        throw OpenMMException("CylinderChainContactForce: Chains and spheres cannot be added to a Context");
    if (owner.getNumExclusions() != (int) search->getSystem().exclusions.size())
        throw OpenMMException("CylinderChainContactForce: Exclusions cannot be added to a Context");
    stiffness = owner.getStiffness();
    int capsule = 0;
    for (int chain = 0; chain < owner.getNumChains(); chain++)
        for (int segment = 0; segment < getNumSegments(chain); segment++)
            search->setRadius(capsule++, 0.5*owner.getChainDiameter(chain));
    for (int sphere = 0; sphere < owner.getNumSpheres(); sphere++)
        search->setRadius(capsule++, 0.5*owner.getSphereDiameter(sphere));
    kernel.getAs<CalcCylinderChainContactForceKernel>().copyParametersToContext(context, stiffness);
    context.systemChanged();
}

/** Call a function with each contact at the present positions, and its pair. */
template <class Function> void CylinderChainContactForceImpl::forContacts(ContextImpl& context,
        Function function) const {
    vector<Vec3> positions;
    context.getPositions(positions);
    Vec3 box[3];
    context.getPeriodicBoxVectors(box[0], box[1], box[2]);
    // The kernel's own search must not forget what it has found.

    ContactSearch around(search->getSystem());
    vector<ContactPair> pairs;
    const double* x = &positions[0][0];
    try {
        around.findPairs(x, x, periodic ? &box[0][0] : NULL, 0, pairs);
    }
    catch (const invalid_argument& error) {
        throw OpenMMException(string("CylinderChainContactForce: ")+error.what());
    }
    for (const ContactPair& pair : pairs) {
        Contact found[2];
        const int count = around.evaluate(pair, x, x, found, 0);
        for (int i = 0; i < count; i++)
            function(pair, found[i]);
    }
}

void CylinderChainContactForceImpl::getContacts(ContextImpl& context, vector<int>& ends, vector<double>& fractions,
        vector<double>& gaps, vector<double>& forces, vector<Vec3>& directions) const {
    const vector<Capsule>& capsules = search->getSystem().capsules;
    forContacts(context, [&] (const ContactPair& pair, const Contact& contact) {
        for (int side : {pair.a, pair.b})
            ends.insert(ends.end(), {capsules[side].chain, capsules[side].index});
        fractions.insert(fractions.end(), {contact.s, contact.t});
        gaps.push_back(contact.gap);
        forces.push_back(-contact.weight*stiffness*contact.gap);
        directions.push_back(Vec3(contact.normal[0], contact.normal[1], contact.normal[2]));
    });
}

void CylinderChainContactForceImpl::findPushes(ContextImpl& context, vector<Push>& pushes) const {
    forContacts(context, [&] (const ContactPair& pair, const Contact& contact) {
        pushes.push_back(pushOfContact(search->getSystem(), pair.a, pair.b, contact.s, contact.t,
                -contact.weight*stiffness*contact.gap, contact.normal));
    });
}
