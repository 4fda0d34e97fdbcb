#include "dynamics/ChainEngine.h"
#include "dynamics/EnginePacks.h"
#include "dynamics/PackPlaces.h"
#include "dynamics/PackStep.h"
#include "dynamics/PlannedDivision.h"
#include "lanes/InstructionSet.h"
#include <algorithm>
#include <cstddef>
#include <stdexcept>
#include <tuple>

using namespace cylchain;
using namespace std;

namespace {

/** The pieces of the chains of a pack that are few and long, or NULL. */
unique_ptr<ChainPieces> piecesOf(const vector<Chain>& chains, const vector<int>& members) {
    if (!ChainPieces::mayBeUsed(chains, members, bestKernels().wide.lanes))
        return NULL;
    return make_unique<ChainPieces>(chains, members, bestKernels().lanes, bestKernels().wide.lanes);
}

template <class Scalar> ParticleRange particlesOf(const ChainPack<Scalar>& pack) {
    return {pack.particlesOfChains.data(), pack.particlesOfChains.data()+pack.particlesOfChains.size()};
}

} // namespace

void SegmentForces::add(const SegmentForces& other, double weight) {
    tension += weight*other.tension;
    for (int k = 0; k < 3; k++) {
        minus[k] += weight*other.minus[k];
        plus[k] += weight*other.plus[k];
        direction[k] += weight*other.direction[k];
    }
}

void ChainEngine::Implementation::add(const vector<Chain>& chains, const vector<int>& own, int lanes) {
    members.push_back(own);
    packs.emplace_back();
    pieces.emplace_back();
    fill(packs.size()-1, chains, lanes);
}

void ChainEngine::Implementation::fill(int pack, const vector<Chain>& chains, int lanes) {
    packs[pack] = packed(chains, members[pack], lanes, tables);
}

WidePack ChainEngine::Implementation::widePackOf(const vector<Chain>& chains, int first, int last) const {
    vector<int> together;
    for (int pack = first; pack < last; pack++)
        together.insert(together.end(), members[pack].begin(), members[pack].end());
    return WidePack(chains, together, first, last);
}

ChainEngine::ChainEngine(const vector<Chain>& chains, bool mayChange) : ChainEngine(chains, {}, mayChange) {
}

ChainEngine::ChainEngine(const vector<Chain>& chains, const vector<PieceOfChain>& origins) :
        ChainEngine(chains, origins, false) {
}

ChainEngine::ChainEngine(const vector<Chain>& chains, const vector<PieceOfChain>& origins, bool mayChange) {
    for (size_t i = 0; i < chains.size(); i++)
        if (!isEntry(chains[i].bending) || !isEntry(chains[i].stretching))
            throw invalid_argument("Chain "+to_string(i)+" has a model that there is not");
    implementation.reset(new Implementation(origins.empty() ? chains : vector<Chain>()));
    implementation->mayChange = mayChange;
    // Chains of similar length come next to each other, the longest first, so that threads end together.
    // Those that are empty now are in none.
    vector<int> order;
    for (size_t i = 0; i < chains.size(); i++)
        if (!chains[i].nodes.empty())
            order.push_back(i);
    stable_sort(order.begin(), order.end(), [&] (int a, int b) {
        auto key = [&] (const Chain& chain) {
            return make_tuple(-(int) chain.nodes.size(), chain.bending, chain.stretching, chain.closed, chain.planar,
                    chain.nodeFriction > 0, chain.twist.isPresent());
        };
        return key(chains[a]) < key(chains[b]);
    });
    vector<vector<int> >& members = implementation->members;
    for (size_t first = 0; first < order.size();) {
        int fitting = 1;
        while (fitting < bestKernels().lanes && first+fitting < order.size() &&
                mayShareLanes(chains[order[first]], chains[order[first+fitting]]))
            fitting++;
        implementation->add(chains, {order.begin()+first, order.begin()+first+fitting},
                lanesFor(fitting, bestKernels().lanes));
        if (!origins.empty())
            setOrigins(implementation->packs.back(), origins);
        else if (!mayChange)
            implementation->pieces.back() = piecesOf(chains, members.back());
        first += fitting;
    }

    // Wide packs are made of those that come next to each other.
    for (size_t first = 0, last; first < members.size(); first = last) {
        const Chain& longest = chains[members[first][0]];
        int lanes = implementation->packs[first].lanes;
        for (last = first+1; last < members.size(); last++) {
            lanes += implementation->packs[last].lanes;
            if (lanes > bestKernels().wide.lanes || !mayShareLanes(longest, chains[members[last].back()]))
                break;
        }
        if (!longest.closed && !hasRange(longest.stretching) && !longest.twist.isBentAtRest())
            implementation->wide.push_back(implementation->widePackOf(chains, first, last));
    }
    if (mayChange)
        implementation->findLimits(chains);
}

