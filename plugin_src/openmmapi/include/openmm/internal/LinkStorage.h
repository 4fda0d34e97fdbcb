#ifndef OPENMM_LINKSTORAGE_H_
#define OPENMM_LINKSTORAGE_H_

#include "couplings/LinkTable.h"
#include "openmm/internal/ContextImpl.h"
#include <iosfwd>
#include <string>

namespace OpenMM {

class SerializationNode;

/**
 * Find the number of a stretching model by its name; an exception is thrown if there is none.
 */
int findStretchingModel(const std::string& name);

/**
 * Write a table to a node.
 */
void writeTable(SerializationNode& node, const cylchain::LinkTable& table);

/**
 * Read a table from a node; an exception is thrown if something is wrong with it.
 */
cylchain::LinkTable readTable(const SerializationNode& node);

/**
 * Write the links of all CylinderChainLinkForces of a Context to a checkpoint.
 */
void writeLinks(std::ostream& stream, ContextImpl& context);

/**
 * Read the links of all CylinderChainLinkForces of a Context from a checkpoint.
 */
void readLinks(std::istream& stream, ContextImpl& context);

/**
 * Write the links of all CylinderChainLinkForces of a Context to children "Links" of a node.
 */
void writeLinks(SerializationNode& node, ContextImpl& context);

/**
 * Read the links of all CylinderChainLinkForces of a Context from the children "Links" of a node.
 */
void readLinks(const SerializationNode& node, ContextImpl& context);

} // namespace OpenMM

#endif /*OPENMM_LINKSTORAGE_H_*/
