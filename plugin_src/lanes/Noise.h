#ifndef CYLCHAIN_NOISE_H_
#define CYLCHAIN_NOISE_H_

#include <cstdint>

namespace cylchain {

/**
 * What random numbers are for: numbers of different kinds are independent. The numbers belong to a place, which is a
 * chain and one of its parts.
 */
enum class NoiseKind : std::uint32_t {
    /** Of a segment: six for its forces, and the first candidate for its length. */
    Segment = 0,
    /** Of a segment: whether candidates for its length are accepted, and further ones. */
    Length = 1,
    /** Of the joint at the start of a segment: candidates for its bend, and whether they are accepted. */
    Bend = 2,
    /** Of a tether, by its number among those of its chain; behind these, two of the frames at the chain's ends. */
    Tether = 3,
    /** Of a particle outside chains, by its index, with zero for the chain. */
    Particle = 4,
    /**
     * Of a node: three for the force on it, one for the length behind it if segments have none, three for its bend. Of
     * a mode, by its number, where modes are what is moved: three for its motion.
     */
    Node = 5,
    /** Of a link between places of chains, by its number, with that of its force for the chain: for its coordinates. */
    Link = 6,
    /** Of a linker that binds and unbinds, by its number, with that of its force for the chain: when, where and how. */
    Linker = 7
};

/**
 * The random numbers of a step. Each of them is a function of the seed, the kind, the level, the number of the step at
 * that level, the chain, its part and the number of the draw, and of nothing else: not of the instruction set, of which
 * chains share a pack, of threads, or of how many numbers were rejected elsewhere.
 *
 * The generator is Philox 4x32-10 of Salmon, Moraes, Dror and Shaw, Proc. SC 2011, doi:10.1145/2063384.2063405. The
 * counter is (part, chain, low half of the step, high half of the step); the key is (seed, kind 2^29 + level 2^24 +
 * draw). Each call gives four words w0 to w3 of 32 bits.
 *
 * Two normal numbers come from two words a and b by the method of Box and Muller, Ann. Math. Stat. 1958, 29, 610. Their
 * distance from the origin is r = (-2 ln u)^(1/2) with u = (2 R+1)/2^41, where R is a followed by the upper eight bits
 * of b: up to 7.5. Their direction comes from the other 24 bits of b: the lowest 22, J, make an angle
 * (2 J+1-2^22) pi/2^24, the next one reverses the x axis and the highest one swaps the axes. The polynomials for all
 * this, in NoiseDouble-inl.h, are good to 10^-11. Draw 0 gives the normal numbers 0 and 1 from w0 and w1, and 2 and 3
 * from w2 and w3; draw 1 gives the next four. All this takes integers and operations that IEEE 754 rounds correctly,
 * without fused multiplication and addition, so that all instruction sets give the same bits, and others can. Single
 * precision has fewer bits of the same numbers.
 *
 * Levels make steps of different sizes follow the same Brownian path, by Levy's construction. A normal number x of a
 * step m at level l > 0 comes from that of the step m/2, rounded down, at the level below, and from another one, e, of
 * that same step which is drawn at level l:
 *
 *     x(l, m) = (x(l-1, m/2) + e(l, m/2)) / 2^(1/2)    if m is even,
 *     x(l, m) = (x(l-1, m/2) - e(l, m/2)) / 2^(1/2)    if m is odd.
 *
 * They are independent, and the mean of two steps, times 2^(1/2), is that of the one above. Candidates that follow a
 * rejected one are drawn at the level of the step itself.
 */
struct NoiseKey {
    std::uint32_t seed;
    /** From 0 to 31. */
    std::uint32_t level;
    /** The number of the step at this level. */
    std::uint64_t step;
    /** The second word of the key. */
    static std::uint32_t streamOf(NoiseKind kind, std::uint32_t level, std::uint32_t draw) {
        return (std::uint32_t) kind<<29 | level<<24 | draw;
    }
};

/** Draw the four words of Philox for places: pairs of a chain and its part. */
void drawWords(const NoiseKey& key, NoiseKind kind, std::uint32_t draw, const std::uint32_t* chains,
        const std::uint32_t* parts, int count, std::uint32_t* words);

/** Draw the normal numbers 0 to 3 of places. */
void drawNormals(const NoiseKey& key, NoiseKind kind, const std::uint32_t* chains, const std::uint32_t* parts,
        int count, double* normals);

/** The same as wide packs draw them, in single precision. */
void drawNormalsInSinglePrecision(const NoiseKey& key, NoiseKind kind, const std::uint32_t* chains,
        const std::uint32_t* parts, int count, double* normals);

/**
 * Draw extensions of FENE segments from equilibrium, as coordinates q with the energy k q^2/2 over the maximum
 * extension D.
 *
 * @param stiffness  k D^2/k_B T of each segment
 */
void drawFeneCoordinates(const NoiseKey& key, const std::uint32_t* chains, const std::uint32_t* segments,
        const double* stiffness, int count, double* coordinates);

} // namespace cylchain

#endif /*CYLCHAIN_NOISE_H_*/
