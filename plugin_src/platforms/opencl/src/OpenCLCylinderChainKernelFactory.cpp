#include "OpenCLCylinderChainKernelFactory.h"
#include "CommonParticles.h"
#include "ReferenceCylinderChainKernelFactory.h"
#include "openmm/internal/ContextImpl.h"
#include "openmm/opencl/OpenCLContext.h"
#include "openmm/opencl/OpenCLPlatform.h"

using namespace OpenMM;
using namespace std;

#define CYLCHAIN_EXPORT extern "C" __attribute__((visibility("default")))

CYLCHAIN_EXPORT void registerPlatforms() {
}

CYLCHAIN_EXPORT void registerKernelFactories() {
    for (int i = 0; i < Platform::getNumPlatforms(); i++) {
        Platform& platform = Platform::getPlatform(i);
        if (platform.getName() == OpenCLPlatform().getName()) {
            OpenCLCylinderChainKernelFactory* factory = new OpenCLCylinderChainKernelFactory();
            for (const string& name : getHostKernelNames())
                platform.registerKernelFactory(name, factory);
        }
    }
}

KernelImpl* OpenCLCylinderChainKernelFactory::createKernelImpl(string name, const Platform& platform,
        ContextImpl& context) const {
    ComputeContext& cc = *static_cast<OpenCLPlatform::PlatformData*>(context.getPlatformData())->contexts[0];
    return createCommonKernel(name, platform, context, cc);
}
