#ifndef CYLCHAIN_PACK_PROPERTIES_H_
#define CYLCHAIN_PACK_PROPERTIES_H_

#include "dynamics/ChainPack.h"
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <map>
#include <memory>
#include <set>
#include <utility>
#include <vector>

namespace cylchain {

/**
 * Tables of numbers, each of which is kept once. Segments and packs are often alike, and where there are many of them,
 * steps wait for memory: it is read more often than it is made.
 */
template <class Scalar> class PropertyTables {
public:
    typedef std::vector<Scalar> Table;
    /**
     * Find the table of the different rows among some.
     *
     * @param rows   one after the other
     * @param size   of a row
     * @param rowOf  receives which row of the table each of them is
     */
    std::shared_ptr<const Table> find(const Table& rows, std::size_t size, std::vector<int>& rowOf) {
        std::map<Table, int> known;
        Table table;
        rowOf.clear();
        for (std::size_t first = 0; first < rows.size(); first += size) {
            const Table row(rows.begin()+first, rows.begin()+first+size);
            const auto found = known.emplace(row, known.size());
            if (found.second)
                table.insert(table.end(), row.begin(), row.end());
            rowOf.push_back(found.first->second);
        }
        return *tables.insert(std::make_shared<const Table>(std::move(table))).first;
    }
private:
    struct Before {
        bool operator()(const std::shared_ptr<const Table>& a, const std::shared_ptr<const Table>& b) const {
            return *a < *b;
        }
    };
    std::set<std::shared_ptr<const Table>, Before> tables;
};

/** The properties of a pack while they are gathered, [node][property][lane]. */
template <class Scalar> class PropertyRows {
public:
    typedef ChainPack<Scalar> Pack;
    /** Those of places that are all filled up. */
    PropertyRows(int nodes, int lanes) : lanes(lanes), size((std::size_t) Pack::NumProperties*lanes),
            values(nodes*size) {
        for (int node = 0; node < nodes; node++)
            for (int lane = 0; lane < lanes; lane++) {
                setSegment(node, lane, {1, 0, 1, 0, 0, 0, 0}, 0);
                // One that has no inverse length is not looked at when an iteration might end.
                at(node, Pack::InverseRestLength)[lane] = 0;
            }
    }
    Scalar* at(int node, int property) {
        return &values[node*size+property*lanes];
    }
    void setSegment(int s, int lane, const Segment& segment, int dimensions) {
        at(s, Pack::RestLength)[lane] = segment.restLength;
        at(s, Pack::InverseRestLength)[lane] = 1/segment.restLength;
        at(s, Pack::Stiffness)[lane] = segment.stiffness;
        at(s, Pack::InverseExtension)[lane] = segment.maximumExtension > 0 ? 1/segment.maximumExtension : 0;
        at(s, Pack::Parallel)[lane] = segment.parallel;
        at(s, Pack::Perpendicular)[lane] = segment.perpendicular;
        at(s, Pack::Rotational)[lane] = segment.rotational;
        at(s, Pack::Extensional)[lane] = segment.extensional;
        at(s, Pack::RootParallel)[lane] = std::sqrt(segment.parallel);
        at(s, Pack::RootPerpendicular)[lane] = std::sqrt(segment.perpendicular);
        at(s, Pack::RootRotational)[lane] = std::sqrt(segment.rotational);
        at(s, Pack::RootExtensional)[lane] = std::sqrt(segment.extensional);
        at(s, Pack::Drift)[lane] = dimensions == 0 || segment.rotational == 0 ? 0.0 :
                dimensions+1-(dimensions-1)*segment.extensional/segment.rotational;
    }
    /** Take those of a pack of fewer lanes, into lanes from one on. */
    template <class Other> void setLanes(int firstLane, const ChainPack<Other>& pack) {
        for (int node = 0; node < pack.nodes; node++)
            for (int property = 0; property < Pack::NumProperties; property++)
                std::copy_n(pack.properties->begin()+(pack.rows[node]*Pack::NumProperties+property)*pack.lanes,
                        pack.lanes, at(node, property)+firstLane);
    }
    /** Let a pack have these properties. */
    void giveTo(Pack& pack, PropertyTables<Scalar>& tables) const {
        pack.properties = tables.find(values, size, pack.rows);
    }
private:
    const int lanes;
    const std::size_t size;
    std::vector<Scalar> values;
};

} // namespace cylchain

#endif /*CYLCHAIN_PACK_PROPERTIES_H_*/
