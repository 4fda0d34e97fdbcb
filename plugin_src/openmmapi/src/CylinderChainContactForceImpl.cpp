#include "openmm/internal/CylinderChainContactForceImpl.h"
#include "couplings/EndContacts.h"
#include "openmm/CylinderChainKernels.h"
#include "openmm/OpenMMException.h"
#include "openmm/System.h"
#include "openmm/internal/ContextImpl.h"
#include "openmm/internal/ContactDescription.h"
#include <algorithm>
#include <cmath>
#include <map>
#include <sstream>

using namespace OpenMM;
using namespace cylchain;
using namespace std;

/**
 * In an implicit step, a periodic box must be wider than twice the sum of a segment and so many of its diameters, or so
 * many of a sphere: contacts are looked for beyond surfaces, and on their way.
 */
static const double DIAMETERS_OF_BOX = 2, DIAMETERS_OF_SPHERE = 1.25;

CylinderChainContactForceImpl::CylinderChainContactForceImpl(const CylinderChainContactForce& owner) :
        PushForceImpl(owner), owner(owner), stiffness(owner.getStiffness()),
        periodic(owner.usesPeriodicBoundaryConditions()) {
}

void CylinderChainContactForceImpl::initialize(ContextImpl& context) {
    const System& system = context.getSystem();
    isSpare = findSpareNodes(system);
    const CapsuleSystem capsules = describeCapsules(owner.getBodies(), system, isSpare);
    search.reset(new ContactSearch(capsules));
    findCurves(capsules.capsules, PlaceResolver(system), onCurves, sites);
    kernel = context.getPlatform().createKernel(CalcCylinderChainContactForceKernel::Name(), context);
    kernel.getAs<CalcCylinderChainContactForceKernel>().initialize(system, *search, stiffness, periodic);
    beginSums(system.getNumParticles());
    kernel.getAs<CalcCylinderChainContactForceKernel>().notePushes(present);
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
    const CapsuleSystem changed = owner.getBodies().getCapsules(isSpare);
    if (changed.capsules.size() != search->getSystem().capsules.size())
        throw OpenMMException("CylinderChainContactForce: Chains and spheres cannot be added to a Context");
    if (changed.exclusions.size() != search->getSystem().exclusions.size())
        throw OpenMMException("CylinderChainContactForce: Exclusions cannot be added to a Context");
    stiffness = owner.getStiffness();
    for (size_t i = 0; i < changed.capsules.size(); i++)
        search->setRadius(i, changed.capsules[i].radius);
    kernel.getAs<CalcCylinderChainContactForceKernel>().copyParametersToContext(context, stiffness);
    versionOfSurroundings++;
    context.systemChanged();
}

void CylinderChainContactForceImpl::setSpareNodes(ContextImpl& context, const vector<bool>& isSpare) {
    this->isSpare = isSpare;
    const CapsuleSystem capsules = owner.getBodies().getCapsules(isSpare);
    search->setSystem(capsules);
    onCurves.clear();
    sites.clear();
    findCurves(capsules.capsules, PlaceResolver(context.getSystem()), onCurves, sites);
    kernel.getAs<CalcCylinderChainContactForceKernel>().copyParametersToContext(context, stiffness);
}

