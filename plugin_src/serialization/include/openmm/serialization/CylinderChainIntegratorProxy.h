#ifndef OPENMM_CYLINDERCHAININTEGRATOR_PROXY_H_
#define OPENMM_CYLINDERCHAININTEGRATOR_PROXY_H_

#include "openmm/serialization/SerializationProxy.h"

namespace OpenMM {

/**
 * This is a proxy for serializing CylinderChainIntegrator objects.
 */
class CylinderChainIntegratorProxy : public SerializationProxy {
public:
    CylinderChainIntegratorProxy();
    void serialize(const void* object, SerializationNode& node) const;
    void* deserialize(const SerializationNode& node) const;
};

} // namespace OpenMM

#endif /*OPENMM_CYLINDERCHAININTEGRATOR_PROXY_H_*/
