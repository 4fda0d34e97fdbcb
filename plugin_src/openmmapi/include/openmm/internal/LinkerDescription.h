#ifndef OPENMM_LINKERDESCRIPTION_H_
#define OPENMM_LINKERDESCRIPTION_H_

#include "couplings/Contours.h"
#include "kinetics/Linkers.h"
#include "openmm/internal/StateColumns.h"
#include <cstddef>
#include <vector>

namespace OpenMM {

/**
 * Linkers as columns of numbers, which is how CylinderChainBindingForce gives and takes them.
 */
struct LinkerColumns {
    std::vector<int> numbers, types, anchors, chains;
    std::vector<double> places;
    int nextNumber = 0;
    LinkerColumns() = default;
    explicit LinkerColumns(const cylchain::LinkerState& state);
    /**
     * Put linkers together; an exception is thrown unless the columns have the same number of rows, and numbers ascend.
     */
    std::vector<cylchain::Linker> getLinkers() const;
};

/**
 * Linkers that diffuse and are not bound: their numbers, and three coordinates of each.
 */
struct FreeColumns {
    std::vector<int> numbers;
    std::vector<double> places;
    FreeColumns() = default;
    explicit FreeColumns(const cylchain::LinkerState& state);
    /**
     * Give linkers their positions, which must be finite; an exception is thrown if there is none of a number.
     */
    void give(cylchain::LinkerState& state) const;
};

/**
 * Store linkers.
 */
StateColumns storeLinkers(const cylchain::LinkerState& state);

/**
 * Put linkers together that were stored; an exception is thrown if something is wrong with them.
 */
cylchain::LinkerState restoreLinkers(const StateColumns& columns);

/**
 * Throw an exception unless linkers fit their types, the anchors and the chains.
 *
 * @param contours  the chains; positions along them are not looked at if it is NULL
 */
void checkLinkers(const std::vector<cylchain::Linker>& linkers, const cylchain::LinkerSystem& system,
        const cylchain::Contours* contours = NULL);

} // namespace OpenMM

#endif /*OPENMM_LINKERDESCRIPTION_H_*/
