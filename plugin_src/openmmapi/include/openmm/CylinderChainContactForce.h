#ifndef OPENMM_CYLINDERCHAINCONTACTFORCE_H_
#define OPENMM_CYLINDERCHAINCONTACTFORCE_H_

#include "couplings/ContactBodies.h"
#include "openmm/Context.h"
#include "openmm/CylinderChainCoupling.h"
#include <vector>

namespace OpenMM {

/**
 * This class keeps filaments, and particles, from passing through each other.
 *
 * Segments of chains are capsules: all points within half the diameter of the line between their ends.  Other particles
 * may be spheres.  Where two of them overlap, the energy is (k/2) g^2, for the gap g: the distance less half the sum of
 * the diameters.  Two segments touch where they are nearest to each other; if they are nearly parallel (within 1.8
 * degrees), at both ends of their overlap, with k/2 at each.  What two neighboring segments of a chain see of one thing
 * counts once.  Energy and force are bounded: two lines meet for (k/2) d^2.
 *
 * Segments that share a particle, or whose numbers in their chain differ by no more than a number that is given with
 * the chain, do not touch each other.  Add exclusions for the spheres of a rigid body.
 *
 * The force is taken at the present positions, with every Integrator.  After a Context has been created, the stiffness
 * and diameters may be changed: call updateParametersInContext() to copy them over.
 */
class CylinderChainContactForce : public CylinderChainCoupling {
public:
    /**
     * Create a CylinderChainContactForce.
     *
     * @param stiffness  the stiffness k, measured in kJ/mol/nm^2
     */
    explicit CylinderChainContactForce(double stiffness);
    /**
     * Get the stiffness k.
     *
     * @return the stiffness, measured in kJ/mol/nm^2
     */
    double getStiffness() const {
        return stiffness;
    }
    /**
     * Set the stiffness k.
     *
     * @param stiffness  the stiffness, measured in kJ/mol/nm^2
     */
    void setStiffness(double stiffness);
    /**
     * Get the number of chains.
     */
    int getNumChains() const {
        return bodies.chains.size();
    }
    /**
     * Add a chain.
     *
     * @param particles          the indices of its particles, in the order of the chain: at least two
     * @param diameter           the diameter of its segments, measured in nm
     * @param excludedNeighbors  segments whose numbers in the chain differ by no more than this do not touch each other
     * @param closed             whether the last particle is joined to the first by a segment more
     * @return the index of the chain that was added
     */
    int addChain(const std::vector<int>& particles, double diameter, int excludedNeighbors = 1, bool closed = false);
    /**
     * Get the particles of a chain.
     *
     * @param chain  the index of the chain
     * @return the indices of the particles, in the order of the chain
     */
    const std::vector<int>& getChainParticles(int chain) const;
    /**
     * Get the number of neighbors that a segment of a chain does not touch, to either side.
     *
     * @param chain  the index of the chain
     */
    int getChainExcludedNeighbors(int chain) const;
    /**
     * Get whether a chain is closed.
     *
     * @param chain  the index of the chain
     */
    bool isChainClosed(int chain) const;
    /**
     * Get the diameter of a chain.
     *
     * @param chain  the index of the chain
     * @return the diameter, measured in nm
     */
    double getChainDiameter(int chain) const;
    /**
     * Set the diameter of a chain.
     *
     * @param chain     the index of the chain
     * @param diameter  the diameter, measured in nm
     */
    void setChainDiameter(int chain, double diameter);
    /**
     * Get the number of spheres.
     */
    int getNumSpheres() const {
        return bodies.spheres.size();
    }
    /**
     * Add a sphere.
     *
     * @param particle  the index of the particle in its center
     * @param diameter  the diameter, measured in nm
     * @return the index of the sphere that was added
     */
    int addSphere(int particle, double diameter);
    /**
     * Get the particle of a sphere.
     *
     * @param sphere  the index of the sphere
     */
    int getSphereParticle(int sphere) const;
    /**
     * Get the diameter of a sphere.
     *
     * @param sphere  the index of the sphere
     * @return the diameter, measured in nm
     */
    double getSphereDiameter(int sphere) const;
    /**
     * Set the diameter of a sphere.
     *
     * @param sphere    the index of the sphere
     * @param diameter  the diameter, measured in nm
     */
    void setSphereDiameter(int sphere, double diameter);
    /**
     * Get the number of exclusions that were added.
     */
    int getNumExclusions() const {
        return bodies.exclusions.size();
    }
    /**
     * Let two segments or spheres not touch each other.
     *
     * @param chain1    the index of the chain of the first segment, or -1 for a sphere
     * @param segment1  the index of the segment in the chain, or that of the sphere
     * @param chain2    the index of the chain of the second segment, or -1 for a sphere
     * @param segment2  the index of the segment in the chain, or that of the sphere
     * @return the index of the exclusion that was added
     */
    int addExclusion(int chain1, int segment1, int chain2, int segment2);
    /**
     * Get an exclusion.
     *
     * @param index          the index of the exclusion
     * @param[out] chain1    the index of the chain of the first segment, or -1 for a sphere
     * @param[out] segment1  the index of the segment in the chain, or that of the sphere
     * @param[out] chain2    the index of the chain of the second segment, or -1 for a sphere
     * @param[out] segment2  the index of the segment in the chain, or that of the sphere
     */
    void getExclusion(int index, int& chain1, int& segment1, int& chain2, int& segment2) const;
    /**
     * Copy the stiffness and the diameters to a Context.  Chains, spheres and exclusions cannot be added in this way.
     */
    void updateParametersInContext(Context& context);
    /**
     * Get the contacts at the present positions of a Context: every place where two segments, two spheres, or a segment
     * and a sphere, overlap.
     *
     * @param context          a Context with this force
     * @param[out] ends        four numbers for each contact: the chain and the segment of the first side, and those of
     *                         the second.  A sphere has -1 for a chain, and its index for a segment.
     * @param[out] fractions   two for each contact: where along its segment each side touches.  Zero for a sphere.
     * @param[out] gaps        the distances of the axes less half the sum of the diameters: negative, measured in nm
     * @param[out] forces      the forces with which the two repel each other, measured in kJ/mol/nm
     * @param[out] directions  unit vectors from the second side to the first
     */
    void getContacts(Context& context, std::vector<int>& ends, std::vector<double>& fractions,
            std::vector<double>& gaps, std::vector<double>& forces, std::vector<Vec3>& directions);
    /**
     * Get the mean force of contacts over the steps of CylinderChainIntegrator since a reader has asked for it last, or
     * since the Context was made.  Checkpoints hold the sums, States do not.  Implicit steps know the mean within them;
     * explicit ones have the force at their start.  If there were no such steps, it is the
     * force at the present positions.
     *
     * @param context      a Context with this force
     * @param reader       0, or a number of addForceReader().  Whoever asks for itself does not shorten what others
     *                     have the mean of.
     * @param[out] forces  on all particles of the System, three numbers for each, measured in kJ/mol/nm
     * @param[out] numbers two for each pair of bodies that have touched: the numbers of chains, and those of
     *                     spheres behind them
     * @param[out] sums    of these, the sum of the forces on the first one, three numbers for each, measured in
     *                     kJ/mol/nm
     * @param[out] loads   and the sum of the sizes of the forces, measured in kJ/mol/nm
     * @return how long the steps have taken together, measured in ps, or 0 for the present positions
     */
    double takeMeanForces(Context& context, int reader, std::vector<double>& forces, std::vector<int>& numbers,
            std::vector<double>& sums, std::vector<double>& loads);
    /**
     * Add somebody who asks a Context for mean forces from now on.
     *
     * @return the number of the reader
     */
    int addForceReader(Context& context);
    /**
     * Set whether the distances of segments and spheres are those of their nearest periodic images.  The positions of a
     * chain's particles are taken as they are, even in a periodic box.
     */
    void setUsesPeriodicBoundaryConditions(bool periodic);
    /**
     * Get whether this Force makes use of periodic boundary conditions.
     */
    bool usesPeriodicBoundaryConditions() const;
    /**
     * Get what touches each other.
     */
    const cylchain::ContactBodies& getBodies() const {
        return bodies;
    }
    std::vector<cylchain::Place> findPlaces(const PlaceResolver& resolver) const;
protected:
    ForceImpl* createImpl() const;
private:
    void checkBody(int chain, int segment) const;
    cylchain::ContactBodies bodies;
    double stiffness;
    bool usePeriodic;
};

} // namespace OpenMM

#endif /*OPENMM_CYLINDERCHAINCONTACTFORCE_H_*/
