#ifndef CYLCHAIN_PREFETCH_H_
#define CYLCHAIN_PREFETCH_H_

#include "mechanics/Inline.h"
#include <cstddef>

namespace cylchain {

/** The bytes that a processor fetches from memory together. */
const std::size_t CACHE_LINE = 64;
/** How many turns of a loop ahead records are asked for. */
const int AHEAD = 8;

/**
 * Ask for a record that is needed soon. Where a step has many chains, memory is far from the processor, and what is
 * found in an order of its own, such as the other capsule of a pair, comes late. It is fetched to the second cache: the
 * first has room for few requests, and when they are used up everything waits.
 */
template <class Record> CYLCHAIN_INLINE void prefetch(const Record* record) {
    const char* const bytes = reinterpret_cast<const char*>(record);
    for (std::size_t i = 0; i < sizeof(Record); i += CACHE_LINE)
        __builtin_prefetch(bytes+i, 0, 2);
    // A record that does not begin with a line ends in one more.
    if (alignof(Record) < CACHE_LINE && sizeof(Record) > 8)
        __builtin_prefetch(bytes+sizeof(Record)-1, 0, 2);
}

/** Ask for the first of some records: those behind them are asked for on the way. */
template <class Record> CYLCHAIN_INLINE void prefetchFirst(const Record* records, int count) {
    for (int i = 0; i < 3 && i < count; i++)
        prefetch(&records[i]);
}

} // namespace cylchain

#endif /*CYLCHAIN_PREFETCH_H_*/
