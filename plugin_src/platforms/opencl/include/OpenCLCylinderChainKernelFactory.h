#ifndef OPENMM_OPENCLCYLINDERCHAINKERNELFACTORY_H_
#define OPENMM_OPENCLCYLINDERCHAINKERNELFACTORY_H_

#include "openmm/KernelFactory.h"

namespace OpenMM {

/**
 * This KernelFactory creates kernels for the OpenCL implementation of cylinder chains.
 */
class OpenCLCylinderChainKernelFactory : public KernelFactory {
public:
    KernelImpl* createKernelImpl(std::string name, const Platform& platform, ContextImpl& context) const;
};

} // namespace OpenMM

#endif /*OPENMM_OPENCLCYLINDERCHAINKERNELFACTORY_H_*/
