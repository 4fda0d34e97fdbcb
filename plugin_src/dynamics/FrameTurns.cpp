#include "dynamics/FrameTurns.h"
#include <algorithm>
#include <cmath>

using namespace cylchain;
using namespace std;

namespace {

/** The most segments of a block. */
const int SEGMENTS_OF_BLOCK = 128;
/** How often a block is linearised around the minimum that it had before, with noise and without. */
const int LINEARISATIONS = 2, LINEARISATIONS_WITHOUT_NOISE = 12;
/**
 * The largest variance of the random turn of a block as a whole, in radians^2; further ones take more parts, and beyond
 * this many of them, turns are slower than they should be.
 */
const double LARGEST_VARIANCE = 0.5;
const int MOST_PARTS_OF_STEP = 8;
/** So many draws make the normal numbers of a place. */
const uint32_t DRAWS_OF_NORMALS = 2;

} // namespace

void FrameTurns::begin(int segments, bool isClosed, double thermalEnergy) {
    count = segments;
    closed = isClosed;
    kT = thermalEnergy;
    joints.assign(count+1, Joint());
    stiffnesses.resize(count);
    targets.assign(count, 0.0);
    turns.assign(count, 0.0);
    for (vector<double>* values : {&diagonal, &coupling, &right, &found, &border})
        values->resize(SEGMENTS_OF_BLOCK);
    parabolas.resize(SEGMENTS_OF_BLOCK+1);
}

void FrameTurns::draw(const NoiseKey& key, uint32_t chain, int part) {
    vector<uint32_t> chains(count, chain), places(count);
    for (int s = 0; s < count; s++)
        places[s] = part*count+s;
    normals.resize(4*count);
    drawNormals(key, NoiseKind::Node, chains.data(), places.data(), count, normals.data());
}

void FrameTurns::take(const NoiseKey& key, uint32_t chain) {
    const double scale = kT > 0 ? 1/kT : 1;
    for (Joint& own : joints)
        own = {own.stiffness*scale, own.torque*scale, own.cosine*scale, own.sine*scale};
    double largest = 0;
    for (double& own : stiffnesses) {
        own *= scale;
        largest = max(largest, 1/own);
    }
    const double perPart = LARGEST_VARIANCE*min(count, SEGMENTS_OF_BLOCK);
    const int parts = kT > 0 ? min<double>(MOST_PARTS_OF_STEP, ceil(largest/perPart)) : 1;
    for (double& own : stiffnesses)
        own = kT > 0 ? max(parts*own, 1/perPart) : own;
    for (int part = 0; part < parts; part++) {
        if (kT > 0)
            draw(key, chain, part);
        for (int s = 0; s < count && kT > 0; s++)
            targets[s] = turns[s]+normals[4*s]/sqrt(stiffnesses[s]);
        sweep(key, chain, part);
    }
}

void FrameTurns::sweep(const NoiseKey& key, uint32_t chain, int part) {
    const int sweeps = count <= SEGMENTS_OF_BLOCK ? 1 : 2;
    for (int number = 0; number < sweeps; number++) {
        // Blocks of the second sweep reach over the ends of those of the first, and around rings.
        const int shift = number == 0 ? 0 : SEGMENTS_OF_BLOCK/2;
        const int end = count+(closed ? shift : 0);
        for (int first = closed ? shift : 0, next; first < end; first = next) {
            next = min(end, first+(first == 0 && shift > 0 ? shift : SEGMENTS_OF_BLOCK));
            const double excess = turnBlock(first, next-first, number);
            if (!(excess > 0))
                continue;
            const uint32_t place = first;
            uint32_t words[4];
            drawWords(key, NoiseKind::Node, DRAWS_OF_NORMALS+2*part+number, &chain, &place, 1, words);
            if ((words[0]+0.5)*0x1p-32 >= exp(-excess))
                swapBlock(first, next-first);
        }
    }
}

/** Exchange the turns of a block for those that have been found. */
void FrameTurns::swapBlock(int first, int length) {
    for (int i = 0; i < length; i++)
        swap(found[i], turns[segmentOf(first+i)]);
}

