#ifndef OPENMM_COMMONCYLINDERCHAINKERNELS_H_
#define OPENMM_COMMONCYLINDERCHAINKERNELS_H_

#include "WorkItemGroups.h"
#include "openmm/KernelImpl.h"
#include "openmm/Platform.h"
#include "openmm/common/ComputeContext.h"
#include <string>
#include <vector>

namespace OpenMM {

/**
 * Get the names of the kernels that platforms for GPUs know.
 */
std::vector<std::string> getCommonKernelNames();

/**
 * Create one of these kernels.
 */
KernelImpl* createCommonKernel(const std::string& name, const Platform& platform, ComputeContext& cc,
        const WorkItemGroups& groups);

} // namespace OpenMM

#endif /*OPENMM_COMMONCYLINDERCHAINKERNELS_H_*/
