#ifndef CYLCHAIN_LOOP_H_
#define CYLCHAIN_LOOP_H_

#include <functional>

namespace cylchain {

/**
 * Calls a function with each number from 0 to count-1, in any order, perhaps on several threads. The function throws no
 * exceptions.
 */
typedef std::function<void(int count, const std::function<void(int)>& iteration)> Loop;

} // namespace cylchain

#endif /*CYLCHAIN_LOOP_H_*/
