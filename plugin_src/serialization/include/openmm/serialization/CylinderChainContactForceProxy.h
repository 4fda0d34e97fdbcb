#ifndef OPENMM_CYLINDERCHAINCONTACTFORCE_PROXY_H_
#define OPENMM_CYLINDERCHAINCONTACTFORCE_PROXY_H_

#include "openmm/serialization/SerializationProxy.h"

namespace OpenMM {

/**
 * This is a proxy for serializing CylinderChainContactForce objects.
 */
class CylinderChainContactForceProxy : public SerializationProxy {
public:
    CylinderChainContactForceProxy();
    void serialize(const void* object, SerializationNode& node) const;
    void* deserialize(const SerializationNode& node) const;
};

} // namespace OpenMM

#endif /*OPENMM_CYLINDERCHAINCONTACTFORCE_PROXY_H_*/
