#ifndef CYLCHAIN_TERM_BLOCKS_H_
#define CYLCHAIN_TERM_BLOCKS_H_

namespace cylchain {

/**
 * How vectors of terms of couplings lie in memory, three numbers for each term: in blocks of four terms, the first
 * coordinate of all four, then the second and the third. So registers hold four terms.
 */
struct TermBlocks {
    static constexpr int SIZE = 4;
    /** Get where a coordinate of a term is. */
    static constexpr int place(int term, int coordinate) {
        return 3*term-2*(term & (SIZE-1))+SIZE*coordinate;
    }
    /** Get how many terms the blocks have room for that hold so many. */
    static constexpr int fill(int count) {
        return (count+SIZE-1) & -SIZE;
    }
};

} // namespace cylchain

#endif /*CYLCHAIN_TERM_BLOCKS_H_*/
