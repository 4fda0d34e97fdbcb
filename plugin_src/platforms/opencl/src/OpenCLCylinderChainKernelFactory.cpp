#include "OpenCLCylinderChainKernelFactory.h"
#include "CommonCylinderChainKernels.h"
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
            for (const string& name : getCommonKernelNames())
                platform.registerKernelFactory(name, factory);
        }
    }
}

KernelImpl* OpenCLCylinderChainKernelFactory::createKernelImpl(string name, const Platform& platform,
        ContextImpl& context) const {
    OpenCLContext& cl = *static_cast<OpenCLPlatform::PlatformData*>(context.getPlatformData())->contexts[0];
    const cl_ulong localMemory = cl.getDevice().getInfo<CL_DEVICE_LOCAL_MEM_SIZE>();
    return createCommonKernel(name, platform, cl, {(int) min(localMemory, (cl_ulong) (48*1024)), false});
}
