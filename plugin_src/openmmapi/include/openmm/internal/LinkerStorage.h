#ifndef OPENMM_LINKERSTORAGE_H_
#define OPENMM_LINKERSTORAGE_H_

#include "kinetics/Linkers.h"
#include "openmm/internal/ContextImpl.h"
#include <iosfwd>

namespace OpenMM {

class SerializationNode;

/**
 * Write linkers to a node.
 */
void writeLinkerState(SerializationNode& node, const cylchain::LinkerState& state);

/**
 * Read linkers from a node; an exception is thrown if something is wrong with them.
 */
cylchain::LinkerState readLinkerState(const SerializationNode& node);

/**
 * Write the linkers of all CylinderChainBindingForces of a Context to a checkpoint.
 */
void writeLinkers(std::ostream& stream, ContextImpl& context);

/**
 * Read the linkers of all CylinderChainBindingForces of a Context from a checkpoint.
 *
 * @param withClocks  whether it has their clocks, which those of earlier versions do not
 * @param withTypes   whether it has events of each type of linkers, which those of earlier versions do not
 */
void readLinkers(std::istream& stream, ContextImpl& context, bool withClocks, bool withTypes);

/**
 * Write the linkers of all CylinderChainBindingForces of a Context to children "Linkers" of a node.
 */
void writeLinkers(SerializationNode& node, ContextImpl& context);

/**
 * Read the linkers of all CylinderChainBindingForces of a Context from the children "Linkers" of a node.
 */
void readLinkers(const SerializationNode& node, ContextImpl& context);

} // namespace OpenMM

#endif /*OPENMM_LINKERSTORAGE_H_*/
