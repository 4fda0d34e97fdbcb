#ifndef OPENMM_CYLINDERCHAIN_WORKITEMGROUPS_H_
#define OPENMM_CYLINDERCHAIN_WORKITEMGROUPS_H_

namespace OpenMM {

/**
 * What the groups of work-items of a device can do.
 */
struct WorkItemGroups {
    /** The memory that a group has to itself, in bytes. */
    int localMemory;
    /** Whether some work-items of a group can wait for each other while the rest of it is at another place. */
    bool waitInParts;
};

} // namespace OpenMM

#endif /*OPENMM_CYLINDERCHAIN_WORKITEMGROUPS_H_*/
