#include "ReferenceCylinderChainKernelFactory.h"
#include "ReferenceCalcCylinderChainContactForceKernel.h"
#include "ReferenceCalcCylinderChainForceKernel.h"
#include "ReferenceCalcCylinderChainLinkForceKernel.h"
#include "ReferenceCalcCylinderChainWallForceKernel.h"
#include "ReferenceIntegrateCylinderChainStepKernel.h"
#include "ReferenceUpdateCylinderChainGrowthKernel.h"
#include "ReferenceParticles.h"
#include "ReferenceUpdateCylinderChainLinkersKernel.h"
#include "openmm/OpenMMException.h"
#include "openmm/reference/ReferencePlatform.h"

using namespace OpenMM;
using namespace std;

extern "C" void registerPlatforms() {
}

extern "C" void registerKernelFactories() {
    for (int i = 0; i < Platform::getNumPlatforms(); i++) {
        Platform& platform = Platform::getPlatform(i);
        if (dynamic_cast<ReferencePlatform*>(&platform) != NULL)
            for (const string& kernel : getHostKernelNames())
                platform.registerKernelFactory(kernel, new ReferenceCylinderChainKernelFactory());
    }
}

vector<string> OpenMM::getHostKernelNames() {
    return {CalcCylinderChainForceKernel::Name(), CalcCylinderChainContactForceKernel::Name(),
            CalcCylinderChainLinkForceKernel::Name(), CalcCylinderChainWallForceKernel::Name(),
            UpdateCylinderChainGrowthKernel::Name(), UpdateCylinderChainLinkersKernel::Name(),
            IntegrateCylinderChainStepKernel::Name()};
}

KernelImpl* OpenMM::createHostKernel(const string& name, const Platform& platform,
        const shared_ptr<HostParticles>& particles) {
    if (name == CalcCylinderChainForceKernel::Name())
        return new ReferenceCalcCylinderChainForceKernel(name, platform, particles);
    if (name == CalcCylinderChainContactForceKernel::Name())
        return new ReferenceCalcCylinderChainContactForceKernel(name, platform, particles);
    if (name == CalcCylinderChainLinkForceKernel::Name())
        return new ReferenceCalcCylinderChainLinkForceKernel(name, platform, particles);
    if (name == CalcCylinderChainWallForceKernel::Name())
        return new ReferenceCalcCylinderChainWallForceKernel(name, platform, particles);
    if (name == UpdateCylinderChainGrowthKernel::Name())
        return new ReferenceUpdateCylinderChainGrowthKernel(name, platform, particles);
    if (name == UpdateCylinderChainLinkersKernel::Name())
        return new ReferenceUpdateCylinderChainLinkersKernel(name, platform, particles);
    if (name == IntegrateCylinderChainStepKernel::Name())
        return new ReferenceIntegrateCylinderChainStepKernel(name, platform, particles);
    throw OpenMMException("Tried to create kernel with illegal kernel name '"+name+"'");
}

KernelImpl* ReferenceCylinderChainKernelFactory::createKernelImpl(string name, const Platform& platform,
        ContextImpl& context) const {
    return createHostKernel(name, platform, make_shared<ReferenceParticles>(context));
}
