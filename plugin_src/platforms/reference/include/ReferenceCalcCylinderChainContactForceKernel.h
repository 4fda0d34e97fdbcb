#ifndef OPENMM_REFERENCECALCCYLINDERCHAINCONTACTFORCEKERNEL_H_
#define OPENMM_REFERENCECALCCYLINDERCHAINCONTACTFORCEKERNEL_H_

#include "HostParticles.h"
#include "networks/ContactGaps.h"
#include "openmm/CylinderChainKernels.h"
#include <memory>
#include <vector>

namespace OpenMM {

/**
 * This kernel is invoked by CylinderChainContactForce to calculate the forces acting on the system and the energy of
 * the system.
 *
 * Pairs are searched for with a skin, and again when a particle has moved by half of it.  Only those that touch count,
 * in the order of their numbers, so that results depend neither on when pairs were searched for nor on threads.
 */
class ReferenceCalcCylinderChainContactForceKernel : public CalcCylinderChainContactForceKernel {
public:
    ReferenceCalcCylinderChainContactForceKernel(std::string name, const Platform& platform,
            std::shared_ptr<HostParticles> particles);
    void initialize(const System& system, cylchain::ContactSearch& search, double stiffness, bool periodic);
    double execute(ContextImpl& context, bool includeForces, bool includeEnergy);
    void notePushes(std::vector<cylchain::Push>& pushes);
    void copyParametersToContext(ContextImpl& context, double stiffness);
    cylchain::ImplicitCouplings* getEquations(ContextImpl& context,
            const std::vector<cylchain::CapsuleOnCurve>& onCurves, const std::vector<cylchain::CurveSite>& sites,
            cylchain::CouplingImpulses& impulses);
private:
    struct Touching;
    bool isListValid(const std::vector<Vec3>& positions, const Vec3* box) const;
    void findPairs(std::vector<Vec3>& positions, Vec3* box);
    std::shared_ptr<HostParticles> host;
    cylchain::ContactSearch* search;
    double stiffness, skin;
    bool periodic, hasList;
    std::vector<int> particles;
    std::vector<cylchain::ContactPair> pairs;
    std::vector<cylchain::Push>* noted;
    cylchain::ContactGaps equations;
    // Where particles were, and the box, when pairs were searched for.

    std::vector<Vec3> listPositions;
    Vec3 listBox[3];
};

} // namespace OpenMM

#endif /*OPENMM_REFERENCECALCCYLINDERCHAINCONTACTFORCEKERNEL_H_*/
