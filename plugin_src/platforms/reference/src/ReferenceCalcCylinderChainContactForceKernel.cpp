#include "ReferenceCalcCylinderChainContactForceKernel.h"
#include "openmm/OpenMMException.h"
#include <algorithm>
#include <stdexcept>

using namespace OpenMM;
using namespace cylchain;
using namespace std;

/**
 * The skin, over the median diameter: a list lasts longer with a larger one, but has more pairs. Over that of a large
 * sphere, all pairs of filaments beside it would be in the list.
 */
static const double SKIN = 0.75;

/** Pairs that are looked at by one thread at a time. */
static const int CHUNK = 512;

/** A contact of a pair. */
struct ReferenceCalcCylinderChainContactForceKernel::Touching {
    int pair;
    Contact contact;
};

ReferenceCalcCylinderChainContactForceKernel::ReferenceCalcCylinderChainContactForceKernel(string name,
        const Platform& platform, shared_ptr<HostParticles> particles) :
        CalcCylinderChainContactForceKernel(name, platform), host(particles), search(NULL), stiffness(0), skin(0),
        periodic(false), hasList(false), noted(NULL) {
}

void ReferenceCalcCylinderChainContactForceKernel::initialize(const System&, ContactSearch& search, double stiffness,
        bool periodic) {
    this->search = &search;
    this->stiffness = stiffness;
    this->periodic = periodic;
    for (const Capsule& capsule : search.getSystem().capsules)
        for (int particle : {capsule.first, capsule.end()})
            particles.push_back(particle);
    sort(particles.begin(), particles.end());
    particles.erase(unique(particles.begin(), particles.end()), particles.end());
    host->include(particles);
}

bool ReferenceCalcCylinderChainContactForceKernel::isListValid(const vector<Vec3>& positions, const Vec3* box) const {
    if (!hasList || (periodic && !equal(box, box+3, listBox)))
        return false;
    const double limit = 0.25*skin*skin;
    double largest = 0;
    bool finite = true;
    for (size_t i = 0; i < particles.size(); i++) {
        const Vec3 moved = positions[particles[i]]-listPositions[i];
        const double square = moved.dot(moved);
        largest = max(largest, square);
        finite &= square < limit;
    }
    // NaN fails.

    return finite && largest < limit;
}

void ReferenceCalcCylinderChainContactForceKernel::findPairs(vector<Vec3>& positions, Vec3* box) {
    vector<double> diameters;
    for (const Capsule& capsule : search->getSystem().capsules)
        diameters.push_back(2*capsule.radius);
    const auto median = diameters.begin()+diameters.size()/2;
    nth_element(diameters.begin(), median, diameters.end());
    hasList = false;
    const Loop run = [&] (int count, const function<void(int)>& iteration) {
        host->getLoop().run(count, iteration);
    };
    // A box that is too small for a skin may be large enough for contacts.

    for (skin = SKIN*(*median); ; skin = 0)
        try {
            search->findPairs(&positions[0][0], &positions[0][0], periodic ? &box[0][0] : NULL, skin, pairs, run);
            break;
        }
        catch (const invalid_argument& error) {
            if (skin == 0 || !periodic)
                throw OpenMMException(string("CylinderChainContactForce: ")+error.what());
        }
    listPositions.resize(particles.size());
    for (size_t i = 0; i < particles.size(); i++)
        listPositions[i] = positions[particles[i]];
    copy(box, box+3, listBox);
    hasList = true;
}

double ReferenceCalcCylinderChainContactForceKernel::execute(ContextImpl&, bool includeForces, bool) {
    if (particles.empty())
        return 0;
    host->update();
    vector<Vec3>& positions = host->getPositions();
    Vec3* const box = host->getBox();
    if (!isListValid(positions, box))
        findPairs(positions, box);
    const double* x = &positions[0][0];
    const int chunks = (pairs.size()+CHUNK-1)/CHUNK;
    vector<vector<Touching> > touching(chunks);
    host->getLoop().run(chunks, [&] (int chunk) {
        const int last = min((int) pairs.size(), (chunk+1)*CHUNK);
        for (int pair = chunk*CHUNK; pair < last; pair++) {
            Contact contacts[2];
            const int count = search->evaluate(pairs[pair], x, x, contacts, 0);
            for (int i = 0; i < count; i++)
                touching[chunk].push_back({pair, contacts[i]});
        }
    });

    // Those that touch are few, so one thread adds their forces, in the order of pairs.

    if (includeForces && noted != NULL)
        noted->clear();
    vector<Vec3>& forces = host->beginForces();
    double energy = 0;
    for (const vector<Touching>& part : touching)
        for (const Touching& one : part) {
            const Contact& contact = one.contact;
            const double k = contact.weight*stiffness;
            energy += 0.5*k*contact.gap*contact.gap;
            if (!includeForces)
                continue;
            const Push push = pushOfContact(search->getSystem(), pairs[one.pair].a, pairs[one.pair].b, contact.s,
                    contact.t, -k*contact.gap, contact.normal);
            for (int i = 0; i < 4; i++)
                forces[push.particles[i]] += Vec3(push.force[0], push.force[1], push.force[2])*push.shares[i];
            if (noted != NULL)
                noted->push_back(push);
        }
    if (includeForces)
        host->endForces();
    return energy;
}

void ReferenceCalcCylinderChainContactForceKernel::notePushes(vector<Push>& pushes) {
    noted = &pushes;
}

void ReferenceCalcCylinderChainContactForceKernel::copyParametersToContext(ContextImpl&, double stiffness) {
    this->stiffness = stiffness;
    hasList = false;
}

ImplicitCouplings* ReferenceCalcCylinderChainContactForceKernel::getEquations(ContextImpl&,
        const vector<CapsuleOnCurve>& onCurves, const vector<CurveSite>& sites, CouplingImpulses& impulses) {
    const double* box = periodic ? &host->getBox()[0][0] : NULL;
    equations.setContacts({search, stiffness, box, &onCurves, &sites, &impulses});
    return &equations;
}
