#include "beams/BeamEngine.h"
#include "beams/BeamPack.h"
#include "dynamics/PackPlaces.h"
#include "lanes/InstructionSet.h"
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <numeric>
#include <stdexcept>
#include <string>
#include <tuple>

using namespace cylchain;
using namespace std;

/** Chains share a pack if at most a fifth of a lane is filled up. */
static const double LARGEST_FILLING = 0.2;

static const BeamKernels& kernels() {
    return loopsOfBest<baselineBeamKernels, avx2BeamKernels, avx512BeamKernels>();
}

/** The fewest nodes of a ring: its elements bend by a third of a turn. */
static const int FEWEST_NODES_OF_RING = 3;

static void check(const BeamChain& chain, int index) {
    const string name = "Beam chain "+to_string(index);
    if (chain.closed && chain.numNodes() < FEWEST_NODES_OF_RING)
        throw invalid_argument(name+" is closed, and must have at least "+to_string(FEWEST_NODES_OF_RING)+" nodes");
    if (chain.numNodes() < 2 || chain.particles.size()%2 != 0)
        throw invalid_argument(name+" must have two particles for each of at least two nodes");
    if (chain.fixed.size() != chain.particles.size())
        throw invalid_argument(name+" must say for each particle whether it is fixed");
    if (chain.findLoneControlPoint() >= 0)
        throw invalid_argument(name+": the control point of node "+to_string(chain.findLoneControlPoint())+
                " is fixed, but its position is not");
    for (const Tether& tether : chain.tethers)
        if (tether.node < 0 || tether.node >= chain.numNodes())
            throw invalid_argument(name+" has a tether at node "+to_string(tether.node)+", which it has not");
}

static void fillLane(BeamPack& pack, int lane, const BeamChain& chain, int index, int firstNoise) {
    const int lanes = pack.lanes;
    pack.chain[lane] = index;
    pack.noiseChain[lane] = firstNoise+index;
    pack.nodesOfLane[lane] = chain.numElements()+1;
    const double properties[] = {chain.elementLength, chain.stretchingModulus, chain.bendingRigidity,
            chain.shortening, chain.parallelFriction, chain.perpendicularFriction, chain.propulsion};
    pack.propelled |= chain.propulsion != 0;
    for (int property = 0; property < BeamPack::NumProperties; property++)
        pack.properties[property*lanes+lane] = properties[property];
    for (int place = 0; place < 2*pack.nodesOfLane[lane]; place++) {
        const size_t i = place%chain.particles.size();
        pack.particles[place*lanes+lane] = chain.particles[i];
        pack.mobile[place*lanes+lane] = chain.fixed[i] ? 0 : 1;
    }
    for (int element = 0; element < chain.numElements(); element++)
        pack.present[element*lanes+lane] = 1;
    pack.free[lane] = any_of(chain.fixed.begin(), chain.fixed.end(), [] (bool fixed) {return fixed;}) ? 0 : 1;
    pack.particlesOfChains.insert(pack.particlesOfChains.end(), chain.particles.begin(), chain.particles.end());
    for (size_t number = 0; number < chain.tethers.size(); number++)
        pack.tethers.push_back({chain.tethers[number], lane, (int) number});
}

/** The largest power of two that is not above a number of chains: these packs have no lanes without a chain. */
static int lanesForBeams(int chains) {
    int lanes = 1;
    while (2*lanes <= chains)
        lanes *= 2;
    return lanes;
}

static BeamPack packed(const vector<BeamChain>& chains, const int* members, int lanes, int firstNoise) {
    BeamPack pack;
    const BeamChain& longest = chains[members[0]];
    pack.lanes = lanes;
    pack.nodes = longest.numElements()+1;
    pack.planar = longest.planar;
    pack.closed = longest.closed;
    pack.chain.resize(lanes);
    pack.noiseChain.resize(lanes);
    pack.nodesOfLane.resize(lanes);
    pack.free.resize(lanes);
    pack.properties.resize((size_t) BeamPack::NumProperties*lanes);
    pack.particles.resize((size_t) 2*pack.nodes*lanes, -1);
    pack.mobile.resize((size_t) 2*pack.nodes*lanes, 0.0);
    pack.present.resize((size_t) pack.nodes*lanes, 0.0);
    for (int lane = 0; lane < lanes; lane++)
        fillLane(pack, lane, chains[members[lane]], members[lane], firstNoise);
    stable_sort(pack.tethers.begin(), pack.tethers.end(), [] (const BeamTether& a, const BeamTether& b) {
        return a.node < b.node;
    });
    return pack;
}

