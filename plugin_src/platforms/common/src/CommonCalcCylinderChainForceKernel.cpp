#include "CommonCalcCylinderChainForceKernel.h"
#include "openmm/common/ComputeForceInfo.h"
#include "openmm/common/ContextSelector.h"
#include "openmm/OpenMMException.h"

using namespace OpenMM;
using namespace cylchain;
using namespace std;

/**
 * Tells OpenMM that chains are molecules, which it wraps into the periodic box as a whole and gives the places of equal
 * ones.  Which chain is at a place is known here, so that chains need not have equal parameters for that.
 */
class CommonCalcCylinderChainForceKernel::ForceInfo : public ComputeForceInfo {
public:
    explicit ForceInfo(const CylinderChainDescription& description) : description(description) {
    }
    int getNumParticleGroups() {
        return description.getChains().size();
    }
    void getParticlesInGroup(int index, vector<int>& particles) {
        particles = description.getChains()[index].nodes;
    }
    bool areGroupsIdentical(int, int) {
        return true;
    }
private:
    const CylinderChainDescription& description;
};

CommonCalcCylinderChainForceKernel::CommonCalcCylinderChainForceKernel(string name, const Platform& platform,
        ComputeContext& cc, const WorkItemGroups& groups) : CalcCylinderChainForceKernel(name, platform), cc(cc),
        groups(groups), description(NULL) {
}

void CommonCalcCylinderChainForceKernel::initialize(const System&, const CylinderChainDescription& chains) {
    if (!chains.getBeams().empty())
        throw OpenMMException("On the "+getPlatform().getName()+" platform, filaments have no beam elements. Use the "
                "CPU platform, or filaments of straight segments (element=\"straight\")");
    description = &chains;
    cc.addForce(new ForceInfo(chains));
}

CommonCylinderChains& CommonCalcCylinderChainForceKernel::getChains() {
    // Kernels can be compiled once all forces have been added to the Context.

    if (!chains)
        chains.reset(new CommonCylinderChains(cc, groups, *description));
    return *chains;
}

double CommonCalcCylinderChainForceKernel::execute(ContextImpl&, bool includeForces, bool includeEnergy) {
    ContextSelector selector(cc);
    ChainEnergy energy;
    getChains().gather(false);
    getChains().addForces(includeForces, includeEnergy ? &energy : NULL);
    return energy.stretching+energy.bending+energy.tethers;
}

void CommonCalcCylinderChainForceKernel::computeEnergies(ContextImpl&, double& stretching, double& bending) {
    ContextSelector selector(cc);
    ChainEnergy energy;
    getChains().gather(false);
    getChains().addForces(false, &energy);
    stretching = energy.stretching;
    bending = energy.bending;
}

void CommonCalcCylinderChainForceKernel::copyParametersToContext(ContextImpl&) {
    ContextSelector selector(cc);
    getChains().update();
}
