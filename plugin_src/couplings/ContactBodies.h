#ifndef CYLCHAIN_CONTACTBODIES_H_
#define CYLCHAIN_CONTACTBODIES_H_

#include "couplings/Capsules.h"
#include <vector>

namespace cylchain {

/** What touches each other: chains of capsules, and spheres. */
struct ContactBodies {
    struct Chain {
        std::vector<int> particles;
        double diameter;
        /** Segments whose numbers differ by at most this do not touch each other. */
        int excludedNeighbors;
        /** Whether the last particle is joined to the first by a segment more. */
        bool closed;
        int countSegments() const {
            return particles.size()-(closed ? 0 : 1);
        }
    };
    struct Sphere {
        int particle;
        double diameter;
    };
    /** Two segments, or spheres with a chain of -1, that do not touch each other. */
    struct Exclusion {
        int chain1, segment1, chain2, segment2;
    };
    std::vector<Chain> chains;
    std::vector<Sphere> spheres;
    std::vector<Exclusion> exclusions;
    /**
     * Describe the segments of all chains, in their order, then the spheres.
     *
     * @param isSpare  whether each particle is no node of its chain, which grows; none is if there are no numbers
     */
    CapsuleSystem getCapsules(const std::vector<bool>& isSpare = {}) const;
};

} // namespace cylchain

#endif /*CYLCHAIN_CONTACTBODIES_H_*/