struct BeamEngine::Implementation {
    vector<BeamPack> packs;
    /** The longest element over its persistence length, times k_B T, of those with a rigidity; and its chain. */
    double softness = 0;
    int softest = -1;
};

BeamEngine::BeamEngine(const vector<BeamChain>& chains, int firstNoise) : implementation(new Implementation()) {
    for (size_t i = 0; i < chains.size(); i++) {
        check(chains[i], i);
        const double softness = chains[i].bendingRigidity > 0 ? chains[i].elementLength/chains[i].bendingRigidity : 0;
        if (softness > implementation->softness) {
            implementation->softness = softness;
            implementation->softest = i;
        }
    }
    // Chains of similar length come next to each other, the longest first, so that threads end together.
    vector<int> order(chains.size());
    iota(order.begin(), order.end(), 0);
    stable_sort(order.begin(), order.end(), [&] (int a, int b) {
        return make_tuple(-chains[a].numNodes(), chains[a].planar, chains[a].closed) <
                make_tuple(-chains[b].numNodes(), chains[b].planar, chains[b].closed);
    });
    for (size_t first = 0; first < order.size();) {
        const BeamChain& longest = chains[order[first]];
        const int least = longest.closed ? longest.numNodes() :
                ceil((1-LARGEST_FILLING)*(longest.numNodes()-1))+1;
        int fitting = 1;
        while (fitting < kernels().lanes && first+fitting < order.size() &&
                chains[order[first+fitting]].numNodes() >= least &&
                chains[order[first+fitting]].planar == longest.planar &&
                chains[order[first+fitting]].closed == longest.closed)
            fitting++;
        const int lanes = lanesForBeams(fitting);
        implementation->packs.push_back(packed(chains, &order[first], lanes, firstNoise));
        first += lanes;
    }
}

BeamEngine::~BeamEngine() {
}

int BeamEngine::getNumPacks() const {
    return implementation->packs.size();
}

unique_ptr<PackStep> BeamEngine::createStep(int pack) const {
    return unique_ptr<PackStep>(kernels().newStep(implementation->packs[pack]));
}

const vector<int>& BeamEngine::getChainsOfLanes(int pack) const {
    return implementation->packs[pack].chain;
}

ParticleRange BeamEngine::getParticles(int pack) const {
    const vector<int>& particles = implementation->packs[pack].particlesOfChains;
    return {particles.data(), particles.data()+particles.size()};
}

void BeamEngine::clearForces(int pack, double* forces) const {
    for (int particle : getParticles(pack))
        forces[3*particle] = forces[3*particle+1] = forces[3*particle+2] = 0;
}

ChainEnergy BeamEngine::addForces(int pack, const double* positions, double* forces, const double* box,
            bool includeEnergy) const {
    return kernels().addForces(implementation->packs[pack], positions, forces, box, includeEnergy);
}

Instability BeamEngine::step(int pack, const double* positions, const double* forces, const double* box,
            const StepSettings& settings, double* displacements) const {
    if (settings.scheme != Scheme::Implicit)
        throw invalid_argument("Beam elements are for scheme \"implicit\" alone");
    const double length = settings.kT*implementation->softness;
    if (length > LONGEST_ELEMENT)
        throw invalid_argument("The elements of beam chain "+to_string(implementation->softest)+" are "+
                to_string(length)+" persistence lengths long; they must not be longer than "+
                to_string(LONGEST_ELEMENT)+": divide the filament into more");
    return kernels().step(implementation->packs[pack], positions, forces, box, settings, displacements);
}
