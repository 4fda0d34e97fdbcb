#ifndef OPENMM_REFERENCEPARALLELLOOP_H_
#define OPENMM_REFERENCEPARALLELLOOP_H_

#include "openmm/internal/ContextImpl.h"
#include "openmm/internal/ParallelLoop.h"
#include "openmm/internal/ThreadPool.h"

namespace OpenMM {

/**
 * This class spreads the iterations of a loop over the threads of a Context: as many as its property "Threads" says,
 * or one if its platform has no such property.
 */
class ReferenceParallelLoop : public ParallelLoop {
public:
    explicit ReferenceParallelLoop(ContextImpl& context);
    void run(int count, const std::function<void(int)>& iteration);
private:
    ThreadPool* threads;
};

} // namespace OpenMM

#endif /*OPENMM_REFERENCEPARALLELLOOP_H_*/
