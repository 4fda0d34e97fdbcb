#ifndef CYLCHAIN_GROWTH_EVENT_H_
#define CYLCHAIN_GROWTH_EVENT_H_

#include <limits>

namespace cylchain {

/** What may happen to a chain, or by a nucleator, and how often. */
struct GrowthEvent {
    static constexpr int ANY_MONOMER = std::numeric_limits<int>::min();
    enum Kind {Gain, Lose, Switch, Vanish, Sever, Nucleate};
    Kind kind;
    /** The number of the growing chain, or of the nucleator. */
    int index;
    /** In 1/ps. */
    double rate;
    /** The plus end (1) or the minus end (0), and the state to which it changes by itself. */
    int end = 0, to = 0;
    /** Whether it happens at regular times. */
    bool isRegular = false;
    /** The monomer before which it is cut by a hand, or before any. */
    int monomer = ANY_MONOMER;
};

} // namespace cylchain

#endif /*CYLCHAIN_GROWTH_EVENT_H_*/
