#ifndef OPENMM_REFERENCECALCCYLINDERCHAINFORCEKERNEL_H_
#define OPENMM_REFERENCECALCCYLINDERCHAINFORCEKERNEL_H_

#include "HostParticles.h"
#include "beams/BeamEngine.h"
#include "dynamics/ChainEngine.h"
#include "openmm/CylinderChainKernels.h"
#include <memory>
#include <vector>

namespace OpenMM {

/**
 * This kernel is invoked by CylinderChainForce to calculate the forces acting on the system and the energy of the
 * system.  It also holds the engine for the integrator.
 */
class ReferenceCalcCylinderChainForceKernel : public CalcCylinderChainForceKernel {
public:
    ReferenceCalcCylinderChainForceKernel(std::string name, const Platform& platform,
            std::shared_ptr<HostParticles> particles);
    void initialize(const System& system, const CylinderChainDescription& chains);
    double execute(ContextImpl& context, bool includeForces, bool includeEnergy,
            const std::vector<std::vector<double> >& twists);
    void computeEnergies(ContextImpl& context, const std::vector<std::vector<double> >& twists, double& stretching,
            double& bending);
    void copyParametersToContext(ContextImpl& context);
    void replaceChains(ContextImpl& context, const std::vector<int>& changed);
    std::vector<int> getArrangement();
    void setArrangement(const std::vector<int>& arrangement);
    /**
     * Get the engine that computes with the present parameters of the chains.
     */
    const cylchain::ChainEngine& getEngine() const {
        return *engine;
    }
    /**
     * Get the engine of chains of beam elements.
     */
    const cylchain::BeamEngine& getBeamEngine() const {
        return *beamEngine;
    }
    /**
     * Get a number that increases whenever the engine is another one, or has other nodes.
     */
    int getEngineVersion() const {
        return version;
    }
    /**
     * Get a number that increases whenever segments alone are others.
     */
    int getVersionOfLengths() const {
        return versionOfLengths;
    }
    /**
     * Get the chains.
     */
    const std::vector<cylchain::Chain>& getChains() const {
        return chains->getChains();
    }
    /**
     * Get the chains of beam elements.
     */
    const std::vector<cylchain::BeamChain>& getBeams() const {
        return chains->getBeams();
    }
    /**
     * Get the box in which segments are taken as their shortest images, as nine numbers, or NULL if they are taken as
     * they are.
     */
    const double* getBox() const;
private:
    void createEngines();
    cylchain::ChainEnergy addForces(std::vector<Vec3>& forces, bool includeEnergy,
            const std::vector<std::vector<double> >& twists);
    std::shared_ptr<HostParticles> particles;
    const CylinderChainDescription* chains;
    std::unique_ptr<cylchain::ChainEngine> engine;
    std::unique_ptr<cylchain::BeamEngine> beamEngine;
    int version = 0, versionOfLengths = 0;
};

} // namespace OpenMM

#endif /*OPENMM_REFERENCECALCCYLINDERCHAINFORCEKERNEL_H_*/
