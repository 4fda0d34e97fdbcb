#include "ReferenceParallelLoop.h"
#include "openmm/Platform.h"
#include "openmm/reference/ReferencePlatform.h"
#include <algorithm>
#include <atomic>

using namespace OpenMM;
using namespace std;

ReferenceParallelLoop::ReferenceParallelLoop(ContextImpl& context) : threads(NULL) {
    const vector<string>& properties = context.getPlatform().getPropertyNames();
    if (find(properties.begin(), properties.end(), "Threads") != properties.end())
        threads = &reinterpret_cast<ReferencePlatform::PlatformData*>(context.getPlatformData())->threads;
}

void ReferenceParallelLoop::run(int count, const function<void(int)>& iteration) {
    if (threads == NULL || threads->getNumThreads() == 1 || count < 2) {
        for (int i = 0; i < count; i++)
            iteration(i);
        return;
    }
    atomic<int> next(0);
    const int helpers = threads->getNumThreads()-1;
    auto work = [&] () {
        for (int i = next++; i < count; i = next++)
            iteration(i);
    };

    // This thread works, too, instead of waiting for others to wake up.

    threads->execute([&] (ThreadPool&, int index) {
        if (index < helpers)
            work();
    });
    work();
    threads->waitForThreads();
}
