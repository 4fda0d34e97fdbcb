#ifndef OPENMM_CYLINDERCHAIN_PARALLELLOOP_H_
#define OPENMM_CYLINDERCHAIN_PARALLELLOOP_H_

#include <functional>

namespace OpenMM {

/**
 * A loop whose iterations a platform may spread over threads.
 */
class ParallelLoop {
public:
    virtual ~ParallelLoop() {
    }
    /**
     * Call a function with each number from 0 to count-1, in any order.  It must not throw exceptions.
     */
    virtual void run(int count, const std::function<void(int)>& iteration) = 0;
};

} // namespace OpenMM

#endif /*OPENMM_CYLINDERCHAIN_PARALLELLOOP_H_*/
