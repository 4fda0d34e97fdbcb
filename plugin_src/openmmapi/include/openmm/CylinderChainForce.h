#ifndef OPENMM_CYLINDERCHAINFORCE_H_
#define OPENMM_CYLINDERCHAINFORCE_H_

#include "mechanics/BendingModels.h"
#include "mechanics/ChainList.h"
#include "mechanics/RigidBody.h"
#include "mechanics/StretchingModels.h"
#include "openmm/Context.h"
#include "openmm/Force.h"
#include "openmm/Vec3.h"
#include <set>
#include <string>
#include <utility>
#include <vector>

namespace OpenMM {

/**
 * This class describes filaments as extensible cylinder chains (Pesek et al., Soft Matter 2016, 12, 3360) and computes
 * their stretching and bending forces.
 *
 * A chain is a sequence of particles, its nodes.  Each two nodes that follow each other are the ends of a segment: a
 * deformable cylinder with a stretching energy and four friction coefficients.  Each two segments that follow each
 * other meet in a joint with a bending energy.  To use this class, create a CylinderChainForce object, then call
 * addChain() once for each chain.  All segments and joints of a chain begin with the same parameters; call
 * setSegmentParameters() and setJointParameters() for chains that are not uniform.
 *
 * A chain may also be made of beam elements, which bend inside: see addBeamChain().  All chains are in one list, and
 * numbered in the order in which they are added, whatever their kind.  Functions that name segments, joints or models
 * are for chains of straight segments, and those that name beam chains for those of beam elements.
 *
 * A chain may be closed: a ring, whose last segment joins its last node and its first.  Segments may propel themselves:
 * see setSegmentPropulsion().  A chain may be confined to a plane: see setChainPlanar().  Nodes may be tethered to
 * points, for instance to those of optical traps: see addTether().
 *
 * The friction coefficients have no influence on forces and energies.  CylinderChainIntegrator reads them here, and
 * moves the chains accordingly.  Every other Integrator takes this class for an ordinary Force.
 *
 * After a Context has been created, parameters of segments, joints and tethers, propulsion and which chains are planar
 * may be changed: call updateParametersInContext() to copy them over.
 */
class CylinderChainForce : public Force {
public:
    /**
     * The bending energy of a joint. mechanics/BendingModels.h says what each is.
     */
    enum BendingModel : int {CYLCHAIN_BENDING_MODELS(CYLCHAIN_ENUMERATOR)};
    /**
     * The stretching energy of a segment of length l, rest length l0 and stiffness k:
     *
     * Harmonic: (k/2) (l-l0)^2, eq. (7).
     *
     * FENE: -(k/2) D^2 ln(1-((l-l0)/D)^2), so that the length stays within l0-D and l0+D.
     */
    enum StretchingModel : int {CYLCHAIN_STRETCHING_MODELS(CYLCHAIN_ENUMERATOR)};
    /**
     * What a chain is made of.
     */
    enum ChainKind : int {StraightSegments = (int) cylchain::ChainKind::StraightSegments,
            BeamElements = (int) cylchain::ChainKind::BeamElements};
    /**
     * Get the names of all bending models, in the order of BendingModel.
     */
    static std::vector<std::string> getBendingModelNames();
    /**
     * Get the names of all stretching models, in the order of StretchingModel.
     */
    static std::vector<std::string> getStretchingModelNames();
    /**
     * Create a CylinderChainForce.
     */
    CylinderChainForce();
    /**
     * Get the number of chains, of all kinds.
     */
    int getNumChains() const {
        return chains.size();
    }
    /**
     * Get what a chain is made of, a ChainKind.
     */
    int getChainKind(int chain) const;
    /**
     * Get the name by which errors call a chain.
     */
    const std::string& getChainName(int chain) const;
    /**
     * Set the name by which errors call a chain, at the beginning of a sentence.  It is "Chain" and its number unless
     * this is called.
     */
    void setChainName(int chain, const std::string& name);
    /**
     * Add a chain.  Segments may have no friction at all if its nodes are given some, by setChainNodeFriction().
     *
     * @param particles              the indices of the particles that are its nodes, in the order of the chain: at
     *                               least two, and none of them twice
     * @param bendingModel           the bending energy of its joints
     * @param stretchingModel        the stretching energy of its segments
     * @param restLength             the rest length l0 of each segment, measured in nm
     * @param stretchingStiffness    the stretching stiffness k of each segment, measured in kJ/mol/nm^2
     * @param maximumExtension       the maximum extension D of each segment, measured in nm; it has no effect unless
     *                               the stretching model is FENE
     * @param jointStiffness         the bending stiffness b of each joint, measured in kJ/mol: the bending rigidity
     *                               divided by the rest length; in kJ/mol/nm^2 if the bending model is BondDifference
     * @param parallelFriction       the friction of each segment against motion along itself, measured in
     *                               kJ ps/mol/nm^2
     * @param perpendicularFriction  the friction of each segment against motion across itself, measured in
     *                               kJ ps/mol/nm^2
     * @param rotationalFriction     the friction of each segment against rotation, measured in kJ ps/mol
     * @param extensionalFriction    the friction of each segment against a change of its length, measured in kJ ps/mol
     * @param closed                 whether the last particle is joined to the first by a segment more; there must be
     *                               at least four particles then
     * @return the index of the chain that was added
     */
    int addChain(const std::vector<int>& particles, BendingModel bendingModel, StretchingModel stretchingModel,
            double restLength, double stretchingStiffness, double maximumExtension, double jointStiffness,
            double parallelFriction, double perpendicularFriction, double rotationalFriction,
            double extensionalFriction, bool closed = false);
    /**
     * Get the particles of a chain: its nodes, or the position and the control point of each node.
     *
     * @param chain  the index of the chain
     * @return the indices of the particles, in the order of the chain
     */
    const std::vector<int>& getChainParticles(int chain) const;
    /**
     * Get the models of a chain.
     *
     * @param chain                 the index of the chain
     * @param[out] bendingModel     the bending energy of its joints, a BendingModel
     * @param[out] stretchingModel  the stretching energy of its segments, a StretchingModel
     */
    void getChainModels(int chain, int& bendingModel, int& stretchingModel) const;
    /**
     * Get whether a chain is closed.
     *
     * @param chain  the index of the chain
     */
    bool isChainClosed(int chain) const;
    /**
     * Get whether the nodes of a chain keep their z.
     *
     * @param chain  the index of the chain
     */
    bool isChainPlanar(int chain) const;
    /**
     * Set whether the nodes of a chain keep their z, which must be the same for all of them.  CylinderChainIntegrator
     * then moves the chain in two dimensions: forces, noise and flow along z do not act on it.
     *
     * @param chain   the index of the chain
     * @param planar  whether its nodes keep their z
     */
    void setChainPlanar(int chain, bool planar);
    /**
     * Get the friction of each node of a chain.
     *
     * @param chain  the index of the chain
     */
    double getChainNodeFriction(int chain) const;
    /**
     * Set the friction of each node of a chain against its motion, the same in all directions, besides that of its
     * segments.  It is zero unless this is called.  A chain of beads has this friction alone.
     *
     * @param chain     the index of the chain
     * @param friction  the friction, measured in kJ ps/mol/nm^2
     */
    void setChainNodeFriction(int chain, double friction);
    /**
     * Get the number of segments of a chain: one less than it has nodes, or as many if it is closed.
     *
     * @param chain  the index of the chain
     */
    int getNumSegments(int chain) const;
    /**
     * Get the number of joints of a chain: one less than it has segments, or as many if it is closed.
     *
     * @param chain  the index of the chain
     */
    int getNumJoints(int chain) const;
    /**
     * Get the parameters of a segment.
     *
     * @param chain                       the index of the chain
     * @param segment                     the index of the segment in the chain
     * @param[out] restLength             the rest length l0, measured in nm
     * @param[out] stretchingStiffness    the stretching stiffness k, measured in kJ/mol/nm^2
     * @param[out] maximumExtension       the maximum extension D, measured in nm
     * @param[out] parallelFriction       the friction against motion along the segment, measured in kJ ps/mol/nm^2
     * @param[out] perpendicularFriction  the friction against motion across the segment, measured in kJ ps/mol/nm^2
     * @param[out] rotationalFriction     the friction against rotation, measured in kJ ps/mol
     * @param[out] extensionalFriction    the friction against a change of length, measured in kJ ps/mol
     */
    void getSegmentParameters(int chain, int segment, double& restLength, double& stretchingStiffness,
            double& maximumExtension, double& parallelFriction, double& perpendicularFriction,
            double& rotationalFriction, double& extensionalFriction) const;
    /**
     * Set the parameters of a segment.
     *
     * @param chain                  the index of the chain
     * @param segment                the index of the segment in the chain
     * @param restLength             the rest length l0, measured in nm
     * @param stretchingStiffness    the stretching stiffness k, measured in kJ/mol/nm^2
     * @param maximumExtension       the maximum extension D, measured in nm
     * @param parallelFriction       the friction against motion along the segment, measured in kJ ps/mol/nm^2
     * @param perpendicularFriction  the friction against motion across the segment, measured in kJ ps/mol/nm^2
     * @param rotationalFriction     the friction against rotation, measured in kJ ps/mol
     * @param extensionalFriction    the friction against a change of length, measured in kJ ps/mol
     */
    void setSegmentParameters(int chain, int segment, double restLength, double stretchingStiffness,
            double maximumExtension, double parallelFriction, double perpendicularFriction,
            double rotationalFriction, double extensionalFriction);
    /**
     * Get the propulsion of a segment.
     *
     * @param chain            the index of the chain
     * @param segment          the index of the segment in the chain
     * @param[out] propulsion  the force along the segment, measured in kJ/mol/nm
     */
    void getSegmentPropulsion(int chain, int segment, double& propulsion) const;
    /**
     * Let a segment propel itself: a force along it, from its first node to its second, half of it on each.  It belongs
     * to no energy.  It is zero unless this is called.
     *
     * @param chain       the index of the chain
     * @param segment     the index of the segment in the chain
     * @param propulsion  the force along the segment, measured in kJ/mol/nm; negative if it acts the other way
     */
    void setSegmentPropulsion(int chain, int segment, double propulsion);
    /**
     * Get the parameters of a joint.
     *
     * @param chain           the index of the chain
     * @param joint           the index of the joint in the chain: joint j is where segments j and j+1 meet, and at node
     *                        j if the chain is closed
     * @param[out] stiffness  the bending stiffness b, measured in kJ/mol
     */
    void getJointParameters(int chain, int joint, double& stiffness) const;
    /**
     * Set the parameters of a joint.
     *
     * @param chain      the index of the chain
     * @param joint      the index of the joint in the chain: joint j is where segments j and j+1 meet, and at node j if
     *                   the chain is closed
     * @param stiffness  the bending stiffness b, measured in kJ/mol
     */
    void setJointParameters(int chain, int joint, double stiffness);
    /**
     * Let the segments of a chain of straight segments have material frames, and its joints an energy of twist,
     * (stiffness/2) (m-rest)^2: mechanics/ChainTwist.h says what the twist m is.  CylinderChainIntegrator moves such a
     * chain with the scheme Implicit.  Twists are state of a Context, see getTwists(), and no function of positions:
     * energies and forces of a Context are without those of twist.  The chain is not planar, and its nodes have no
     * friction.
     *
     * @param chain      the index of the chain
     * @param stiffness  the stiffness of each joint, measured in kJ/mol: the torsional rigidity divided by the rest
     *                   length
     * @param rest       the twist of each joint at rest, measured in radians
     * @param friction   the friction of each segment against turning about itself, measured in kJ ps/mol; none for a
     *                   chain without twist
     */
    void setChainTwist(int chain, const std::vector<double>& stiffness, const std::vector<double>& rest,
            const std::vector<double>& friction);
    /**
     * Get what was set by setChainTwist().
     */
    void getChainTwist(int chain, std::vector<double>& stiffness, std::vector<double>& rest,
            std::vector<double>& friction) const;
    /**
     * Let the joints of a chain with twist be bent at rest: their bending energy is that of the vector b-R k in place
     * of the bend b, where R k is a vector of the material.  mechanics/ChainTwist.h says of which frame.  The frame of
     * the first segment is state then: it is in the first twist of an open chain, and in one more, the last, of a
     * closed one.  Segments turn when nodes have moved.  The energy of a Context is that for its twists; there are no
     * forces outside of steps.
     *
     * @param chain  the index of the chain, which has twist
     * @param bends  two components of each joint in the material frame half-way over it; none if all joints are
     *               straight.  They have the size of b: the square root of twice the energy of the model for the angle
     *               at rest and the stiffness one.
     */
    void setChainRestBends(int chain, const std::vector<double>& bends);
    /**
     * Get what was set by setChainRestBends().
     */
    void getChainRestBends(int chain, std::vector<double>& bends) const;
    /**
     * Set the frame beyond an end of an open chain with twist.  A body that carries it still does.  A frame whose joint
     * has a stiffness is held, or turns against a friction of its own, as a bead does; one without turns with the last
     * segment.  An end is free unless this is called.
     *
     * @param chain            the index of the chain
     * @param end              0 for that of the first node, and 1 for that of the last
     * @param direction        where the chain goes on there, from its first to its last node, in any length; zero if
     *                         the end is free
     * @param stiffness        the stiffness of the joint to the frame against twist, measured in kJ/mol; zero if the
     *                         frame turns with the last segment
     * @param torque           the torque on a frame that is not held, about the direction, measured in kJ/mol
     * @param angularVelocity  how fast a frame that is held turns about the direction, measured in radians/ps
     * @param friction         the friction against which a frame with a stiffness turns, measured in kJ ps/mol; zero if
     *                         it is held
     */
    void setEndFrame(int chain, int end, const Vec3& direction, double stiffness, double torque,
            double angularVelocity, double friction = 0);
    /**
     * Get the frame beyond an end of a chain.  See setEndFrame() for details.
     */
    void getEndFrame(int chain, int end, Vec3& direction, double& stiffness, double& torque,
            double& angularVelocity, double& friction) const;
    /**
     * Let a rigid body carry a frame that is held: it turns with the body, which has the torque of its joint, and
     * against it with its angular velocity.
     *
     * @param chain  the index of the chain
     * @param end    as in setEndFrame(), which must have been called: its direction is that in the frame of the body
     * @param body   the index of the body, or -1 if none carries the frame
     */
    void setEndFrameBody(int chain, int end, int body);
    /**
     * Get the index of the body that carries the frame beyond an end of a chain, or -1.
     */
    int getEndFrameBody(int chain, int end) const;
    /**
     * Get the twists of a chain in a Context: the angle at each of its joints, from the frame before it to the one
     * behind it.  That of an open chain with N segments has N+1, the first and the last of which are those to the
     * frames beyond its ends; number j of a closed chain is that at node j.  They begin with those at rest, and stay
     * what they are when positions are set.
     *
     * @param context      a Context of a System that holds this Force
     * @param chain        the index of the chain
     * @param[out] twists  the angles, measured in radians; none of a chain without twist
     */
    void getTwists(Context& context, int chain, std::vector<double>& twists) const;
    /**
     * Set the twists of a chain in a Context.  See getTwists() for details.
     */
    void setTwists(Context& context, int chain, const std::vector<double>& twists) const;
    /**
     * Add a chain of beam elements, which bend inside; mechanics/BeamChain.h says what they are.  Only scheme
     * "implicit" moves them.  Any other Force may act on their particles.
     *
     * @param particles             two for each node, its position and its control point, for at least two nodes, and
     *                              none of them twice
     * @param elementLength         the length h of each element, measured in nm
     * @param stretchingModulus     EA, measured in kJ/mol/nm
     * @param bendingRigidity       EI, measured in kJ nm/mol
     * @param shortening            the part by which a chord is shorter, because bends inside of an element fluctuate
     * @param parallelFriction      the friction per length against motion along the curve, measured in kJ ps/mol/nm^3
     * @param perpendicularFriction the friction per length against motion across it
     * @param planar                whether particles keep their z
     * @param closed                whether one more element leads from the last node to the first; there must be at
     *                              least three nodes then
     * @return the index of the chain that was added
     */
    int addBeamChain(const std::vector<int>& particles, double elementLength, double stretchingModulus,
            double bendingRigidity, double shortening, double parallelFriction, double perpendicularFriction,
            bool planar = false, bool closed = false);
    /**
     * Get the parameters of a chain of beam elements, see addBeamChain().
     */
    void getBeamChainParameters(int chain, double& elementLength, double& stretchingModulus, double& bendingRigidity,
            double& shortening, double& parallelFriction, double& perpendicularFriction) const;
    /**
     * Set the parameters of a chain of beam elements, see addBeamChain().
     */
    void setBeamChainParameters(int chain, double elementLength, double stretchingModulus, double bendingRigidity,
            double shortening, double parallelFriction, double perpendicularFriction);
    /**
     * Get the propulsion of a chain of beam elements.
     *
     * @param[out] propulsion  the force on each element along its curve, measured in kJ/mol/nm
     */
    void getBeamChainPropulsion(int chain, double& propulsion) const;
    /**
     * Set the propulsion of a chain of beam elements: a force on each element, spread evenly along its curve in the
     * direction of the tangent, towards its second node.  It belongs to no energy.
     */
    void setBeamChainPropulsion(int chain, double propulsion);
    /**
     * Add a rigid body: particles outside chains that CylinderChainIntegrator moves as one, with the scheme Implicit;
     * other Integrators are refused.  The forces on all of its particles move and turn it.  Links, contacts and walls
     * that take hold of them are in the equations of steps.  At least three particles must not be on one line, which
     * would not tell how the body is turned.
     *
     * Positions that are set in a Context must be those of a body that is rigid.
     *
     * @param particles           the indices of the particles, none of which is in another body
     * @param places              where they are in the frame of the body, three numbers for each, measured in nm.  The
     *                            origin of this frame is the centre of the body, at which its friction against motion
     *                            and that against turning are independent.
     * @param friction            the friction coefficient against motion, measured in kJ ps/mol/nm^2
     * @param rotationalFriction  the friction coefficient against turning in the frame of the body, measured in
     *                            kJ ps/mol: the entries xx, xy, xz, yy, yz and zz of a positive definite matrix
     * @param planar              whether the body moves in a plane of constant z alone, and turns about z alone
     * @return the index of the body
     */
    int addBody(const std::vector<int>& particles, const std::vector<double>& places, double friction,
            const std::vector<double>& rotationalFriction, bool planar);
    /**
     * Get the number of rigid bodies.
     */
    int getNumBodies() const {
        return bodies.size();
    }
    /**
     * Get what a rigid body is.  See addBody() for details.
     */
    void getBody(int index, std::vector<int>& particles, std::vector<double>& places, double& friction,
            std::vector<double>& rotationalFriction, bool& planar) const;
    /**
     * Get all rigid bodies.
     */
    const std::vector<cylchain::RigidBody>& getBodies() const {
        return bodies;
    }
    /**
     * Get the number of tethers.
     */
    int getNumTethers() const {
        return tethers.size();
    }
    /**
     * Tether a node to a point by a harmonic spring with the energy (k/2) d^2 for their distance d; the distance to
     * the nearest periodic image if this Force makes use of periodic boundary conditions.  A node can have one tether.
     *
     * CylinderChainIntegrator's scheme Implicit treats tethers like the other forces of chains, so they may be as stiff
     * as segments.
     *
     * @param chain      the index of the chain, of any kind
     * @param node       the index of the node in the chain
     * @param point      the point, measured in nm
     * @param stiffness  the stiffness k of the spring, measured in kJ/mol/nm^2
     * @return the index of the tether that was added
     */
    int addTether(int chain, int node, const Vec3& point, double stiffness);
    /**
     * Get the parameters of a tether.
     *
     * @param index           the index of the tether
     * @param[out] chain      the index of the chain
     * @param[out] node       the index of the node in the chain
     * @param[out] point      the point, measured in nm
     * @param[out] stiffness  the stiffness k of the spring, measured in kJ/mol/nm^2
     */
    void getTetherParameters(int index, int& chain, int& node, Vec3& point, double& stiffness) const;
    /**
     * Set the parameters of a tether.
     *
     * @param index      the index of the tether
     * @param chain      the index of the chain
     * @param node       the index of the node in the chain
     * @param point      the point, measured in nm
     * @param stiffness  the stiffness k of the spring, measured in kJ/mol/nm^2
     */
    void setTetherParameters(int index, int chain, int node, const Vec3& point, double stiffness);
    /**
     * Copy the parameters of segments, joints and tethers to a Context, so that changes made by setSegmentParameters(),
     * setSegmentPropulsion(), setJointParameters(), setTetherParameters(), setChainPlanar() and setEndFrame() take
     * effect in it, and so does what is set of chains of beam elements.
     * Models and particles cannot be changed in this way, and neither can chains be added; tethers can.
     */
    void updateParametersInContext(Context& context);
    /**
     * Compute the energies of a Context's chains in its present positions, separately.
     *
     * @param context          a Context of a System that holds this Force
     * @param[out] stretching  the stretching energy of all segments, measured in kJ/mol
     * @param[out] bending     the bending energy of all joints, measured in kJ/mol
     */
    void computeEnergies(Context& context, double& stretching, double& bending) const;
    /**
     * Set whether the distance between nodes that follow each other should be that of their nearest periodic images.
     * By default it is not: the positions of a chain's nodes are taken as they are, even in a periodic box.
     */
    void setUsesPeriodicBoundaryConditions(bool periodic);
    /**
     * Get whether this Force makes use of periodic boundary conditions.
     */
    bool usesPeriodicBoundaryConditions() const;
    /**
     * Get the chains without their tethers.
     */
    const cylchain::ChainList& getChains() const {
        return chains;
    }
    /**
     * Describe the chains with their tethers; which particles are fixed is known by a System.
     */
    cylchain::ChainList describeChains() const;
protected:
    ForceImpl* createImpl() const;
private:
    struct TetherInfo {
        int chain;
        cylchain::Tether tether;
    };
    const cylchain::Chain& getChain(int chain) const;
    cylchain::Chain& getChain(int chain);
    const cylchain::BeamChain& getBeam(int chain) const;
    void checkIndex(int chain) const;
    void checkKind(int chain, cylchain::ChainKind kind) const;
    void checkTether(const TetherInfo& info) const;
    cylchain::ChainList chains;
    std::vector<TetherInfo> tethers;
    std::vector<cylchain::RigidBody> bodies;
    std::set<std::pair<int, int> > tetheredNodes;
    bool usePeriodic;
};

} // namespace OpenMM

#endif /*OPENMM_CYLINDERCHAINFORCE_H_*/
