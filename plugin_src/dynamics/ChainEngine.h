#ifndef CYLCHAIN_CHAIN_ENGINE_H_
#define CYLCHAIN_CHAIN_ENGINE_H_

#include "dynamics/BrokenCoupling.h"
#include "dynamics/Precisions.h"
#include "dynamics/Schemes.h"
#include "mechanics/BackgroundFlow.h"
#include "mechanics/Chain.h"
#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

namespace cylchain {

class PackStep;

/** Energies of a pack of chains. */
struct ChainEnergy {
    double stretching = 0, bending = 0, tethers = 0;
};

/** What has happened in a step. */
struct Instability {
    /**
     * A chain by which the step has gone wrong, or -1: its equations were not solved, a segment would change by more
     * than its rest length, or leave the range of its potential. See findBrokenSegment().
     */
    int chain = -1;
    /** The number of chains for which an implicit step was taken in parts, because its equations were not solved. */
    int divided = 0;
    /** The number of iterations that the equations of an implicit step took. */
    int iterations = 0;
    /** The rigid body that the twist of this chain would turn too far, however often the step is divided, or -1. */
    int body = -1;
    /** Of chains that are coupled: the coupling that is at fault, if there is one. */
    BrokenCoupling coupling = {};
};

/** The particles of a pack, each of them once, chain by chain. */
class ParticleRange {
public:
    ParticleRange(const int* first, const int* last) : first(first), last(last) {
    }
    const int* begin() const {
        return first;
    }
    const int* end() const {
        return last;
    }
private:
    const int *first, *last;
};

/** The largest level of a step that may be divided. */
const int LARGEST_LEVEL = 20;

/** Forces of a segment in a step of the implicit scheme: means over its time, with friction and noise. */
struct SegmentForces {
    /** Along the segment, positive where it pulls its ends together. */
    double tension = 0;
    /**
     * What the segment itself exerts on its ends: friction, noise, tension, the bending of its joints, propulsion and
     * the drag of a flow.
     */
    double minus[3] = {}, plus[3] = {};
    /** The direction from the minus to the plus end, half-way through the step. */
    double direction[3] = {};
    /** Add those of another time, with a weight. */
    void add(const SegmentForces& other, double weight);
};

/** What a step needs besides positions and forces. */
struct StepSettings {
    Scheme scheme;
    double kT, stepSize;
    /**
     * The noise of a step is a function of the seed, of which 32 bits count, the level, the number of the step at that
     * level, and the chain's number. Steps of the size h/2^level follow the Brownian path of those of the size h at
     * level 0; levels go from 0 to LARGEST_LEVEL. See Noise.h.
     */
    std::uint64_t seed, step;
    int level = 0;
    BackgroundFlow flow = {};
    /**
     * Where to record the forces of segments, for each chain and segment, or NULL. The implicit scheme alone does so.
     */
    std::vector<std::vector<SegmentForces> >* segmentForces = NULL;
    Precision precision = Precision::Double;
    /**
     * The twists of each chain of the engine at the start of the step, and where to write how much they change; NULL if
     * no chain has any. Scheme Implicit alone has them.
     */
    std::vector<std::vector<double> >* twists = NULL;
    std::vector<std::vector<double> >* twistChanges = NULL;
    /**
     * Where pieces of chains write these changes instead, and how far segments turn about themselves, in the place of
     * the particle of the node at the joint or before the segment; NULL for whole chains.
     */
    double* twistChangesOfPieces = NULL;
    double* turnsOfPieces = NULL;
    /** What hands do to the turns of each of these chains, each pair of segments once; NULL if none does. */
    const std::vector<std::vector<TurnedPair> >* turnedPairs = NULL;
    /**
     * For each of these chains, where the frames beyond both ends point, six numbers, if rigid bodies carry any of
     * them; none for others. NULL if there are no such bodies.
     */
    const std::vector<std::vector<double> >* endDirections = NULL;
    /** Where to write the torques of the joints to these frames at the end of the step: two numbers for each chain. */
    double* endTorques = NULL;
    /** The torques of these frames on each rigid body, three numbers, as they are known in an iteration; or NULL. */
    const double* bodyTorques = NULL;
    /** Whether chains whose implicit step fails take it in parts; otherwise it has failed. */
    bool mayDivide = true;
};

/** What a chain is a piece of, whose noise it has: the number of a chain, of its first node, and of its tethers. */
struct PieceOfChain {
    int chain, firstNode;
    std::vector<int> tethers;
};

/**
 * What has become of packs of which chains have changed: they hold the same nodes as before, or other ones; or they
 * have become too many for what they hold, and a new engine is needed.
 */
enum class Replacement {SameNodes, OtherNodes, Impossible};

/**
 * Forces and displacements of many chains. Chains are gathered into packs that are computed in the lanes of the
 * processor's vector registers; packs are independent, so they can be given to different threads, and no result
 * depends on which thread computes what.
 *
 * Registers hold twice as many numbers in single precision. Beside the packs that hold all chains, each of them once,
 * there are wide ones for the chains of several of these. A step takes those that getPacksOfStep() says, which makes
 * a wide pack when it first gives it.
 *
 * Positions, forces and displacements are arrays of three doubles for each particle.
 */
class ChainEngine {
public:
    /**
     * @param chains     the chains; no particle may be a node of two of them. A chain without models is refused, and
     *                   one without nodes does nothing.
     * @param mayChange  whether replaceChains() may be called: results then depend on what chains are, and not on the
     *                   packs in which they have come to be
     */
    explicit ChainEngine(const std::vector<Chain>& chains, bool mayChange = false);
    /**
     * Compute pieces of chains by the implicit schemes.
     *
     * @param chains   the pieces; each has particles of its own
     * @param origins  what they are pieces of
     */
    ChainEngine(const std::vector<Chain>& chains, const std::vector<PieceOfChain>& origins);
    ~ChainEngine();
    /**
     * Take over chains that have other nodes, segments and joints than before, or have come or gone. Packs without such
     * stay as they are.
     *
     * @param chains   all chains
     * @param changed  the numbers of those that are others
     * @return what has become of the packs
     */
    Replacement replaceChains(const std::vector<Chain>& chains, const std::vector<int>& changed);
    /**
     * Describe in which packs chains have come to be, on which the last digits of results depend.
     */
    std::vector<int> getArrangement() const;
    /**
     * Let chains be in the packs that getArrangement() has described, if that can be.
     */
    void setArrangement(const std::vector<Chain>& chains, const std::vector<int>& arrangement);
    /**
     * Get the number of packs in double precision, which hold all chains.
     */
    int getNumPacks() const;
    /**
     * Get the packs that a step with some settings takes: together, they hold each chain once. Those whose number is
     * not below getNumPacks() are wide ones, or of modes. This depends on the settings but for seed, step and what is
     * recorded. The scheme of modes is for chains that have some alone, see findModes(). Several threads may call it at
     * the same time, and while others use packs.
     */
    std::vector<int> getPacksOfStep(const StepSettings& settings) const;
    /**
     * Get the number of chains that some packs take in mixed precision, if chains are coupled: see createStep().
     */
    int getNumMixedChains(const std::vector<int>& packs) const;
    /**
     * The same for step(), which may take long chains piece by piece. No other thread may take steps of the packs.
     */
    int getNumMixedChains(const std::vector<int>& packs, const StepSettings& settings) const;
    /**
     * Add the forces on the nodes of a pack, which is not a wide one.
     *
     * @param box            the three vectors of a periodic box (nine doubles), to take each segment as its shortest
     *                       image, or NULL
     * @param includeEnergy  whether to compute the energies; they are zero otherwise
     * @param twists         the twists of each chain, for energies of bends at rest; their forces are in steps alone
     */
    ChainEnergy addForces(int pack, const double* positions, double* forces, const double* box, bool includeEnergy,
            const std::vector<std::vector<double> >* twists = NULL) const;
    /**
     * Get the particles of a pack.
     */
    ParticleRange getParticles(int pack) const;
    /**
     * Set the forces on the nodes of a pack to zero.
     */
    void clearForces(int pack, double* forces) const;
    /**
     * Compute the displacements of the nodes of a pack in one step: noise, resistance, redistribution. The forces are
     * all those on the nodes; for schemes that compute those of the chains themselves, all but these. A pack that is
     * not below getNumPacks() is for the settings that getPacksOfStep() gives it for. A pack of few long chains takes
     * an implicit step piece by piece, see ChainPieces.h: each pack is for one thread at a time.
     *
     * @param displacements  receives those of the pack's nodes
     * @return the first instability found, with chain = -1 if there is none
     */
    Instability step(int pack, const double* positions, const double* forces, const double* box,
            const StepSettings& settings, double* displacements) const;
    /**
     * Get whether the chain in a lane takes an implicit step in parts from the start, as short ones do that turn far.
     */
    bool isStepDivided(int pack, int lane, const StepSettings& settings) const;
    /**
     * Create an object that takes implicit steps of a pack whose chains are coupled to others. The pack is one of those
     * that getPacksOfStep() has returned.
     */
    std::unique_ptr<PackStep> createStep(int pack) const;
    /**
     * Get the chain of each lane of a pack, or -1.
     */
    const std::vector<int>& getChainsOfLanes(int pack) const;
    /** The instruction set in use: "avx512", "avx2" or "baseline". */
    static std::string getInstructionSet();
private:
    ChainEngine(const std::vector<Chain>& chains, const std::vector<PieceOfChain>& origins, bool mayChange);
    struct Implementation;
    std::unique_ptr<Implementation> implementation;
};

} // namespace cylchain

#endif /*CYLCHAIN_CHAIN_ENGINE_H_*/
