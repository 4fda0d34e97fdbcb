#include "HipCylinderChainKernelFactory.h"
#include "CommonParticles.h"
#include "ReferenceCylinderChainKernelFactory.h"
#include "openmm/hip/HipContext.h"
#include "openmm/hip/HipPlatform.h"
#include "openmm/internal/ContextImpl.h"

using namespace OpenMM;
using namespace std;

#define CYLCHAIN_EXPORT extern "C" __attribute__((visibility("default")))

CYLCHAIN_EXPORT void registerPlatforms() {
}

CYLCHAIN_EXPORT void registerKernelFactories() {
    for (int i = 0; i < Platform::getNumPlatforms(); i++) {
        Platform& platform = Platform::getPlatform(i);
        if (platform.getName() == "HIP") {
            HipCylinderChainKernelFactory* factory = new HipCylinderChainKernelFactory();
            for (const string& name : getHostKernelNames())
                platform.registerKernelFactory(name, factory);
        }
    }
}

KernelImpl* HipCylinderChainKernelFactory::createKernelImpl(string name, const Platform& platform,
        ContextImpl& context) const {
    ComputeContext& cc = *static_cast<HipPlatform::PlatformData*>(context.getPlatformData())->contexts[0];
    return createCommonKernel(name, platform, context, cc);
}
