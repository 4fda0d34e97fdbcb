#ifndef OPENMM_CUDACYLINDERCHAINKERNELFACTORY_H_
#define OPENMM_CUDACYLINDERCHAINKERNELFACTORY_H_

#include "openmm/KernelFactory.h"

namespace OpenMM {

/**
 * This KernelFactory creates kernels for the CUDA implementation of cylinder chains.
 */
class CudaCylinderChainKernelFactory : public KernelFactory {
public:
    KernelImpl* createKernelImpl(std::string name, const Platform& platform, ContextImpl& context) const;
};

} // namespace OpenMM

#endif /*OPENMM_CUDACYLINDERCHAINKERNELFACTORY_H_*/
