#ifndef OPENMM_CYLINDERCHAINGROWTHFORCE_H_
#define OPENMM_CYLINDERCHAINGROWTHFORCE_H_

#include "growth/ChainGrowth.h"
#include "openmm/Context.h"
#include "openmm/Force.h"
#include <set>
#include <vector>

namespace OpenMM {

/**
 * This class lets the ends of chains of straight segments gain and lose monomers, with detailed balance.  It has no
 * energy of its own; growth/ChainGrowth.h says how chains grow.
 *
 * The particles of a chain that grows are its nodes as far as its monomers need them, from the first particle on.  The
 * others are spare: they are where the last node is, and nothing acts on them.  A chain that has no spare node left
 * waits.  A System can have one such Force.  Its chains are moved by the implicit schemes of CylinderChainIntegrator on
 * the Reference and CPU platforms.  They may have walls, contacts and linkers of this plugin; no other Force may act on
 * them.
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
     * @param lastMonomer    the number behind that of its last monomer
     * @param leastMonomers  the fewest monomers that it can have, two or more
     * @param minusOnRate    the rate at which the minus end gains monomers, per number in a volume, measured in nm^3/ps
     * @param minusOffRate   the rate at which it loses them, measured in 1/ps
     * @param plusOnRate     the same of the plus end
     * @param plusOffRate    the same of the plus end
     * @return the index of the chain among those that grow
     */
    int addGrowingChain(int chain, int table, int pool, int firstMonomer, int lastMonomer, int leastMonomers,
            double minusOnRate, double minusOffRate, double plusOnRate, double plusOffRate);
    /**
     * Get the parameters of a chain that grows, see addGrowingChain().
     */
    void getGrowingChainParameters(int index, int& chain, int& table, int& pool, int& firstMonomer, int& lastMonomer,
            int& leastMonomers, double& minusOnRate, double& minusOffRate, double& plusOnRate,
            double& plusOffRate) const;
    /**
     * Let an end of a chain that grows have dynamic instability: in turn it grows, with the rates of addGrowingChain(),
     * and shrinks.
     *
     * @param index             the index of the chain among those that grow
     * @param end               the minus end (0) or the plus end (1)
     * @param shrinkingOnRate   the rate at which it gains monomers while it shrinks, measured in nm^3/ps
     * @param shrinkingOffRate  the rate at which it loses them then, measured in 1/ps
     * @param catastropheRate   the rate at which it begins to shrink, measured in 1/ps
     * @param rescueRate        the rate at which it begins to grow again, measured in 1/ps
     */
    void setDynamicInstability(int index, int end, double shrinkingOnRate, double shrinkingOffRate,
            double catastropheRate, double rescueRate);
    /**
     * Get the dynamic instability of an end, see setDynamicInstability(): all rates are zero if it has none.
     */
    void getDynamicInstability(int index, int end, double& shrinkingOnRate, double& shrinkingOffRate,
            double& catastropheRate, double& rescueRate) const;
    /**
     * Get how far chains have grown in a Context.
     *
     * @param context          a Context of a System that holds this Force
     * @param[out] ends        for each chain that grows, the number of its first monomer, and that behind its last one
     * @param[out] numbers     for each of its ends, minus before plus, one if it shrinks in its dynamic instability,
     *                         and zero if not
     * @param[out] parameters  for each of its ends, how many monomers it has gained, how many it has lost, how often it
     *                         had no spare node for one, how often it has begun to shrink, and how often it was rescued
     * @param[out] loads       for each pool, its concentration, measured in 1/nm^3
     */
    void getGrowthInContext(Context& context, std::vector<int>& ends, std::vector<int>& numbers,
            std::vector<double>& parameters, std::vector<double>& loads) const;
    /**
     * Tell a Context how far its chains have grown at its present positions.  Monomers of closed pools come and go as
     * chains have become longer and shorter.
     *
     * @param context  a Context of a System that holds this Force
     * @param ends     as above
     */
    void setGrowthInContext(Context& context, const std::vector<int>& ends) const;
    /**
     * Get what grows.
     */
    const cylchain::GrowthSystem& getSystem() const {
        return system;
    }
    /**
     * Get how far chains have grown before anything happens.
     */
    cylchain::GrowthState getState() const;
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
    cylchain::GrowthSystem system;
    std::vector<cylchain::MonomerRange> ranges;
};

} // namespace OpenMM

#endif /*OPENMM_CYLINDERCHAINGROWTHFORCE_H_*/
