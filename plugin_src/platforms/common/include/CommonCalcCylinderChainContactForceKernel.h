#ifndef OPENMM_COMMONCALCCYLINDERCHAINCONTACTFORCEKERNEL_H_
#define OPENMM_COMMONCALCCYLINDERCHAINCONTACTFORCEKERNEL_H_

#include "CoupledParticles.h"
#include "couplings/ContactSearch.h"
#include "openmm/CylinderChainKernels.h"

namespace OpenMM {

/**
 * This kernel is invoked by CylinderChainContactForce to calculate the forces acting on the system and the energy of
 * the system.
 *
 * The processor searches for pairs with a skin, and again when a particle has moved by half of it: only then do
 * positions come from the device.  Forces do not depend on when pairs were searched for.
 */
class CommonCalcCylinderChainContactForceKernel : public CalcCylinderChainContactForceKernel {
public:
    CommonCalcCylinderChainContactForceKernel(std::string name, const Platform& platform, ComputeContext& cc);
    void initialize(const System& system, cylchain::ContactSearch& search, double stiffness, bool periodic);
    double execute(ContextImpl& context, bool includeForces, bool includeEnergy);
    void copyParametersToContext(ContextImpl& context, double stiffness);
private:
    bool isListValid();
    void findPairs();
    void uploadPairs();
    void makeKernels();
    ComputeContext& cc;
    CoupledParticles coupled;
    cylchain::ContactSearch* search;
    double stiffness, skin;
    bool periodic, hasList;
    std::vector<Vec3> positions;
    std::vector<double> listBox;
    std::vector<cylchain::ContactPair> pairs;
    ComputeArray ends, numbers, energies, listPositions, summary;
    ComputeKernel kernel, movedKernel;
};

} // namespace OpenMM

#endif /*OPENMM_COMMONCALCCYLINDERCHAINCONTACTFORCEKERNEL_H_*/