/** Turn a block, and find by how much that must be worth more to be accepted in any case. */
double FrameTurns::turnBlock(int first, int length, int number) {
    linearise(first, length, false);
    solve(first, length, NULL);
    const int times = kT > 0 ? LINEARISATIONS : LINEARISATIONS_WITHOUT_NOISE;
    for (int i = 0; i < times; i++) {
        linearise(first, length, true);
        solve(first, length, i == times-1 && kT > 0 ? &normals[number+1] : NULL);
    }
    const double lacking = findLacking(first, length);
    swapBlock(first, length);
    return kT > 0 ? lacking-findLacking(first, length) : 0;
}

/** Find the quadratic energy of a block, with that of bends as it is where the block has been found. */
void FrameTurns::linearise(int first, int length, bool withBends) {
    const bool isRing = closed && length == count;
    for (int i = 0; i < length; i++) {
        const int s = segmentOf(first+i);
        diagonal[i] = stiffnesses[s];
        right[i] = stiffnesses[s]*targets[s];
        border[i] = 0;
    }
    for (int i = 0; i <= length-(isRing ? 1 : 0); i++) {
        const Joint& own = jointBefore(first+i);
        const int before = i > 0 ? i-1 : isRing ? length-1 : -1, behind = i < length ? i : -1;
        const double turn1 = before >= 0 ? found[before] : turnBeside(first-1);
        const double turn2 = behind >= 0 ? found[behind] : turnBeside(first+length);
        Parabola bend = {0, 0};
        if (withBends) {
            const double mean = 0.5*(turn1+turn2), cosine = cos(mean), sine = sin(mean);
            bend.curvature = max(0.0, own.cosine*cosine+own.sine*sine);
            bend.slope = own.cosine*sine-own.sine*cosine-bend.curvature*mean;
        }
        parabolas[i] = bend;
        const double both = 0.25*bend.curvature-own.stiffness, each = 0.25*bend.curvature+own.stiffness;
        if (before >= 0) {
            diagonal[before] += each;
            right[before] += own.torque-0.5*bend.slope-(behind >= 0 ? 0 : both*turn2);
        }
        if (behind >= 0) {
            diagonal[behind] += each;
            right[behind] += -own.torque-0.5*bend.slope-(before >= 0 ? 0 : both*turn1);
        }
        if (i > 0 && i < length)
            coupling[i] = both;
        else if (isRing)
            border[0] = both;
    }
}

/** Find the minimum of a block, or draw from its Gaussian, with the first of normal numbers of each segment. */
void FrameTurns::solve(int first, int length, const double* random) {
    const int last = length-1;
    for (int i = 0; i < last; i++) {
        // The border couples a segment to the last one of a ring.
        if (i == last-1)
            coupling[last] += border[i];
        else if (border[i] != 0) {
            const double factor = border[i]/diagonal[i];
            diagonal[last] -= factor*border[i];
            right[last] -= factor*right[i];
            border[i+1] -= factor*coupling[i+1];
        }
        const double factor = coupling[i+1]/diagonal[i];
        diagonal[i+1] -= factor*coupling[i+1];
        right[i+1] -= factor*right[i];
    }
    for (int i = last; i >= 0; i--) {
        double value = right[i];
        if (i < last)
            value -= coupling[i+1]*found[i+1];
        if (i < last-1)
            value -= border[i]*found[last];
        found[i] = value/diagonal[i];
        if (random != NULL)
            found[i] += random[4*segmentOf(first+i)]/sqrt(diagonal[i]);
    }
}

/** Find what the quadratic energy lacks of that of the bends of a block. */
double FrameTurns::findLacking(int first, int length) const {
    const bool isRing = closed && length == count;
    double result = 0;
    for (int i = 0; i <= length-(isRing ? 1 : 0); i++) {
        const Joint& own = jointBefore(first+i);
        const double turn1 = i > 0 ? found[i-1] : isRing ? found[length-1] : turnBeside(first-1);
        const double turn2 = i < length ? found[i] : turnBeside(first+length), mean = 0.5*(turn1+turn2);
        result -= own.cosine*cos(mean)+own.sine*sin(mean)+
                (parabolas[i].slope+0.5*parabolas[i].curvature*mean)*mean;
    }
    return result;
}

double FrameTurns::changeOf(int number) const {
    if (!closed)
        return (number < count ? turns[number] : 0)-(number > 0 ? turns[number-1] : 0);
    return turns[segmentOf(number)]-(number > 0 ? turns[number-1] : 0);
}