ChainEngine::~ChainEngine() {
}

int ChainEngine::getNumPacks() const {
    return implementation->packs.size();
}

vector<int> ChainEngine::getPacksOfStep(const StepSettings& settings) const {
    vector<int> result;
    if (settings.scheme == Scheme::Modes) {
        result = implementation->modes.getPacksOfStep(settings);
        for (int& pack : result)
            pack += getNumPacks()+implementation->wide.size();
        return result;
    }
    int next = 0;
    const lock_guard<mutex> lock(implementation->making);
    for (size_t wide = 0; wide < implementation->wide.size(); wide++) {
        WidePack& pack = implementation->wide[wide];
        const ChainPieces* const pieces = pack.last == pack.first+1 ? implementation->piecesOf(pack.first) : NULL;
        const WidePack& limits = implementation->mayChange ? *implementation->limits : pack;
        if (!limits.isUsed(settings) || (pieces != NULL && pieces->isUsed(settings)))
            continue;
        pack.make(implementation->packs, implementation->wideTables);
        for (; next < pack.first; next++)
            result.push_back(next);
        result.push_back(getNumPacks()+wide);
        next = pack.last;
    }
    for (; next < getNumPacks(); next++)
        result.push_back(next);
    return result;
}

int ChainEngine::getNumMixedChains(const vector<int>& packs) const {
    int count = 0;
    for (int pack : packs)
        count += implementation->with(pack, [] (const auto&) {return 0;},
                [] (const WidePack& wide) {return wide.chains;},
                [&] (int modes) {return implementation->modes.getNumWideChains(modes);});
    return count;
}

int ChainEngine::getNumMixedChains(const vector<int>& packs, const StepSettings& settings) const {
    int count = getNumMixedChains(packs);
    for (int pack : packs) {
        ChainPieces* const pieces = implementation->piecesOf(pack);
        if (pieces != NULL && pieces->isUsed(settings) && pieces->isMixed(settings))
            count += pieces->getNumChains();
    }
    return count;
}

ChainEnergy ChainEngine::addForces(int pack, const double* positions, double* forces, const double* box,
            bool includeEnergy, const vector<vector<double> >* twists) const {
    return bestKernels().addForces(implementation->packs[pack], positions, forces, box, includeEnergy, twists);
}

ParticleRange ChainEngine::getParticles(int pack) const {
    const ModePacks& modes = implementation->modes;
    return implementation->with(pack, [] (const ChainPack<double>& own) {return particlesOf(own);},
            [] (const WidePack& wide) {return particlesOf(*wide.pack);},
            [&] (int own) {return modes.isWide(own) ? particlesOf(modes.getWide(own).pack) :
                    particlesOf(modes.get(own).pack);});
}

void ChainEngine::clearForces(int pack, double* forces) const {
    for (int particle : getParticles(pack))
        forces[3*particle] = forces[3*particle+1] = forces[3*particle+2] = 0;
}

