#ifndef OPENMM_CYLINDERCHAINWALLFORCE_PROXY_H_
#define OPENMM_CYLINDERCHAINWALLFORCE_PROXY_H_

#include "openmm/serialization/SerializationProxy.h"

namespace OpenMM {

/**
 * This is a proxy for serializing CylinderChainWallForce objects.
 */
class CylinderChainWallForceProxy : public SerializationProxy {
public:
    CylinderChainWallForceProxy();
    void serialize(const void* object, SerializationNode& node) const;
    void* deserialize(const SerializationNode& node) const;
};

} // namespace OpenMM

#endif /*OPENMM_CYLINDERCHAINWALLFORCE_PROXY_H_*/
