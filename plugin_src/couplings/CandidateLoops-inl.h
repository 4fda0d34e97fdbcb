// Compiled once for each instruction set, which CYLCHAIN_LOOPS names. It does not compile alone.

#include "couplings/CandidateLoops.h"
#include "couplings/Capsules.h"
#include "mechanics/Inline.h"
#include "mechanics/Prefetch.h"
#include <cmath>
#include <cstddef>
#include <cstring>
#include <type_traits>
#if defined(__AVX2__) || defined(__AVX512F__)
#include <immintrin.h>
#endif

namespace cylchain {
namespace CYLCHAIN_LOOPS {

typedef float Floats __attribute__((vector_size(4*CYLCHAIN_LANES)));
typedef int Ints __attribute__((vector_size(4*CYLCHAIN_LANES)));

CYLCHAIN_INLINE Floats splat(float value) {
    return value-Floats{};
}

CYLCHAIN_INLINE Floats load(const float* values) {
    Floats result;
    std::memcpy(&result, values, sizeof(result));
    return result;
}

CYLCHAIN_INLINE Floats magnitude(Floats value) {
    return (Floats) ((Ints) value & 0x7fffffff);
}

CYLCHAIN_INLINE Floats clamped(Floats value) {
    const Floats one = splat(1);
    const Floats below = value < one ? value : one;
    return below > -one ? below : -one;
}

template <class Values> CYLCHAIN_INLINE Values root(Values value) {
    typedef std::decay_t<decltype(value[0])> Number;
    Values result;
    for (std::size_t i = 0; i < sizeof(Values)/sizeof(Number); i++)
        reinterpret_cast<Number*>(&result)[i] = std::sqrt(reinterpret_cast<const Number*>(&value)[i]);
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

/** The numbers at a place of some records of equal size. */
template <int Size> CYLCHAIN_INLINE Floats gather(const float* base, Ints indices) {
#if defined(__AVX512F__) && CYLCHAIN_LANES == 16
    return (Floats) _mm512_mask_i32gather_ps(_mm512_setzero_ps(), 0xffff, (__m512i) (indices*Size), base, 4);
#elif defined(__AVX2__) && CYLCHAIN_LANES == 8
    return (Floats) _mm256_i32gather_ps(base, (__m256i) (indices*Size), 4);
#else
    Floats result;
    for (int i = 0; i < CYLCHAIN_LANES; i++)
        result[i] = base[(std::size_t) Size*indices[i]];
    return result;
#endif
}

#if defined(__AVX512F__) && CYLCHAIN_LANES == 16
/** Two blocks of four numbers of each of two registers. The intrinsics without masks make GCC warn. */
template <int Which> CYLCHAIN_INLINE __m512 blocks(__m512 one, __m512 other) {
    return _mm512_maskz_shuffle_f32x4(0xffff, one, other, Which);
}

/**
 * The numbers of sixteen records of sixteen numbers, each of them in all lanes: the records are loaded as they are and
 * transposed, which takes less time than to gather number after number.
 */
CYLCHAIN_INLINE void transposeRecords(const float* base, Ints indices, Floats* numbers) {
    __m512 a[16], b[16];
    for (int i = 0; i < 16; i++)
        a[i] = _mm512_loadu_ps(base+16*(std::size_t) indices[i]);
    for (int i = 0; i < 16; i += 2) {
        b[i] = _mm512_maskz_unpacklo_ps(0xffff, a[i], a[i+1]);
        b[i+1] = _mm512_maskz_unpackhi_ps(0xffff, a[i], a[i+1]);
    }
    // Now in each block of four, number 4 block+k of records i to i+3.
    for (int i = 0; i < 16; i += 4) {
        a[i] = _mm512_maskz_shuffle_ps(0xffff, b[i], b[i+2], 0x44);
        a[i+1] = _mm512_maskz_shuffle_ps(0xffff, b[i], b[i+2], 0xee);
        a[i+2] = _mm512_maskz_shuffle_ps(0xffff, b[i+1], b[i+3], 0x44);
        a[i+3] = _mm512_maskz_shuffle_ps(0xffff, b[i+1], b[i+3], 0xee);
    }
    const int even = 0x88, odd = 0xdd;
    for (int k = 0; k < 4; k++) {
        const __m512 even1 = blocks<even>(a[k], a[4+k]), even2 = blocks<even>(a[8+k], a[12+k]);
        const __m512 odd1 = blocks<odd>(a[k], a[4+k]), odd2 = blocks<odd>(a[8+k], a[12+k]);
        numbers[k] = (Floats) blocks<even>(even1, even2);
        numbers[8+k] = (Floats) blocks<odd>(even1, even2);
        numbers[4+k] = (Floats) blocks<even>(odd1, odd2);
        numbers[12+k] = (Floats) blocks<odd>(odd1, odd2);
    }
}
#elif defined(__AVX2__) && CYLCHAIN_LANES == 8
/** The same of eight records. */
CYLCHAIN_INLINE void transposeRecords(const float* base, Ints indices, Floats* numbers) {
    for (int half = 0; half < 2; half++) {
        __m256 a[8], b[8];
        for (int i = 0; i < 8; i++)
            a[i] = _mm256_loadu_ps(base+16*(std::size_t) indices[i]+8*half);
        for (int i = 0; i < 8; i += 2) {
            b[i] = _mm256_unpacklo_ps(a[i], a[i+1]);
            b[i+1] = _mm256_unpackhi_ps(a[i], a[i+1]);
        }
        // Now in each block of four, number 4 block+k of records i to i+3.
        for (int i = 0; i < 8; i += 4) {
            a[i] = _mm256_shuffle_ps(b[i], b[i+2], 0x44);
            a[i+1] = _mm256_shuffle_ps(b[i], b[i+2], 0xee);
            a[i+2] = _mm256_shuffle_ps(b[i+1], b[i+3], 0x44);
            a[i+3] = _mm256_shuffle_ps(b[i+1], b[i+3], 0xee);
        }
        for (int k = 0; k < 4; k++) {
            numbers[8*half+k] = (Floats) _mm256_permute2f128_ps(a[k], a[4+k], 0x20);
            numbers[8*half+4+k] = (Floats) _mm256_permute2f128_ps(a[k], a[4+k], 0x31);
        }
    }
}
#endif

template <int Size> CYLCHAIN_INLINE LaneVector gatherVector(const float* base, Ints indices) {
    return {gather<Size>(base, indices), gather<Size>(base+1, indices), gather<Size>(base+2, indices)};
}

/** Some capsules in lanes. */
struct LaneCapsules {
    LaneVector center, middle, half, laterMiddle, laterHalf;
    Floats radius;
    CYLCHAIN_INLINE LaneCapsules(const CoarseCapsule* capsules, Ints indices) {
        static_assert(sizeof(CoarseCapsule) == 16*sizeof(float), "A capsule is sixteen numbers");
        const float* base = capsules[0].center;
#if (defined(__AVX512F__) && CYLCHAIN_LANES == 16) || (defined(__AVX2__) && CYLCHAIN_LANES == 8)
        Floats numbers[16];
        transposeRecords(base, indices, numbers);
        auto vector = [&] (int first) {
            return LaneVector {numbers[first], numbers[first+1], numbers[first+2]};
        };
        center = vector(0);
        middle = vector(3);
        half = vector(6);
        laterMiddle = vector(9);
        laterHalf = vector(12);
        radius = numbers[15];
#else
        center = gatherVector<16>(base, indices);
        middle = gatherVector<16>(base+3, indices);
        half = gatherVector<16>(base+6, indices);
        laterMiddle = gatherVector<16>(base+9, indices);
        laterHalf = gatherVector<16>(base+12, indices);
        radius = gather<16>(base+15, indices);
#endif
    }
};

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

static int findOverlaps(const SweptBoxes& boxes, int capsule, const CapsuleRow* rows, int numRows,
        const CandidatePairs& pairs) {
    Ints lanes;
    for (int i = 0; i < CYLCHAIN_LANES; i++)
        lanes[i] = i;
    int count = 0;
    for (int row = 0; row < numRows; row++) {
        const CapsuleRow& others = rows[row];
        Floats center[3], half[3];
        for (int k = 0; k < 3; k++) {
            center[k] = splat(boxes.center[k][capsule]-others.shift[k]);
            half[k] = splat(boxes.half[k][capsule]);
        }
        for (int start = others.first; start < others.last; start += CYLCHAIN_LANES) {
            Ints mask = lanes < others.last-start;
            for (int k = 0; k < 3; k++)
                mask &= magnitude(load(boxes.center[k]+start)-center[k]) <= load(boxes.half[k]+start)+half[k];
            for (unsigned bits = bitsOf(mask); bits != 0; bits &= bits-1) {
                pairs.first[count] = capsule;
                pairs.second[count] = start+__builtin_ctz(bits);
                pairs.image[count++] = others.image;
            }
        }
    }
    return count;
}

static int keepNear(const CoarseCapsule* capsules, const float* shifts, float reach, float margin,
        const CandidatePairs& pairs, int count) {
    int kept = 0;
    for (int start = 0; start < count; start += CYLCHAIN_LANES) {
        Ints first, second, image;
        for (int i = start+CYLCHAIN_LANES; i < count && i < start+2*CYLCHAIN_LANES; i++)
            prefetch(&capsules[pairs.second[i]]);
        for (int i = 0; i < CYLCHAIN_LANES; i++) {
            const int pair = start+i < count ? start+i : start;
            first[i] = pairs.first[pair];
            second[i] = pairs.second[pair];
            image[i] = pairs.image[pair];
        }
        const LaneCapsules a(capsules, first), b(capsules, second);
        const LaneVector between = a.center-b.center-gatherVector<4>(shifts, image);
        const LaneVector w = between+a.middle-b.middle, laterW = between+a.laterMiddle-b.laterMiddle;
        const LaneVector dw = laterW-w, dp = a.laterHalf-a.half, dq = b.laterHalf-b.half;
        const Floats contact = a.radius+b.radius+(reach+margin);
        const Floats before = distance(a.half, b.half, w), after = distance(a.laterHalf, b.laterHalf, laterW);
        // Spheres pass through others near their axis.
        const Floats zero = Floats{};
        const Ints sphere = (a.half.dot(a.half) == zero) | (b.half.dot(b.half) == zero);
        const Floats deep = sphere ? splat(DEEP)*(a.radius+b.radius) : zero;
        const Floats motion = root(dw.dot(dw))+root(dp.dot(dp))+root(dq.dot(dq))+2*deep;
        const Ints near = (before <= contact) | (after <= contact) | (before+after <= motion+2*(reach+margin));
        const Floats nearest = before < after ? before : after;
        const unsigned sure = bitsOf((Ints) (nearest <= contact-2*margin));
        const Floats clearance = 0.5f*(before+after-motion)-margin;
        const Floats distance = clearance > zero ? after-margin : Floats{};
        const Floats atStart = before > margin ? before-margin : Floats{};
        for (unsigned bits = bitsOf(near); bits != 0; bits &= bits-1) {
            const int lane = __builtin_ctz(bits), pair = start+lane;
            if (pair >= count)
                break;
            pairs.first[kept] = pairs.first[pair];
            pairs.second[kept] = pairs.second[pair];
            pairs.distance[kept] = distance[lane];
            pairs.clearance[kept] = clearance[lane];
            pairs.before[kept] = atStart[lane];
            pairs.image[kept++] = pairs.image[pair]+((sure>>lane & 1) != 0 ? SURE : 0);
        }
    }
    return kept;
}

/** As many pairs as there are doubles in a register. */
const int DOUBLES = CYLCHAIN_LANES/2;
typedef double Doubles __attribute__((vector_size(8*DOUBLES)));
typedef long long Masks __attribute__((vector_size(8*DOUBLES)));
typedef int Numbers __attribute__((vector_size(4*DOUBLES)));
typedef float FloatsOfDoubles __attribute__((vector_size(4*DOUBLES)));

struct DoubleVector {
    Doubles x, y, z;
    CYLCHAIN_INLINE DoubleVector operator+(const DoubleVector& v) const {return {x+v.x, y+v.y, z+v.z};}
    CYLCHAIN_INLINE DoubleVector operator-(const DoubleVector& v) const {return {x-v.x, y-v.y, z-v.z};}
    CYLCHAIN_INLINE DoubleVector operator*(Doubles s) const {return {x*s, y*s, z*s};}
    CYLCHAIN_INLINE Doubles dot(const DoubleVector& v) const {return x*v.x+y*v.y+z*v.z;}
    CYLCHAIN_INLINE DoubleVector cross(const DoubleVector& v) const {
        return {y*v.z-z*v.y, z*v.x-x*v.z, x*v.y-y*v.x};
    }
};

CYLCHAIN_INLINE Doubles gatherOf(const double* base, Numbers records) {
    static_assert(sizeof(MovingSegment) == 16*sizeof(double), "A segment is sixteen numbers");
    Doubles result;
    for (int i = 0; i < DOUBLES; i++)
        result[i] = base[16*(std::size_t) records[i]];
    return result;
}

CYLCHAIN_INLINE DoubleVector gatherVectorOf(const double* base, Numbers records) {
    return {gatherOf(base, records), gatherOf(base+1, records), gatherOf(base+2, records)};
}

/** Some segments in lanes. */
struct LaneSegments {
    DoubleVector first, along, laterFirst, laterAlong, laterNext;
#if (defined(__AVX512F__) && CYLCHAIN_LANES == 16) || (defined(__AVX2__) && CYLCHAIN_LANES == 8)
    CYLCHAIN_INLINE LaneSegments(const MovingSegment* segments, Numbers records) {
        Doubles numbers[16];
        for (int part = 0; part < 16/DOUBLES; part++)
            transposePart(reinterpret_cast<const double*>(segments)+DOUBLES*part, records, numbers+DOUBLES*part);
        auto vector = [&] (int begin) {
            return DoubleVector {numbers[begin], numbers[begin+1], numbers[begin+2]};
        };
        first = vector(0);
        along = vector(3);
        laterFirst = vector(6);
        laterAlong = vector(9);
        laterNext = vector(12);
    }
private:
#if CYLCHAIN_LANES == 8
    /** Four numbers of each of four records, as transposeRecords() does. */
    static CYLCHAIN_INLINE void transposePart(const double* base, Numbers records, Doubles* numbers) {
        __m256d a[4], b[4];
        for (int i = 0; i < 4; i++)
            a[i] = _mm256_loadu_pd(base+16*(std::size_t) records[i]);
        for (int i = 0; i < 4; i += 2) {
            b[i] = _mm256_unpacklo_pd(a[i], a[i+1]);
            b[i+1] = _mm256_unpackhi_pd(a[i], a[i+1]);
        }
        for (int k = 0; k < 2; k++) {
            numbers[k] = (Doubles) _mm256_permute2f128_pd(b[k], b[2+k], 0x20);
            numbers[2+k] = (Doubles) _mm256_permute2f128_pd(b[k], b[2+k], 0x31);
        }
    }
#else
    template <int Which> static CYLCHAIN_INLINE __m512d blocksOf(__m512d one, __m512d other) {
        return _mm512_maskz_shuffle_f64x2(0xff, one, other, Which);
    }
    /** Eight numbers of each of eight records, as transposeRecords() does. */
    static CYLCHAIN_INLINE void transposePart(const double* base, Numbers records, Doubles* numbers) {
        __m512d a[8], b[8];
        for (int i = 0; i < 8; i++)
            a[i] = _mm512_loadu_pd(base+16*(std::size_t) records[i]);
        for (int i = 0; i < 8; i += 2) {
            b[i] = _mm512_maskz_unpacklo_pd(0xff, a[i], a[i+1]);
            b[i+1] = _mm512_maskz_unpackhi_pd(0xff, a[i], a[i+1]);
        }
        const int even = 0x88, odd = 0xdd;
        for (int k = 0; k < 2; k++) {
            const __m512d even1 = blocksOf<even>(b[k], b[2+k]), even2 = blocksOf<even>(b[4+k], b[6+k]);
            const __m512d odd1 = blocksOf<odd>(b[k], b[2+k]), odd2 = blocksOf<odd>(b[4+k], b[6+k]);
            numbers[k] = (Doubles) blocksOf<even>(even1, even2);
            numbers[4+k] = (Doubles) blocksOf<odd>(even1, even2);
            numbers[2+k] = (Doubles) blocksOf<even>(odd1, odd2);
            numbers[6+k] = (Doubles) blocksOf<odd>(odd1, odd2);
        }
    }
#endif
#else
    CYLCHAIN_INLINE LaneSegments(const MovingSegment* segments, Numbers records) {
        const double* base = reinterpret_cast<const double*>(segments);
        first = gatherVectorOf(base, records);
        along = gatherVectorOf(base+3, records);
        laterFirst = gatherVectorOf(base+6, records);
        laterAlong = gatherVectorOf(base+9, records);
        laterNext = gatherVectorOf(base+12, records);
    }
#endif
};

template <class Values> CYLCHAIN_INLINE Values loadOf(const void* values) {
    Values result;
    std::memcpy(&result, values, sizeof(result));
    return result;
}

CYLCHAIN_INLINE Doubles toUnit(Doubles value) {
    const Doubles zero = {}, one = zero+1;
    const Doubles above = value > zero ? value : zero;
    return above < one ? above : one;
}

CYLCHAIN_INLINE Doubles smaller(Doubles a, Doubles b) {
    return a < b ? a : b;
}

CYLCHAIN_INLINE Doubles greater(Doubles a, Doubles b) {
    return a > b ? a : b;
}

static void outlook(const MovingSegment* segments, double parallel, double atEnd, const PairsOfSegments& pairs,
        int count) {
    // Rounding may not let it seem that nothing crosses, or that a distance decreases. Segments that stay in one plane
    // (areInOnePlane() in Crossings.h) may cross there: no volume of theirs is more than this.
    const double ofVolumes = 2e-7, ofMotion = 1+1e-9, ofSlope = 1e-12, tiny = 1e-30;
    for (int start = 0; start < count; start += DOUBLES) {
        const Numbers first = loadOf<Numbers>(pairs.first+start), second = loadOf<Numbers>(pairs.second+start);
        const DoubleVector shift = {loadOf<Doubles>(pairs.shift[0]+start), loadOf<Doubles>(pairs.shift[1]+start),
                loadOf<Doubles>(pairs.shift[2]+start)};
        const LaneSegments one(segments, first), other(segments, second);
        const DoubleVector w0 = one.first-other.first+shift, p0 = one.along, q0 = other.along;
        const DoubleVector w = one.laterFirst-other.laterFirst+shift, p = one.laterAlong, q = other.laterAlong;

        const Doubles a = p.dot(p)+tiny, b = p.dot(q), e = q.dot(q)+tiny, c = p.dot(w), f = q.dot(w);
        const Doubles determinant = a*e-b*b;
        Doubles s = toUnit((b*f-c*e)/greater(determinant, a*e*1e-14));
        Doubles t = toUnit((b*s+f)/e);
        s = toUnit((b*t-c)/a);
        t = toUnit((b*s+f)/e);
        const DoubleVector r = w+p*s-q*t;
        const Doubles squared = r.dot(r);

        // The volume is a cubic in time; it does not vanish where all its Bernstein coefficients have one sign.
        const DoubleVector dw = w-w0, dp = p-p0, dq = q-q0;
        const DoubleVector n0 = p0.cross(q0), n1 = p0.cross(dq)+dp.cross(q0), n2 = dp.cross(dq);
        const Doubles c0 = w0.dot(n0), c1 = w0.dot(n1)+dw.dot(n0), c2 = w0.dot(n2)+dw.dot(n1), c3 = dw.dot(n2);
        const Doubles f1 = c0+c1/3.0, f2 = f1+(c1+c2)/3.0, f3 = c0+c1+c2+c3;
        const Doubles least = smaller(smaller(c0, f1), smaller(f2, f3));
        const Doubles most = greater(greater(c0, f1), greater(f2, f3));
        const Doubles size = a+e+w.dot(w)+p0.dot(p0)+q0.dot(q0)+w0.dot(w0);
        // In units of volume, squared.
        const Doubles limit = ofVolumes*ofVolumes*size*size*size;
        const Masks oneSign = ((least > 0.0) & (least*least > limit)) | ((most < 0.0) & (most*most > limit));
        const DoubleVector ends[] = {dw, dw+dp, dw-dq, dw+dp-dq};
        const Doubles motion = greater(greater(ends[0].dot(ends[0]), ends[1].dot(ends[1])),
                greater(ends[2].dot(ends[2]), ends[3].dot(ends[3])));
        // They would have met on the way.
        const Doubles distance = root(squared), way = root(motion);
        const Doubles before = __builtin_convertvector(loadOf<FloatsOfDoubles>(pairs.before+start), Doubles);
        const Masks mayCross = ~(oneSign | (before+distance > way*ofMotion));

        const DoubleVector p1 = one.laterNext, q1 = other.laterNext;
        const Doubles along = r.dot(p1), against = r.dot(q1);
        const Masks firstNearer = (s > 1-atEnd) & (along < 0.0) & (along*along > ofSlope*squared*p1.dot(p1));
        const Masks secondNearer = (t > 1-atEnd) & (against > 0.0) & (against*against > ofSlope*squared*q1.dot(q1));
        const Masks flags = (mayCross & MAY_CROSS) | (~(determinant > 1.001*parallel*a*e) & MAY_BE_PARALLEL) |
                ((s < atEnd) & FIRST_AT_START) | ((t < atEnd) & SECOND_AT_START) | (firstNearer & FIRST_GOES_NEARER) |
                (secondNearer & SECOND_GOES_NEARER);
        for (int i = 0; i < DOUBLES; i++) {
            pairs.distance[start+i] = distance[i];
            pairs.flags[start+i] = flags[i];
        }
    }
}

static const CandidateKernels KERNELS = {CYLCHAIN_LOOPS_NAME, findOverlaps, keepNear, outlook};

} // namespace CYLCHAIN_LOOPS
} // namespace cylchain
