#include "ReferenceParallelLoop.h"
#include "openmm/Platform.h"
#include "openmm/reference/ReferencePlatform.h"
#include <algorithm>
#include <atomic>
#include <condition_variable>
#include <mutex>
#include <thread>

using namespace OpenMM;
using namespace cylchain;
using namespace std;

namespace {

/**
 * How often a thread looks for work before it sleeps: some tens of microseconds.
 */
const int LARGEST_NUMBER_OF_LOOKS = 100;

/**
 * Loops that follow each other, and threads that wait for them.  Iterations are taken one by one, so that nobody waits
 * for a thread that comes late: it finds none left.
 */
class SuccessiveLoops {
public:
    void run(int count, const function<void(int)>& newIteration) {
        if (count == 0)
            return;
        iteration = &newIteration;
        size = count;
        finished = 0;
        left = count;
        if (sleeping > 0) {
            lock_guard<mutex> lock(access);
            wakeUp.notify_all();
        }
        work();
        while (finished < size)
            this_thread::yield();
    }
    /**
     * Take part in all loops until they have ended.
     */
    void help() {
        for (int looks = 0; !ended; looks++) {
            if (work())
                looks = 0;
            if (looks < LARGEST_NUMBER_OF_LOOKS)
                this_thread::yield();
            else {
                unique_lock<mutex> lock(access);
                sleeping++;
                wakeUp.wait(lock, [&] () {return left > 0 || ended;});
                sleeping--;
                looks = 0;
            }
        }
    }
    void end() {
        lock_guard<mutex> lock(access);
        ended = true;
        wakeUp.notify_all();
    }
private:
    /**
     * Take iterations as long as there are any.  Who has taken one knows that its loop goes on until it is finished.
     */
    bool work() {
        bool any = false;
        for (int own = left; own > 0; own = left)
            if (left.compare_exchange_weak(own, own-1)) {
                (*iteration)(size-own);
                finished++;
                any = true;
            }
        return any;
    }
    const function<void(int)>* iteration = NULL;
    int size = 0;
    atomic<int> left{0}, finished{0}, sleeping{0};
    atomic<bool> ended{false};
    mutex access;
    condition_variable wakeUp;
};

} // namespace

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

void ReferenceParallelLoop::runMany(const function<void(const Loop&)>& function) {
    if (threads == NULL || threads->getNumThreads() == 1) {
        function([&] (int count, const std::function<void(int)>& iteration) {run(count, iteration);});
        return;
    }
    SuccessiveLoops loops;
    const int helpers = threads->getNumThreads()-1;
    threads->execute([&] (ThreadPool&, int index) {
        if (index < helpers)
            loops.help();
    });
    try {
        function([&] (int count, const std::function<void(int)>& iteration) {loops.run(count, iteration);});
    }
    catch (...) {
        loops.end();
        threads->waitForThreads();
        throw;
    }
    loops.end();
    threads->waitForThreads();
}
