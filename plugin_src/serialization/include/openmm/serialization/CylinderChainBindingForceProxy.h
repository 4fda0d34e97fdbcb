#ifndef OPENMM_CYLINDERCHAINBINDINGFORCE_PROXY_H_
#define OPENMM_CYLINDERCHAINBINDINGFORCE_PROXY_H_

#include "openmm/serialization/SerializationProxy.h"

namespace OpenMM {

/**
 * This is a proxy for serializing CylinderChainBindingForce objects.
 */
class CylinderChainBindingForceProxy : public SerializationProxy {
public:
    CylinderChainBindingForceProxy();
    void serialize(const void* object, SerializationNode& node) const;
    void* deserialize(const SerializationNode& node) const;
};

} // namespace OpenMM

#endif /*OPENMM_CYLINDERCHAINBINDINGFORCE_PROXY_H_*/
