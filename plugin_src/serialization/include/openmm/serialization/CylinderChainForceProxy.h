#ifndef OPENMM_CYLINDERCHAINFORCE_PROXY_H_
#define OPENMM_CYLINDERCHAINFORCE_PROXY_H_

#include "openmm/serialization/SerializationProxy.h"

namespace OpenMM {

/**
 * This is a proxy for serializing CylinderChainForce objects.
 */
class CylinderChainForceProxy : public SerializationProxy {
public:
    CylinderChainForceProxy();
    void serialize(const void* object, SerializationNode& node) const;
    void* deserialize(const SerializationNode& node) const;
};

} // namespace OpenMM

#endif /*OPENMM_CYLINDERCHAINFORCE_PROXY_H_*/
