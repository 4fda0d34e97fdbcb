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
 * Loops that follow each other, and threads that wait for them.  Each thread begins with the same part of each loop, so
 * that what it works on stays in its cache.  Iterations are taken one by one, also those of others, so that nobody
 * waits for a thread that comes late: it finds none left.
 */
class SuccessiveLoops {
public:
    explicit SuccessiveLoops(int threads) : parts(threads) {
    }
    void run(int count, const function<void(int)>& newIteration) {
        if (count == 0)
            return;
        iteration = &newIteration;
        size = count;
        finished = 0;
        const int numParts = parts.size();
        for (int part = 0; part < numParts; part++)
            parts[part].end = (long long) count*(part+1)/numParts;
        // From here on, others may take iterations.
        for (int part = 0; part < numParts; part++)
            parts[part].left = parts[part].end-(long long) count*part/numParts;
        if (sleeping > 0) {
            lock_guard<mutex> lock(access);
            wakeUp.notify_all();
        }
        work(0);
        while (finished < size)
            this_thread::yield();
    }
    /**
     * Take part in all loops until they have ended.
     */
    void help(int thread) {
        for (int looks = 0; !ended; looks++) {
            if (work(thread))
                looks = 0;
            if (looks < LARGEST_NUMBER_OF_LOOKS)
                this_thread::yield();
            else {
                unique_lock<mutex> lock(access);
                sleeping++;
                wakeUp.wait(lock, [&] () {return ended || anyLeft();});
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
     * A part of a loop, in memory that no other part shares.
     */
    struct alignas(64) Part {
        atomic<int> left{0};
        int end = 0;
    };
    bool anyLeft() const {
        return any_of(parts.begin(), parts.end(), [] (const Part& part) {return part.left > 0;});
    }
    /**
     * Take iterations as long as there are any, those of the own part first.  Who has taken one knows that its loop
     * goes on until it is finished.
     */
    bool work(int thread) {
        const int numParts = parts.size();
        bool any = false;
        for (int i = 0; i < numParts; i++) {
            Part& part = parts[(thread+i)%numParts];
            for (int own = part.left; own > 0; own = part.left)
                if (part.left.compare_exchange_weak(own, own-1)) {
                    (*iteration)(part.end-own);
                    finished++;
                    any = true;
                }
        }
        return any;
    }
    vector<Part> parts;
    const function<void(int)>* iteration = NULL;
    int size = 0;
    atomic<int> finished{0}, sleeping{0};
    atomic<bool> ended{false};
    mutex access;
    condition_variable wakeUp;
};

} // namespace

ReferenceParallelLoop::ReferenceParallelLoop(ContextImpl& context) : threads(NULL) {
    const vector<string>& properties = context.getPlatform().getPropertyNames();
    if (find(properties.begin(), properties.end(), "Threads") == properties.end())
        return;
#if CYLCHAIN_OPENMM_VERSION >= 804
    threads = &reinterpret_cast<ReferencePlatform::PlatformData*>(context.getPlatformData())->threads;
#else
    // The threads of the platform are its own.
    ownThreads = make_unique<ThreadPool>(stoi(context.getPlatform().getPropertyValue(context.getOwner(), "Threads")));
    threads = ownThreads.get();
#endif
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
    SuccessiveLoops loops(threads->getNumThreads());
    const int helpers = threads->getNumThreads()-1;
    threads->execute([&] (ThreadPool&, int index) {
        if (index < helpers)
            loops.help(index+1);
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
