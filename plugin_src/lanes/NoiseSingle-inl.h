// Included into the namespace of an instruction set. It does not compile alone.

/**
 * The words of the random number generator in lanes of 32 bits, and normal numbers of them in single precision: those
 * of NoiseDouble-inl.h but for rounding.
 */

/** Lanes of 64 bits for every other lane of 32 bits. */
template <int W> struct EveryOther {
    typedef std::uint64_t Type __attribute__((vector_size(4*W)));
};

/** The product of numbers of 32 bits. Compilers do not find the instruction for it themselves. */
template <int W> CYLCHAIN_INLINE typename EveryOther<W>::Type product(typename EveryOther<W>::Type a, std::uint32_t b) {
    typedef typename EveryOther<W>::Type Bits;
    const Bits all = (std::uint64_t) b+Bits{};
#ifdef CYLCHAIN_X86_64
    if constexpr (W == 4)
        return (Bits) _mm_mul_epu32((__m128i) a, (__m128i) all);
#if CYLCHAIN_LANES > 4
    if constexpr (W == 8)
        return (Bits) _mm256_mul_epu32((__m256i) a, (__m256i) all);
#endif
#if CYLCHAIN_LANES > 8
    if constexpr (W == 16)
        return (Bits) _mm512_maskz_mul_epu32(-1, (__m512i) a, (__m512i) all);
#endif
#endif
    return (a&0xffffffffULL)*all;
}

inline void philoxOfOne(std::uint32_t* c, std::uint32_t seed, std::uint32_t stream) {
    for (int round = 0; round < 10; round++) {
        const std::uint64_t first = (std::uint64_t) c[0]*0xD2511F53u, second = (std::uint64_t) c[2]*0xCD9E8D57u;
        const std::uint32_t next[] = {(std::uint32_t) (second>>32)^c[1]^seed, (std::uint32_t) second,
                (std::uint32_t) (first>>32)^c[3]^stream, (std::uint32_t) first};
        std::copy(next, next+4, c);
        seed += 0x9E3779B9u;
        stream += 0xBB67AE85u;
    }
}

/** The words of the draws from a first one on. */
template <int W, int DRAWS> CYLCHAIN_INLINE Words<W, DRAWS> wordsOf(const NoiseKey& key, NoiseKind kind,
        const NoisePlaces<W>& places, std::uint32_t firstDraw) {
    Words<W, DRAWS> words;
    std::uint32_t streams[DRAWS];
    for (int draw = 0; draw < DRAWS; draw++)
        streams[draw] = NoiseKey::streamOf(kind, key.level, firstDraw+draw);
    if constexpr (W == 1) {
        for (int draw = 0; draw < DRAWS; draw++) {
            std::uint32_t* const c = words.word[draw];
            c[0] = places.part;
            c[1] = places.chain;
            c[2] = (std::uint32_t) key.step;
            c[3] = (std::uint32_t) (key.step>>32);
            philoxOfOne(c, key.seed, streams[draw]);
        }
    }
    else {
        // The even lanes and the odd ones, in 64 bits each, of which the upper half does not count.
        typedef typename EveryOther<W>::Type Bits;
        Bits halves[DRAWS][2][4];
        for (int draw = 0; draw < DRAWS; draw++)
            for (int odd = 0; odd < 2; odd++) {
                Bits* const c = halves[draw][odd];
                c[0] = reinterpreted<Bits>(places.part)>>(32*odd);
                c[1] = reinterpreted<Bits>(places.chain)>>(32*odd);
                c[2] = key.step+Bits{};
                c[3] = (key.step>>32)+Bits{};
            }
        std::uint32_t seed = key.seed, bump = 0;
        for (int round = 0; round < 10; round++) {
            for (int draw = 0; draw < DRAWS; draw++)
                for (int odd = 0; odd < 2; odd++) {
                    Bits* const c = halves[draw][odd];
                    const Bits first = product<W>(c[0], 0xD2511F53), second = product<W>(c[2], 0xCD9E8D57);
                    c[0] = (second>>32)^c[1]^(std::uint64_t) seed;
                    c[1] = second;
                    c[2] = (first>>32)^c[3]^(std::uint64_t) (std::uint32_t) (streams[draw]+bump);
                    c[3] = first;
                }
            seed += 0x9E3779B9u;
            bump += 0xBB67AE85u;
        }
        for (int draw = 0; draw < DRAWS; draw++)
            for (int k = 0; k < 4; k++)
                words.word[draw][k] = reinterpreted<typename Lanes<W>::Bits>(
                        (halves[draw][0][k]&0xffffffffULL)|(halves[draw][1][k]<<32));
    }
    return words;
}

