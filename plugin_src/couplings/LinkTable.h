#ifndef CYLCHAIN_LINK_TABLE_H_
#define CYLCHAIN_LINK_TABLE_H_

#include "couplings/Links.h"
#include <cstddef>
#include <cstdint>
#include <deque>
#include <utility>
#include <vector>

namespace cylchain {

/** A link, and whether it is there or switched off. */
struct LinkEntry {
    Link link;
    bool active = true;
};

/** A change of a table: entries that go, others that come or replace those of their numbers, and the next number. */
struct LinkChange {
    /** In ascending order. */
    std::vector<std::uint32_t> removed;
    /** In the order of their numbers. */
    std::vector<LinkEntry> put;
    std::uint32_t nextNumber = 0;
    std::size_t size() const {
        return removed.size()+put.size();
    }
};

/**
 * The links of a Context, or those that new Contexts begin with.
 */
class LinkTable {
public:
    /** In the order of their numbers. */
    const std::vector<LinkEntry>& getEntries() const {
        return entries;
    }
    /** The number of the next link. */
    std::uint32_t getNextNumber() const {
        return nextNumber;
    }
    /** Find the entry of a number; NULL if there is none. */
    const LinkEntry* find(std::uint32_t number) const;
    /**
     * Get a digest of all that the table holds: 52 bits, which a double holds exactly.
     */
    std::uint64_t getDigest() const;
    /** Change the table, and return what takes it back. */
    LinkChange apply(const LinkChange& change);
    /** The change that makes this table another one. */
    LinkChange changeTo(const LinkTable& other) const;
private:
    void add(const LinkEntry& entry, int sign);
    std::vector<LinkEntry> entries;
    std::uint32_t nextNumber = 0;
    /** The sum of the digests of entries, which does not depend on the order of changes. */
    std::uint64_t sum = 0;
};

/**
 * A table, and what takes it back to those it was before.
 */
class LinkHistory {
public:
    /** How many changes one can go back, */
    static constexpr std::size_t CHANGES = 256;
    /** or fewer where they hold more links than this. */
    static constexpr std::size_t LINKS = 1<<20;
    LinkHistory() = default;
    /** Begin with a table. */
    explicit LinkHistory(const LinkTable& table) : table(table) {
    }
    const LinkTable& getTable() const {
        return table;
    }
    void change(const LinkChange& change);
    /** Take the table back to the latest one with a digest; return false if there was none. */
    bool goBack(std::uint64_t digest);
private:
    void note(std::uint64_t digest, LinkChange back);
    LinkTable table;
    /** The digests of tables, and what takes the next one back to each. */
    std::deque<std::pair<std::uint64_t, LinkChange> > changes;
    std::size_t held = 0;
};

} // namespace cylchain

#endif /*CYLCHAIN_LINK_TABLE_H_*/
