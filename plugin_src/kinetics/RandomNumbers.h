#ifndef CYLCHAIN_RANDOM_NUMBERS_H_
#define CYLCHAIN_RANDOM_NUMBERS_H_

#include "lanes/Noise.h"
#include <cmath>
#include <cstdint>

namespace cylchain {

/** The random numbers of a linker in a step, one after the other: draws 0, 1, ... of its place, see NoiseKey. */
class RandomNumbers {
public:
    RandomNumbers(const NoiseKey& key, std::uint32_t force, std::uint32_t number) : key(key), force(force),
            number(number) {
    }
    /** A number between 0 and 1, neither of which it is. */
    double uniform() {
        if (left == 0) {
            drawWords(key, NoiseKind::Linker, draw++, &force, &number, 1, words);
            left = 4;
        }
        left -= 2;
        return numberOf(words[left], words[left+1]);
    }
    /** A number with an exponential distribution, the mean of which is 1. */
    double exponential() {
        return -std::log(uniform());
    }
private:
    static double numberOf(std::uint32_t high, std::uint32_t low) {
        const std::uint64_t bits = static_cast<std::uint64_t>(high)<<32|low;
        return (static_cast<double>(bits>>12)+0.5)*0x1p-52;
    }
    NoiseKey key;
    std::uint32_t force, number, draw = 0, words[4];
    int left = 0;
};

} // namespace cylchain

#endif /*CYLCHAIN_RANDOM_NUMBERS_H_*/
