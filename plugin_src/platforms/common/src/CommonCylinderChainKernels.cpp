#include "CommonCylinderChainKernels.h"
#include "CommonCalcCylinderChainContactForceKernel.h"
#include "CommonCalcCylinderChainForceKernel.h"
#include "CommonCouplingKernels.h"
#include "CommonIntegrateCylinderChainStepKernel.h"
#include "CommonUpdateCylinderChainLinkersKernel.h"
#include "openmm/OpenMMException.h"

using namespace OpenMM;
using namespace std;

vector<string> OpenMM::getCommonKernelNames() {
    return {CalcCylinderChainForceKernel::Name(), IntegrateCylinderChainStepKernel::Name(),
            CalcCylinderChainContactForceKernel::Name(), CalcCylinderChainLinkForceKernel::Name(),
            CalcCylinderChainWallForceKernel::Name(), UpdateCylinderChainLinkersKernel::Name()};
}

KernelImpl* OpenMM::createCommonKernel(const string& name, const Platform& platform, ComputeContext& cc,
        const WorkItemGroups& groups) {
    if (name == CalcCylinderChainForceKernel::Name())
        return new CommonCalcCylinderChainForceKernel(name, platform, cc, groups);
    if (name == IntegrateCylinderChainStepKernel::Name())
        return new CommonIntegrateCylinderChainStepKernel(name, platform, cc);
    if (name == CalcCylinderChainLinkForceKernel::Name())
        return new CommonCalcCylinderChainLinkForceKernel(name, platform, cc);
    if (name == CalcCylinderChainWallForceKernel::Name())
        return new CommonCalcCylinderChainWallForceKernel(name, platform, cc);
    if (name == CalcCylinderChainContactForceKernel::Name())
        return new CommonCalcCylinderChainContactForceKernel(name, platform, cc);
    if (name == UpdateCylinderChainLinkersKernel::Name())
        return new CommonUpdateCylinderChainLinkersKernel(name, platform, cc);
    throw OpenMMException("Tried to create kernel with illegal kernel name '"+name+"'");
}
