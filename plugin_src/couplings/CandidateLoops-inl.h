// Compiled once for each instruction set, which CYLCHAIN_LOOPS names. It does not compile alone.

#include "couplings/CandidateLoops.h"
#include <cmath>
#include <cstddef>
#include <cstring>
#if defined(__AVX2__) || defined(__AVX512F__)
#include <immintrin.h>
#endif

namespace cylchain {
namespace CYLCHAIN_LOOPS {

typedef float Floats __attribute__((vector_size(4*CYLCHAIN_LANES)));
typedef int Ints __attribute__((vector_size(4*CYLCHAIN_LANES)));

// Called functions cannot keep vectors in registers.
#define CYLCHAIN_INLINE inline __attribute__((always_inline))

CYLCHAIN_INLINE Floats splat(float value) {
    return value-Floats{};
}

CYLCHAIN_INLINE Floats load(const float* values) {
    Floats result;
    std::memcpy(&result, values, sizeof(result));
    return result;
}

CYLCHAIN_INLINE Floats magnitude(Floats value) {
    return value > -value ? value : -value;
}

CYLCHAIN_INLINE Floats clamped(Floats value) {
    const Floats one = splat(1);
    const Floats below = value < one ? value : one;
    return below > -one ? below : -one;
}

CYLCHAIN_INLINE Floats root(Floats value) {
    Floats result;
    for (int i = 0; i < CYLCHAIN_LANES; i++)
        reinterpret_cast<float*>(&result)[i] = std::sqrt(reinterpret_cast<const float*>(&value)[i]);
    return result;
}

/** One bit for each lane that is not zero. */
CYLCHAIN_INLINE unsigned bitsOf(Ints mask) {
#if defined(__AVX512F__) && CYLCHAIN_LANES == 16
    return _mm512_test_epi32_mask((__m512i) mask, (__m512i) mask);
#elif defined(__AVX2__) && CYLCHAIN_LANES == 8
    return _mm256_movemask_ps((__m256) mask);
#else
    unsigned bits = 0;
    for (int i = 0; i < CYLCHAIN_LANES; i++)
        bits |= (mask[i] != 0 ? 1u : 0u)<<i;
    return bits;
#endif
}

struct LaneVector {
    Floats x, y, z;
    CYLCHAIN_INLINE LaneVector operator+(const LaneVector& v) const {return {x+v.x, y+v.y, z+v.z};}
    CYLCHAIN_INLINE LaneVector operator-(const LaneVector& v) const {return {x-v.x, y-v.y, z-v.z};}
    CYLCHAIN_INLINE LaneVector operator*(Floats s) const {return {x*s, y*s, z*s};}
    CYLCHAIN_INLINE Floats dot(const LaneVector& v) const {return x*v.x+y*v.y+z*v.z;}
};

CYLCHAIN_INLINE LaneVector splat(const float* vector) {
    return {splat(vector[0]), splat(vector[1]), splat(vector[2])};
}

/** The numbers at a place of some capsules. */
CYLCHAIN_INLINE Floats gather(const CoarseCapsule* capsules, Ints indices, int place) {
    const float* base = capsules[0].center+place;
    static_assert(sizeof(CoarseCapsule) == 16*sizeof(float), "A capsule is sixteen numbers");
#if defined(__AVX512F__) && CYLCHAIN_LANES == 16
    return (Floats) _mm512_mask_i32gather_ps(_mm512_setzero_ps(), 0xffff, (__m512i) (indices*16), base, 4);
#elif defined(__AVX2__) && CYLCHAIN_LANES == 8
    return (Floats) _mm256_i32gather_ps(base, (__m256i) (indices*16), 4);
#else
    Floats result;
    for (int i = 0; i < CYLCHAIN_LANES; i++)
        result[i] = base[(std::size_t) 16*indices[i]];
    return result;
#endif
}

CYLCHAIN_INLINE LaneVector gatherVector(const CoarseCapsule* capsules, Ints indices, int place) {
    return {gather(capsules, indices, place), gather(capsules, indices, place+1), gather(capsules, indices, place+2)};
}

/** The distance of segments c+-p and c'+-q, for w = c-c'. Where they are nearly parallel, it may be a bit too large. */
CYLCHAIN_INLINE Floats distance(const LaneVector& p, const LaneVector& q, const LaneVector& w) {
    const Floats tiny = splat(1e-30f);
    const Floats a = p.dot(p)+tiny, b = p.dot(q), e = q.dot(q)+tiny, c = p.dot(w), f = q.dot(w);
    const Floats ae = a*e;
    Floats s = clamped((b*f-c*e)/(ae-b*b+1e-6f*ae));
    Floats t = clamped((b*s+f)/e);
    s = clamped((b*t-c)/a);
    t = clamped((b*s+f)/e);
    const LaneVector r = w+p*s-q*t;
    return root(r.dot(r));
}

static int findOverlaps(const SweptBoxes& boxes, int first, int last, const QueryBox& query, int* hits) {
    Ints lanes;
    for (int i = 0; i < CYLCHAIN_LANES; i++)
        lanes[i] = i;
    int count = 0;
    for (int start = first; start < last; start += CYLCHAIN_LANES) {
        Ints mask = lanes < last-start;
        for (int j = 0; j < 3; j++)
            mask &= magnitude(load(boxes.center[j]+start)-query.center[j]) <= load(boxes.half[j]+start)+query.half[j];
        for (unsigned bits = bitsOf(mask); bits != 0; bits &= bits-1)
            hits[count++] = start+__builtin_ctz(bits);
    }
    return count;
}

static int keepNear(const CoarseCapsule* capsules, int query, const float* shift, float reach, float margin,
        int* hits, int count) {
    const CoarseCapsule& own = capsules[query];
    const float place[3] = {own.center[0]+shift[0], own.center[1]+shift[1], own.center[2]+shift[2]};
    const LaneVector center = splat(place), middle = splat(own.middle), half = splat(own.half),
            laterMiddle = splat(own.laterMiddle), laterHalf = splat(own.laterHalf);
    int kept = 0;
    for (int start = 0; start < count; start += CYLCHAIN_LANES) {
        Ints indices;
        for (int i = 0; i < CYLCHAIN_LANES; i++)
            indices[i] = hits[start+i < count ? start+i : start];
        const LaneVector between = center-gatherVector(capsules, indices, 0);
        const LaneVector w = between+middle-gatherVector(capsules, indices, 3);
        const LaneVector q = gatherVector(capsules, indices, 6);
        const LaneVector laterW = between+laterMiddle-gatherVector(capsules, indices, 9);
        const LaneVector laterQ = gatherVector(capsules, indices, 12);
        const Floats contact = gather(capsules, indices, 15)+(own.radius+reach+margin);
        const Floats d = distance(half, q, w), later = distance(laterHalf, laterQ, laterW);
        const LaneVector dw = laterW-w, dp = laterHalf-half, dq = laterQ-q;
        const Floats motion = root(dw.dot(dw))+root(dp.dot(dp))+root(dq.dot(dq));
        const Ints near = (d <= contact) | (later <= contact) | (d+later <= motion+2*margin);
        for (unsigned bits = bitsOf(near); bits != 0; bits &= bits-1) {
            const int i = start+__builtin_ctz(bits);
            if (i < count)
                hits[kept++] = hits[i];
        }
    }
    return kept;
}

static const CandidateKernels KERNELS = {CYLCHAIN_LOOPS_NAME, findOverlaps, keepNear};

} // namespace CYLCHAIN_LOOPS
} // namespace cylchain
