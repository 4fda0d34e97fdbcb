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
    float *distance, *clearance, *before;
};

/**
 * A segment at the start and at the end of a step, the one that follows it in its chain at the end, or zero, and its
 * radius. A sphere is one that has no length.
 */
struct MovingSegment {
    double first[3], along[3], laterFirst[3], laterAlong[3], laterNext[3], radius;
    bool hasLength() const {
        return along[0] != 0 || along[1] != 0 || along[2] != 0;
    }
};

/** Pairs of segments, the first ones shifted, and what outlook() finds of them at the end of a step. */
struct PairsOfSegments {
    const int *first, *second;
    const double* shift[3];
    /** What is known of their distance at the start of the step: it is not less. */
    const float* before;
    double* distance;
    /** Some of the flags below. */
    int* flags;
};

/** Two segments may have passed through each other. */
const int MAY_CROSS = 1;
/** They are nearly parallel, or nearly so. */
const int MAY_BE_PARALLEL = 2;
/** The first or the second of them is nearest to the other one at its start. */
const int FIRST_AT_START = 4, SECOND_AT_START = 8;
/** It is so at its end, and what follows it comes nearer. */
const int FIRST_GOES_NEARER = 16, SECOND_GOES_NEARER = 32;

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
     * Keep those of some pairs that come near each other at the start or at the end, or may cross in between or when
     * they have moved on by the reach, and return how many. Where there is no doubt that they come near, SURE is added
     * to the image.
     *
     * @param shifts  the vectors of images, four numbers each
     * @param reach   how near their surfaces come
     * @param margin  what rounding may add to a distance
     */
    int (*keepNear)(const CoarseCapsule* capsules, const float* shifts, float reach, float margin,
            const CandidatePairs& pairs, int count);
    /**
     * Find how far apart some pairs of segments are, and whether they may touch.
     *
     * @param parallel  the largest sin^2 of the angle of segments that are nearly parallel
     * @param atEnd     fractions that are at an end
     * @param count     it is rounded up to a multiple of 8
     */
    void (*outlook)(const MovingSegment* segments, double parallel, double atEnd, const PairsOfSegments& pairs,
            int count);
};

/** Get the loops for the best instruction set that there is. */
const CandidateKernels& candidateKernels();

const CandidateKernels& baselineCandidateKernels();
const CandidateKernels& avx2CandidateKernels();
const CandidateKernels& avx512CandidateKernels();

} // namespace cylchain

#endif /*CYLCHAIN_CANDIDATE_LOOPS_H_*/
