#ifndef OPENMM_CYLINDERCHAININTEGRATOR_H_
#define OPENMM_CYLINDERCHAININTEGRATOR_H_

#include "dynamics/Precisions.h"
#include "dynamics/Schemes.h"
#include "mechanics/RigidBody.h"
#include "openmm/Integrator.h"
#include "openmm/Vec3.h"
#include <cstdint>
#include <iosfwd>
#include <map>
#include <memory>
#include <string>
#include <vector>

namespace OpenMM {

class CylinderChainForceImpl;
class CylinderChainStepper;

/**
 * This is an Integrator which simulates a System that contains filaments, described by a CylinderChainForce, using
 * Brownian dynamics.
 *
 * The nodes of each chain move together: in each step, the forces on them and a random force are redistributed along
 * the chain (Pesek et al., Soft Matter 2016, 12, 3360).  That takes all forces of the System into account.  The random
 * forces are correlated as the friction of the segments demands.
 *
 * All other particles move independently of each other.  The friction coefficient of a particle outside chains is its
 * mass times getFriction(), as BrownianIntegrator has it, unless setParticleFriction() gives it one of its own.  With a
 * friction of zero, each of them must have one of its own: a Context is refused otherwise.
 *
 * Particles outside chains may be those of rigid bodies, which move as one: see CylinderChainForce::addBody().
 *
 * The fluid may flow: see setFlow().  Friction is then relative to the fluid where each segment or particle is.
 *
 * Particles whose mass is zero do not move; this includes nodes of chains, but not all nodes of the same chain.
 * Virtual sites follow the particles they depend on, but cannot be nodes.  Constraints are not supported.
 *
 * Motion is overdamped: there is no kinetic energy.  Velocities are displacements divided by the step size.
 *
 * The noise of a step depends only on the random number seed, on the path level, see setPathLevel(), and on the number
 * of steps taken since the Context was created, or the step count of the Context if that is greater: no noise comes
 * twice if the step count is set back, or if a State without parameters of the Integrator is restored.  Checkpoints
 * contain all this and the flow, so a simulation that goes on from a checkpoint is identical to one that was not
 * interrupted.  A State contains the number of steps taken, the path level that they were taken at, and the flow.
 *
 * In a periodic box, positions may have been wrapped particle by particle, which tears chains that cross its faces.  If
 * the CylinderChainForce does not use periodic boundary conditions, step() throws an exception that tells which chain
 * is torn.
 *
 * A chain or a particle may become unstable: because the step is too large, or because a force is.  step() then throws
 * an exception that tells where and when, and leaves the positions as they were before the step that failed.
 */
class CylinderChainIntegrator : public Integrator {
public:
    /**
     * The ways to advance chains by one step.  All are of weak order one in the step size.
     *
     * Euler: Section 4 of Pesek et al. 2016.  Its drift is that of free segments: equilibrium averages of chains are
     * biased at every step size.
     *
     * Midpoint: Fixman's midpoint, which has the right drift.
     *
     * Implicit: the forces of the chains are taken at the end of the step, those of all other Forces at its start.
     * Stretching, bending and tethers do not limit the step, and keep their equilibrium.  It is the default.  If the
     * force group of the CylinderChainForce is not among the integration force groups, this is the same as Midpoint.
     *
     * ImplicitSecondOrder: the same in two stages.  The motion of bends, which is of first order in the step otherwise,
     * is right to second order, for half as much again of work.
     *
     * Modes: for chains of beads alone, those of Panja, Barkema and van Leeuwen, Phys. Rev. E 2015, 92, 032603: open,
     * with harmonic segments that have no friction, BondDifference joints of one stiffness kappa, friction of nodes,
     * and no fixed node.  In terms of their (1), inner segments have the stiffness k = lambda-2 kappa and the rest
     * length lambda d/k, those at the ends lambda-kappa and lambda d/(lambda-kappa), and one that is alone lambda and
     * d.  Their normal modes are advanced as in Section IV, to first order in the step.  This takes less work than
     * other schemes and is stable, but bonds forget their length in steps that are long.  Other forces, tethers among
     * them, are taken at the start of the step; they act on each mode as it relaxes.
     */
    enum Scheme : int {CYLCHAIN_SCHEMES(CYLCHAIN_ENUMERATOR)};
    /**
     * The precision that steps of chains are computed in.  Positions, twists, forces and energies are in double
     * precision in any case.
     *
     * Automatic: mixed, where it is right and faster: for open chains with harmonic lengths and a scheme that is
     * implicit, at a temperature above zero, without a flow, with bends that relax within a step by less than 10^4 of
     * their relaxation time, lengths of at most 10^9 kT that noise changes by 10^-5 in a step or more, and twist of
     * at most 10^5 kT over how far a segment turns in a step, on which no hands follow a helix, if there are enough
     * such chains to fill more than half of a vector register, or chains so long that pieces of them do.  For the
     * scheme Modes: at a temperature above zero and with a stiffness of bonds and bends of at most 10^9 kT.  It is the
     * default.
     *
     * Mixed: what happens within a step is computed in single precision wherever that is right, for as few chains as
     * there are.  Chains for which it is not right are computed in double precision.
     *
     * Double: everything is computed in double precision.
     */
    enum Precision : int {CYLCHAIN_PRECISIONS(CYLCHAIN_ENUMERATOR)};
    /**
     * Get the names of all schemes, in the order of Scheme.
     */
    static std::vector<std::string> getSchemeNames();
    /**
     * Get the names of all precisions, in the order of Precision.
     */
    static std::vector<std::string> getPrecisionNames();
    /**
     * Create a CylinderChainIntegrator.
     *
     * @param temperature    the temperature of the heat bath (in Kelvin)
     * @param frictionCoeff  the friction coefficient of particles outside chains, divided by their mass (in 1/ps), or 0
     *                       if each of them has one of its own
     * @param stepSize       the step size with which to integrate the system (in picoseconds)
     */
    CylinderChainIntegrator(double temperature, double frictionCoeff, double stepSize);
    /**
     * Get the temperature of the heat bath (in Kelvin).
     */
    double getTemperature() const {
        return temperature;
    }
    /**
     * Set the temperature of the heat bath (in Kelvin).  Friction coefficients stay as they are.
     *
     * @param temp  the temperature of the heat bath, measured in Kelvin
     */
    void setTemperature(double temp);
    /**
     * Get the friction coefficient of particles outside chains, divided by their mass (in 1/ps).
     */
    double getFriction() const {
        return friction;
    }
    /**
     * Set the friction coefficient of particles outside chains, divided by their mass (in 1/ps).
     *
     * @param coeff  the friction coefficient, measured in 1/ps, or 0 if each of them has one of its own
     */
    void setFriction(double coeff);
    /**
     * Get the particles outside chains that have a friction coefficient of their own, and those coefficients,
     * measured in kJ ps/mol/nm^2.
     */
    const std::map<int, double>& getParticleFrictions() const {
        return particleFrictions;
    }
    /**
     * Give a particle outside chains a friction coefficient of its own.  In a Context that exists already, this takes
     * effect when it is reinitialized.
     *
     * @param particle  the index of the particle
     * @param coeff     the friction coefficient, measured in kJ ps/mol/nm^2
     */
    void setParticleFriction(int particle, double coeff);
    /**
     * Get how chains are advanced by one step.
     */
    Scheme getScheme() const {
        return scheme;
    }
    /**
     * Set how chains are advanced by one step.
     */
    void setScheme(Scheme scheme);
    /**
     * Get the precision that steps of chains are computed in.
     */
    Precision getPrecision() const {
        return precision;
    }
    /**
     * Set the precision that steps of chains are computed in.  In a Context that exists already, this takes effect with
     * the next step.  The noise is that of the same Brownian path in any precision, so that positions differ by
     * rounding alone at first.  Checkpoints do not contain the precision.
     */
    void setPrecision(Precision precision);
    /**
     * Get the number of chains that the last step has computed in mixed precision.  It is 0 before the first one.
     */
    int getNumMixedPrecisionChains() const;
    /**
     * Get the flow of the fluid.  See setFlow() for details.
     *
     * @param[out] velocity   the velocity at the origin of the flow, measured in nm/ps
     * @param[out] gradientX  the derivatives of the x component of the velocity by x, y and z, measured in 1/ps
     * @param[out] gradientY  those of its y component
     * @param[out] gradientZ  those of its z component
     * @param[out] origin     the origin of the flow, measured in nm
     */
    void getFlow(Vec3& velocity, Vec3& gradientX, Vec3& gradientY, Vec3& gradientZ, Vec3& origin) const;
    /**
     * Set the flow of the fluid: its velocity at origin+r is velocity+(gradientX.r, gradientY.r, gradientZ.r).  It
     * carries segments along, turns them and stretches them, as far as forces let it.  If the System uses periodic
     * boundary conditions, or its box was set, the velocity is that at the image of a particle which is nearest to the
     * origin; for a chain, the image of its first node.
     *
     * @param velocity   the velocity at the origin of the flow, measured in nm/ps
     * @param gradientX  the derivatives of the x component of the velocity by x, y and z, measured in 1/ps
     * @param gradientY  those of its y component
     * @param gradientZ  those of its z component
     * @param origin     the origin of the flow, measured in nm
     */
    void setFlow(const Vec3& velocity, const Vec3& gradientX, const Vec3& gradientY, const Vec3& gradientZ,
            const Vec3& origin);
    /**
     * Get how many times a step of a chain was taken in parts since the Context was created, because the equations of
     * the implicit scheme could not be solved, or a segment would have moved by more than its length.  The parts
     * follow the Brownian path of the step.  If this is more than a few in a thousand steps, the step is too large.
     */
    long long getNumDividedSteps() const {
        return dividedSteps;
    }
    /**
     * Get the force groups of which implicit schemes take all forces at the start of a step, as flags.
     */
    int getExplicitForceGroups() const {
        return explicitGroups;
    }
    /**
     * Set the force groups of which implicit schemes take all forces at the start of a step, also those of links,
     * contacts and walls that could be in their equations: one bit each, as in setIntegrationForceGroups().  None by
     * default.  Their stiffness bounds the step then.
     */
    void setExplicitForceGroups(int groups) {
        explicitGroups = groups;
    }
    /**
     * Get the number of steps over which the work of explicit forces is averaged.  See setWorkWindow() for details.
     */
    int getWorkWindow() const {
        return workWindow;
    }
    /**
     * Set the number of steps over which the work of explicit forces is averaged, or 0, which is the default, to
     * measure nothing.
     *
     * Forces are explicit if a step takes those of its start: all but those of the chains, with the scheme Implicit, or
     * all of them.  If a step is too long for them, it shows by the work w = -(f(after)-f(before)).dx that they do on a
     * particle in a step which moves it by dx: for a harmonic coordinate that relaxes by x = k mu h in a step, w has
     * the mean 2 kT x/(1-x/2).  The means over the window of dx and of the change of f are taken off first.
     *
     * Steps are left out that follow on a change of positions, of parameters of Forces or of the Context, or of the
     * periodic box.  Nothing is measured at zero temperature, nor where several steps are taken at once because there
     * are no other forces than those of the chains.
     */
    void setWorkWindow(int steps);
    /**
     * Get the mean work of explicit forces in the last window of steps that has been finished, for the particle where
     * it is largest.  Each window can be got once.  See setWorkWindow() for details.
     *
     * @param[out] work       the mean, over kT
     * @param[out] particle   the index of the particle
     * @param[out] steps      the number of steps in the window, or 0 if none has been finished since the last call
     * @param[out] particles  the number of particles of which it is the largest: those with such work
     */
    void takeExplicitWork(double& work, int& particle, int& steps, int& particles);
    /**
     * Get whether tensions are recorded.  See getMeanTensions() for details.
     */
    bool getRecordsTensions() const {
        return recordsTensions;
    }
    /**
     * Set whether tensions are recorded, which is not so by default.  See getMeanTensions() for details.
     */
    void setRecordsTensions(bool records) {
        recordsTensions = records;
    }
    /**
     * Get the tension of a chain as a mean over the last step, with friction and noise, for the scheme Implicit.  It is
     * recorded in the last step of each call to step() while setRecordsTensions(true) holds; otherwise this throws an
     * exception.  Checkpoints do not contain it.
     *
     * @param chain             the index of the chain
     * @param[out] tensions     the tension of each segment, measured in kJ/mol/nm: its elastic force, its friction
     *                          against becoming longer relative to the fluid and the noise of both, along its mean
     *                          direction
     * @param[out] jointForces  the force that the segment behind each joint exerts on the one before it, measured in
     *                          kJ/mol/nm.  Forces of tethers, and all that come from outside the chain, act on both
     *                          segments of a joint in equal parts.  The last joint of a ring is that of its last
     *                          segment and the first.
     * @param[out] directions   the direction of each segment half-way through the step, a unit vector
     */
    void getMeanTensions(int chain, std::vector<double>& tensions, std::vector<Vec3>& jointForces,
            std::vector<Vec3>& directions) const;
    /**
     * Get the random number seed.  See setRandomNumberSeed() for details.
     */
    int getRandomNumberSeed() const {
        return randomNumberSeed;
    }
    /**
     * Set the random number seed.  Two simulations with the same seed and otherwise identical are identical, on any
     * number of threads, if the forces are.
     *
     * If seed is set to 0 (which is the default value assigned), a unique seed is chosen when a Context is created from
     * this Integrator.  In a Context that exists already, a new seed takes effect when it is reinitialized.
     */
    void setRandomNumberSeed(int seed) {
        randomNumberSeed = seed;
    }
    /**
     * Get the path level.  See setPathLevel() for details.
     */
    int getPathLevel() const {
        return pathLevel;
    }
    /**
     * Set the path level.  The noise of two simulations with the same seed whose step sizes are h at level 0 and
     * h/2^level at another level is that of the same Brownian path, so that their difference is the error of the longer
     * step.  The lengths and bends of the implicit scheme that relax within a step are drawn anew in every step at any
     * level.  Those modes of the scheme Modes that relax within a step forget what came before it, so that the noise of
     * two short steps is not that of a long one for them.
     *
     * The level is between 0, which is the default, and getLargestPathLevel().  In a Context that exists already, a new
     * one takes effect when the Context is reinitialized.  A State from a simulation at another level is continued at
     * the same time on its path.
     */
    void setPathLevel(int level);
    /**
     * Get the largest path level that there is.  See setPathLevel() for details.
     */
    static int getLargestPathLevel();
    /**
     * Get the temperature of the heat bath (in Kelvin): overdamped motion has no temperature of its own.
     */
    double computeSystemTemperature() const {
        return temperature;
    }
    /**
     * Advance a simulation through time by taking a series of time steps.
     *
     * @param steps  the number of time steps to take
     */
    void step(int steps);
protected:
    /**
     * This will be called by the Context when it is created.  It informs the Integrator of what context it will be
     * integrating, and gives it a chance to do any necessary initialization.  It will also get called again if the
     * application calls reinitialize() on the Context.
     */
    void initialize(ContextImpl& context);
    /**
     * This will be called by the Context when it is destroyed to let the Integrator do any necessary cleanup.  It will
     * also get called again if the application calls reinitialize() on the Context.
     */
    void cleanup();
    /**
     * Get the names of all Kernels used by this Integrator.
     */
    std::vector<std::string> getKernelNames();
    /**
     * Note that positions have changed: chains may have been torn.  Whatever has changed, the next step does not follow
     * on the last one.
     */
    void stateChanged(State::DataType changed);
    /**
     * There is no kinetic energy.
     */
    double computeKineticEnergy();
    /**
     * Computing the kinetic energy for this integrator does not require forces.
     */
    bool kineticEnergyRequiresForce() const;
    /**
     * Write the seed, the path level, the number of steps taken, the flow and the links of all CylinderChainLinkForces
     * to a checkpoint.
     */
    void createCheckpoint(std::ostream& stream) const;
    /**
     * Read the seed, the path level, the number of steps taken, the flow and links from a checkpoint.
     */
    void loadCheckpoint(std::istream& stream);
    /**
     * Write the path level, the number of steps taken, the flow and the links of all CylinderChainLinkForces to a
     * State.
     */
    void serializeParameters(SerializationNode& node) const;
    /**
     * Read the number of steps taken, for the path level, the flow and links from a State.
     */
    void deserializeParameters(const SerializationNode& node);
private:
    void checkSystem(const System& system, const CylinderChainForceImpl& chains) const;
    void checkBodies(const System& system, const std::vector<cylchain::RigidBody>& bodies,
            const std::vector<bool>& isNode) const;
    std::uint64_t findNextStep() const;
    double temperature, friction;
    std::map<int, double> particleFrictions;
    Scheme scheme;
    Precision precision;
    Vec3 flowVelocity, flowGradient[3], flowOrigin;
    int randomNumberSeed, pathLevel, noiseLevel;
    std::uint64_t noiseSeed, stepsTaken;
    // The step count of the Context after the steps that were taken, or -1 if these were restored.

    long long countAfterSteps;
    long long dividedSteps;
    int workWindow, explicitGroups;
    bool chainsAreAlone, positionsHaveChanged, followsOn, recordsTensions;
    CylinderChainForceImpl* chains;
    std::shared_ptr<CylinderChainStepper> stepper;
};

} // namespace OpenMM

#endif /*OPENMM_CYLINDERCHAININTEGRATOR_H_*/
