#ifndef CYLCHAIN_CAPSULE_MOTION_H_
#define CYLCHAIN_CAPSULE_MOTION_H_

#include "couplings/Capsules.h"
#include "mechanics/Loop.h"
#include "mechanics/Prefetch.h"
#include <cstddef>
#include <functional>
#include <vector>

namespace cylchain {

/** How far capsules move in the iterations of a step, since their pairs were looked for. */
class CapsuleMotion {
public:
    /** Forget all: no pairs have been looked for in this step. */
    void clear() {
        searched.clear();
    }
    /** Get whether begin() was called since clear(). */
    bool hasBegun() const {
        return !searched.empty();
    }
    /**
     * The pairs of all capsules have been looked for where particles are.
     *
     * @param capsules  they must exist as long as this is used
     * @param moved     where particles are, three doubles for each
     */
    void begin(const std::vector<Capsule>& capsules, const double* moved, const Loop& loop);
    /** The same after another search, of all capsules or of some. */
    void beginAgain(const double* moved, const Loop& loop);
    void beginAgain(const std::vector<int>& numbers, const double* moved);
    /**
     * Follow capsules to where an iteration has led them.
     *
     * @param takesPart  whether a capsule took part in it; others have stayed
     * @param reach      see getMovers()
     * @param use        is called with capsules that took part, some at a time, perhaps on several threads
     */
    void follow(const std::function<bool(int)>& takesPart, const double* moved, double reach, const Loop& loop,
            const std::function<void(const std::vector<int>&)>& use);
    /** Ask for what getWay() needs soon. */
    void prefetchWay(int a, int b) const {
        prefetch(&travelled[a]);
        prefetch(&travelled[b]);
    }
    /** Get the length of the ways of two capsules in all iterations together. */
    double getWay(int a, int b) const {
        return travelled[a]+travelled[b];
    }
    /** Get whether two capsules may have moved by more than the reach together since their pairs were looked for. */
    bool exceedsReach() const {
        return exceeds;
    }
    /** Get the capsules that have moved by more than half of the reach. */
    const std::vector<int>& getMovers() const {
        return movers;
    }
private:
    /** The largest two motions of some capsules, and who has moved by more than half of the reach. */
    struct Largest {
        double first = 0, second = 0;
        std::vector<int> movers, taken;
        void include(double motion);
    };
    void takeNoteOf(int capsule, const double* moved);
    double followOne(int capsule, const double* moved);
    const std::vector<Capsule>* capsules = nullptr;
    /** Where the ends of each capsule were when its pairs were looked for, and after the last iteration. */
    std::vector<double> searched, before;
    /** How far each capsule has travelled in all iterations, and how far it is from where it was searched for. */
    std::vector<double> travelled, motion;
    std::vector<Largest> parts;
    std::vector<int> movers;
    bool exceeds = false;
};

/** The capsule whose first particle has moved most, from three doubles for each to others. */
int findFastest(const std::vector<Capsule>& capsules, const double* begun, const double* moved);

} // namespace cylchain

#endif /*CYLCHAIN_CAPSULE_MOTION_H_*/
