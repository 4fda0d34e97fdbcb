#ifndef OPENMM_CYLINDERCHAINBINDINGFORCEIMPL_H_
#define OPENMM_CYLINDERCHAINBINDINGFORCEIMPL_H_

#include "couplings/Contours.h"
#include "couplings/Links.h"
#include "couplings/TwistedContour.h"
#include "kinetics/Linkers.h"
#include "openmm/CylinderChainBindingForce.h"
#include "openmm/Kernel.h"
#include "openmm/internal/SpringForceImpl.h"
#include <cstdint>
#include <map>
#include <memory>
#include <string>
#include <utility>
#include <vector>

namespace OpenMM {

class CylinderChainForceImpl;
class CylinderChainIntegrator;

/**
 * This is the internal implementation of CylinderChainBindingForce.  It holds the linkers of a Context.
 *
 * A parameter of the Context has a digest of how many steps they have taken, and how often they have bound and unbound.
 * Where that is another one, because the Context has got a State or a checkpoint that does not say where linkers were,
 * there is nothing to go on with.  A State that holds no parameters leaves the digest alone, but sets time and step
 * count.
 */
class CylinderChainBindingForceImpl : public SpringForceImpl {
public:
    explicit CylinderChainBindingForceImpl(const CylinderChainBindingForce& owner);
    void initialize(ContextImpl& context);
    const CylinderChainBindingForce& getOwner() const {
        return owner;
    }
    void updateContextState(ContextImpl& context, bool& forcesInvalid);
    double calcForcesAndEnergy(ContextImpl& context, bool includeForces, bool includeEnergy, int groups);
    std::map<std::string, double> getDefaultParameters();
    std::vector<std::string> getKernelNames();
    /**
     * Get the springs of linkers that join two places, in the order of their numbers.
     */
    const std::vector<cylchain::Link>& getLinks();
    /**
     * Get the linkers of the Context.  An exception is thrown if they are not known.
     */
    const cylchain::LinkerState& getState();
    /**
     * Get the linkers that were known last.
     */
    const cylchain::LinkerState& getKnownState() const {
        return state;
    }
    /**
     * Give the Context other linkers, whether its present ones are known or not.
     */
    void setState(const cylchain::LinkerState& replaced);
    int getOrder() const {
        return 1;
    }
    void findHeldEnds(std::vector<cylchain::HeldEnd>& ends);
    void findChangesOfEnds(std::vector<cylchain::HeldEnd>& ends) const;
    void findActingHands(std::vector<cylchain::ActingHand>& hands);
    /**
     * Add what hands do that follow the helix of chains, in the step that their linkers have taken last.
     *
     * @param pairs  of each chain of straight segments
     * @return whether there are any such hands
     */
    bool addTurnedPairs(std::vector<std::vector<cylchain::TurnedPair> >& pairs) const;
    void chainsHaveGrown(ContextImpl& context, const cylchain::ChainList& chains,
            const cylchain::GrowthChanges& changes);
    std::unique_ptr<cylchain::Surroundings> describeSurroundings(const cylchain::ChainList& chains,
            const std::vector<int>& growing);
    std::string getStateName() const {
        return "linkers";
    }
    StateColumns storeState(bool inCheckpoint);
    void restoreState(const StateColumns& columns);
private:
    template <class Function> void forBoundHands(Function function);
    /**
     * Throw an exception unless chains of which hands follow the helix have twist.
     */
    void checkHelices(const cylchain::ChainList& chains);
    cylchain::TwistedContour describeTwist(int chain) const;
    /**
     * Find what hands do that follow the helix of chains and have taken a step.
     *
     * @param before  the linkers before the step
     */
    void findTurnedPairs(const std::vector<cylchain::Linker>& before, double size);
    bool addBranches(const cylchain::GrowthChanges& changes);
    bool removeBrokenBranches();
    void checkDiffusion() const;
    /**
     * Have linkers within the walls of the System, as they are in the Context now.
     */
    void updateWalls();
    /**
     * Find positions for linkers that diffuse, and check those that they have.
     */
    void placeUnbound(cylchain::LinkerState& changed);
    void follow() const;
    void accept();
    /**
     * Get whether time and step count are neither those before nor those behind the last step of the linkers.
     */
    bool isAtAnotherTime() const;
    /**
     * Throw an exception if a hand reaches beyond half of the periodic box, which may have shrunk.
     */
    void checkReaches(ContextImpl& context) const;
    /**
     * Find the integrator of the Context, NULL if it is none of this plugin.
     */
    const CylinderChainIntegrator* findIntegrator() const;
    double getTemperature() const;
    const CylinderChainBindingForce& owner;
    CylinderChainForceImpl* chainImpl = NULL;
    Kernel linkerKernel;
    std::string parameter;
    cylchain::LinkerState state;
    cylchain::LinkerSystem system;
    std::unique_ptr<cylchain::Contours> contours;
    std::vector<cylchain::Link> links;
    std::uint32_t seed;
    int number;
    // Whether hands follow the helix of chains; and what those do that are bound, by the chain.

    bool anyOnHelix = false;
    std::vector<std::pair<int, cylchain::TurnedPair> > turnedPairs;
    bool upToDate, wasExcluded;
    // Before the last step of the linkers, unless they were given since.
    bool hasStepped;
    double timeBefore, stepSize;
    long long countBefore;
};

} // namespace OpenMM

#endif /*OPENMM_CYLINDERCHAINBINDINGFORCEIMPL_H_*/
