// Included into the namespace of an instruction set. It does not compile alone.

/**
 * The words of the random number generator in lanes of 64 bits, and normal numbers of them in double precision.
 */

// Adding 2^52 in the exponent's place turns up to 52 bits into a double.
const std::uint64_t INTEGER = 0x4330000000000000ULL;
const double TWO_TO_52 = 4503599627370496.0;
const std::uint64_t LOW_HALF = 0xffffffffULL;

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

template <int W, int DRAWS> CYLCHAIN_INLINE void philox(Words<W, DRAWS>& words, std::uint32_t seed,
        const std::uint32_t* streams) {
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
template <int W> CYLCHAIN_INLINE typename Lanes<W>::Type uniformOf(typename Lanes<W>::Bits a,
        typename Lanes<W>::Bits b) {
    typedef typename Lanes<W>::Type Real;
    const typename Lanes<W>::Bits odd = (a<<20)|(b>>12)|1;
    return (reinterpreted<Real>(odd|INTEGER)-TWO_TO_52)*(1/TWO_TO_52);
}
