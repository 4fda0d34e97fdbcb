#ifndef OPENMM_HIPCYLINDERCHAINKERNELFACTORY_H_
#define OPENMM_HIPCYLINDERCHAINKERNELFACTORY_H_

#include "openmm/KernelFactory.h"

namespace OpenMM {

/**
 * This KernelFactory creates kernels for the HIP implementation of cylinder chains.
 */
class HipCylinderChainKernelFactory : public KernelFactory {
public:
    KernelImpl* createKernelImpl(std::string name, const Platform& platform, ContextImpl& context) const;
};

} // namespace OpenMM

#endif /*OPENMM_HIPCYLINDERCHAINKERNELFACTORY_H_*/
