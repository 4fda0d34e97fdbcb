// Included once for each instruction set and precision, by a file that names them. It does not compile alone.

/**
 * The random numbers that NoiseLanes-inl.h declares. This file is compiled for each instruction set and, if
 * CYLCHAIN_SINGLE_PRECISION is defined, in single precision: into a namespace of its own, CYLCHAIN_LOOPS, for up to
 * CYLCHAIN_LANES lanes, and without fused multiplication and addition.
 */

#include "lanes/Noise.h"
#include "mechanics/Inline.h"
#ifdef CYLCHAIN_X86_64
#include <immintrin.h>
#endif
#include <algorithm>
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

#include "lanes/VectorLanes-inl.h"
#include "lanes/NoiseLanes-inl.h"

namespace {

template <class To, class From> CYLCHAIN_INLINE To reinterpreted(From from) {
    To result;
    std::memcpy(&result, &from, sizeof(result));
    return result;
}

/** The words of several draws: each lane holds a word of 32 bits. */
template <int W, int DRAWS> struct Words {
    typename Lanes<W>::Bits word[DRAWS][4];
};

#ifdef CYLCHAIN_SINGLE_PRECISION
#include "lanes/NoiseSingle-inl.h"
#else
#include "lanes/NoiseDouble-inl.h"
#endif

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
        const Scalar sign = step&1 ? -1 : 1;
        for (int i = 0; i < 2*PAIRS; i++)
            normals[i] = (normals[i]+others[i]*sign)*Scalar(M_SQRT1_2);
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
    Scalar drawn[2];
    normalsOfWords<1, 1>(words, drawn);
    std::copy(drawn, drawn+2, normals);
    uniform = uniformOf<1>(words.word[0][2], words.word[0][3]);
}

void drawUniforms(const NoiseKey& key, NoiseKind kind, std::uint32_t chain, std::uint32_t part, std::uint32_t draw,
        double* uniforms) {
    const Words<1, 1> words = wordsOf<1, 1>(key, kind, NoisePlaces<1> {chain, part}, draw);
    for (int i = 0; i < 2; i++)
        uniforms[i] = uniformOf<1>(words.word[0][2*i], words.word[0][2*i+1]);
}

/**
 * The density of lengths l is exp(-V/k_B T). As one of x = q/D, with l = l0+-D (1-exp(-x^2))^(1/2), it is that of a
 * normal number with the variance 1/(k D^2/k_B T+3/2), times (y/sinh y)^(1/2) with y = x^2/2. At least 97.7 % of
 * candidates are accepted, however soft the segment is.
 */
template <int W> void drawFeneCoordinates(const NoiseKey& key, const NoisePlaces<W>& places,
        typename Lanes<W>::Type stiffness, typename Lanes<W>::Type& coordinates) {
    typedef typename Lanes<W>::Type Real;
    typedef typename Lanes<W>::Bits Bits;
    const Words<W, 1> words = wordsOf<W, 1>(key, NoiseKind::Length, places, 0);
    Real uniforms = uniformOf<W>(words.word[0][2], words.word[0][3]), deviation = 1/root(stiffness+Scalar(1.5));
    coordinates = coordinates*deviation;
    Real half = 0.5*coordinates*coordinates, surely = 1-half*half*Scalar(1.0/12);
    for (int i = 0; i < W; i++) {
        double uniform = lane(uniforms, i), y = lane(half, i);
        if (uniform <= lane(surely, i))
            continue;
        Bits chain = places.chain, part = places.part;
        for (std::uint32_t draw = 1; uniform > std::sqrt(y/std::sinh(y)); draw++) {
            double normals[2];
            drawCandidate(key, NoiseKind::Length, reinterpret_cast<Word*>(&chain)[i], reinterpret_cast<Word*>(&part)[i],
                    draw, normals, uniform);
            lane(coordinates, i) = normals[0]*lane(deviation, i);
            y = 0.5*lane(coordinates, i)*lane(coordinates, i);
        }
    }
}

namespace {

/** Those that come after W lanes. In single precision, there are all lanes or one. */
#ifdef CYLCHAIN_SINGLE_PRECISION
template <int W> const int SMALLER_LANES = 1;
#else
template <int W> const int SMALLER_LANES = W/2;
#endif

/** Call a function for places in as many lanes as possible. */
template <int W, class Function> void forPlaces(const std::uint32_t* chains, const std::uint32_t* parts, int first,
        int count, Function function) {
    for (; first+W <= count; first += W) {
        NoisePlaces<W> places;
        for (int i = 0; i < W; i++) {
            reinterpret_cast<Word*>(&places.chain)[i] = chains[first+i];
            reinterpret_cast<Word*>(&places.part)[i] = parts[first+i];
        }
        function(places, first);
    }
    if constexpr (W > 1)
        forPlaces<SMALLER_LANES<W>>(chains, parts, first, count, function);
}

template <int W> std::integral_constant<int, W> lanesOf(const NoisePlaces<W>&) {
    return {};
}

} // namespace

void drawNormalsOf(const NoiseKey& key, NoiseKind kind, const std::uint32_t* chains, const std::uint32_t* parts,
        int count, double* normals) {
    forPlaces<CYLCHAIN_LANES>(chains, parts, 0, count, [&] (const auto& places, int first) {
        constexpr int W = decltype(lanesOf(places))();
        typename Lanes<W>::Type drawn[4];
        drawNormals<W, 2>(key, kind, places, drawn);
        for (int k = 0; k < 4; k++)
            for (int i = 0; i < W; i++)
                normals[4*(first+i)+k] = lane(drawn[k], i);
    });
}

#ifndef CYLCHAIN_SINGLE_PRECISION

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

#endif

#define CYLCHAIN_INSTANTIATE_NORMALS(W, PAIRS) \
    template void drawNormals<W, PAIRS>(const NoiseKey&, NoiseKind, const NoisePlaces<W>&, Lanes<W>::Type*);
#define CYLCHAIN_INSTANTIATE_NOISE(W) \
    CYLCHAIN_INSTANTIATE_NORMALS(W, 1) \
    CYLCHAIN_INSTANTIATE_NORMALS(W, 2) \
    CYLCHAIN_INSTANTIATE_NORMALS(W, 3) \
    CYLCHAIN_INSTANTIATE_NORMALS(W, 4) \
    template void drawCandidates<W>(const NoiseKey&, NoiseKind, const NoisePlaces<W>&, Lanes<W>::Type*, \
            Lanes<W>::Type&); \
    template void drawFeneCoordinates<W>(const NoiseKey&, const NoisePlaces<W>&, Lanes<W>::Type, Lanes<W>::Type&);

CYLCHAIN_INSTANTIATE_NOISE(1)
#ifdef CYLCHAIN_SINGLE_PRECISION
CYLCHAIN_INSTANTIATE_NOISE(CYLCHAIN_LANES)
#else
CYLCHAIN_INSTANTIATE_NOISE(2)
#if CYLCHAIN_LANES > 2
CYLCHAIN_INSTANTIATE_NOISE(4)
#endif
#if CYLCHAIN_LANES > 4
CYLCHAIN_INSTANTIATE_NOISE(8)
#endif
#endif

} // namespace CYLCHAIN_LOOPS
} // namespace cylchain
