#ifndef OPENMM_REFERENCECYLINDERCHAINKERNELFACTORY_H_
#define OPENMM_REFERENCECYLINDERCHAINKERNELFACTORY_H_

#include "openmm/KernelFactory.h"

namespace OpenMM {

/**
 * This KernelFactory creates kernels for the reference implementation of cylinder chains, which serves the CPU platform
 * as well.
 */
class ReferenceCylinderChainKernelFactory : public KernelFactory {
public:
    KernelImpl* createKernelImpl(std::string name, const Platform& platform, ContextImpl& context) const;
};

} // namespace OpenMM

#endif /*OPENMM_REFERENCECYLINDERCHAINKERNELFACTORY_H_*/
