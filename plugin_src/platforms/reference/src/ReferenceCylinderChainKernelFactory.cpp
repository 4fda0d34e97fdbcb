#include "ReferenceCylinderChainKernelFactory.h"
#include "ReferenceCalcCylinderChainContactForceKernel.h"
#include "ReferenceCalcCylinderChainForceKernel.h"
#include "ReferenceCalcCylinderChainLinkForceKernel.h"
#include "ReferenceCalcCylinderChainWallForceKernel.h"
#include "ReferenceIntegrateCylinderChainStepKernel.h"
#include "ReferenceUpdateCylinderChainGrowthKernel.h"
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
        if (dynamic_cast<ReferencePlatform*>(&platform) != NULL) {
            ReferenceCylinderChainKernelFactory* factory = new ReferenceCylinderChainKernelFactory();
            platform.registerKernelFactory(CalcCylinderChainForceKernel::Name(), factory);
            platform.registerKernelFactory(CalcCylinderChainContactForceKernel::Name(), factory);
            platform.registerKernelFactory(CalcCylinderChainLinkForceKernel::Name(), factory);
            platform.registerKernelFactory(CalcCylinderChainWallForceKernel::Name(), factory);
            platform.registerKernelFactory(UpdateCylinderChainGrowthKernel::Name(), factory);
            platform.registerKernelFactory(UpdateCylinderChainLinkersKernel::Name(), factory);
            platform.registerKernelFactory(IntegrateCylinderChainStepKernel::Name(), factory);
        }
    }
}

KernelImpl* ReferenceCylinderChainKernelFactory::createKernelImpl(string name, const Platform& platform,
        ContextImpl& context) const {
    if (name == CalcCylinderChainForceKernel::Name())
        return new ReferenceCalcCylinderChainForceKernel(name, platform, context);
    if (name == CalcCylinderChainContactForceKernel::Name())
        return new ReferenceCalcCylinderChainContactForceKernel(name, platform, context);
    if (name == CalcCylinderChainLinkForceKernel::Name())
        return new ReferenceCalcCylinderChainLinkForceKernel(name, platform, context);
    if (name == CalcCylinderChainWallForceKernel::Name())
        return new ReferenceCalcCylinderChainWallForceKernel(name, platform);
    if (name == UpdateCylinderChainGrowthKernel::Name())
        return new ReferenceUpdateCylinderChainGrowthKernel(name, platform);
    if (name == UpdateCylinderChainLinkersKernel::Name())
        return new ReferenceUpdateCylinderChainLinkersKernel(name, platform, context);
    if (name == IntegrateCylinderChainStepKernel::Name())
        return new ReferenceIntegrateCylinderChainStepKernel(name, platform, context);
    throw OpenMMException("Tried to create kernel with illegal kernel name '"+name+"'");
}
