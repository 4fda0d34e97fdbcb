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
    const size_t least = longest.closed ? longest.segments.size() : ceil((1-LARGEST_FILLING)*longest.segments.size());
    return chain.bending == longest.bending && chain.stretching == longest.stretching && chain.closed == longest.closed &&
            chain.planar == longest.planar && chain.segments.size() >= least;
}

void fillLane(ChainPack& pack, int lane, const Chain& chain, int index) {
    const int lanes = pack.lanes;
    const size_t own = chain.nodes.size(), unrolled = own+(chain.closed ? 2 : 0);
    pack.chain[lane] = index;
    pack.nodesOfLane[lane] = unrolled;
    pack.segmentsOfLane[lane] = chain.segments.size();
    for (size_t node = 0; node < unrolled; node++) {
        pack.particles[node*lanes+lane] = chain.nodes[node%own];
        pack.mobile[node*lanes+lane] = chain.fixed[node%own] ? 0.0 : 1.0;
    }
    pack.free[lane] = any_of(chain.fixed.begin(), chain.fixed.end(), [] (bool fixed) {return fixed;}) ? 0.0 : 1.0;
    for (size_t node = 1; node < unrolled-1; node++)
        pack.joints[node*lanes+lane] = chain.joints[chain.closed ? node%own : node-1];
    for (size_t number = 0; number < chain.tethers.size(); number++)
        pack.tethers.push_back({chain.tethers[number], lane, (int) number});
    for (int s = 0; s < pack.nodes-1; s++) {
        const bool filling = (s >= (int) unrolled-1);
        const Segment segment = filling ? Segment {1, 0, 1, 0, 0, 0, 0} : chain.segments[s%chain.segments.size()];
        double* properties = &pack.properties[(size_t) s*ChainPack::NumProperties*lanes+lane];
        properties[ChainPack::RestLength*lanes] = segment.restLength;
        properties[ChainPack::InverseRestLength*lanes] = 1/segment.restLength;
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
        const int dimensions = chain.planar ? 2 : 3;
        properties[ChainPack::Drift*lanes] = filling ? 0.0 :
                dimensions+1-(dimensions-1)*segment.extensional/segment.rotational;
        if (segment.propulsion != 0) {
            pack.propulsions.resize((size_t) (pack.nodes-1)*lanes);
            pack.propulsions[(size_t) s*lanes+lane] = 0.5*segment.propulsion;
        }
    }
}

ChainPack packed(const vector<Chain>& chains, const vector<int>& members) {
    ChainPack pack;
    const Chain& longest = chains[members[0]];
    pack.lanes = members.size();
    pack.nodes = longest.nodes.size()+(longest.closed ? 2 : 0);
    pack.segments = longest.segments.size();
    pack.bending = longest.bending;
    pack.stretching = longest.stretching;
    pack.closed = longest.closed;
    pack.planar = longest.planar;
    pack.chain.resize(pack.lanes);
    pack.nodesOfLane.resize(pack.lanes);
    pack.segmentsOfLane.resize(pack.lanes);
    pack.free.resize(pack.lanes);
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

void cylchain::takeToNearestImage(double* displacement, const double* box) {
    for (int k = 2; k >= 0; k--) {
        const double images = floor(displacement[k]/box[4*k]+0.5);
        for (int j = 0; j < 3; j++)
            displacement[j] -= images*box[3*k+j];
    }
}

bool BackgroundFlow::varies() const {
    return any_of(gradient, gradient+9, [] (double derivative) {return derivative != 0;});
}

void BackgroundFlow::getVelocity(const double* x, double* result) const {
    double r[] = {x[0]-origin[0], x[1]-origin[1], x[2]-origin[2]};
    if (box != NULL)
        takeToNearestImage(r, box);
    for (int i = 0; i < 3; i++)
        result[i] = velocity[i]+gradient[3*i]*r[0]+gradient[3*i+1]*r[1]+gradient[3*i+2]*r[2];
}

void SegmentForces::add(const SegmentForces& other, double weight) {
    tension += weight*other.tension;
    for (int k = 0; k < 3; k++) {
        minus[k] += weight*other.minus[k];
        plus[k] += weight*other.plus[k];
        direction[k] += weight*other.direction[k];
    }
}

struct ChainEngine::Implementation {
    vector<ChainPack> packs;
};

ChainEngine::ChainEngine(const vector<Chain>& chains) : implementation(new Implementation()) {
    // Chains of similar length come next to each other, the longest first, so that threads end together.
    vector<int> order(chains.size());
    iota(order.begin(), order.end(), 0);
    stable_sort(order.begin(), order.end(), [&] (int a, int b) {
        auto key = [&] (const Chain& chain) {
            return make_tuple(-(int) chain.nodes.size(), chain.bending, chain.stretching, chain.closed, chain.planar);
        };
        return key(chains[a]) < key(chains[b]);
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

ParticleRange ChainEngine::getParticles(int index) const {
    const ChainPack& pack = implementation->packs[index];
    return {pack.particles.data(), pack.particles.data()+(size_t) pack.ownNodes()*pack.lanes};
}

void ChainEngine::clearForces(int pack, double* forces) const {
    for (int particle : getParticles(pack))
        if (particle >= 0)
            forces[3*particle] = forces[3*particle+1] = forces[3*particle+2] = 0;
}

Instability ChainEngine::step(int pack, const double* positions, const double* forces, const double* box,
            const StepSettings& settings, double* displacements) const {
    return kernels().step(implementation->packs[pack], positions, forces, box, settings, displacements);
}

void cylchain::drawWords(const NoiseKey& key, NoiseKind kind, uint32_t draw, const uint32_t* chains, const uint32_t* parts,
            int count, uint32_t* words) {
    kernels().drawWords(key, kind, draw, chains, parts, count, words);
}

void cylchain::drawNormals(const NoiseKey& key, NoiseKind kind, const uint32_t* chains, const uint32_t* parts, int count,
            double* normals) {
    kernels().drawNormals(key, kind, chains, parts, count, normals);
}

void cylchain::drawFeneCoordinates(const NoiseKey& key, const uint32_t* chains, const uint32_t* segments,
            const double* stiffness, int count, double* coordinates) {
    kernels().drawFeneCoordinates(key, chains, segments, stiffness, count, coordinates);
}

string ChainEngine::getInstructionSet() {
    return kernels().instructionSet;
}
