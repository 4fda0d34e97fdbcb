#ifndef CYLCHAIN_LOOP_H_
#define CYLCHAIN_LOOP_H_

#include <algorithm>
#include <functional>

namespace cylchain {

/**
 * Calls a function with each number from 0 to count-1, in any order, perhaps on several threads. The function throws no
 * exceptions.
 */
typedef std::function<void(int count, const std::function<void(int)>& iteration)> Loop;

/** Call a function with each number from 0 to count-1, some of which follow each other on the same thread. */
template <class Function> void runInChunks(const Loop& loop, int count, int chunk, Function function) {
    loop((count+chunk-1)/chunk, [&] (int part) {
        for (int i = part*chunk; i < std::min(count, (part+1)*chunk); i++)
            function(i);
    });
}

} // namespace cylchain

#endif /*CYLCHAIN_LOOP_H_*/
