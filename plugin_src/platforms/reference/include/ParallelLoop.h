#ifndef OPENMM_CYLINDERCHAIN_PARALLELLOOP_H_
#define OPENMM_CYLINDERCHAIN_PARALLELLOOP_H_

#include "openmm/internal/ContextImpl.h"
#include "openmm/internal/ThreadPool.h"
#include <functional>

namespace OpenMM {

/**
 * This class spreads the iterations of a loop over the threads of a Context: as many as its property "Threads" says,
 * or one if its platform has no such property.
 */
class ParallelLoop {
public:
    explicit ParallelLoop(ContextImpl& context);
    /**
     * Call a function with each number from 0 to count-1, in any order.  It must not throw exceptions.
     */
    void run(int count, const std::function<void(int)>& iteration);
private:
    ThreadPool* threads;
};

} // namespace OpenMM

#endif /*OPENMM_CYLINDERCHAIN_PARALLELLOOP_H_*/
