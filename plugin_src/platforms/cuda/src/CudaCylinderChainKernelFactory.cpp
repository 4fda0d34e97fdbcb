#include "CudaCylinderChainKernelFactory.h"
#include "CommonCylinderChainKernels.h"
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
            for (const string& name : getCommonKernelNames())
                platform.registerKernelFactory(name, factory);
        }
    }
}

KernelImpl* CudaCylinderChainKernelFactory::createKernelImpl(string name, const Platform& platform,
        ContextImpl& context) const {
    CudaContext& cu = *static_cast<CudaPlatform::PlatformData*>(context.getPlatformData())->contexts[0];
    // A kernel may have this much local memory without asking for more. Parts of a warp go their own ways since Volta.
    return createCommonKernel(name, platform, cu, {48*1024, cu.getComputeCapability() >= 7});
}