Instability ChainEngine::step(int pack, const double* positions, const double* forces, const double* box,
            const StepSettings& settings, double* displacements) const {
    if (implementation->isOfModes(pack) != (settings.scheme == Scheme::Modes))
        throw invalid_argument("Pack "+to_string(pack)+" is not for this scheme");
    const ModePacks& modes = implementation->modes;
    auto stepOf = [&] (auto function, const auto& own) {
        return function(own, positions, forces, box, settings, displacements);
    };
    ChainPieces* const pieces = implementation->piecesOf(pack);
    Instability result;
    if (pieces != NULL && pieces->isUsed(settings) &&
            pieces->step(positions, forces, box, settings, displacements, result))
        return result;
    return implementation->with(pack, [&] (const ChainPack<double>& own) {return stepOf(bestKernels().step, own);},
            [&] (const WidePack& wide) {return stepOf(bestKernels().wide.step, *wide.pack);},
            [&] (int own) {return modes.isWide(own) ? stepOf(bestKernels().wide.stepOfModes, modes.getWide(own)) :
                    stepOf(bestKernels().stepOfModes, modes.get(own));});
}

bool ChainEngine::isStepDivided(int pack, int lane, const StepSettings& settings) const {
    return implementation->with(pack, [&] (const auto& own) {return plannedDivision(own, settings, lane) > 0;},
            [&] (const WidePack& wide) {return plannedDivision(*wide.pack, settings, lane) > 0;},
            [] (int) {return false;});
}

unique_ptr<PackStep> ChainEngine::createStep(int pack) const {
    typedef unique_ptr<PackStep> Step;
    return implementation->with(pack, [] (const auto& own) {return Step(bestKernels().createStep(own));},
            [] (const WidePack& wide) {return Step(bestKernels().wide.createStep(*wide.pack));},
            [] (int) -> Step {throw invalid_argument("A pack of modes takes no implicit steps");});
}

const vector<int>& ChainEngine::getChainsOfLanes(int pack) const {
    typedef const vector<int>& Chains;
    const ModePacks& modes = implementation->modes;
    return implementation->with(pack, [] (const ChainPack<double>& own) -> Chains {return own.chain;},
            [] (const WidePack& wide) -> Chains {return wide.pack->chain;},
            [&] (int own) -> Chains {return modes.isWide(own) ? modes.getWide(own).pack.chain :
                    modes.get(own).pack.chain;});
}

void cylchain::drawWords(const NoiseKey& key, NoiseKind kind, uint32_t draw, const uint32_t* chains,
            const uint32_t* parts, int count, uint32_t* words) {
    bestKernels().drawWords(key, kind, draw, chains, parts, count, words);
}

void cylchain::drawNormals(const NoiseKey& key, NoiseKind kind, const uint32_t* chains, const uint32_t* parts,
            int count, double* normals) {
    bestKernels().drawNormals(key, kind, chains, parts, count, normals);
}

void cylchain::drawNormalsInSinglePrecision(const NoiseKey& key, NoiseKind kind, const uint32_t* chains,
            const uint32_t* parts, int count, double* normals) {
    bestKernels().wide.drawNormals(key, kind, chains, parts, count, normals);
}

void cylchain::drawFeneCoordinates(const NoiseKey& key, const uint32_t* chains, const uint32_t* segments,
            const double* stiffness, int count, double* coordinates) {
    bestKernels().drawFeneCoordinates(key, chains, segments, stiffness, count, coordinates);
}

void cylchain::transformCosines(int length, int count, double* values, bool inverse) {
    bestKernels().transformCosines(length, count, values, inverse);
}

void cylchain::transformCosinesInSinglePrecision(int length, int count, double* values, bool inverse) {
    bestKernels().wide.transformCosines(length, count, values, inverse);
}

string ChainEngine::getInstructionSet() {
    return bestKernels().instructionSet;
}
