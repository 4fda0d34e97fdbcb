/**
 * How the work on a chain is shared out. One work-item does all of it; or, where the program is compiled with
 * CHAIN_BY_GROUP, those of a group do, each for some of the places of the chain. What is along the chain is left to
 * the files that have one part for either form: see solverOfItem.cc and solverOfGroup.cc.
 *
 * All work-items of a group wait at the same places of a program, whatever there is to do between. No branch goes
 * around such a place, and loops with one of them test at their end: PoCL, which splits programs there, compiles what
 * follows a branch once for either side of it. What is not wanted is done for no place. Results do not depend on the
 * order in which work-items run.
 */

#ifdef CHAIN_BY_GROUP
/** The loops of a work-item over places. */
#define EACH(place, count) for (int place = LOCAL_ID; place < (count); place += ITEMS_OF_CHAIN)
/**
 * Loops whose body adds to a place and to the next one: neighbours take turns, and wait for each other after each turn.
 */
#define NUM_TURNS 2
#define EACH_IN_TURN(place, count, turn) \
    for (int place = 2*LOCAL_ID+(turn); place < (count); place += 2*ITEMS_OF_CHAIN)
/** What work-items have written until here, all of them may read. */
#define WAIT_FOR_ALL SYNC_THREADS
#else
#define EACH(place, count) for (int place = 0; place < (count); place++)
#define NUM_TURNS 1
#define EACH_IN_TURN(place, count, turn) EACH(place, count)
#define WAIT_FOR_ALL
#endif

#ifdef CHAIN_BY_GROUP
/** The greatest of a number over work-items, for all of them. NaN is less than any number. */
inline DEVICE double greatestOfItems(const Step* step, double own) {
    step->exchanged[LOCAL_ID] = own;
    SYNC_THREADS
    double result = step->exchanged[0];
    for (int item = 1; item < ITEMS_OF_CHAIN; item++)
        result = fmax(result, step->exchanged[item]);
    SYNC_THREADS
    return result;
}
#else
inline DEVICE double greatestOfItems(const Step* step, double own) {
    return own;
}
#endif

/** Whether something is true for any work-item. */
inline DEVICE bool isTrueOfAny(const Step* step, bool own) {
    return greatestOfItems(step, own ? 1 : 0) > 0;
}

/**
 * Let a vector of each node become the sum of those up to it, and return the sum of these sums. Others may have written
 * the vectors before, and may read the sums behind.
 */
inline DEVICE Vector sumAlongChain(const Step* step, int field, int nodes) {
    Vector total = zeroVector();
#ifdef CHAIN_BY_GROUP
    // Each work-item has some nodes that follow on each other. What those before it have, its own all have, too.
    WAIT_FOR_ALL
    const int perItem = (nodes+ITEMS_OF_CHAIN-1)/ITEMS_OF_CHAIN;
    const int first = min(perItem*(int) LOCAL_ID, nodes), end = min(first+perItem, nodes);
    LOCAL_ARG double* own = step->exchanged+6*LOCAL_ID;
    Vector sum = zeroVector();
    for (int node = first; node < end; node++) {
        sum = sum+loadVector(step, field, node);
        storeVector(step, field, node, sum);
        total = total+sum;
    }
    own[0] = sum.x;
    own[1] = sum.y;
    own[2] = sum.z;
    own[3] = total.x;
    own[4] = total.y;
    own[5] = total.z;
    SYNC_THREADS
    Vector before = zeroVector();
    sum = total = zeroVector();
    for (int item = 0; item < ITEMS_OF_CHAIN; item++) {
        LOCAL_ARG const double* other = step->exchanged+6*item;
        const int count = min(perItem*(item+1), nodes)-min(perItem*item, nodes);
        if (item == LOCAL_ID)
            before = sum;
        total = total+make_double3(other[3], other[4], other[5])+sum*count;
        sum = sum+make_double3(other[0], other[1], other[2]);
    }
    for (int node = first; node < end; node++)
        addVector(step, field, node, before);
    SYNC_THREADS
#else
    Vector sum = zeroVector();
    for (int node = 0; node < nodes; node++) {
        sum = sum+loadVector(step, field, node);
        storeVector(step, field, node, sum);
        total = total+sum;
    }
#endif
    return total;
}
