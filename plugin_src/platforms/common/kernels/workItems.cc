/**
 * How the work on a chain is shared out. One work-item does all of it; or, where the program is compiled with
 * CHAIN_BY_GROUP, ITEMS_OF_CHAIN of them do, each for some of the places of the chain. What is along the chain is left
 * to the files that have one part for either form: see solverOfItem.cc and solverOfGroup.cc.
 *
 * These work-items are a group; or, where CHAINS_OF_GROUP chains share one, a part of a warp of CUDA, whose parts need
 * not wait for each other. A warp takes as long for two work-items that eliminate nodes as for those of four chains.
 *
 * All work-items of a chain wait at the same places of a program, whatever there is to do between. No branch goes
 * around such a place, and loops with one of them test at their end: PoCL, which splits programs there, compiles what
 * follows a branch once for either side of it. What is not wanted is done for no place. Results do not depend on the
 * order in which work-items run.
 */

#ifdef CHAIN_BY_GROUP
/**
 * The number of a work-item among those of its chain, that of the chain among those of its group, and a place that what
 * work-items have written before may be read behind by all of the chain.
 */
#if CHAINS_OF_GROUP > 1
#define ITEM ((int) (LOCAL_ID%ITEMS_OF_CHAIN))
#define CHAIN_OF_GROUP (LOCAL_ID/ITEMS_OF_CHAIN)
#define WAIT_FOR_ITEMS __syncwarp(((1u<<ITEMS_OF_CHAIN)-1)<<(LOCAL_ID-ITEM));
#else
#define ITEM ((int) LOCAL_ID)
#define CHAIN_OF_GROUP 0
#define WAIT_FOR_ITEMS SYNC_THREADS
#endif
/** The loops of a work-item over places. */
#define EACH(place, count) for (int place = ITEM; place < (count); place += ITEMS_OF_CHAIN)
/**
 * Loops whose body adds to a place and to the next one: neighbours take turns, and wait for each other after each turn.
 */
#define NUM_TURNS 2
#define EACH_IN_TURN(place, count, turn) \
    for (int place = 2*ITEM+(turn); place < (count); place += 2*ITEMS_OF_CHAIN)
#else
#define ITEM 0
#define WAIT_FOR_ITEMS
#define EACH(place, count) for (int place = 0; place < (count); place++)
#define NUM_TURNS 1
#define EACH_IN_TURN(place, count, turn) EACH(place, count)
#endif

#ifdef CHAIN_BY_GROUP
/** The greatest of a number over work-items, for all of them. NaN is less than any number. */
inline DEVICE double greatestOfItems(const Step* step, double own) {
    step->exchanged[ITEM] = own;
    WAIT_FOR_ITEMS
    double result = step->exchanged[0];
    for (int item = 1; item < ITEMS_OF_CHAIN; item++)
        result = fmax(result, step->exchanged[item]);
    WAIT_FOR_ITEMS
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
    WAIT_FOR_ITEMS
    const int perItem = (nodes+ITEMS_OF_CHAIN-1)/ITEMS_OF_CHAIN;
    const int first = min(perItem*ITEM, nodes), end = min(first+perItem, nodes);
    LOCAL_ARG double* own = step->exchanged+NUM_EXCHANGED*ITEM;
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
    WAIT_FOR_ITEMS
    Vector before = zeroVector();
    sum = total = zeroVector();
    for (int item = 0; item < ITEMS_OF_CHAIN; item++) {
        LOCAL_ARG const double* other = step->exchanged+NUM_EXCHANGED*item;
        const int count = min(perItem*(item+1), nodes)-min(perItem*item, nodes);
        if (item == ITEM)
            before = sum;
        total = total+make_double3(other[3], other[4], other[5])+sum*count;
        sum = sum+make_double3(other[0], other[1], other[2]);
    }
    for (int node = first; node < end; node++)
        addVector(step, field, node, before);
    WAIT_FOR_ITEMS
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
