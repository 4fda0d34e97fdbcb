#ifndef OPENMM_CYLINDERCHAINGROWTHFORCE_H_
#define OPENMM_CYLINDERCHAINGROWTHFORCE_H_

#include "growth/GrowthSystem.h"
#include "openmm/Context.h"
#include "openmm/Force.h"
#include "openmm/Vec3.h"
#include <set>
#include <vector>

namespace OpenMM {

/**
 * This class lets the ends of chains of straight segments gain and lose monomers, with detailed balance, and chains
 * begin, vanish and be cut.  It has no energy of its own; growth/ChainGrowth.h says how chains grow.
 *
 * The particles of a chain that grows are its nodes as far as its monomers need them, from the first particle on.  The
 * others are spare: they are where the last node is, and nothing acts on them.  A chain that has no spare node left
 * waits.  A System can have one such Force.  Its chains are moved by the implicit schemes of CylinderChainIntegrator.
 * They may have walls, contacts and linkers of this plugin; no other Force may act on them.
 *
 * How far chains have grown belongs to a Context.  Checkpoints of the integrator hold it, and so do States with the
 * integrator's parameters.
 */
class CylinderChainGrowthForce : public Force {
public:
    /** Create a CylinderChainGrowthForce. */
    CylinderChainGrowthForce();
    /**
     * Get the number of tables.
     */
    int getNumTables() const {
        return system.tables.size();
    }
    /**
     * Add a table of what segments are, by the numbers of their monomers.
     *
     * @param monomersPerSegment  the monomers of each segment but those at ends, two or more
     * @param parameters          eight for each segment with 1, 2, ..., 2 monomersPerSegment monomers: rest length,
     *                            stretching stiffness, maximum extension, the parallel, perpendicular, rotational and
     *                            extensional friction, in the units of CylinderChainForce::addChain(), and propulsion
     * @param loads               the stiffness of the joint between two segments that have 2, 3, ...,
     *                            3 monomersPerSegment monomers together, measured in kJ/mol
     * @return the index of the table that was added
     */
    int addTable(int monomersPerSegment, const std::vector<double>& parameters, const std::vector<double>& loads);
    /**
     * Get a table.
     */
    void getTable(int table, int& monomersPerSegment, std::vector<double>& parameters,
            std::vector<double>& loads) const;
    /**
     * Get the number of pools.
     */
    int getNumPools() const {
        return system.pools.size();
    }
    /**
     * Add a pool of monomers.
     *
     * @param concentration  the number of free monomers in 1 nm^3.  It stays as it is if the volume is zero.
     * @param volume         the volume of a pool that runs dry, measured in nm^3, or zero
     * @return the index of the pool that was added
     */
    int addPool(double concentration, double volume);
    /**
     * Get the parameters of a pool.
     */
    void getPoolParameters(int pool, double& concentration, double& volume) const;
    /**
     * Get the number of chains that grow.
     */
    int getNumGrowingChains() const {
        return system.chains.size();
    }
    /**
     * Let a chain grow.
     *
     * @param chain          the index of the chain among those of the CylinderChainForce
     * @param table          what it is made of
     * @param pool           where its monomers come from
     * @param firstMonomer   the number of its first monomer, at the minus end: joints are at multiples of
     *                       monomersPerSegment
     * @param lastMonomer    the number behind that of its last monomer.  If both are zero, there is no chain yet: it
     *                       may begin by a nucleator, or be a part of one that is cut.
     * @param leastMonomers  the fewest monomers that it can have, two or more
     * @param vanishes       whether it vanishes when it loses another one
     * @return the index of the chain among those that grow
     */
    int addGrowingChain(int chain, int table, int pool, int firstMonomer, int lastMonomer, int leastMonomers,
            bool vanishes);
    /**
     * Get the parameters of a chain that grows, see addGrowingChain().
     */
    void getGrowingChainParameters(int index, int& chain, int& table, int& pool, int& firstMonomer, int& lastMonomer,
            int& leastMonomers, bool& vanishes) const;
    /**
     * Set what an end of a chain that grows does in each of its states.  Without this, it does nothing.
     *
     * @param index         the index of the chain among those that grow
     * @param end           the minus end (0) or the plus end (1)
     * @param initialState  the state that it has at first
     * @param parameters    two for each state: the rate at which it gains monomers, per number in a volume, measured in
     *                      nm^3/ps, and the rate at which it loses them, measured in 1/ps
     * @param numbers       two for each state: those in which it is after it has gained or lost a monomer
     * @param loads         for each state, the rates at which it changes to each of them, measured in 1/ps
     */
    void setEndStates(int index, int end, int initialState, const std::vector<double>& parameters,
            const std::vector<int>& numbers, const std::vector<double>& loads);
    /**
     * Get the states of an end, see setEndStates().
     */
    void getEndStates(int index, int end, int& initialState, std::vector<double>& parameters,
            std::vector<int>& numbers, std::vector<double>& loads) const;
    /**
     * Set what else the rates depend on at which an end changes its states.
     *
     * @param index       the index of the chain among those that grow
     * @param end         the minus end (0) or the plus end (1)
     * @param parameters  for each state, the length of a chain, measured in nm, that has the rates from it, which are
     *                    proportional to lengths; zero if they are not
     * @param loads       for each state, how much larger the rates to each of them are while what is around lets no
     *                    monomer come, measured in 1/ps.  They follow the share of the monomers that do.
     */
    void setEndSwitching(int index, int end, const std::vector<double>& parameters, const std::vector<double>& loads);
    /**
     * Get what else the rates depend on at which an end changes its states, see setEndSwitching().
     */
    void getEndSwitching(int index, int end, std::vector<double>& parameters, std::vector<double>& loads) const;
    /**
     * Set how much larger the rates at which an end changes its states are while the chain has its fewest monomers.
     *
     * @param index  the index of the chain among those that grow
     * @param end    the minus end (0) or the plus end (1)
     * @param loads  for each state, those to each of them, measured in 1/ps
     */
    void setSwitchingOfShortest(int index, int end, const std::vector<double>& loads);
    /**
     * Get how much larger rates are while the chain has its fewest monomers, see setSwitchingOfShortest().
     */
    void getSwitchingOfShortest(int index, int end, std::vector<double>& loads) const;
    /**
     * Set how monomers come and go at an end.
     *
     * @param index      the index of the chain among those that grow
     * @param end        the minus end (0) or the plus end (1)
     * @param isRegular  whether they do so at regular times, as many as would be gained and lost on the average, and
     *                   not at random
     * @param stiffness  of those that come, the energy E of the share exp(-dV/E) that what is around leaves of their
     *                   rate, measured in kJ/mol; k_B T if it is zero, which alone has an equilibrium
     */
    void setEndTiming(int index, int end, bool isRegular, double stiffness);
    /**
     * Get how monomers come and go at an end, see setEndTiming().
     */
    void getEndTiming(int index, int end, bool& isRegular, double& stiffness) const;
    /**
     * Let the states of the ends of a chain be those of the monomers there.  Monomers inside change as they would at
     * the plus end, and have the state then that they have come to when they are at an end again.
     *
     * @param index  the index of the chain among those that grow
     */
    void setMonomersHaveStates(int index, bool monomersHaveStates);
    /**
     * Get whether the states of the ends of a chain are those of monomers, see setMonomersHaveStates().
     */
    bool getMonomersHaveStates(int index) const;
    /**
     * Let a chain be cut between any two of its monomers.  Both parts are chains then, for which there must be another
     * one without monomers: it waits otherwise.
     *
     * @param index       the index of the chain among those that grow
     * @param rate        the rate, for each monomer but one, measured in 1/ps
     * @param minusState  the state of the minus end that is new, if monomers have no states
     * @param plusState   the state of the plus end that is new, if monomers have no states
     * @param parameters  if monomers have states, the share of the rate for each of these, from 0 to 1, or nothing
     */
    void setSevering(int index, double rate, int minusState, int plusState, const std::vector<double>& parameters);
    /**
     * Get how a chain is cut, see setSevering().
     */
    void getSevering(int index, double& rate, int& minusState, int& plusState, std::vector<double>& parameters) const;
    /**
     * Get the number of nucleators.
     */
    int getNumNucleators() const {
        return system.nucleators.size();
    }
    /**
     * Add a nucleator, with which chains begin.  All places of a region are as likely for the minus end, and so are
     * all directions, unless there is one.
     *
     * @param rate        the rate in the whole region, at the first concentration of the pool, measured in 1/ps
     * @param order       the power of the concentration that it is proportional to
     * @param monomers    the monomers of a chain that begins
     * @param region      0 for the periodic box, 1 for a cuboid, 2 for a sphere
     * @param parameters  two corners of the cuboid, or the centre and the radius of the sphere, measured in nm
     * @param vector      the direction of the first segment, or zero for any
     * @param numbers     the indices among those that grow of the chains that may begin.  They are made of the same.
     * @return the index of the nucleator that was added
     */
    int addNucleator(double rate, int order, int monomers, int region, const std::vector<double>& parameters,
            const Vec3& vector, const std::vector<int>& numbers);
    /**
     * Let the chains of a nucleator begin as branches of others: its rate is that for each monomer of these, wherever
     * they are in its region.
     *
     * @param index      the index of the nucleator
     * @param angle      the angle between a branch and its mother, towards their plus ends, measured in radians
     * @param stiffness  K of the energy K (theta-theta0)^2/2 by which angles differ, measured in kJ/mol
     * @param distance   how far from the axis of the mother a branch begins, measured in nm
     * @param beyond     how much of the mother must be there beyond the place, measured in nm
     * @param numbers    the indices among those that grow of the mothers
     */
    void setBranching(int index, double angle, double stiffness, double distance, double beyond,
            const std::vector<int>& numbers);
    /**
     * Get the branching of a nucleator, see setBranching(): it has no mothers if its chains are no branches.
     */
    void getBranching(int index, double& angle, double& stiffness, double& distance, double& beyond,
            std::vector<int>& numbers) const;
    /**
     * Get the parameters of a nucleator, see addNucleator().
     */
    void getNucleatorParameters(int index, double& rate, int& order, int& monomers, int& region,
            std::vector<double>& parameters, Vec3& vector, std::vector<int>& numbers) const;
    /**
     * Get how far chains have grown in a Context.
     *
     * @param context          a Context of a System that holds this Force
     * @param[out] ends        for each chain that grows, the number of its first monomer, and that behind its last one:
     *                         both are zero if there is none now
     * @param[out] numbers     for each of its ends, minus before plus, its state
     * @param[out] parameters  for each of its ends, how many monomers it has gained, how many it has lost, how often it
     *                         had no spare node for one, and how often it has changed to each of its states by itself
     * @param[out] loads       for each pool, its concentration, measured in 1/nm^3
     */
    void getGrowthInContext(Context& context, std::vector<int>& ends, std::vector<int>& numbers,
            std::vector<double>& parameters, std::vector<double>& loads) const;
    /**
     * Get which chains there are in a Context.
     *
     * @param context          a Context of a System that holds this Force
     * @param[out] parameters  for each chain that grows, which one it is of all that have ever been, counted from zero,
     *                         and of which of these it was a part when it was cut: -1 for none
     * @param[out] sums        how many have begun, vanished and were cut, and how often one would have begun or been
     *                         cut, but there was no chain for it
     */
    void getPopulationInContext(Context& context, std::vector<double>& parameters, std::vector<double>& sums) const;
    /**
     * Tell a Context how far its chains have grown at its present positions.  Monomers of closed pools come and go as
     * chains have become longer and shorter.
     *
     * @param context  a Context of a System that holds this Force
     * @param ends     as above
     */
    void setGrowthInContext(Context& context, const std::vector<int>& ends) const;
    /**
     * Cut chains of a Context at once, wherever they go through a plane.  Both parts are chains then, see
     * setSevering(): where there is none for a part, or a part has too few monomers, a chain is not cut.
     *
     * @param context  a Context of a System that holds this Force
     * @param point    a point on the plane, measured in nm
     * @param vector   its normal
     * @param numbers  the indices of the chains among those that grow
     * @return at how many places they go through the plane
     */
    int cutInContext(Context& context, const Vec3& point, const Vec3& vector, const std::vector<int>& numbers) const;
    /**
     * Get what grows.
     */
    const cylchain::GrowthSystem& getSystem() const {
        return system;
    }
    /**
     * Get the monomers of chains before anything happens.
     */
    const std::vector<cylchain::MonomerRange>& getRanges() const {
        return ranges;
    }
    /**
     * Get how far chains have grown before anything happens.
     */
    cylchain::GrowthState getState() const {
        return cylchain::GrowthState(system, ranges);
    }
    /**
     * Let chains have the segments of their monomers.
     *
     * @param chains        those of the CylinderChainForce
     * @param[out] growing  the numbers of those that grow
     */
    void setMonomers(cylchain::ChainList& chains, std::set<int>& growing) const;
    bool usesPeriodicBoundaryConditions() const {
        return false;
    }
protected:
    ForceImpl* createImpl() const;
private:
    cylchain::GrowingChain& getOwn(int index);
    const cylchain::GrowingChain& getOwn(int index) const;
    cylchain::GrowthSystem system;
    std::vector<cylchain::MonomerRange> ranges;
};

} // namespace OpenMM

#endif /*OPENMM_CYLINDERCHAINGROWTHFORCE_H_*/
