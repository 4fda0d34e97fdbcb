#include "openmm/CylinderChainBindingForce.h"
#include "openmm/CylinderChainContactForce.h"
#include "openmm/CylinderChainForce.h"
#include "openmm/CylinderChainIntegrator.h"
#include "openmm/CylinderChainLinkForce.h"
#include "openmm/CylinderChainWallForce.h"
#include "openmm/serialization/CylinderChainBindingForceProxy.h"
#include "openmm/serialization/CylinderChainContactForceProxy.h"
#include "openmm/serialization/CylinderChainForceProxy.h"
#include "openmm/serialization/CylinderChainIntegratorProxy.h"
#include "openmm/serialization/CylinderChainLinkForceProxy.h"
#include "openmm/serialization/CylinderChainWallForceProxy.h"
#include <typeinfo>

using namespace OpenMM;

/**
 * Register the proxies when the library is loaded.
 */
static const bool registered = []() {
    SerializationProxy::registerProxy(typeid(CylinderChainForce), new CylinderChainForceProxy());
    SerializationProxy::registerProxy(typeid(CylinderChainLinkForce), new CylinderChainLinkForceProxy());
    SerializationProxy::registerProxy(typeid(CylinderChainContactForce), new CylinderChainContactForceProxy());
    SerializationProxy::registerProxy(typeid(CylinderChainBindingForce), new CylinderChainBindingForceProxy());
    SerializationProxy::registerProxy(typeid(CylinderChainWallForce), new CylinderChainWallForceProxy());
    SerializationProxy::registerProxy(typeid(CylinderChainIntegrator), new CylinderChainIntegratorProxy());
    return true;
}();
