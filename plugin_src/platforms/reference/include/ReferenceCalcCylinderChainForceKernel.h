#ifndef OPENMM_REFERENCECALCCYLINDERCHAINFORCEKERNEL_H_
#define OPENMM_REFERENCECALCCYLINDERCHAINFORCEKERNEL_H_

#include "dynamics/ChainEngine.h"
#include "ParallelLoop.h"
#include "openmm/CylinderChainKernels.h"
#include <memory>
#include <vector>

namespace OpenMM {

/**
 * This kernel is invoked by CylinderChainForce to calculate the forces acting on the system and the energy of the
 * system.  It also holds the chains for the integrator.
 */
class ReferenceCalcCylinderChainForceKernel : public CalcCylinderChainForceKernel {
public:
    ReferenceCalcCylinderChainForceKernel(std::string name, const Platform& platform, ContextImpl& context);
    void initialize(const System& system, const CylinderChainForce& force);
    double execute(ContextImpl& context, bool includeForces, bool includeEnergy);
    void computeEnergies(ContextImpl& context, double& stretching, double& bending);
    void copyParametersToContext(ContextImpl& context, const CylinderChainForce& force);
    /**
     * Get the chains.
     */
    const std::vector<cylchain::Chain>& getChains() const {
        return chains;
    }
    /**
     * Get the force group of the chains.
     */
    int getForceGroup() const {
        return forceGroup;
    }
    /**
     * Get the engine that computes with the present parameters of the chains.
     */
    const cylchain::ChainEngine& getEngine() const {
        return *engine;
    }
    /**
     * Get the box in which segments are taken as their shortest images, as nine numbers, or NULL if they are taken as
     * they are.
     */
    const double* getBox(ContextImpl& context) const;
private:
    cylchain::ChainEnergy addForces(ContextImpl& context, std::vector<Vec3>& forces, bool includeEnergy);
    ParallelLoop loop;
    std::vector<cylchain::Chain> chains;
    std::unique_ptr<cylchain::ChainEngine> engine;
    bool periodic;
    int forceGroup;
};

} // namespace OpenMM

#endif /*OPENMM_REFERENCECALCCYLINDERCHAINFORCEKERNEL_H_*/