template <int W> CYLCHAIN_INLINE typename Lanes<W>::Type converted(typename Lanes<W>::Bits bits) {
    if constexpr (W == 1)
        return (std::int32_t) bits;
    else {
        typedef std::int32_t Signed __attribute__((vector_size(4*W)));
        return __builtin_convertvector(reinterpreted<Signed>(bits), typename Lanes<W>::Type);
    }
}

/** A pair of normal numbers, with polynomials of fewer terms. */
template <int W> CYLCHAIN_INLINE void normalsOf(typename Lanes<W>::Bits a, typename Lanes<W>::Bits b,
        typename Lanes<W>::Type* normals) {
    typedef typename Lanes<W>::Type Real;
    typedef typename Lanes<W>::Bits Bits;
    // The distance of u from zero or from one, whichever is nearer. A float would round it away where u is near to one.
    const Bits upper = Bits{}-(a>>31), near = a^upper, low = (b>>24)^(upper&0xff);
    const Real distance = converted<W>(near)*2.3283064365386963e-10f+(converted<W>(low)+0.5f)*9.094947017729282e-13f;
    const Real one = splat<Real>(1);
    const Real u =
            reinterpreted<Real>((reinterpreted<Bits>(distance)&~upper)|(reinterpreted<Bits>(one-distance)&upper));
    // u = 2^k m
    const Bits shifted = reinterpreted<Bits>(u)-0x3f3504f3u, k = shifted>>23;
    const Real m = reinterpreted<Real>((shifted&0x7fffffu)+0x3f3504f3u);
    // m-1, which is the distance itself where u is its difference from one, and m as well.
    const Bits itself = upper&(Bits{}-(((shifted>>31)^1u)&1u));
    const Real f =
            reinterpreted<Real>((reinterpreted<Bits>(m-1)&~itself)|(reinterpreted<Bits>(Real{}-distance)&itself));
    const Real s = f/(2+f), z = s*s;
    const Real series = 4.0f+z*(1.3333334f+z*(0.7999921f+z*0.5764569f));
    // k has nine bits and a sign.
    const Real power = converted<W>((k^0x100u)-0x100u);
    const Real square = Real{}-power*1.3862944f-s*series;
    const Real radius = root(square > 0 ? square : Real{});

    const Bits steps = ((b&0x3fffffu)<<1)|1u;
    const Real angle = converted<W>(steps-4194304u)*1.8725351e-07f; // pi/2^24
    const Real angleSquared = angle*angle;
    const Real sine = angle*(1.0f+angleSquared*(-0.16666655f+angleSquared*(0.008332161f+angleSquared*-0.00019515296f)));
    const Real cosine = 1.0f+angleSquared*(-0.5f+angleSquared*(0.041666646f+angleSquared*(-0.0013887316f+
            angleSquared*2.4433157e-05f)));
    const Bits first = reinterpreted<Bits>(radius*cosine)^((b<<9)&0x80000000u);
    const Bits second = reinterpreted<Bits>(radius*sine);
    const Bits exchanged = (first^second)&(Bits{}-((b>>23)&1u));
    normals[0] = reinterpreted<Real>(first^exchanged);
    normals[1] = reinterpreted<Real>(second^exchanged);
}

/** A number between 0 and 1, neither of which it ever is. */
template <int W> CYLCHAIN_INLINE typename Lanes<W>::Type uniformOf(typename Lanes<W>::Bits a, typename Lanes<W>::Bits) {
    return (converted<W>(a>>9)+0.5f)*1.1920929e-07f; // 2^-23
}
