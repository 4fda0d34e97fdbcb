#ifndef CYLCHAIN_CHAIN_POPULATION_H_
#define CYLCHAIN_CHAIN_POPULATION_H_

#include "growth/ChainsInStep.h"
#include "growth/GrowthEvent.h"
#include <vector>

namespace cylchain {

/**
 * Chains that begin, vanish and are cut.
 *
 * A nucleator begins chains at the rate J min(1, exp(-V/k_B T)), with V the energy of all that is around the new one:
 * it begins somewhere in the region of the nucleator, all places and directions being as likely, with the shape of
 * equilibrium. A chain with as few monomers as it can have vanishes at the rate k_off min(1, exp(V/k_B T)), k_off being
 * the sum of those of its ends. So chains that begin and vanish are in equilibrium with those that grow and shrink.
 * Chains that are cut are in none, but both parts keep the shape of it.
 */
class ChainPopulation {
public:
    ChainPopulation(const GrowthSystem& system, ChainShapes& shapes) : system(system), shapes(shapes) {
    }
    /** Add what may happen to a chain as a whole. */
    void listEvents(const GrowthState& state, int index, const ChainsInStep& chains,
            std::vector<GrowthEvent>& events) const;
    /** Add that a nucleator begins a chain. */
    void listNucleation(const GrowthState& state, int nucleator, std::vector<GrowthEvent>& events) const;
    /**
     * Let an event happen at a time, unless energies, or a lack of chains, are against it.
     *
     * @param changes  receives where a chain was cut, or has got a branch
     * @return the number of the growing chain that has begun, or is a part, or -1
     */
    int apply(GrowthState& state, const GrowthStep& step, const GrowthEvent& event, double time, RandomNumbers& random,
            ChainsInStep& chains, GrowthChanges& changes);
    /**
     * Cut a chain wherever it goes through the plane of a step, where both parts may be and there is a chain for one.
     */
    void cutByPlane(GrowthState& state, const GrowthStep& step, int index, RandomNumbers& random,
            ChainsInStep& chains, GrowthChanges& changes);
private:
    /** A side of a chain that is cut: its nodes and lengths along it before its segments are those of its monomers. */
    struct CutSide {
        std::vector<Vec3d> nodes;
        std::vector<double> along, alongAfter;
        CarriedEnd carried;
        /** How many segments at the cut become one. */
        int segments = 1;
    };
    int nucleate(GrowthState& state, const GrowthStep& step, int nucleator, double time, RandomNumbers& random,
            ChainsInStep& chains, GrowthChanges& changes);
    bool findBranchPlace(const GrowthState& state, const GrowthStep& step, int number, RandomNumbers& random,
            ChainsInStep& chains, ChainBranch& branch, Vec3d& start, Vec3d& direction);
    bool isInRegion(const Nucleator& nucleator, const Vec3d& place) const;
    double drawAngle(const BranchPlace& branch, double kT, RandomNumbers& random) const;
    long long countMonomers(const Nucleator& nucleator, const GrowthState& state) const;
    void vanish(GrowthState& state, int index, RandomNumbers& random, ChainsInStep& chains, GrowthChanges& changes);
    int sever(GrowthState& state, const GrowthStep& step, const GrowthEvent& event, double time, RandomNumbers& random,
            ChainsInStep& chains, GrowthChanges& changes);
    CutSide cutSide(int index, int side, double cut, const std::vector<Vec3d>& nodes, const std::vector<double>& along,
            MonomerRange before, MonomerRange range, double kT, RandomNumbers& random) const;
    void setParts(GrowthState& state, int index, int part, int monomer, const bool* stays, double time,
            RandomNumbers& random) const;
    bool mayCut(GrowthState& state, int index, int monomer, double time, RandomNumbers& random) const;
    void clear(GrowthState& state, int index, ChainsInStep& chains, GrowthChanges& changes) const;
    void returnMonomers(GrowthState& state, int index, long long count) const;
    double findTetherEnergy(int index, const Vec3d& first, const ChainsInStep& chains) const;
    Vec3d drawDirection(int index, RandomNumbers& random) const;
    Vec3d drawPlace(const Nucleator& nucleator, const GrowthStep& step, RandomNumbers& random) const;
    const GrowthSystem& system;
    ChainShapes& shapes;
};

} // namespace cylchain

#endif /*CYLCHAIN_CHAIN_POPULATION_H_*/
