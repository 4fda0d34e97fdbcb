#ifndef CYLCHAIN_CAPSULES_H_
#define CYLCHAIN_CAPSULES_H_

#include <utility>
#include <vector>

namespace cylchain {

/** A sphere that comes nearer to an axis, or to another sphere, than this over the sum of radii is deep. */
const double DEEP = 0.7;

/** All points within a radius of the line between two particles, or of one particle: a sphere. */
struct Capsule {
    int first;
    /** -1 for a sphere. */
    int second = -1;
    double radius = 0;
    /** The chain that it is a segment of, or -1. */
    int chain = -1;
    /** The number of the segment in its chain, or of the sphere. */
    int index = 0;
    int end() const {
        return second < 0 ? first : second;
    }
};

/** A chain of capsules that share particles. */
struct CapsuleChain {
    int numCapsules = 0;
    /** Whether the last capsule is joined to the first. */
    bool closed = false;
    /** Capsules whose numbers differ by at most this do not touch each other. */
    int excludedNeighbors = 1;
};

/** Capsules, and which pairs of them do not touch each other. Those that share a particle never do. */
struct CapsuleSystem {
    std::vector<Capsule> capsules;
    std::vector<CapsuleChain> chains;
    /** Other pairs of capsules that do not touch. */
    std::vector<std::pair<int, int> > exclusions;
};

/** Two capsules that may touch: a < b. */
struct ContactPair {
    int a, b;
    /** What takes a to its image near b. It stays the same in a step. */
    double shift[3];
    /**
     * The sign of w.(p x q) at the start of the step, for the vectors p along a, q along b, and w from the first end of
     * b to that of a.
     */
    signed char side;
    /**
     * At the end of the step, the distance of the axes is not less than this, unless they have crossed; and they have
     * not, and will not before both have moved this far together. Zero if that is not known.
     */
    float distance, clearance;
    /** At the start of the step, the distance of the axes is not less than this. */
    float before;
};

/** Where two capsules are nearest to each other. */
struct Contact {
    /** Fractions along a and b. */
    double s, t;
    /** A unit vector that points from b to a. */
    double normal[3];
    /** The distance less the radii. That of a pair that has crossed is negative, see ContactSearch::evaluate(). */
    double gap;
    /**
     * The share of the stiffness: 1, or 1/2 for each of the two contacts of segments that are nearly parallel, and for
     * each of the segments at a joint that has crossed.
     */
    double weight;
    /** Whether the two have crossed. */
    bool crossed;
};

} // namespace cylchain

#endif /*CYLCHAIN_CAPSULES_H_*/
