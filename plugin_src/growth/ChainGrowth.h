#ifndef CYLCHAIN_CHAIN_GROWTH_H_
#define CYLCHAIN_CHAIN_GROWTH_H_

#include "couplings/Surroundings.h"
#include "growth/SegmentLaws.h"
#include "mechanics/ChainList.h"
#include "mechanics/MonomerTable.h"
#include <cstdint>
#include <memory>
#include <utility>
#include <vector>

namespace cylchain {

/** The rates at which an end gains monomers, in nm^3/ps, which is per number in a volume, and loses them, in 1/ps. */
struct EndRates {
    double onRate = 0, offRate = 0;
};

/**
 * An end: its rates, and those while it shrinks if it does so in turn (dynamic instability), with the rates, in 1/ps,
 * at which it begins to shrink and at which it is rescued.
 */
struct GrowingEnd : EndRates {
    EndRates shrinking = {};
    double catastropheRate = 0, rescueRate = 0;
    bool switches() const {
        return catastropheRate > 0 || rescueRate > 0;
    }
    bool grows() const {
        return onRate > 0 || offRate > 0 || shrinking.onRate > 0 || shrinking.offRate > 0;
    }
};

/** A chain that grows: its number, what it is made of, and its minus (0) and plus end (1). */
struct GrowingChain {
    int chain = -1, table = 0, pool = 0;
    /** The fewest monomers that it has. */
    int leastMonomers = 2;
    GrowingEnd ends[2];
};

/** Where monomers come from: a concentration that is always the same, or a volume with so many of them. */
struct MonomerPool {
    /** The number in 1 nm^3. */
    double concentration = 0;
    /** The volume of a pool that runs dry, in nm^3, or zero. */
    double volume = 0;
    bool isClosed() const {
        return volume > 0;
    }
};

/** What grows. */
struct GrowthSystem {
    std::vector<MonomerTable> tables;
    std::vector<MonomerPool> pools;
    std::vector<GrowingChain> chains;
};

/** What has happened at an end. */
struct EndEvents {
    long long gained = 0, lost = 0;
    /** How often it would have gained a monomer, but had no spare node. */
    long long waited = 0;
    /** How often it has begun to shrink, and was rescued. */
    long long catastrophes = 0, rescues = 0;
};

/** What grows, at a time. */
struct GrowthState {
    /** The number of steps that were taken. */
    std::uint64_t steps = 0;
    /** Of each growing chain, and its ends. */
    std::vector<MonomerRange> ranges;
    std::vector<EndEvents> events;
    /** Whether each end shrinks, of those that do so in turn. */
    std::vector<char> shrinks;
    /** The monomers that are free, of each pool that is closed. */
    std::vector<long long> free;
};

/** A step in which chains grow. */
struct GrowthStep {
    double kT, stepSize;
    std::uint32_t seed;
    /** The three vectors of the periodic box, and whether segments are their shortest images in it. */
    const double* box = nullptr;
    bool takesNearestImages = false;
};

/**
 * Chains that gain and lose monomers at their ends, with detailed balance.
 *
 * The weight of a chain of N monomers with its nodes at x is
 *
 *     z^N exp(-U/k_B T)/Z(N) exp(-V/k_B T),    z = k_on c/k_off,
 *
 * with U the energies of its lengths and bends, Z(N) their integral, and V the energies of all that is around it. So a
 * free end gains k_on c monomers and loses k_off per time, whatever segments are. A step is a Markov process in
 * continuous time, in which all else stands still. Monomers come at the rate k_on c min(1, exp(-dV/k_B T)), and go at
 * k_off min(1, exp(-dV/k_B T)). The segment at an end, and the joint behind it, are carried from their law to that
 * with one monomer more or less (SegmentLaws); a joint that comes is drawn, with its two segments, and one that goes is
 * forgotten. U is that of equilibrium before and after.
 *
 * An end with dynamic instability has other rates while it shrinks, and begins and ends to do so at random: its rates
 * are those of no equilibrium.
 *
 * Random numbers belong to the seed, the number of the step, and the chain or, if its pool is closed, the pool: all
 * chains of a closed pool take their turns in the order of time.
 */
class ChainGrowth {
public:
    ChainGrowth(const GrowthSystem& system, const std::vector<BendingModel>& bending,
            const std::vector<StretchingModel>& stretching, const std::vector<char>& planar);
    /**
     * Take a step.
     *
     * @param chains     the chains, of which those that grow get other segments, joints and nodes
     * @param positions  of all particles, three numbers for each: those of chains that have changed are set
     * @param around     what their ends feel
     * @param changed    receives which of the growing chains have changed, by their numbers among these
     * @return the number of a growing chain the rates of which are too large for the step, or -1
     */
    int advance(GrowthState& state, const GrowthStep& step, ChainList& chains, double* positions,
            const std::vector<Surroundings*>& around, std::vector<int>& changed);
private:
    /** What may happen to a chain. */
    enum class EventKind {Gain, Lose, Switch};
    struct Event {
        int index, end;
        EventKind kind;
        bool gains() const {
            return kind == EventKind::Gain;
        }
    };
    /** A chain that an event has come to in this step. */
    struct Present {
        std::vector<Vec3d> nodes;
        bool isKnown = false, hasChanged = false;
    };
    struct Laws {
        double kT = -1;
        std::vector<std::unique_ptr<LengthLaw> > lengths;
        std::vector<std::unique_ptr<BendLaw> > bends;
    };
    double getConcentration(const GrowthState& state, int pool) const;
    double getRate(const GrowthState& state, const Event& event) const;
    bool takeTurns(GrowthState& state, const GrowthStep& step, const std::vector<int>& members, std::uint32_t number,
            ChainList& chains, double* positions, const std::vector<Surroundings*>& around);
    MonomerRange findRange(const GrowthState& state, const Event& event) const;
    void switchEnd(GrowthState& state, const Event& event) const;
    void apply(GrowthState& state, const GrowthStep& step, const Event& event, RandomNumbers& random,
            ChainList& chains, const double* positions, const std::vector<Surroundings*>& around);
    bool propose(const GrowthState& state, const GrowthStep& step, const Event& event, RandomNumbers& random,
            const std::vector<Vec3d>& nodes, std::vector<Vec3d>& after, int* segments, double& joint);
    std::vector<double> findLengths(int index, const MonomerRange& range) const;
    void setChain(const GrowthState& state, int index, Chain& chain, double* positions) const;
    const LengthLaw& getLengths(int index, int monomers, double kT);
    const BendLaw& getBends(int index, int monomersOfBoth, double kT);
    double restLengthOf(int index, int monomers) const {
        return system.tables[system.chains[index].table].getSegment(monomers).restLength;
    }
    Vec3d turn(const Vec3d& along, const Vec3d& direction, bool planar, const BendLaw& from, const BendLaw& to,
            RandomNumbers& random) const;
    Vec3d bendFrom(const Vec3d& along, bool planar, const BendLaw& law, RandomNumbers& random) const;
    GrowthSystem system;
    std::vector<BendingModel> bending;
    std::vector<StretchingModel> stretching;
    std::vector<char> planar;
    /** Which laws each growing chain has: those of its table, its models, and whether it is planar. */
    std::vector<int> lawsOf;
    std::vector<Laws> laws;
    /** The growing chains of each closed pool, and each of the others by itself. */
    std::vector<std::vector<int> > groups;
    std::vector<Present> present;
    /** Whether what is around has taken note of the step. */
    bool aroundIsKnown = false;
};

} // namespace cylchain

#endif /*CYLCHAIN_CHAIN_GROWTH_H_*/
