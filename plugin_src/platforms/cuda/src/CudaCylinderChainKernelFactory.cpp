#include "CudaCylinderChainKernelFactory.h"
#include "CommonParticles.h"
#include "ReferenceCylinderChainKernelFactory.h"
#include "openmm/cuda/CudaContext.h"
#include "openmm/cuda/CudaPlatform.h"
#include "openmm/internal/ContextImpl.h"

using namespace OpenMM;
using namespace std;

#define CYLCHAIN_EXPORT extern "C" __attribute__((visibility("default")))

CYLCHAIN_EXPORT void registerPlatforms() {
}

CYLCHAIN_EXPORT void registerKernelFactories() {
    for (int i = 0; i < Platform::getNumPlatforms(); i++) {
        Platform& platform = Platform::getPlatform(i);
        if (platform.getName() == "CUDA") {
            CudaCylinderChainKernelFactory* factory = new CudaCylinderChainKernelFactory();
            for (const string& name : getHostKernelNames())
                platform.registerKernelFactory(name, factory);
        }
    }
}

KernelImpl* CudaCylinderChainKernelFactory::createKernelImpl(string name, const Platform& platform,
        ContextImpl& context) const {
    ComputeContext& cc = *static_cast<CudaPlatform::PlatformData*>(context.getPlatformData())->contexts[0];
    return createCommonKernel(name, platform, context, cc);
}
