#include "openmm/internal/OtherParticles.h"

using namespace OpenMM;
using namespace std;

OtherParticles::OtherParticles(const System& system, const CylinderChainIntegrator& integrator,
        const CylinderChainDescription& chains) {
    const int numParticles = system.getNumParticles();
    vector<bool> isNode(numParticles, false);
    for (int chain = 0; chain < chains.getList().size(); chain++)
        for (int particle : chains.getList().getParticles(chain))
            isNode[particle] = true;
    for (const cylchain::Chain& chain : chains.getChains())
        for (int particle : chain.spareNodes)
            isNode[particle] = true;
    bodies = chains.getBodies();
    ofBody.assign(numParticles, false);
    for (const cylchain::RigidBody& body : bodies)
        for (int particle : body.particles)
            ofBody[particle] = true;
    masses.resize(numParticles);
    for (int i = 0; i < numParticles; i++) {
        masses[i] = system.getParticleMass(i);
        if (isNode[i])
            continue;
        particles.push_back(i);
        if (masses[i] != 0.0 && !ofBody[i])
            mobile.push_back(i);
    }
    frictions.assign(numParticles, 0.0);
    for (auto& entry : integrator.getParticleFrictions())
        frictions[entry.first] = entry.second;
}
