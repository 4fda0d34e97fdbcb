#ifndef OPENMM_LINKDESCRIPTION_H_
#define OPENMM_LINKDESCRIPTION_H_

#include "couplings/LinkTable.h"
#include "openmm/internal/PlaceResolver.h"
#include "openmm/internal/StateColumns.h"
#include <cstddef>
#include <string>
#include <vector>

namespace OpenMM {

/**
 * Links as columns of numbers, which is how CylinderChainLinkForce gives and takes many of them.
 */
struct LinkColumns {
    std::vector<int> ends;
    std::vector<double> fractions, points;
    std::vector<int> models;
    std::vector<double> parameters;
    LinkColumns() = default;
    /**
     * Take columns; an exception is thrown unless they have the same number of rows.
     */
    LinkColumns(const std::vector<int>& ends, const std::vector<double>& fractions,
            const std::vector<double>& points, const std::vector<int>& models, const std::vector<double>& parameters);
    std::size_t size() const {
        return models.size();
    }
    void add(const cylchain::Link& link);
    /**
     * Make a link of a row, which is active.
     */
    cylchain::LinkEntry getEntry(std::size_t row, std::uint32_t number) const;
};

/**
 * Throw an exception if something is wrong with a link, whatever the System is.
 */
void checkLink(const cylchain::Link& link);

/**
 * Throw an exception if a link does not fit a System.
 */
void checkLink(const cylchain::Link& link, const PlaceResolver& places);

/**
 * Put a table together; an exception is thrown if something is wrong with it.
 */
cylchain::LinkTable makeTable(const std::vector<int>& numbers, const LinkColumns& columns,
        const std::vector<int>& active, int nextNumber);

/**
 * Store a table.
 */
StateColumns storeTable(const cylchain::LinkTable& table);

/**
 * Put a table together that was stored; an exception is thrown if something is wrong with it.
 */
cylchain::LinkTable restoreTable(const StateColumns& columns);

/**
 * Describe the places that a link joins: "between particles 3 and 5".
 */
std::string describePlaces(const cylchain::Link& link);

/**
 * The change that adds links to a table.
 */
cylchain::LinkChange changeToAdd(const cylchain::LinkTable& table, const LinkColumns& columns);

/**
 * The change that removes links from a table.
 */
cylchain::LinkChange changeToRemove(const cylchain::LinkTable& table, const std::vector<int>& numbers);

/**
 * The change that switches links of a table on or off.
 */
cylchain::LinkChange changeToSwitch(const cylchain::LinkTable& table, const std::vector<int>& numbers, bool active);

/**
 * The change that gives links of a table other parameters: a StretchingModel, and a rest length, stiffness and maximum
 * extension for each.
 */
cylchain::LinkChange changeParameters(const cylchain::LinkTable& table, const std::vector<int>& numbers,
        const std::vector<int>& models, const std::vector<double>& parameters);

/**
 * Find a link of a table; an exception is thrown if there is none of that number.
 */
const cylchain::LinkEntry& findEntry(const cylchain::LinkTable& table, int number);

} // namespace OpenMM

#endif /*OPENMM_LINKDESCRIPTION_H_*/
