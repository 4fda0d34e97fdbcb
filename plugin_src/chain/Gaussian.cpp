#include "Gaussian.h"
#include <cmath>

using namespace cylchain;

namespace {

struct Ziggurat {
    static constexpr double tail = 3.6541528853610088;
    GaussianStream::Layer layers[256];
    double height[256];
    Ziggurat() {
        const double units = 4503599627370496.0; // 2^52
        const double area = tail*std::exp(-0.5*tail*tail)+std::sqrt(0.5*M_PI)*std::erfc(tail*M_SQRT1_2);
        const double base = area/std::exp(-0.5*tail*tail);
        double edge = tail, previous = tail;
        layers[0] = {base/units, std::floor(tail/base*units)};
        height[0] = 1;
        layers[1].inside = 0;
        layers[255].width = tail/units;
        height[255] = std::exp(-0.5*tail*tail);
        for (int i = 254; i >= 1; i--) {
            edge = std::sqrt(-2*std::log(area/edge+std::exp(-0.5*edge*edge)));
            layers[i+1].inside = std::floor(edge/previous*units);
            previous = edge;
            layers[i].width = edge/units;
            height[i] = std::exp(-0.5*edge*edge);
        }
    }
};

const Ziggurat& ziggurat() {
    static const Ziggurat table;
    return table;
}

std::uint64_t mixed(std::uint64_t x) {
    x += 0x9e3779b97f4a7c15ULL;
    x = (x^(x>>30))*0xbf58476d1ce4e5b9ULL;
    x = (x^(x>>27))*0x94d049bb133111ebULL;
    return x^(x>>31);
}

inline std::uint64_t rotated(std::uint64_t x, int k) {
    return (x<<k)|(x>>(64-k));
}

inline std::uint64_t bitsOf(std::uint64_t state[4]) {
    const std::uint64_t result = rotated(state[0]+state[3], 23)+state[0];
    const std::uint64_t t = state[1]<<17;
    state[2] ^= state[0];
    state[3] ^= state[1];
    state[1] ^= state[2];
    state[0] ^= state[3];
    state[2] ^= t;
    state[3] = rotated(state[3], 45);
    return result;
}

inline double fraction(std::uint64_t bits) {
    return (bits>>11)*(1.0/9007199254740992.0);
}

} // namespace

GaussianStream::GaussianStream(std::uint64_t seed, std::uint64_t step, std::uint64_t index) {
    std::uint64_t x = mixed(mixed(mixed(seed)^step)^index);
    for (std::uint64_t& word : state)
        word = (x = mixed(x));
}

const GaussianStream::Layer* GaussianStream::layers() {
    return ziggurat().layers;
}

void GaussianStream::fill(double* values, int count) {
    const Layer* table = layers();
    for (int i = 0; i < count; i++) {
        const std::uint64_t bits = bitsOf(state);
        const double magnitude = (double) (bits>>12);
        const Layer& layer = table[bits&0xff];
        const double x = magnitude*layer.width;
        if (__builtin_expect(magnitude < layer.inside, 1))
            values[i] = (bits&0x100) ? -x : x;
        else
            values[i] = finish(bits, state);
    }
}

double GaussianStream::next() {
    double value;
    fill(&value, 1);
    return value;
}

double GaussianStream::uniform() {
    return fraction(bitsOf(state));
}

double GaussianStream::finish(std::uint64_t bits, std::uint64_t state[4]) {
    const Ziggurat& table = ziggurat();
    while (true) {
        const int layer = bits&0xff;
        const double sign = (bits&0x100) ? -1.0 : 1.0;
        const double magnitude = (double) (bits>>12);
        const double x = magnitude*table.layers[layer].width;
        if (magnitude < table.layers[layer].inside)
            return sign*x;
        if (layer == 0) {
            while (true) {
                const double beyond = -std::log1p(-fraction(bitsOf(state)))/Ziggurat::tail;
                const double y = -std::log1p(-fraction(bitsOf(state)));
                if (2*y > beyond*beyond)
                    return sign*(Ziggurat::tail+beyond);
            }
        }
        const double top = table.height[layer-1], bottom = table.height[layer];
        if (bottom+(top-bottom)*fraction(bitsOf(state)) < std::exp(-0.5*x*x))
            return sign*x;
        bits = bitsOf(state);
    }
}
