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

/** The boxes that capsules sweep, in fractions of the frame: one array for each center coordinate and half width. */
struct SweptBoxes {
    const float *center[3], *half[3];
};

/** Capsules that follow each other in the order of cells, and what takes them to their image next to others. */
struct CapsuleRow {
    int first, last;
    /** The number of the image, and its vector in fractions of the frame. */
    int image;
    float shift[3];
};

/** Pairs of capsules, the second one in an image, and what keepNear() finds: see ContactPair. */
struct CandidatePairs {
    int *first, *second, *image;
    float *distance, *clearance;
};

/** What is added to the image of pairs that are near without doubt. */
const int SURE = 32;

/** A first look at many pairs, in lanes. It finds a few too many, and none too few. */
struct CandidateKernels {
    const char* instructionSet;
    /**
     * Write which boxes in some rows overlap that of a capsule, and return how many. There is room for 16 more.
     */
    int (*findOverlaps)(const SweptBoxes& boxes, int capsule, const CapsuleRow* rows, int numRows,
            const CandidatePairs& pairs);
    /**
     * Keep those of some pairs that come near each other at the start or at the end, or may cross in between, and
     * return how many. Where there is no doubt that they come near, SURE is added to the image.
     *
     * @param shifts  the vectors of images, four numbers each
     * @param reach   how near their surfaces come
     * @param margin  what rounding may add to a distance
     */
    int (*keepNear)(const CoarseCapsule* capsules, const float* shifts, float reach, float margin,
            const CandidatePairs& pairs, int count);
};

/** Get the loops for the best instruction set that there is. */
const CandidateKernels& candidateKernels();

const CandidateKernels& baselineCandidateKernels();
const CandidateKernels& avx2CandidateKernels();
const CandidateKernels& avx512CandidateKernels();

} // namespace cylchain

#endif /*CYLCHAIN_CANDIDATE_LOOPS_H_*/
