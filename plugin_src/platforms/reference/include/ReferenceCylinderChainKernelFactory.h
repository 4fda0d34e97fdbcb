#ifndef OPENMM_REFERENCECYLINDERCHAINKERNELFACTORY_H_
#define OPENMM_REFERENCECYLINDERCHAINKERNELFACTORY_H_

#include "HostParticles.h"
#include "openmm/KernelFactory.h"
#include "openmm/KernelImpl.h"
#include <memory>
#include <string>
#include <vector>

namespace OpenMM {

/**
 * This KernelFactory creates kernels of cylinder chains for the Reference and CPU platforms.
 */
class ReferenceCylinderChainKernelFactory : public KernelFactory {
public:
    KernelImpl* createKernelImpl(std::string name, const Platform& platform, ContextImpl& context) const;
};

/**
 * Get the names of all kernels.
 */
std::vector<std::string> getHostKernelNames();

/**
 * Create a kernel that works on the processor, wherever the particles of its platform are.
 */
KernelImpl* createHostKernel(const std::string& name, const Platform& platform,
        const std::shared_ptr<HostParticles>& particles);

} // namespace OpenMM

#endif /*OPENMM_REFERENCECYLINDERCHAINKERNELFACTORY_H_*/
