#ifndef OPENMM_REFERENCEPARALLELLOOP_H_
#define OPENMM_REFERENCEPARALLELLOOP_H_

#include "openmm/internal/ContextImpl.h"
#include "openmm/internal/ParallelLoop.h"
#include "openmm/internal/ThreadPool.h"
#include "mechanics/Loop.h"
#include <memory>

namespace OpenMM {

/**
 * This class spreads the iterations of a loop over the threads of a Context: as many as its property "Threads" says,
 * or one if its platform has no such property.
 */
class ReferenceParallelLoop : public ParallelLoop {
public:
    explicit ReferenceParallelLoop(ContextImpl& context);
    /**
     * Use the threads of a pool, which must outlive this.
     */
    explicit ReferenceParallelLoop(ThreadPool& threads) : threads(&threads) {
    }
    void run(int count, const std::function<void(int)>& iteration);
    /**
     * Call a function that runs many short loops, one after the other.  Threads stay awake between these for a while:
     * to wake them takes longer than a loop.
     */
    void runMany(const std::function<void(const cylchain::Loop& loop)>& function);
private:
    std::unique_ptr<ThreadPool> ownThreads;
    ThreadPool* threads;
};

} // namespace OpenMM

#endif /*OPENMM_REFERENCEPARALLELLOOP_H_*/
