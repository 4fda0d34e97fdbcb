#ifndef OPENMM_CYLINDERCHAINWALLFORCEIMPL_H_
#define OPENMM_CYLINDERCHAINWALLFORCEIMPL_H_

#include "couplings/Walls.h"
#include "openmm/CylinderChainWallForce.h"
#include "openmm/Kernel.h"
#include "openmm/internal/PlaceResolver.h"
#include "openmm/internal/PushForceImpl.h"
#include <map>
#include <memory>
#include <string>
#include <vector>

namespace OpenMM {

/**
 * This is the internal implementation of CylinderChainWallForce.
 */
class CylinderChainWallForceImpl : public PushForceImpl {
public:
    explicit CylinderChainWallForceImpl(const CylinderChainWallForce& owner);
    void initialize(ContextImpl& context);
    const CylinderChainWallForce& getOwner() const {
        return owner;
    }
    double calcForcesAndEnergy(ContextImpl& context, bool includeForces, bool includeEnergy, int groups);
    std::map<std::string, double> getDefaultParameters() {
        return std::map<std::string, double>();
    }
    std::vector<std::string> getKernelNames();
    void updateParametersInContext(ContextImpl& context);
    int getOrder() const {
        // Those that hold particles on a surface are no gaps.
        return walls.wall.side == cylchain::WallSide::Surface ? 1 : 3;
    }
    bool hasForces() {
        return !walls.particles.empty() && walls.stiffness != 0;
    }
    /**
     * Get the wall, as it is in the Context now.
     */
    const cylchain::Wall& getWall() const {
        return walls.wall;
    }
    cylchain::ImplicitCouplings* getEquations(ContextImpl& context);
    void setSpareNodes(ContextImpl& context, const std::vector<bool>& isSpare);
    std::unique_ptr<cylchain::Surroundings> describeSurroundings(const cylchain::ChainList& chains,
            const std::vector<int>& growing);
    std::string describeFailure(const cylchain::BrokenCoupling& coupling, const std::string& other);
protected:
    void findPushes(ContextImpl& context, std::vector<cylchain::Push>& pushes) const;
private:
    cylchain::WallSystem describe() const;
    const CylinderChainWallForce& owner;
    std::unique_ptr<PlaceResolver> places;
    std::vector<bool> isSpare;
    cylchain::WallSystem walls;
    Kernel kernel;
};

} // namespace OpenMM

#endif /*OPENMM_CYLINDERCHAINWALLFORCEIMPL_H_*/
