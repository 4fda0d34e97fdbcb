#ifndef OPENMM_REFERENCECONTEXTDATA_H_
#define OPENMM_REFERENCECONTEXTDATA_H_

#include "openmm/internal/ContextImpl.h"
#include "openmm/reference/ReferencePlatform.h"

namespace OpenMM {

/** The positions, velocities, forces and box of a Context of the Reference or the CPU platform. */
inline ReferencePlatform::PlatformData& extractData(ContextImpl& context) {
    return *reinterpret_cast<ReferencePlatform::PlatformData*>(context.getPlatformData());
}

} // namespace OpenMM

#endif /*OPENMM_REFERENCECONTEXTDATA_H_*/
