#include "networks/Gap.h"
#include <algorithm>
#include <cmath>
#include <vector>

using namespace cylchain;
using namespace std;

namespace {

/** The limits of the depth of hard surfaces, over the thermal one. */
const double LEAST_LIMIT = 3, LARGEST_LIMIT = 9;
/** What is deeper than this, over the same, may come out in one step. */
const double FREE_DEPTH = 10;
/** Chains of links and linkers are numbers of forces: with this bit, the numbers are those of gaps. */
const uint32_t OF_GAPS = 0x80000000u;
/** What sets apart the numbers of each part. */
const uint32_t OF_PARTS = 0x85EBCA6Bu;
/** Draws that normal numbers are not made of. */
const int OF_SURFACES = 1, OF_LIMITS = 2;

double uniformOf(uint32_t word) {
    return (word+0.5)/4294967296.0;
}

} // namespace

GapNoise::GapNoise(const NoiseKey& step) : step(step) {
    uint32_t words[4];
    drawWords(step, NoiseKind::Link, OF_LIMITS, &OF_GAPS, &OF_GAPS, 1, words);
    limit = LEAST_LIMIT+(LARGEST_LIMIT-LEAST_LIMIT)*uniformOf(words[0]);
}

void GapNoise::drawSurfaces(const uint32_t* first, const uint32_t* second, int count, double* variates) const {
    static thread_local vector<uint32_t> chains, words;
    chains.resize(count);
    words.resize(4*(size_t) count);
    for (int i = 0; i < count; i++)
        chains[i] = first[i] | OF_GAPS;
    drawWords(step, NoiseKind::Link, OF_SURFACES, chains.data(), second, count, words.data());
    for (int i = 0; i < count; i++)
        variates[i] = -log(uniformOf(words[4*i]));
}

void GapNoise::draw(const Gap* gaps, int count, int parts, double* bridges, double* reflections) const {
    static thread_local vector<uint32_t> chains, keys;
    static thread_local vector<double> normals;
    chains.resize(count);
    keys.resize(count);
    normals.resize(4*(size_t) count);
    for (int part = 0; part < parts; part++) {
        for (int i = 0; i < count; i++) {
            chains[i] = (gaps[i].key[0]+part*OF_PARTS) | OF_GAPS;
            keys[i] = gaps[i].key[1];
        }
        drawNormals(step, NoiseKind::Link, chains.data(), keys.data(), count, normals.data());
        // Both places have two: one for the bridge, and one for the reflection.
        for (int i = 0; i < count; i++)
            for (int side = 0; side < 2; side++) {
                bridges[(2*i+side)*parts+part] = normals[4*i+2*side];
                reflections[(2*i+side)*parts+part] = normals[4*i+2*side+1];
            }
    }
}

double cylchain::placeHardSurface(double kT, double limit, double variate, double deepest, double begun,
        Gap& gap) {
    gap.start = begun;
    if (kT == 0) {
        gap.law = GapLaw::SpringBehind;
        return 0;
    }
    const double variance = kT/gap.stiffness, inside = min(begun, 0.0);
    const double largest = min(deepest, limit*sqrt(variance));
    if (begun < -largest) {
        gap.law = GapLaw::Spring;
        gap.ceiling = begun < -FREE_DEPTH*sqrt(variance) ? HUGE_VAL : -largest;
        return 0;
    }
    gap.law = GapLaw::Reflection;
    const double depth = min(sqrt(inside*inside+2*variance*variate), largest);
    gap.start = begun+depth;
    return depth;
}
