#ifndef CYLCHAIN_CANDIDATE_LOOPS_H_
#define CYLCHAIN_CANDIDATE_LOOPS_H_

namespace cylchain {

/** What is known of a capsule in single precision, for a first look at pairs. */
struct CoarseCapsule {
    /** The center of the box that it sweeps. */
    float center[3];
    /** The middle of the segment and half the vector along it, at the start and at the end; middles are relative. */
    float middle[3], half[3], laterMiddle[3], laterHalf[3];
    float radius;
};

/** The boxes that capsules sweep, one array for each center coordinate and each half width. */
struct SweptBoxes {
    const float *center[3], *half[3];
};

/** A box that others are compared with. */
struct QueryBox {
    float center[3], half[3];
};

/** A first look at many pairs, in lanes. It finds a few too many, and none too few. */
struct CandidateKernels {
    const char* instructionSet;
    /** Write which of some boxes overlap the query, and return how many. There is room for 16 more. */
    int (*findOverlaps)(const SweptBoxes& boxes, int first, int last, const QueryBox& query, int* hits);
    /**
     * Keep those of some capsules that come near a capsule at the start or at the end, or may cross it in between, and
     * return how many.
     *
     * @param shift   what takes the capsule to its image next to the others
     * @param reach   how near their surfaces come
     * @param margin  what rounding may add to a distance
     */
    int (*keepNear)(const CoarseCapsule* capsules, int query, const float* shift, float reach, float margin, int* hits,
            int count);
};

/** Get the loops for the best instruction set that there is. */
const CandidateKernels& candidateKernels();

const CandidateKernels& baselineCandidateKernels();
const CandidateKernels& avx2CandidateKernels();
const CandidateKernels& avx512CandidateKernels();

} // namespace cylchain

#endif /*CYLCHAIN_CANDIDATE_LOOPS_H_*/
