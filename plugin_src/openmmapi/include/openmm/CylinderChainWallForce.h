#ifndef OPENMM_CYLINDERCHAINWALLFORCE_H_
#define OPENMM_CYLINDERCHAINWALLFORCE_H_

#include "couplings/Walls.h"
#include "openmm/Context.h"
#include "openmm/CylinderChainCoupling.h"
#include <string>
#include <vector>

namespace OpenMM {

/**
 * This class keeps particles in a region: a half space, or the inside of a slab, sphere, cylinder, box,
 * ellipsoid, capsule or torus.  It may also keep them outside of one, or hold them on its surface: see setSide().
 *
 * Where a sphere around a particle gets beyond the surface of the region by a depth d, the energy is (k/2) d^2.  Of a
 * slab or box, each plane counts by itself, so that the energy of a box is that of the distance from it.  The depth of
 * an ellipsoid is (s-1)/|grad s|, with s^2 the sum of (x_i/a_i)^2: that of its surface to first order.
 *
 * Three things describe a region:
 *
 *     shape        point                      vector                           length
 *     "plane"      on it                      its normal, into the half space  -
 *     "slab"       half-way between planes    their normal                     their distance
 *     "sphere"     the center                 -                                the radius
 *     "cylinder"   on the axis                the axis                         the radius
 *     "box"        the lower corner           the upper corner                 -
 *     "ellipsoid"  the center                 the semi-axes                    -
 *     "capsule"    the middle                 from it to where a cap begins    the radius
 *     "torus"      the center                 the axis, as long as the radius  the radius of the tube
 *                                             of its circle
 *
 * With other Integrators than CylinderChainIntegrator, and with its explicit schemes, the force is taken at the present
 * positions.  Implicit schemes have it in their equations, unless one of the particles is a virtual site.
 *
 * Positions are taken as they are, even in a periodic box.  After a Context has been created, the region, the stiffness
 * and the radii may be changed: call updateParametersInContext() to copy them over.
 */
class CylinderChainWallForce : public CylinderChainCoupling {
public:
    /**
     * Create a CylinderChainWallForce.
     *
     * @param shape      the name of the shape
     * @param point      see above, measured in nm
     * @param vector     see above; all but directions are measured in nm, which need not be normalized
     * @param length     see above, measured in nm
     * @param stiffness  the stiffness k, measured in kJ/mol/nm^2
     */
    CylinderChainWallForce(const std::string& shape, const Vec3& point, const Vec3& vector, double length,
            double stiffness);
    /**
     * Get the region.
     *
     * @param[out] point   see above, measured in nm
     * @param[out] vector  see above; directions are normalized
     * @param[out] length  see above, measured in nm
     * @return the name of the shape
     */
    std::string getRegion(Vec3& point, Vec3& vector, double& length) const;
    /**
     * Set the region.
     *
     * @param shape   the name of the shape
     * @param point   see above, measured in nm
     * @param vector  see above; all but directions are measured in nm, which need not be normalized
     * @param length  see above, measured in nm
     */
    void setRegion(const std::string& shape, const Vec3& point, const Vec3& vector, double length);
    /**
     * Get on which side of the surface particles are kept.
     *
     * @return "inside", "outside" or "surface"
     */
    std::string getSide() const;
    /**
     * Set on which side of the surface of the region particles are kept.  The others than "inside" are for shapes with
     * one face: not for slabs and boxes.  Outside, the depth d is that to which a sphere around a particle gets into
     * the region.  On the surface, the energy is (k/2) d^2 with the depth d of the sphere beyond the surface, positive
     * or negative: the particle is held by its radius inside of it.  A Context that has a surface keeps it.
     *
     * @param side  "inside", which is what there is without this, "outside" or "surface"
     */
    void setSide(const std::string& side);
    /**
     * Get the stiffness k.
     *
     * @return the stiffness, measured in kJ/mol/nm^2
     */
    double getStiffness() const {
        return walls.stiffness;
    }
    /**
     * Set the stiffness k.
     *
     * @param stiffness  the stiffness, measured in kJ/mol/nm^2
     */
    void setStiffness(double stiffness);
    /**
     * Get the number of particles.
     */
    int getNumParticles() const {
        return walls.particles.size();
    }
    /**
     * Add a particle.
     *
     * @param particle  the index of the particle
     * @param radius    the radius of the sphere around it, measured in nm
     * @return the index, in this Force, of the particle that was added
     */
    int addParticle(int particle, double radius = 0);
    /**
     * Get the particle that an index stands for.
     *
     * @param index  the index in this Force
     * @return the index of the particle
     */
    int getParticle(int index) const;
    /**
     * Get the radius of a particle.
     *
     * @param index  the index in this Force
     * @return the radius, measured in nm
     */
    double getParticleRadius(int index) const;
    /**
     * Set the radius of a particle.
     *
     * @param index   the index in this Force
     * @param radius  the radius, measured in nm
     */
    void setParticleRadius(int index, double radius);
    /**
     * Get the mean force of the wall over the steps of CylinderChainIntegrator since a reader has asked for it last, or
     * since the Context was made.  Checkpoints hold the sums, States do not.  Implicit steps know the mean within them;
     * explicit ones have the force at their start.  If there were no such steps, it is the
     * force at the present positions.
     *
     * @param context      a Context with this force
     * @param reader       0, or a number of addForceReader().  Whoever asks for itself does not shorten what others
     *                     have the mean of.
     * @param[out] forces  on all particles of the System, three numbers for each, measured in kJ/mol/nm
     * @param[out] numbers two for each face that has pushed: its number, and -1.  A slab has the faces 0, at
     *                     which its normal points, and 1; a box 0 to 5 (lower x, upper x, lower y, ...)
     * @param[out] sums    of these, the sum of the forces, three numbers for each, measured in kJ/mol/nm
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
     * Copy the region, the stiffness and the radii to a Context.  Particles cannot be added in this way.
     */
    void updateParametersInContext(Context& context);
    /**
     * Get whether this Force makes use of periodic boundary conditions: it does not.
     */
    bool usesPeriodicBoundaryConditions() const {
        return false;
    }
    std::vector<cylchain::Place> findPlaces(const PlaceResolver& resolver) const;
    /**
     * Get the wall and its particles.
     */
    const cylchain::WallSystem& getWalls() const {
        return walls;
    }
protected:
    ForceImpl* createImpl() const;
private:
    cylchain::WallSystem walls;
};

} // namespace OpenMM

#endif /*OPENMM_CYLINDERCHAINWALLFORCE_H_*/
