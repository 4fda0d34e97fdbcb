/**
 * The random numbers that NoiseLanes.h declares. This file is compiled once for each instruction set, into a namespace of
 * its own, CYLCHAIN_LOOPS, for up to CYLCHAIN_LANES lanes, and without fused multiplication and addition.
 */

#include "Noise.h"
#ifdef CYLCHAIN_X86_64
#include <immintrin.h>
#endif
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <new>
#include <type_traits>
#include <vector>

namespace cylchain {
namespace CYLCHAIN_LOOPS {

#include "VectorLanes.h"
#include "NoiseLanes.h"

namespace {

// Adding 2^52 in the exponent's place turns up to 52 bits into a double.
const std::uint64_t INTEGER = 0x4330000000000000ULL;
const double TWO_TO_52 = 4503599627370496.0;
const std::uint64_t LOW_HALF = 0xffffffffULL;

template <class To, class From> CYLCHAIN_INLINE To reinterpreted(From from) {
    To result;
    std::memcpy(&result, &from, sizeof(result));
    return result;
}

/** One where a bit is set, in the lanes of a mask. */
template <class Bits> CYLCHAIN_INLINE Bits maskOf(Bits bits, int position) {
    return -((bits>>position)&1);
}

/** The product of numbers of 32 bits. Compilers do not find the instruction for it themselves. */
template <int W> CYLCHAIN_INLINE typename Lanes<W>::Bits product(typename Lanes<W>::Bits a, std::uint32_t b) {
#ifdef CYLCHAIN_X86_64
    typedef typename Lanes<W>::Bits Bits;
    if constexpr (W == 2)
        return (Bits) _mm_mul_epu32((__m128i) a, (__m128i) ((std::uint64_t) b+Bits{}));
#if CYLCHAIN_LANES > 2
    if constexpr (W == 4)
        return (Bits) _mm256_mul_epu32((__m256i) a, (__m256i) ((std::uint64_t) b+Bits{}));
#endif
#if CYLCHAIN_LANES > 4
    if constexpr (W == 8)
        return (Bits) _mm512_maskz_mul_epu32(-1, (__m512i) a, (__m512i) ((std::uint64_t) b+Bits{}));
#endif
#endif
    return a*(std::uint64_t) b;
}

/** The words of several draws: each lane holds a word of 32 bits. */
template <int W, int DRAWS> struct Words {
    typename Lanes<W>::Bits word[DRAWS][4];
};

template <int W, int DRAWS> CYLCHAIN_INLINE void philox(Words<W, DRAWS>& words, std::uint32_t seed, const std::uint32_t* streams) {
    typedef typename Lanes<W>::Bits Bits;
    std::uint32_t key = seed, bump = 0;
    for (int round = 0; round < 10; round++) {
        for (int draw = 0; draw < DRAWS; draw++) {
            Bits* const c = words.word[draw];
            const Bits first = product<W>(c[0], 0xD2511F53), second = product<W>(c[2], 0xCD9E8D57);
            c[0] = (second>>32)^c[1]^(std::uint64_t) key;
            c[1] = second&LOW_HALF;
            c[2] = (first>>32)^c[3]^(std::uint64_t) (std::uint32_t) (streams[draw]+bump);
            c[3] = first&LOW_HALF;
        }
        key += 0x9E3779B9u;
        bump += 0xBB67AE85u;
    }
}

/** The words of the draws from a first one on. */
template <int W, int DRAWS> CYLCHAIN_INLINE Words<W, DRAWS> wordsOf(const NoiseKey& key, NoiseKind kind,
        const NoisePlaces<W>& places, std::uint32_t firstDraw) {
    typedef typename Lanes<W>::Bits Bits;
    Words<W, DRAWS> words;
    std::uint32_t streams[DRAWS];
    for (int draw = 0; draw < DRAWS; draw++) {
        words.word[draw][0] = places.part;
        words.word[draw][1] = places.chain;
        words.word[draw][2] = (key.step&LOW_HALF)+Bits{};
        words.word[draw][3] = (key.step>>32)+Bits{};
        streams[draw] = NoiseKey::streamOf(kind, key.level, firstDraw+draw);
    }
    philox<W, DRAWS>(words, key.seed, streams);
    return words;
}

/**
 * A pair of normal numbers. The polynomials have the least relative error, 5 10^-12, for (2/s) ln((1+s)/(1-s)), where m
 * is between 2^(-1/2) and 2^(1/2), and for sine and cosine up to pi/4.
 */
template <int W> CYLCHAIN_INLINE void normalsOf(typename Lanes<W>::Bits a, typename Lanes<W>::Bits b,
        typename Lanes<W>::Type* normals) {
    typedef typename Lanes<W>::Type Real;
    typedef typename Lanes<W>::Bits Bits;
    // 2^41 u = 2^k m
    const Bits odd = (a<<9)|(b>>24<<1)|1;
    const Bits bits = reinterpreted<Bits>(reinterpreted<Real>(odd|INTEGER)-TWO_TO_52);
    const Bits shifted = bits-0x3fe6a09e667f3bcdULL, k = shifted>>52;
    const Real m = reinterpreted<Real>((shifted&0xfffffffffffffULL)+0x3fe6a09e667f3bcdULL);
    const Real f = m-1;
    const Real s = f/(2+f), z = s*s;
    const Real series = 4.000000000016848+z*(1.3333333048091949+z*(0.8000077173579951+z*(0.5706997198099943+
            z*0.47234929546248894)));
    const Real power = TWO_TO_52+41-reinterpreted<Real>(k|INTEGER);
    const Real radius = root(power*1.3862943611198906-s*series);

    const Bits steps = ((b&0x3fffff)<<1)|1;
    const Real angle = (reinterpreted<Real>(steps|INTEGER)-(TWO_TO_52+4194304))*1.8725351414619643e-07; // pi/2^24
    const Real square = angle*angle;
    const Real sine = angle*(0.9999999999954503+square*(-0.16666666630446217+square*(0.008333328690152379+
            square*(-0.0001983917835543003+square*2.717152804771581e-06))));
    const Real cosine = 0.9999999999999347+square*(-0.4999999999927173+square*(0.04166666653373851+
            square*(-0.001388887993644608+square*(2.4798844637538058e-05-square*2.716800521187314e-07))));
    const Bits first = reinterpreted<Bits>(radius*cosine)^((b<<41)&0x8000000000000000ULL);
    const Bits second = reinterpreted<Bits>(radius*sine);
    const Bits exchanged = (first^second)&maskOf<Bits>(b, 23);
    normals[0] = reinterpreted<Real>(first^exchanged);
    normals[1] = reinterpreted<Real>(second^exchanged);
}

/** A number between 0 and 1, neither of which it ever is. */
template <int W> CYLCHAIN_INLINE typename Lanes<W>::Type uniformOf(typename Lanes<W>::Bits a, typename Lanes<W>::Bits b) {
    typedef typename Lanes<W>::Type Real;
    const typename Lanes<W>::Bits odd = (a<<20)|(b>>12)|1;
    return (reinterpreted<Real>(odd|INTEGER)-TWO_TO_52)*(1/TWO_TO_52);
}

template <int W, int PAIRS> CYLCHAIN_INLINE void normalsOfWords(const Words<W, (PAIRS+1)/2>& words,
        typename Lanes<W>::Type* normals) {
#pragma GCC unroll 4
    for (int pair = 0; pair < PAIRS; pair++) {
        const typename Lanes<W>::Bits* const c = words.word[pair/2]+2*(pair%2);
        normalsOf<W>(c[0], c[1], normals+2*pair);
    }
}

/** The normal numbers that Levy's construction takes from the levels below that of the step. */
template <int W, int PAIRS> void drawPath(const NoiseKey& key, NoiseKind kind, const NoisePlaces<W>& places,
        typename Lanes<W>::Type* normals) {
    typedef typename Lanes<W>::Type Real;
    NoiseKey drawn = {key.seed, 0, key.step>>key.level};
    normalsOfWords<W, PAIRS>(wordsOf<W, (PAIRS+1)/2>(drawn, kind, places, 0), normals);
    for (drawn.level = 1; drawn.level <= key.level; drawn.level++) {
        const std::uint64_t step = key.step>>(key.level-drawn.level);
        drawn.step = step>>1;
        Real others[2*PAIRS];
        normalsOfWords<W, PAIRS>(wordsOf<W, (PAIRS+1)/2>(drawn, kind, places, 0), others);
        const double sign = step&1 ? -1 : 1;
        for (int i = 0; i < 2*PAIRS; i++)
            normals[i] = (normals[i]+others[i]*sign)*M_SQRT1_2;
    }
}

} // namespace

template <int W, int PAIRS> void drawNormals(const NoiseKey& key, NoiseKind kind, const NoisePlaces<W>& places,
        typename Lanes<W>::Type* normals) {
    if (key.level == 0)
        normalsOfWords<W, PAIRS>(wordsOf<W, (PAIRS+1)/2>(key, kind, places, 0), normals);
    else
        drawPath<W, PAIRS>(key, kind, places, normals);
}

template <int W> void drawCandidates(const NoiseKey& key, NoiseKind kind, const NoisePlaces<W>& places,
        typename Lanes<W>::Type* normals, typename Lanes<W>::Type& uniform) {
    const Words<W, 1> words = wordsOf<W, 1>(key, kind, places, 0);
    uniform = uniformOf<W>(words.word[0][2], words.word[0][3]);
    if (key.level == 0)
        normalsOfWords<W, 1>(words, normals);
    else
        drawPath<W, 1>(key, kind, places, normals);
}

void drawCandidate(const NoiseKey& key, NoiseKind kind, std::uint32_t chain, std::uint32_t part, std::uint32_t draw,
        double* normals, double& uniform) {
    const Words<1, 1> words = wordsOf<1, 1>(key, kind, NoisePlaces<1> {chain, part}, draw);
    normalsOfWords<1, 1>(words, normals);
    uniform = uniformOf<1>(words.word[0][2], words.word[0][3]);
}

void drawUniforms(const NoiseKey& key, NoiseKind kind, std::uint32_t chain, std::uint32_t part, std::uint32_t draw,
        double* uniforms) {
    const Words<1, 1> words = wordsOf<1, 1>(key, kind, NoisePlaces<1> {chain, part}, draw);
    for (int i = 0; i < 2; i++)
        uniforms[i] = uniformOf<1>(words.word[0][2*i], words.word[0][2*i+1]);
}

/**
 * The density of lengths l is exp(-V/k_B T). As one of x = q/D, with l = l0+-D (1-exp(-x^2))^(1/2), it is that of a normal
 * number with the variance 1/(k D^2/k_B T+3/2), times (y/sinh y)^(1/2) with y = x^2/2. At least 97.7 % of candidates are
 * accepted, however soft the segment is.
 */
template <int W> void drawFeneCoordinates(const NoiseKey& key, const NoisePlaces<W>& places,
        typename Lanes<W>::Type stiffness, typename Lanes<W>::Type& coordinates) {
    typedef typename Lanes<W>::Type Real;
    typedef typename Lanes<W>::Bits Bits;
    const Words<W, 1> words = wordsOf<W, 1>(key, NoiseKind::Length, places, 0);
    Real uniforms = uniformOf<W>(words.word[0][2], words.word[0][3]), deviation = 1/root(stiffness+1.5);
    coordinates = coordinates*deviation;
    Real half = 0.5*coordinates*coordinates, surely = 1-half*half*(1.0/12);
    for (int i = 0; i < W; i++) {
        double uniform = lane(uniforms, i), y = lane(half, i);
        if (uniform <= lane(surely, i))
            continue;
        Bits chain = places.chain, part = places.part;
        for (std::uint32_t draw = 1; uniform > std::sqrt(y/std::sinh(y)); draw++) {
            double normals[2];
            drawCandidate(key, NoiseKind::Length, reinterpret_cast<std::uint64_t*>(&chain)[i],
                    reinterpret_cast<std::uint64_t*>(&part)[i], draw, normals, uniform);
            lane(coordinates, i) = normals[0]*lane(deviation, i);
            y = 0.5*lane(coordinates, i)*lane(coordinates, i);
        }
    }
}

namespace {

/** Call a function for places in as many lanes as possible. */
template <int W, class Function> void forPlaces(const std::uint32_t* chains, const std::uint32_t* parts, int first, int count,
        Function function) {
    for (; first+W <= count; first += W) {
        NoisePlaces<W> places;
        for (int i = 0; i < W; i++) {
            reinterpret_cast<std::uint64_t*>(&places.chain)[i] = chains[first+i];
            reinterpret_cast<std::uint64_t*>(&places.part)[i] = parts[first+i];
        }
        function(places, first);
    }
    if constexpr (W > 1)
        forPlaces<W/2>(chains, parts, first, count, function);
}

template <int W> std::integral_constant<int, W> lanesOf(const NoisePlaces<W>&) {
    return {};
}

} // namespace

void drawWordsOf(const NoiseKey& key, NoiseKind kind, std::uint32_t draw, const std::uint32_t* chains,
        const std::uint32_t* parts, int count, std::uint32_t* words) {
    forPlaces<CYLCHAIN_LANES>(chains, parts, 0, count, [&] (const auto& places, int first) {
        constexpr int W = decltype(lanesOf(places))();
        Words<W, 1> drawn = wordsOf<W, 1>(key, kind, places, draw);
        for (int k = 0; k < 4; k++)
            for (int i = 0; i < W; i++)
                words[4*(first+i)+k] = reinterpret_cast<std::uint64_t*>(&drawn.word[0][k])[i];
    });
}

void drawNormalsOf(const NoiseKey& key, NoiseKind kind, const std::uint32_t* chains, const std::uint32_t* parts, int count,
        double* normals) {
    forPlaces<CYLCHAIN_LANES>(chains, parts, 0, count, [&] (const auto& places, int first) {
        constexpr int W = decltype(lanesOf(places))();
        typename Lanes<W>::Type drawn[4];
        drawNormals<W, 2>(key, kind, places, drawn);
        for (int k = 0; k < 4; k++)
            for (int i = 0; i < W; i++)
                normals[4*(first+i)+k] = lane(drawn[k], i);
    });
}

void drawFeneCoordinatesOf(const NoiseKey& key, const std::uint32_t* chains, const std::uint32_t* segments,
        const double* stiffness, int count, double* coordinates) {
    forPlaces<CYLCHAIN_LANES>(chains, segments, 0, count, [&] (const auto& places, int first) {
        constexpr int W = decltype(lanesOf(places))();
        typedef typename Lanes<W>::Type Real;
        Real drawn[8], stiffnesses;
        for (int i = 0; i < W; i++)
            lane(stiffnesses, i) = stiffness[first+i];
        drawNormals<W, 4>(key, NoiseKind::Segment, places, drawn);
        drawFeneCoordinates<W>(key, places, stiffnesses, drawn[6]);
        for (int i = 0; i < W; i++)
            coordinates[first+i] = lane(drawn[6], i);
    });
}

#define CYLCHAIN_INSTANTIATE_NORMALS(W, PAIRS) \
    template void drawNormals<W, PAIRS>(const NoiseKey&, NoiseKind, const NoisePlaces<W>&, Lanes<W>::Type*);
#define CYLCHAIN_INSTANTIATE_NOISE(W) \
    CYLCHAIN_INSTANTIATE_NORMALS(W, 2) \
    CYLCHAIN_INSTANTIATE_NORMALS(W, 3) \
    CYLCHAIN_INSTANTIATE_NORMALS(W, 4) \
    template void drawCandidates<W>(const NoiseKey&, NoiseKind, const NoisePlaces<W>&, Lanes<W>::Type*, Lanes<W>::Type&); \
    template void drawFeneCoordinates<W>(const NoiseKey&, const NoisePlaces<W>&, Lanes<W>::Type, Lanes<W>::Type&);

CYLCHAIN_INSTANTIATE_NOISE(1)
CYLCHAIN_INSTANTIATE_NOISE(2)
#if CYLCHAIN_LANES > 2
CYLCHAIN_INSTANTIATE_NOISE(4)
#endif
#if CYLCHAIN_LANES > 4
CYLCHAIN_INSTANTIATE_NOISE(8)
#endif

} // namespace CYLCHAIN_LOOPS
} // namespace cylchain
