#include "ChainEngine.h"
#include "ChainPack.h"
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdlib>
#include <numeric>
#include <tuple>

using namespace cylchain;
using namespace std;

namespace {

/** Chains share a pack if they use the same models and at most a fifth of a lane is filled up. */
const double LARGEST_FILLING = 0.2;

const ChainKernels& bestKernels() {
#ifdef CYLCHAIN_X86_64
    // CYLCHAIN_INSTRUCTION_SET names a lesser instruction set to use, for tests and comparisons.
    const char* chosen = getenv("CYLCHAIN_INSTRUCTION_SET");
    const string limit = (chosen == NULL ? "avx512" : chosen);
    if (limit == "avx512" && __builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512dq"))
        return avx512Kernels();
    if (limit != "baseline" && __builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma"))
        return avx2Kernels();
#endif
    return baselineKernels();
}

const ChainKernels& kernels() {
    static const ChainKernels& best = bestKernels();
    return best;
}

bool mayShareLanes(const Chain& longest, const Chain& chain) {
    return chain.bending == longest.bending && chain.stretching == longest.stretching &&
            chain.segments.size() >= (1-LARGEST_FILLING)*longest.segments.size();
}

void fillLane(ChainPack& pack, int lane, const Chain& chain, int index) {
    const int lanes = pack.lanes;
    pack.chain[lane] = index;
    pack.nodesOfLane[lane] = chain.nodes.size();
    for (size_t node = 0; node < chain.nodes.size(); node++) {
        pack.particles[node*lanes+lane] = chain.nodes[node];
        pack.mobile[node*lanes+lane] = chain.fixed[node] ? 0.0 : 1.0;
    }
    for (size_t joint = 0; joint < chain.joints.size(); joint++)
        pack.joints[(joint+1)*lanes+lane] = chain.joints[joint];
    for (const Tether& tether : chain.tethers)
        pack.tethers.push_back({tether, lane});
    for (int s = 0; s < pack.nodes-1; s++) {
        const bool filling = (s >= (int) chain.segments.size());
        const Segment segment = filling ? Segment {1, 0, 1, 0, 0, 0, 0} : chain.segments[s];
        double* properties = &pack.properties[(size_t) s*ChainPack::NumProperties*lanes+lane];
        properties[ChainPack::RestLength*lanes] = segment.restLength;
        properties[ChainPack::Stiffness*lanes] = segment.stiffness;
        properties[ChainPack::InverseExtension*lanes] = segment.maximumExtension > 0 ? 1/segment.maximumExtension : 0;
        properties[ChainPack::Parallel*lanes] = segment.parallel;
        properties[ChainPack::Perpendicular*lanes] = segment.perpendicular;
        properties[ChainPack::Rotational*lanes] = segment.rotational;
        properties[ChainPack::Extensional*lanes] = segment.extensional;
        properties[ChainPack::RootParallel*lanes] = sqrt(segment.parallel);
        properties[ChainPack::RootPerpendicular*lanes] = sqrt(segment.perpendicular);
        properties[ChainPack::RootRotational*lanes] = sqrt(segment.rotational);
        properties[ChainPack::RootExtensional*lanes] = sqrt(segment.extensional);
        properties[ChainPack::Drift*lanes] = filling ? 0.0 : 2-segment.extensional/segment.rotational;
    }
}

ChainPack packed(const vector<Chain>& chains, const vector<int>& members) {
    ChainPack pack;
    pack.lanes = members.size();
    pack.nodes = chains[members[0]].nodes.size();
    pack.bending = chains[members[0]].bending;
    pack.stretching = chains[members[0]].stretching;
    pack.chain.resize(pack.lanes);
    pack.nodesOfLane.resize(pack.lanes);
    const size_t places = (size_t) pack.nodes*pack.lanes;
    pack.particles.resize(places, -1);
    pack.mobile.resize(places, 0.0);
    pack.joints.resize(places, 0.0);
    pack.properties.resize((places-pack.lanes)*ChainPack::NumProperties);
    for (int lane = 0; lane < pack.lanes; lane++)
        fillLane(pack, lane, chains[members[lane]], members[lane]);
    stable_sort(pack.tethers.begin(), pack.tethers.end(), [] (const LaneTether& a, const LaneTether& b) {
        return a.node < b.node;
    });
    return pack;
}

} // namespace

struct ChainEngine::Implementation {
    vector<ChainPack> packs;
};

ChainEngine::ChainEngine(const vector<Chain>& chains) : implementation(new Implementation()) {
    // Chains of similar length come next to each other, the longest first, so that threads end together.
    vector<int> order(chains.size());
    iota(order.begin(), order.end(), 0);
    stable_sort(order.begin(), order.end(), [&] (int a, int b) {
        return make_tuple(-(int) chains[a].nodes.size(), chains[a].bending, chains[a].stretching) <
                make_tuple(-(int) chains[b].nodes.size(), chains[b].bending, chains[b].stretching);
    });
    for (size_t first = 0; first < order.size();) {
        int fitting = 1;
        while (fitting < kernels().lanes && first+fitting < order.size() &&
                mayShareLanes(chains[order[first]], chains[order[first+fitting]]))
            fitting++;
        int lanes = 1;
        while (2*lanes <= fitting)
            lanes *= 2;
        implementation->packs.push_back(packed(chains, vector<int>(order.begin()+first, order.begin()+first+lanes)));
        first += lanes;
    }
}

ChainEngine::~ChainEngine() {
}

int ChainEngine::getNumPacks() const {
    return implementation->packs.size();
}

ChainEnergy ChainEngine::addForces(int pack, const double* positions, double* forces, const double* box,
            bool includeEnergy) const {
    return kernels().addForces(implementation->packs[pack], positions, forces, box, includeEnergy);
}

const vector<int>& ChainEngine::getParticles(int pack) const {
    return implementation->packs[pack].particles;
}

void ChainEngine::clearForces(int pack, double* forces) const {
    for (int particle : implementation->packs[pack].particles)
        if (particle >= 0)
            forces[3*particle] = forces[3*particle+1] = forces[3*particle+2] = 0;
}

Instability ChainEngine::step(int pack, const double* positions, const double* forces, const double* box,
            const StepSettings& settings, double* displacements) const {
    return kernels().step(implementation->packs[pack], positions, forces, box, settings, displacements);
}

string ChainEngine::getInstructionSet() {
    return kernels().instructionSet;
}
