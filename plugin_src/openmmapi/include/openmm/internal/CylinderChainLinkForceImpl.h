#ifndef OPENMM_CYLINDERCHAINLINKFORCEIMPL_H_
#define OPENMM_CYLINDERCHAINLINKFORCEIMPL_H_

#include "couplings/LinkTable.h"
#include "openmm/CylinderChainLinkForce.h"
#include "openmm/internal/SpringForceImpl.h"
#include <map>
#include <memory>
#include <string>
#include <vector>

namespace OpenMM {

/**
 * This is the internal implementation of CylinderChainLinkForce.  It holds the links of a Context.
 *
 * Which they are is said by a parameter of the Context, the digest of their table.  Where that has changed, because the
 * Context has got a State or a checkpoint, the links follow as soon as they are looked at.
 */
class CylinderChainLinkForceImpl : public SpringForceImpl {
public:
    explicit CylinderChainLinkForceImpl(const CylinderChainLinkForce& owner);
    void initialize(ContextImpl& context);
    const CylinderChainLinkForce& getOwner() const {
        return owner;
    }
    double calcForcesAndEnergy(ContextImpl& context, bool includeForces, bool includeEnergy, int groups);
    std::map<std::string, double> getDefaultParameters();
    /**
     * Get the links of the Context that are switched on, in the order of their numbers.  Places at virtual sites
     * between two particles are those between these particles, and those between the nodes of a beam element are on its
     * curve.  An exception is thrown if the links are not known.
     */
    const std::vector<cylchain::Link>& getLinks();
    /**
     * Get the places of these links.
     */
    std::vector<cylchain::Place> findPlaces(const PlaceResolver& resolver);
    long long getVersion();
    int getOrder() const {
        return 0;
    }
    std::string getStateName() const {
        return "links";
    }
    StateColumns storeState(bool inCheckpoint);
    void restoreState(const StateColumns& columns);
    /**
     * Get all links of the Context as they were described.  An exception is thrown if they are not known.
     */
    const cylchain::LinkTable& getTable();
    /**
     * Change links of the Context.
     */
    void change(const cylchain::LinkChange& change);
    /**
     * Give the Context another table, whether its present links are known or not.
     */
    void setTable(const cylchain::LinkTable& table);
    /**
     * Get the name of the parameter that holds the digest of the links.
     */
    const std::string& getDigestParameter() const {
        return parameter;
    }
private:
    void check(const cylchain::LinkChange& change) const;
    cylchain::Place resolve(const cylchain::Place& place) const;
    void follow();
    void accept(const cylchain::LinkChange& change);
    void reportLink(int index);
    const CylinderChainLinkForce& owner;
    std::unique_ptr<PlaceResolver> places;
    std::string parameter;
    cylchain::LinkHistory history;
    std::vector<cylchain::Link> links;
    // Whether the links above are those of the table.

    bool upToDate;
    long long version;
};

} // namespace OpenMM

#endif /*OPENMM_CYLINDERCHAINLINKFORCEIMPL_H_*/
