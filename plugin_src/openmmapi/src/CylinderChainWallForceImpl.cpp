#include "openmm/internal/CylinderChainWallForceImpl.h"
#include "couplings/EndWalls.h"
#include "openmm/CylinderChainKernels.h"
#include "openmm/OpenMMException.h"
#include "openmm/System.h"
#include "openmm/internal/ContextImpl.h"
#include <algorithm>
#include <map>

using namespace OpenMM;
using namespace cylchain;
using namespace std;

CylinderChainWallForceImpl::CylinderChainWallForceImpl(const CylinderChainWallForce& owner) : PushForceImpl(owner),
        owner(owner), walls(owner.getWalls()) {
}

WallSystem CylinderChainWallForceImpl::describe() const {
    WallSystem result = owner.getWalls();
    const vector<Place> found = owner.findPlaces(*places);
    for (size_t i = 0; i < found.size(); i++) {
        WallParticle& own = result.particles[i];
        if (found[i].isOnCurve())
            own.onCurve = found[i];
        if (result.wall.side != WallSide::Outside && !(own.radius < getRoom(result.wall)))
            throw OpenMMException("CylinderChainWallForce: Particle "+to_string(own.particle)+
                    " with its radius does not fit into the "+Names<WallShape>::ALL[(int) result.wall.shape]);
    }
    auto& particles = result.particles;
    particles.erase(remove_if(particles.begin(), particles.end(), [&] (const WallParticle& own) {
        return isSpare[own.particle];
    }), particles.end());
    return result;
}

void CylinderChainWallForceImpl::setSpareNodes(ContextImpl& context, const vector<bool>& isSpare) {
    this->isSpare = isSpare;
    walls = describe();
    kernel.getAs<CalcCylinderChainWallForceKernel>().copyParametersToContext(context, walls);
}

unique_ptr<Surroundings> CylinderChainWallForceImpl::describeSurroundings(const ChainList& chains,
        const vector<int>& growing) {
    map<int, double> radii;
    for (int i = 0; i < owner.getNumParticles(); i++)
        radii[owner.getParticle(i)] = owner.getParticleRadius(i);
    vector<double> ofChains(chains.size(), -1);
    for (int number : growing) {
        const Chain& chain = chains.getChain(number);
        vector<int> particles = chain.nodes;
        particles.insert(particles.end(), chain.spareNodes.begin(), chain.spareNodes.end());
        const auto first = radii.find(particles[0]);
        if (first != radii.end())
            ofChains[number] = first->second;
        for (int particle : particles) {
            const auto found = radii.find(particle);
            if (found == radii.end() ? ofChains[number] >= 0 : found->second != ofChains[number])
                throw OpenMMException("CylinderChainWallForce: "+chains.getName(number)+" grows, so the wall must hold "
                        "all of its particles, with the same radius, or none, but particle "+to_string(particle)+
                        " differs from particle "+to_string(particles[0]));
        }
    }
    return make_unique<EndWalls>(owner.getWalls().wall, owner.getStiffness(), ofChains);
}

void CylinderChainWallForceImpl::initialize(ContextImpl& context) {
    const System& system = context.getSystem();
    for (int i = 0; i < owner.getNumParticles(); i++)
        if (owner.getParticle(i) >= system.getNumParticles())
            throw OpenMMException("CylinderChainWallForce: Illegal particle index: "+to_string(owner.getParticle(i)));
    places.reset(new PlaceResolver(system));
    isSpare = findSpareNodes(system);
    walls = describe();
    kernel = context.getPlatform().createKernel(CalcCylinderChainWallForceKernel::Name(), context);
    kernel.getAs<CalcCylinderChainWallForceKernel>().initialize(context.getSystem(), walls);
    beginSums(system.getNumParticles());
    kernel.getAs<CalcCylinderChainWallForceKernel>().notePushes(present);
}

void CylinderChainWallForceImpl::findPushes(ContextImpl& context, vector<Push>& pushes) const {
    vector<Vec3> positions;
    context.getPositions(positions);
    cylchain::findPushes(walls, &positions[0][0], pushes);
}

double CylinderChainWallForceImpl::calcForcesAndEnergy(ContextImpl& context, bool includeForces, bool includeEnergy,
        int groups) {
    if (isIn(groups) && !isExcluded())
        return kernel.getAs<CalcCylinderChainWallForceKernel>().execute(context, includeForces, includeEnergy);
    return 0.0;
}

vector<string> CylinderChainWallForceImpl::getKernelNames() {
    return {CalcCylinderChainWallForceKernel::Name()};
}

void CylinderChainWallForceImpl::updateParametersInContext(ContextImpl& context) {
    const WallSystem present = describe();
    const bool same = equal(walls.particles.begin(), walls.particles.end(), present.particles.begin(),
            present.particles.end(), [] (const WallParticle& a, const WallParticle& b) {
                return a.particle == b.particle;
            });
    if (!same)
        throw OpenMMException("CylinderChainWallForce: Particles cannot be added to a Context");
    if ((walls.wall.side == WallSide::Surface) != (present.wall.side == WallSide::Surface))
        throw OpenMMException("CylinderChainWallForce: A wall cannot become a surface in a Context, nor a surface a "
                "wall");
    walls = present;
    kernel.getAs<CalcCylinderChainWallForceKernel>().copyParametersToContext(context, walls);
    versionOfSurroundings++;
    context.systemChanged();
}

ImplicitCouplings* CylinderChainWallForceImpl::getEquations(ContextImpl&) {
    return kernel.getAs<CalcCylinderChainWallForceKernel>().getEquations(getImpulses());
}

string CylinderChainWallForceImpl::describeFailure(const BrokenCoupling&, const string&) {
    return "a wall cannot hold it";
}
