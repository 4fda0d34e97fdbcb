#include "dynamics/Gap.h"
#include <algorithm>
#include <cmath>

using namespace cylchain;
using namespace std;

namespace {

/** The limits of the depth of hard surfaces, over the thermal one. */
const double LEAST_LIMIT = 3, LARGEST_LIMIT = 9;
/** What is deeper than this, over the same, may come out in one step. */
const double FREE_DEPTH = 10;
/** Chains of links and linkers are numbers of forces: with this bit, the numbers are those of gaps. */
const uint32_t OF_GAPS = 0x80000000u;
/** The first draw of those of parts. */
const int FIRST_PART = 1;

double uniformOf(uint32_t word) {
    return (word+0.5)/4294967296.0;
}

} // namespace

void GapNoise::drawFour(const Gap& gap, int draw, uint32_t* words) const {
    const uint32_t chain = gap.key[0] | OF_GAPS, part = gap.key[1];
    drawWords(step, NoiseKind::Link, draw, &chain, &part, 1, words);
}

SurfaceVariates GapNoise::drawSurface(const Gap& gap) const {
    uint32_t words[4];
    drawFour(gap, 0, words);
    return {-log(uniformOf(words[0])), uniformOf(words[1])};
}

void GapNoise::draw(const Gap* gaps, int count, int parts, double* bridges, double* reflections) const {
    vector<uint32_t> chains(count), keys(count), words(4*(size_t) count);
    for (int i = 0; i < count; i++) {
        chains[i] = gaps[i].key[0] | OF_GAPS;
        keys[i] = gaps[i].key[1];
    }
    // Each draw has two numbers for both places: one for the bridge, and one for the reflection.
    for (int part = 0; part < parts; part++) {
        drawWords(step, NoiseKind::Link, FIRST_PART+part, chains.data(), keys.data(), count, words.data());
        for (int i = 0; i < count; i++)
            for (int side = 0; side < 2; side++) {
                const uint32_t* const own = &words[4*i+2*side];
                const double size = sqrt(-2*log(uniformOf(own[0]))), angle = 2*M_PI*uniformOf(own[1]);
                bridges[(2*i+side)*parts+part] = size*cos(angle);
                reflections[(2*i+side)*parts+part] = size*sin(angle);
            }
    }
}

double cylchain::placeHardSurface(double kT, const SurfaceVariates& variates, double deepest, double begun,
        Gap& gap) {
    gap.start = begun;
    if (kT == 0) {
        gap.law = GapLaw::SpringBehind;
        return 0;
    }
    const double variance = kT/gap.stiffness, inside = min(begun, 0.0);
    const double random = LEAST_LIMIT+(LARGEST_LIMIT-LEAST_LIMIT)*variates.uniform;
    const double limit = min(deepest, random*sqrt(variance));
    if (begun < -limit) {
        gap.law = GapLaw::Spring;
        gap.ceiling = begun < -FREE_DEPTH*sqrt(variance) ? HUGE_VAL : -limit;
        return 0;
    }
    gap.law = GapLaw::Reflection;
    const double depth = min(sqrt(inside*inside+2*variance*variates.exponential), limit);
    gap.start = begun+depth;
    return depth;
}
