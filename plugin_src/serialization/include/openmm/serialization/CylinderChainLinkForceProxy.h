#ifndef OPENMM_CYLINDERCHAINLINKFORCE_PROXY_H_
#define OPENMM_CYLINDERCHAINLINKFORCE_PROXY_H_

#include "openmm/serialization/SerializationProxy.h"

namespace OpenMM {

/**
 * This is a proxy for serializing CylinderChainLinkForce objects.
 */
class CylinderChainLinkForceProxy : public SerializationProxy {
public:
    CylinderChainLinkForceProxy();
    void serialize(const void* object, SerializationNode& node) const;
    void* deserialize(const SerializationNode& node) const;
};

} // namespace OpenMM

#endif /*OPENMM_CYLINDERCHAINLINKFORCE_PROXY_H_*/
