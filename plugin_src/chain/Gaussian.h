#ifndef CYLCHAIN_GAUSSIAN_H_
#define CYLCHAIN_GAUSSIAN_H_

#include <cstdint>

namespace cylchain {

/**
 * A stream of independent standard normal numbers that is a function of three numbers alone: for instance of a seed,
 * the number of a time step and the number of a chain. Streams of different numbers are independent.
 *
 * The generator is xoshiro256++ of Blackman and Vigna, ACM Trans. Math. Softw. 2021, 47, 36, and the method the
 * ziggurat of Marsaglia and Tsang, J. Stat. Softw. 2000, 5 (8), with 256 layers and 52 random bits in a number.
 */
class GaussianStream {
public:
    /** A layer of the ziggurat: the width of a unit of the 52 bits, and the number of units that surely lie inside. */
    struct Layer {
        double width, inside;
    };
    GaussianStream() = default;
    GaussianStream(std::uint64_t seed, std::uint64_t step, std::uint64_t index);
    /** The next number. */
    double next();
    /** The next number of a stream of numbers that are uniform between 0 and 1. */
    double uniform();
    /** Fill an array. */
    void fill(double* values, int count);
    /** The state of the generator, for loops that advance several streams at once. */
    std::uint64_t state[4];
    static const Layer* layers();
    /** Finish a number whose first 64 bits, the lowest eight of them its layer, do not surely lie inside. */
    static double finish(std::uint64_t bits, std::uint64_t state[4]);
};

} // namespace cylchain

#endif /*CYLCHAIN_GAUSSIAN_H_*/
