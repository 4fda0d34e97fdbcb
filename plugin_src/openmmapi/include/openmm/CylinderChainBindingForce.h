#ifndef OPENMM_CYLINDERCHAINBINDINGFORCE_H_
#define OPENMM_CYLINDERCHAINBINDINGFORCE_H_

#include "kinetics/Linkers.h"
#include "openmm/Context.h"
#include "openmm/CylinderChainCoupling.h"
#include "openmm/Vec3.h"
#include <string>
#include <vector>

namespace OpenMM {

/**
 * This class describes linkers that bind to filaments, walk along them and unbind: crosslinkers and motors.
 *
 * A linker is a spring, with the energy (k/2) (d-d0)^2 of its length d, between two hands that bind to the chains of
 * the CylinderChainForce of the System; or between an anchor, which is a particle or a point that does not move, and
 * one hand.  Before each step of any Integrator, hands that are bound walk, and then all linkers bind and unbind at
 * random as long as the step takes, while chains stand still.  With c the rate of binding per length, the reach R, the
 * energy U and the tension F of the spring,
 *
 *     a linker that is not bound     binds one hand with the rate c v/V for each length of filament, where V is the
 *                                    volume of unbound linkers, and v = (4 pi/3) (R1 R2)^(3/2);
 *     a linker with one hand bound   binds the other one with the rate c exp(-(1-lambda) U/kT) for each length of
 *                                    filament within its reach;
 *     a hand that is bound           unbinds with the rate k exp(lambda U/kT), or k exp(|F|/Fu), to which a second
 *                                    pathway adds kc exp(-|F|/Fc).
 *
 * Linkers of a type that diffuses have positions while they are not bound: within the walls of each
 * CylinderChainWallForce of the System, or those of the type, and in the periodic box.  They bind a hand with the rate
 * c (R'/R)^(3/2) for each length of filament within its reach R, R' being that of the other hand, and unbind to
 * anywhere in a sphere with the radius R: as often, in equilibrium, as those without positions.
 *
 * With the first law of unbinding and without speed, equilibrium is that of the energies, whatever the step is.
 * Lengths along a filament are those of its segments at rest, from its first node, the minus end, to its last, the plus
 * end.  Hands bind to the curves of beam elements.
 *
 * Which linkers there are and where they are bound belongs to each Context; this object holds what every new Context
 * begins with.  A parameter of the Context counts the steps that they have taken.  CylinderChainIntegrator writes them
 * into its checkpoints, and into States that hold the parameters of the Integrator.  With other Integrators, save what
 * getLinkersInContext() returns beside the State, and give it to setLinkersInContext().
 */
class CylinderChainBindingForce : public CylinderChainCoupling {
public:
    /**
     * Create a CylinderChainBindingForce.
     *
     * @param temperature  the temperature T, measured in K; that of a CylinderChainIntegrator counts instead
     */
    explicit CylinderChainBindingForce(double temperature);
    /** Get the temperature, measured in K. */
    double getTemperature() const {
        return temperature;
    }
    /** Set the temperature, measured in K. */
    void setTemperature(double temperature);
    /** Get the random number seed; with 0, each Context chooses one. */
    int getRandomNumberSeed() const {
        return randomNumberSeed;
    }
    /**
     * Set the random number seed.  With 0, each Context chooses one.  That of a CylinderChainIntegrator counts instead,
     * so that Contexts of one System whose integrators have other seeds have other random numbers.
     */
    void setRandomNumberSeed(int seed) {
        randomNumberSeed = seed;
    }
    /** Get the number of kinds of hands. */
    int getNumHands() const {
        return hands.size();
    }
    /**
     * Add a kind of hands.
     *
     * @param bindingRate    the rate of binding per length of filament, c, measured in 1/(ps nm)
     * @param reach          how far from the other hand or the anchor it binds, R, measured in nm
     * @param unbindingRate  the rate of unbinding without load, k, measured in 1/ps
     * @param chains         the chains that it binds to
     * @return the number of the kind
     */
    int addHand(double bindingRate, double reach, double unbindingRate, const std::vector<int>& chains);
    /**
     * Get the parameters of a kind of hands.
     *
     * @param hand                the number of the kind
     * @param[out] bindingRate    the rate of binding per length of filament, measured in 1/(ps nm)
     * @param[out] reach          how far it binds, measured in nm
     * @param[out] unbindingRate  the rate of unbinding without load, measured in 1/ps
     */
    void getHandParameters(int hand, double& bindingRate, double& reach, double& unbindingRate) const;
    /** Get the chains that a kind of hands binds to. */
    const std::vector<int>& getHandChains(int hand) const;
    /**
     * Get how load makes a kind of hands unbind.
     *
     * @param hand                 the number of the kind
     * @param[out] strainShare     lambda
     * @param[out] unbindingForce  Fu, measured in kJ/mol/nm, or 0 if there is none
     * @param[out] catchRate       kc, measured in 1/ps
     * @param[out] catchForce      Fc, measured in kJ/mol/nm, or 0 if the second pathway does not depend on the force
     */
    void getHandUnbinding(int hand, double& strainShare, double& unbindingForce, double& catchRate,
            double& catchForce) const;
    /**
     * Set how load makes a kind of hands unbind.  All are 0 unless this is called.
     *
     * @param hand            the number of the kind
     * @param strainShare     lambda, from 0 to 1; it must be 0 if Fu is given
     * @param unbindingForce  Fu, measured in kJ/mol/nm, or 0 if there is none
     * @param catchRate       kc, measured in 1/ps
     * @param catchForce      Fc, measured in kJ/mol/nm, or 0 if the second pathway does not depend on the force
     */
    void setHandUnbinding(int hand, double strainShare, double unbindingForce, double catchRate, double catchForce);
    /**
     * Get how a kind of hands walks.
     *
     * @param hand                the number of the kind
     * @param[out] speed          the speed without load, towards the plus end if positive, measured in nm/ps
     * @param[out] stallForce     the load at which it stops, measured in kJ/mol/nm, or 0 if no load changes its speed
     * @param[out] walksBackward  whether it walks backward under larger loads
     * @param[out] holdsAtEnds    whether it stays at the end of a filament to which it has walked, or unbinds there
     */
    void getHandWalking(int hand, double& speed, double& stallForce, bool& walksBackward, bool& holdsAtEnds) const;
    /**
     * Set how a kind of hands walks: with the speed v0 (1+F/Fs) where F is the force of the spring along the direction
     * of walking, at most 2 v0, and at least 0, or -v0 if it walks backward.  A hand does not walk unless this is
     * called.
     *
     * @param hand           the number of the kind
     * @param speed          the speed without load, v0, towards the plus end if positive, measured in nm/ps
     * @param stallForce     Fs, measured in kJ/mol/nm, or 0 if no load changes the speed
     * @param walksBackward  whether it walks backward under larger loads
     * @param holdsAtEnds    whether it stays at the end of a filament to which it has walked, or unbinds there
     */
    void setHandWalking(int hand, double speed, double stallForce, bool walksBackward, bool holdsAtEnds);
    /**
     * Set what a kind of hands has to do with an end of chains that grow.
     *
     * @param hand        the index of the kind
     * @param end         the plus end (1), the minus end (0), or either (2), of which it changes no states; or -1 for
     *                    none
     * @param range       how near to the end counts as there, measured in nm
     * @param bindsThere  whether it binds there alone, and comes to the end itself then
     * @param tracks      whether one that is at the end stays there while the end grows and shrinks, and does not
     *                    slide away
     * @param freeState   the state of ends that it changes, see CylinderChainGrowthForce::setEndStates(), or -1
     * @param heldState   the state that these have while it is there, or -1
     * @param numbers     the chains the ends of which it changes
     */
    void setHandAtEnd(int hand, int end, double range, bool bindsThere, bool tracks, int freeState, int heldState,
            const std::vector<int>& numbers);
    /** Get what a kind of hands has to do with an end, see setHandAtEnd(). */
    void getHandAtEnd(int hand, int& end, double& range, bool& bindsThere, bool& tracks, int& freeState,
            int& heldState, std::vector<int>& numbers) const;
    /**
     * Set to which part of filaments a kind of hands binds.  It binds to all of them unless this is called.
     *
     * @param hand      the number of the kind
     * @param end       the plus end (1), the minus end (0), or either (2), or -1 if it binds to all of a filament
     * @param range     how near to the end is near, measured in nm
     * @param excluded  whether it binds to all but what is near; else to what is near alone
     */
    void setHandBindingRange(int hand, int end, double range, bool excluded);
    /** Get to which part of filaments a kind of hands binds, see setHandBindingRange(). */
    void getHandBindingRange(int hand, int& end, double& range, bool& excluded) const;
    /** Get how hands of a kind take monomers off ends, see setHandRemoval(). */
    void getHandRemoval(int hand, double& offRate, int& sites, double& unbindingRate) const;
    /**
     * Let hands of a kind take monomers off the end with which they have to do, see setHandAtEnd(), while they are
     * there. An end that neither gains nor loses monomers by itself keeps them.
     *
     * @param hand           the index of the kind
     * @param offRate        how often each of them does so, measured in 1/ps
     * @param sites          how many of them do so at most at an end
     * @param unbindingRate  how often they unbind there without load, measured in 1/ps, or -1 if as often as elsewhere
     */
    void setHandRemoval(int hand, double offRate, int sites, double unbindingRate);
    /** Get the friction of hands of a kind that slide, measured in kJ ps/mol/nm^2, or 0 if they do not. */
    double getHandSliding(int hand) const;
    /**
     * Let hands of a kind slide along filaments: at random, and by the force of the spring, over their friction.
     *
     * @param hand      the number of the kind, which has neither sites nor a speed
     * @param friction  the friction, measured in kJ ps/mol/nm^2, or 0 if they do not slide
     */
    void setHandSliding(int hand, double friction);
    /** Get how hands of a kind follow the helix of filaments, see setHandOnHelix(). */
    void getHandOnHelix(int hand, double& pitch, double& friction, double& stallTorque, double& range) const;
    /**
     * Let hands of a kind follow the helix of filaments with twist: they turn about the filament with the material, and
     * as they walk.
     *
     * @param hand         the index of the kind, which has neither sites nor friction of sliding
     * @param pitch        the length of a turn of the helix at rest, negative if it is left-handed, measured in nm; or
     *                     0 of hands that follow none
     * @param friction     against turning about the filament, measured in kJ ps/mol
     * @param stallTorque  the torque of the filament that stops it, measured in kJ/mol, or 0 if none changes its speed
     * @param range        from how far on either side the torque is known, measured in nm
     */
    void setHandOnHelix(int hand, double pitch, double friction, double stallTorque, double range);
    /** Get the rate at which hands of a kind cut filaments, see setHandSevering(). */
    double getHandSevering(int hand) const;
    /**
     * Let hands of a kind cut filaments that grow where they are bound, before the nearest monomer.
     *
     * @param hand  the index of the kind
     * @param rate  how often, measured in 1/ps
     */
    void setHandSevering(int hand, double rate);
    /**
     * Get the distance of binding sites along filaments, measured in nm, or 0 if a kind of hands binds anywhere.
     */
    double getHandSiteSpacing(int hand) const;
    /**
     * Set the distance of binding sites along filaments, measured in nm; 0 if hands bind anywhere.  A site holds one
     * hand, of all kinds with the same distance of sites.
     */
    void setHandSiteSpacing(int hand, double spacing);
    /** Get the number of types of linkers. */
    int getNumLinkerTypes() const {
        return types.size();
    }
    /**
     * Add a type of linkers.
     *
     * @param hand1       the kind of the first hand, or -1 if linkers of this type are anchored
     * @param hand2       the kind of the second hand
     * @param restLength  the rest length d0, measured in nm
     * @param stiffness   the stiffness k, measured in kJ/mol/nm^2
     * @param sameChain   whether both hands may bind to the same chain
     * @return the number of the type
     */
    int addLinkerType(int hand1, int hand2, double restLength, double stiffness, bool sameChain);
    /**
     * Get the parameters of a type of linkers.
     *
     * @param type             the number of the type
     * @param[out] hand1       the kind of the first hand, or -1 if linkers of this type are anchored
     * @param[out] hand2       the kind of the second hand
     * @param[out] restLength  the rest length d0, measured in nm
     * @param[out] stiffness   the stiffness k, measured in kJ/mol/nm^2
     * @param[out] sameChain   whether both hands may bind to the same chain
     */
    void getLinkerTypeParameters(int type, int& hand1, int& hand2, double& restLength, double& stiffness,
            bool& sameChain) const;
    /**
     * Get where linkers of a type are while they are not bound.
     *
     * @param type                the number of the type
     * @param[out] volume         the volume in which they are, measured in nm^3, or 0 if it is that of the periodic box
     * @param[out] concentration  their number per nm^3 if that does not change, or -1
     */
    void getLinkerTypeReservoir(int type, double& volume, double& concentration) const;
    /**
     * Set where linkers of a type are while they are not bound.
     *
     * @param type           the number of the type
     * @param volume         the volume in which they are, measured in nm^3, or 0 if it is that of the periodic box
     * @param concentration  their number per nm^3 if that does not change, or -1 if there are as many as were added
     */
    void setLinkerTypeReservoir(int type, double volume, double concentration);
    /** Get which pairs of places linkers of a type join, and in which order their hands bind. */
    void getLinkerTypeRules(int type, double& leastCosine, double& largestCosine, bool& transActivated,
            bool& reversible) const;
    /**
     * Set which pairs of places linkers of a type join, and in which order their hands bind.  There are no such rules
     * unless this is called.
     *
     * @param type            the number of the type
     * @param leastCosine     the second hand to bind does so where the cosine of the angle between both filaments is at
     *                        least this
     * @param largestCosine   and at most this
     * @param transActivated  whether the second hand of the type binds only while the first one is bound, and that one
     *                        only before it
     * @param reversible      whether hands unbind only where and when they could bind by these rules, so that one way
     *                        is as likely as the other; else they always unbind
     */
    void setLinkerTypeRules(int type, double leastCosine, double largestCosine, bool transActivated, bool reversible);
    /** Get how far the hands of linkers of a type are that bind at once, or 0, see setLinkerTypeLoading(). */
    double getLinkerTypeLoading(int type) const {
        return getLinkerType(type).loadingDistance;
    }
    /**
     * Let both hands of linkers of a type bind at once, at the rate of the first one, and unbind at once, at the sum of
     * the rates of both: extruders of loops.
     *
     * @param type      the number of the type, the linkers of which have two hands
     * @param distance  how far from the first hand, towards the plus end of the same chain, the second one binds,
     *                  measured in nm, not less than the distance of its sites; or 0 if they bind one after the other
     */
    void setLinkerTypeLoading(int type, double distance);
    /** Get the number of barriers. */
    int getNumBarriers() const {
        return barriers.size();
    }
    /**
     * Add a barrier, which captures hands that walk past it along a chain.
     *
     * @param chain               the chain, which does not grow
     * @param position            the length along it, measured in nm
     * @param direction           1 if it captures those that walk towards the plus end, -1 the minus end, 0 either
     * @param captureProbability  how likely it captures a hand
     * @param releaseRate         the rate at which it lets a hand go on, measured in 1/ps
     * @return the number of the barrier
     */
    int addBarrier(int chain, double position, int direction, double captureProbability, double releaseRate);
    /** Get a barrier, see addBarrier(). */
    void getBarrierParameters(int index, int& chain, double& position, int& direction, double& captureProbability,
            double& releaseRate) const;
    /** Get all barriers.  This is for internal use. */
    const std::vector<cylchain::Barrier>& getBarriers() const {
        return barriers;
    }
    /**
     * Get how linkers of a type diffuse while they are not bound.
     *
     * @param type            the number of the type
     * @param[out] diffusion  the diffusion coefficient, measured in nm^2/ps, or -1 if they have no positions
     * @param[out] planar     whether they stay in the plane z = 0
     */
    void getLinkerTypeDiffusion(int type, double& diffusion, bool& planar) const;
    /**
     * Set how linkers of a type diffuse while they are not bound.  They have no positions unless this is called.
     *
     * @param type       the number of the type, the linkers of which have two hands, and no volume or concentration
     * @param diffusion  the diffusion coefficient, measured in nm^2/ps, or -1 if they have no positions
     * @param planar     whether they stay in the plane z = 0; the rate of binding has the factor R'/R then
     */
    void setLinkerTypeDiffusion(int type, double diffusion, bool planar);
    /** Get the number of walls that linkers of a type are within which diffuse, see addLinkerTypeWall(). */
    int getNumLinkerTypeWalls(int type) const {
        return getLinkerType(type).walls.size();
    }
    /**
     * Let linkers of a type that diffuse be within a region of their own, in place of the walls of the System; if there
     * are several, within all of them.
     *
     * @param type    the number of the type
     * @param shape   the name of the shape, see CylinderChainWallForce
     * @param point   see CylinderChainWallForce, measured in nm
     * @param vector  see CylinderChainWallForce
     * @param length  see CylinderChainWallForce, measured in nm
     */
    void addLinkerTypeWall(int type, const std::string& shape, const Vec3& point, const Vec3& vector, double length);
    /**
     * Get a wall of a type of linkers.
     *
     * @param type         the number of the type
     * @param wall         the number of the wall
     * @param[out] point   see CylinderChainWallForce, measured in nm
     * @param[out] vector  see CylinderChainWallForce
     * @param[out] length  see CylinderChainWallForce, measured in nm
     * @return the name of the shape
     */
    std::string getLinkerTypeWall(int type, int wall, Vec3& point, Vec3& vector, double& length) const;
    /** Get the number of anchors. */
    int getNumAnchors() const {
        return anchors.size();
    }
    /**
     * Add an anchor at a particle that is not part of a chain.
     *
     * @return the number of the anchor
     */
    int addParticleAnchor(int particle);
    /**
     * Add an anchor at a point that does not move.
     *
     * @param point  the point, measured in nm
     * @return the number of the anchor
     */
    int addPointAnchor(const Vec3& point);
    /**
     * Get an anchor.
     *
     * @param anchor         the number of the anchor
     * @param[out] particle  its particle, or -1 if it is a point
     * @param[out] point     the point, measured in nm
     */
    void getAnchor(int anchor, int& particle, Vec3& point) const;
    /** Get the number of linkers. */
    int getNumLinkers() const {
        return state.linkers.size();
    }
    /**
     * Add linkers that are not bound.
     *
     * @param type   their type, the linkers of which are not anchored
     * @param count  how many
     */
    void addLinkers(int type, int count);
    /**
     * Add a linker at an anchor, with a hand that is not bound.
     *
     * @param type    its type
     * @param anchor  the number of the anchor
     */
    void addAnchoredLinker(int type, int anchor);
    /**
     * Get all linkers at once.
     *
     * @param[out] numbers     their numbers, in ascending order
     * @param[out] types       the type of each
     * @param[out] anchors     the anchor of each, or -1
     * @param[out] chains      the chains to which the two hands of each are bound, -1 where they are not
     * @param[out] places      the lengths along these chains from their minus ends, measured in nm
     * @param[out] nextNumber  the number that the next linker will have
     */
    void getLinkers(std::vector<int>& numbers, std::vector<int>& types, std::vector<int>& anchors,
            std::vector<int>& chains, std::vector<double>& places, int& nextNumber) const;
    /**
     * Replace all linkers.
     *
     * @param numbers     their numbers, in ascending order
     * @param types       the type of each
     * @param anchors     the anchor of each, or -1
     * @param chains      the chains to which the two hands of each are bound, -1 where they are not
     * @param places      the lengths along these chains from their minus ends, measured in nm
     * @param nextNumber  the number that the next linker will have
     */
    void setLinkers(const std::vector<int>& numbers, const std::vector<int>& types, const std::vector<int>& anchors,
            const std::vector<int>& chains, const std::vector<double>& places, int nextNumber);
    /** Get all linkers of a Context at once, like getLinkers(). */
    void getLinkersInContext(Context& context, std::vector<int>& numbers, std::vector<int>& types,
            std::vector<int>& anchors, std::vector<int>& chains, std::vector<double>& places, int& nextNumber) const;
    /** Replace all linkers of a Context, like setLinkers(). */
    void setLinkersInContext(Context& context, const std::vector<int>& numbers, const std::vector<int>& types,
            const std::vector<int>& anchors, const std::vector<int>& chains, const std::vector<double>& places,
            int nextNumber) const;
    /**
     * Get where those linkers are that diffuse and are not bound, and have been given positions.
     *
     * @param[out] numbers  their numbers, in ascending order
     * @param[out] places   three coordinates of each, measured in nm
     */
    void getUnboundPositions(std::vector<int>& numbers, std::vector<double>& places) const;
    /**
     * Set where linkers are that diffuse and are not bound.  All others are anywhere in their region, at random.
     *
     * @param numbers  their numbers, in ascending order
     * @param places   three coordinates of each, measured in nm
     */
    void setUnboundPositions(const std::vector<int>& numbers, const std::vector<double>& places);
    /**
     * Get where those linkers of a Context are that diffuse and are not bound, like getUnboundPositions().  In a
     * periodic box, they are not taken back into it.
     */
    void getUnboundPositionsInContext(Context& context, std::vector<int>& numbers, std::vector<double>& places) const;
    /** Set where linkers of a Context are that diffuse and are not bound; all others stay where they are. */
    void setUnboundPositionsInContext(Context& context, const std::vector<int>& numbers,
            const std::vector<double>& places) const;
    /**
     * Get how often hands of linkers of a type have bound and unbound in a Context.
     *
     * @param context          the Context
     * @param type             the index of the type
     * @param[out] bindings    how often a hand has bound
     * @param[out] unbindings  how often a hand has unbound, for whatever reason
     */
    void getNumEventsInContext(Context& context, int type, long long& bindings, long long& unbindings) const;
    /** Get whether distances are those of nearest periodic images. */
    bool usesPeriodicBoundaryConditions() const {
        return periodic;
    }
    /** Set whether distances are those of nearest periodic images.  They are not unless this is called. */
    void setUsesPeriodicBoundaryConditions(bool periodic) {
        this->periodic = periodic;
    }
    /** Get the number of joints of branches. */
    int getNumBranchJoints() const {
        return branchJoints.size();
    }
    /**
     * Hold the chains that begin as branches by a nucleator of the CylinderChainGrowthForce: by a linker of each of
     * some types, which have two hands, the first of them on the mother, and a concentration of zero.  When one of its
     * linkers lets go, all do.
     *
     * @param nucleator   the index of the nucleator
     * @param types       the types, which nothing else has
     * @param parameters  where each holds the mother, beyond the place of the branch, measured in nm
     * @param places      where each holds the branch, measured in nm
     * @return the index of the joint that was added
     */
    int addBranchJoint(int nucleator, const std::vector<int>& types, const std::vector<double>& parameters,
            const std::vector<double>& places);
    /** Get a joint of branches, see addBranchJoint(). */
    void getBranchJointParameters(int index, int& nucleator, std::vector<int>& types, std::vector<double>& parameters,
            std::vector<double>& places) const;
    /** Get the linkers that every new Context begins with.  This is for internal use. */
    const cylchain::LinkerState& getState() const {
        return state;
    }
    /** Get the description of a kind of hands.  This is for internal use. */
    const cylchain::Hand& getHand(int hand) const;
    /** Get the description of a joint of branches.  This is for internal use. */
    const cylchain::BranchJoint& getBranchJoint(int index) const {
        return branchJoints[index];
    }
    /** Get the description of a type of linkers.  This is for internal use. */
    const cylchain::LinkerType& getLinkerType(int type) const;
    std::vector<cylchain::Place> findPlaces(const PlaceResolver& resolver) const;
protected:
    ForceImpl* createImpl() const;
private:
    cylchain::Hand& handOf(int hand);
    double temperature;
    int randomNumberSeed;
    bool periodic;
    std::vector<cylchain::Hand> hands;
    std::vector<cylchain::LinkerType> types;
    std::vector<cylchain::Place> anchors;
    std::vector<cylchain::BranchJoint> branchJoints;
    std::vector<cylchain::Barrier> barriers;
    cylchain::LinkerState state;
};

} // namespace OpenMM

#endif /*OPENMM_CYLINDERCHAINBINDINGFORCE_H_*/
