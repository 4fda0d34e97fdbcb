#include "CommonCylinderChainKernels.h"
#include "CommonCalcCylinderChainForceKernel.h"
#include "CommonCouplingKernels.h"
#include "CommonIntegrateCylinderChainStepKernel.h"
#include "openmm/OpenMMException.h"

using namespace OpenMM;
using namespace std;

vector<string> OpenMM::getCommonKernelNames() {
    return {CalcCylinderChainForceKernel::Name(), IntegrateCylinderChainStepKernel::Name(),
            CalcCylinderChainContactForceKernel::Name(), CalcCylinderChainLinkForceKernel::Name(),
            CalcCylinderChainWallForceKernel::Name(), UpdateCylinderChainLinkersKernel::Name()};
}

KernelImpl* OpenMM::createCommonKernel(const string& name, const Platform& platform, ComputeContext& cc) {
    if (name == CalcCylinderChainForceKernel::Name())
        return new CommonCalcCylinderChainForceKernel(name, platform, cc);
    if (name == IntegrateCylinderChainStepKernel::Name())
        return new CommonIntegrateCylinderChainStepKernel(name, platform, cc);
    if (name == CalcCylinderChainLinkForceKernel::Name())
        return new CommonCalcCylinderChainLinkForceKernel(name, platform, cc);
    if (name == CalcCylinderChainWallForceKernel::Name())
        return new CommonCalcCylinderChainWallForceKernel(name, platform, cc);
    string force;
    if (name == CalcCylinderChainContactForceKernel::Name())
        force = "contacts of capsules (CylinderChainContactForce)";
    else if (name == UpdateCylinderChainLinkersKernel::Name())
        force = "linkers that bind and unbind (CylinderChainBindingForce)";
    else
        throw OpenMMException("Tried to create kernel with illegal kernel name '"+name+"'");
    throw OpenMMException("The "+platform.getName()+" platform does not compute "+force+
            " of the compiled engine. Create the Context on the CPU platform");
}
