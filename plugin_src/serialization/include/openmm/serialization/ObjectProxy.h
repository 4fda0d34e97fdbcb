#ifndef OPENMM_OBJECTPROXY_H_
#define OPENMM_OBJECTPROXY_H_

#include "openmm/Force.h"
#include "openmm/OpenMMException.h"
#include "openmm/serialization/SerializationNode.h"
#include "openmm/serialization/SerializationProxy.h"
#include <memory>
#include <string>
#include <type_traits>
#include <typeinfo>

namespace OpenMM {

/**
 * This is a proxy for serializing the objects of a class, by a function that writes one and a function that reads it.
 * Of a Force, group and name are written and read here.
 */
template <class Object> class ObjectProxy : public SerializationProxy {
public:
    typedef void (*Writer)(const Object& object, SerializationNode& node);
    typedef std::unique_ptr<Object> (*Reader)(const SerializationNode& node);
    /**
     * @param name     the name of the class
     * @param version  of what is written; none but this is read
     */
    ObjectProxy(const std::string& name, int version, Writer writer, Reader reader) : SerializationProxy(name),
            version(version), writer(writer), reader(reader) {
    }
    void serialize(const void* object, SerializationNode& node) const {
        const Object& own = *reinterpret_cast<const Object*>(object);
        node.setIntProperty("version", version);
        if constexpr (std::is_base_of<Force, Object>::value)
            node.setIntProperty("forceGroup", own.getForceGroup()).setStringProperty("name", own.getName());
        writer(own, node);
    }
    void* deserialize(const SerializationNode& node) const {
        if (node.getIntProperty("version") != version)
            throw OpenMMException("Unsupported version number");
        std::unique_ptr<Object> own = reader(node);
        if constexpr (std::is_base_of<Force, Object>::value) {
            own->setForceGroup(node.getIntProperty("forceGroup"));
            own->setName(node.getStringProperty("name"));
        }
        return own.release();
    }
private:
    int version;
    Writer writer;
    Reader reader;
};

/**
 * Register a proxy, see ObjectProxy.  The value of a static constant, so that it is done when the library is loaded.
 */
template <class Object> bool registerProxy(const std::string& name, int version,
        typename ObjectProxy<Object>::Writer writer, typename ObjectProxy<Object>::Reader reader) {
    SerializationProxy::registerProxy(typeid(Object), new ObjectProxy<Object>(name, version, writer, reader));
    return true;
}

} // namespace OpenMM

#endif /*OPENMM_OBJECTPROXY_H_*/
