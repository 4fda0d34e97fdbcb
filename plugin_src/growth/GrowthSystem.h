#ifndef CYLCHAIN_GROWTH_SYSTEM_H_
#define CYLCHAIN_GROWTH_SYSTEM_H_

#include "couplings/CapsuleGeometry.h"
#include "kinetics/Linkers.h"
#include "mechanics/ChainList.h"
#include "mechanics/MonomerTable.h"
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <vector>

namespace cylchain {

/** What an end does while it is in a state: of growth, of shrinking, of a cap, of its last monomer. */
struct EndState {
    /** The rates at which it gains monomers, in nm^3/ps, which is per number in a volume, and loses them, in 1/ps. */
    double onRate = 0, offRate = 0;
    /** The states in which it is when it has gained or lost a monomer. */
    int afterGain = 0, afterLoss = 0;
    /** The rates, in 1/ps, at which it changes to each state. */
    std::vector<double> switchRates;
    /**
     * How much larger these are while what is around lets no monomer come, or nothing: as many of the monomers that
     * do not come let it change. The rate follows the share that comes then, and so the mean speed.
     */
    std::vector<double> blockedRates = {};
    /** The length, in nm, of a chain that has these rates, which are proportional to lengths; zero if they are not. */
    double lengthOfRates = 0;
    /** How much larger the rates at which it changes are while the chain has its fewest monomers, or nothing. */
    std::vector<double> ratesOfShortest = {};
};

/** How monomers come and go. */
struct EndTiming {
    /** Whether they do so at regular times, and not at random. */
    bool isRegular = false;
    /**
     * Of those that come, the energy E in kJ/mol of the share exp(-dV/E) that what is around leaves of their rate;
     * k_B T if it is zero.
     */
    double energyOfLoad = 0;
};

/** An end: its states, and that which it has at first. */
struct GrowingEnd {
    std::vector<EndState> states = std::vector<EndState>(1);
    int initialState = 0;
    EndTiming timing;
    bool grows() const {
        return std::any_of(states.begin(), states.end(), [] (const EndState& state) {
            return state.onRate > 0 || state.offRate > 0;
        });
    }
};

/** How a chain is cut at random. */
struct ChainSevering {
    /** The rate, in 1/ps, for each monomer but one. */
    double rate = 0;
    /** The share of this for monomers of each state, if monomers have states; otherwise it is the same for all. */
    std::vector<double> shares;
    /** The states of both ends that are new. */
    int minusState = 0, plusState = 0;
};

/** A chain that grows: its number, what it is made of, and its minus (0) and plus end (1). */
struct GrowingChain {
    int chain = -1, table = 0, pool = 0;
    /** The fewest monomers that it has. */
    int leastMonomers = 2;
    /** Whether it vanishes when it loses another one, and parts of it that have fewer do. */
    bool vanishes = false;
    /**
     * Whether the states of its ends are those of the monomers there, which change inside as they would at the plus
     * end.
     */
    bool monomersHaveStates = false;
    GrowingEnd ends[2];
    ChainSevering severing;
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

/** Where chains begin: in the periodic box, in a box of its own, or in a sphere. */
enum class NucleationRegion : int {PeriodicBox, Cuboid, Sphere};

/** How a chain begins as a branch of another one. */
struct BranchPlace {
    /** The angle between both, towards the plus ends, and the stiffness K in kJ/mol of K (theta-theta0)^2/2. */
    double angle = 0, stiffness = 0;
    /** How far from the axis of the other one it begins, and how much of that must be there beyond the place. */
    double distance = 0, beyond = 0;
};

/** Where and how often chains begin. */
struct Nucleator {
    /** The rate, in 1/ps, at the first concentration of the pool: in all of the region, or for a monomer of mothers. */
    double rate = 0;
    /** Which power of the concentration it is proportional to. */
    int order = 0;
    /** The monomers of a chain that begins. */
    int monomers = 2;
    NucleationRegion region = NucleationRegion::PeriodicBox;
    /** Two corners of a cuboid. */
    Vec3d lower = {0, 0, 0}, upper = {0, 0, 0};
    /** Of a sphere. */
    Vec3d centre = {0, 0, 0};
    double radius = 0;
    /** The direction of its first segment, or zero for any. */
    Vec3d direction = {0, 0, 0};
    /** The numbers of the growing chains that may begin, which are all the same but for where they are. */
    std::vector<int> chains;
    /** Those of which they are branches, wherever these are in the region, or none. */
    std::vector<int> mothers;
    BranchPlace branch;
};

/** What grows. */
struct GrowthSystem {
    std::vector<MonomerTable> tables;
    std::vector<MonomerPool> pools;
    std::vector<GrowingChain> chains;
    std::vector<Nucleator> nucleators;
    /** Find the number of monomers of a pool that is closed, at first. */
    long long countAtFirst(int pool) const {
        return std::llround(pools[pool].concentration*pools[pool].volume);
    }
};

/** What has happened at an end. */
struct EndEvents {
    long long gained = 0, lost = 0;
    /** How often it would have gained a monomer, but had no spare node. */
    long long waited = 0;
    /** How often it has changed to each of its states by itself. */
    std::vector<long long> switches;
};

/** What has happened to chains as a whole. */
struct PopulationEvents {
    long long nucleated = 0, vanished = 0, severed = 0;
    /** How often one would have begun, but there was no chain for it. */
    long long waited = 0;
};

/** A monomer: the state that it had at a time, in ps. */
struct MonomerState {
    double time;
    int state;
};

/** What grows, at a time. */
struct GrowthState {
    /** The number of steps that were taken, and how long they were. */
    std::uint64_t steps = 0;
    double time = 0;
    /** Of each growing chain, without a monomer if there is none now, and its ends. */
    std::vector<MonomerRange> ranges;
    std::vector<EndEvents> events;
    std::vector<int> endStates;
    /** Of each end at which monomers come and go at regular times, the share of the next one that has passed. */
    std::vector<double> phases;
    /** Of each chain whose monomers have states, from the first to the last one. */
    std::vector<std::deque<MonomerState> > monomers;
    /** The monomers that are free, of each pool that is closed. */
    std::vector<long long> free;
    /** Which of all chains that have ever been each of them is, from zero on, and of which it was a part, or -1. */
    std::vector<long long> identities, parents;
    long long nextIdentity = 0;
    PopulationEvents population;
    /** Get the state of everything before it has grown. */
    GrowthState() = default;
    GrowthState(const GrowthSystem& system, const std::vector<MonomerRange>& ranges) : ranges(ranges),
            monomers(ranges.size()), identities(ranges.size(), -1), parents(ranges.size(), -1) {
        for (std::size_t i = 0; i < ranges.size(); i++) {
            const GrowingChain& own = system.chains[i];
            for (const GrowingEnd& end : own.ends) {
                EndEvents none;
                none.switches.resize(end.states.size());
                events.push_back(none);
                endStates.push_back(end.initialState);
                phases.push_back(0);
            }
            if (own.monomersHaveStates)
                monomers[i].assign(ranges[i].size(), {0, own.ends[1].initialState});
            if (ranges[i].size() > 0)
                identities[i] = nextIdentity++;
        }
        for (std::size_t pool = 0; pool < system.pools.size(); pool++)
            free.push_back(system.countAtFirst(pool));
    }
};

/** A plane, and the chains that are cut where they go through it, by their numbers among those that grow. */
struct CuttingPlane {
    Vec3d point, normal;
    std::vector<int> chains;
};

/** A step in which chains grow. */
struct GrowthStep {
    double kT, stepSize;
    std::uint32_t seed;
    /** The three vectors of the periodic box, and whether segments are their shortest images in it. */
    const double* box = nullptr;
    bool takesNearestImages = false;
    /** Hands that cut, or take monomers off ends. */
    std::vector<ActingHand> hands = {};
    /** What cuts at its beginning, or nothing. */
    const CuttingPlane* plane = nullptr;
};

/** A chain that has begun as a branch. */
struct ChainBranch {
    int nucleator;
    /** Its number and that of its mother among all chains, and where that is along the mother. */
    int chain, mother;
    double along;
    /** How many cuts there were in the step before. */
    std::size_t cutsBefore;
};

/** What a step has changed. */
struct GrowthChanges {
    /** The growing chains that have changed, by their numbers among these. */
    std::vector<int> chains;
    /** Where chains were cut, or have vanished, one after the other. */
    std::vector<ChainCut> cuts;
    std::vector<ChainBranch> branches;
    /** At how many places chains have gone through the plane that cuts. */
    int crossings = 0;
    /** The number of a growing chain the rates of which are too large for the step, or -1. */
    int failed = -1;
};

} // namespace cylchain

#endif /*CYLCHAIN_GROWTH_SYSTEM_H_*/