unique_ptr<Surroundings> CylinderChainContactForceImpl::describeSurroundings(
        const ChainList& chains, const vector<int>& growing) {
    const ContactBodies& bodies = owner.getBodies();
    map<int, int> chainOf;
    for (int number : growing) {
        const Chain& chain = chains.getChain(number);
        for (const vector<int>* particles : {&chain.nodes, &chain.spareNodes})
            for (int particle : *particles)
                chainOf[particle] = number;
    }
    vector<int> numbers;
    for (const ContactBodies::Chain& body : bodies.chains) {
        numbers.push_back(-1);
        for (size_t i = 0; i < body.particles.size(); i++) {
            const auto found = chainOf.find(body.particles[i]);
            if (found == chainOf.end() && numbers.back() == -1)
                continue;
            numbers.back() = found == chainOf.end() ? numbers.back() : found->second;
            const Chain& chain = chains.getChain(numbers.back());
            const size_t count = chain.nodes.size();
            const bool isNext = body.particles.size() == count+chain.spareNodes.size() && body.particles[i] ==
                    (i < count ? chain.nodes[i] : chain.spareNodes[i-count]);
            if (!isNext)
                throw OpenMMException("CylinderChainContactForce: "+chains.getName(numbers.back())+" grows, so it must "
                        "touch others with all of its particles, in their order, or with none");
        }
    }
    for (const ContactBodies::Sphere& sphere : bodies.spheres)
        if (chainOf.count(sphere.particle) > 0)
            throw OpenMMException("CylinderChainContactForce: Particle "+to_string(sphere.particle)+" belongs to "+
                    chains.getNameInSentence(chainOf[sphere.particle])+", which grows, and cannot be a sphere");
    for (const ContactBodies::Exclusion& exclusion : bodies.exclusions)
        for (int chain : {exclusion.chain1, exclusion.chain2})
            if (chain >= 0 && numbers[chain] >= 0)
                throw OpenMMException("CylinderChainContactForce: "+chains.getName(numbers[chain])+" grows, so there "
                        "cannot be exclusions of its segments");
    return make_unique<EndContacts>(bodies, numbers, stiffness, periodic);
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

ImplicitCouplings* CylinderChainContactForceImpl::getEquations(ContextImpl& context) {
    return kernel.getAs<CalcCylinderChainContactForceKernel>().getEquations(context, onCurves, sites, getImpulses());
}

void CylinderChainContactForceImpl::refuseChains(const CylinderChainDescription& chains) const {
    vector<int> ofBeams;
    for (const BeamChain& beam : chains.getBeams())
        ofBeams.insert(ofBeams.end(), beam.particles.begin(), beam.particles.end());
    sort(ofBeams.begin(), ofBeams.end());
    for (const Capsule& capsule : search->getSystem().capsules)
        for (int particle : {capsule.first, capsule.end()})
            if (binary_search(ofBeams.begin(), ofBeams.end(), particle))
                throw OpenMMException("CylinderChainIntegrator: Chains of beam elements cannot have contacts of this "
                        "plugin between their nodes, but between virtual sites on their curves: take such sites, or "
                        "segments");
}

void CylinderChainContactForceImpl::refuseBox(ContextImpl& context, const CylinderChainDescription& chains) const {
    if (!periodic)
        return;
    // How long the longest segment at each particle is, whichever end of it is there.

    map<int, double> lengths;
    auto note = [&] (int first, int second, double length) {
        for (int particle : {first, second})
            lengths[particle] = max(lengths[particle], length);
    };
    double longestElement = 0;
    for (const Chain& chain : chains.getChains())
        for (size_t i = 0; i < chain.segments.size(); i++)
            note(chain.nodes[i], chain.nodes[(i+1)%chain.nodes.size()], chain.segments[i].restLength);
    for (const BeamChain& beam : chains.getBeams())
        longestElement = max(longestElement, beam.elementLength);
    const vector<Capsule>& capsules = search->getSystem().capsules;
    for (const CapsuleOnCurve& own : onCurves)
        note(capsules[own.capsule].first, capsules[own.capsule].second, longestElement/own.pieces);
    double size = 0, length = 0, diameter = 0;
    for (const Capsule& capsule : capsules) {
        const bool isSphere = capsule.second < 0;
        const double own = isSphere ? 0 : min(lengths[capsule.first], lengths[capsule.second]);
        const double needed = own+(isSphere ? DIAMETERS_OF_SPHERE : DIAMETERS_OF_BOX)*2*capsule.radius;
        if (needed <= size)
            continue;
        size = needed;
        length = own;
        diameter = 2*capsule.radius;
    }
    Vec3 a, b, c;
    context.getPeriodicBoxVectors(a, b, c);
    double narrowest = INFINITY;
    for (const Vec3& face : {b.cross(c), c.cross(a), a.cross(b)})
        narrowest = min(narrowest, a[0]*b[1]*c[2]/sqrt(face.dot(face)));
    const double needed = 2*size;
    if (narrowest >= needed)
        return;
    stringstream message;
    message << "The periodic box is too small for contacts in implicit steps: it is " << narrowest <<
            " nm wide between two of its faces, but ";
    if (length > 0)
        message << "segments of " << length << " nm with contacts of " << diameter << " nm need twice the sum of their "
                "length and " << DIAMETERS_OF_BOX << " diameters, ";
    else
        message << "spheres of " << diameter << " nm need " << 2*DIAMETERS_OF_SPHERE << " diameters, ";
    message << needed << " nm. Take a larger box" << (length > 0 ? " or shorter segments" : "");
    throw OpenMMException(message.str());
}

string CylinderChainContactForceImpl::describeFailure(const BrokenCoupling& coupling, const string& other) {
    switch (coupling.reason) {
        case BrokenCoupling::Crosses:
            return "it would pass through "+other+", however short the parts of the step";
        case BrokenCoupling::LeavesBox:
            return "it moves too far for the periodic box, which must be wider than twice what a segment with its "
                    "diameter passes over in a step";
        default:
            return "its contact with "+other+" cannot be solved";
    }
}
