/**
 * This tests random numbers: Philox against published answers, normal numbers against another implementation, their
 * moments, tails and correlations, Brownian paths, and FENE lengths. It passes with one checksum for all instruction
 * sets.
 */

#include "TestChains.h"
#include "lanes/Noise.h"
#include <algorithm>
#include <cstring>

typedef vector<uint32_t> Integers;

/** Philox for counters and keys that are given as such. */
static Integers philoxOf(const Integers& counter, const Integers& key, int places) {
    const NoiseKey noise = {key[0], key[1]>>24&31, (uint64_t) counter[3]<<32 | counter[2]};
    const Integers parts(places, counter[0]), chains(places, counter[1]);
    Integers words(4*places);
    drawWords(noise, (NoiseKind) (key[1]>>29), key[1]&0xffffff, chains.data(), parts.data(), places, words.data());
    return words;
}

/** The known answers of Random123 for philox4x32-10, in lanes of all widths. */
static void testKnownAnswers() {
    const vector<vector<Integers> > answers = {
        {{0, 0, 0, 0}, {0, 0}, {0x6627e8d5, 0xe169c58d, 0xbc57ac4c, 0x9b00dbd8}},
        {{0xffffffff, 0xffffffff, 0xffffffff, 0xffffffff}, {0xffffffff, 0xffffffff},
                {0x408f276d, 0x41c83b0e, 0xa20bc7c6, 0x6d5451fd}},
        {{0x243f6a88, 0x85a308d3, 0x13198a2e, 0x03707344}, {0xa4093822, 0x299f31d0},
                {0xd16cfe09, 0x94fdcceb, 0x5001e420, 0x24126ea1}}
    };
    for (const vector<Integers>& answer : answers) {
        const int places = 15;
        const Integers words = philoxOf(answer[0], answer[1], places);
        for (int i = 0; i < 4*places; i++)
            check(words[i] == answer[2][i%4], "known answer of Philox");
    }
}

/** The normal numbers of places, four for each. */
static Array normalsOf(const NoiseKey& key, NoiseKind kind, const Integers& chains, const Integers& parts) {
    Array normals(4*chains.size());
    drawNormals(key, kind, chains.data(), parts.data(), chains.size(), normals.data());
    return normals;
}

/** One place after the other. */
static Array normalsOfParts(const NoiseKey& key, NoiseKind kind, uint32_t chain, int count) {
    Integers parts(count);
    for (int i = 0; i < count; i++)
        parts[i] = i;
    return normalsOf(key, kind, Integers(count, chain), parts);
}

/** Noise.h, word by word, with the functions of the standard library. */
static void testNormalsAgainstDescription() {
    const NoiseKey key = {12345, 0, 0x123456789abcULL};
    const int count = 10000;
    const Array normals = normalsOfParts(key, NoiseKind::Tether, 77, count);
    for (int i = 0; i < count; i++) {
        const uint32_t stream = NoiseKey::streamOf(NoiseKind::Tether, 0, 0);
        const Integers w = philoxOf({(uint32_t) i, 77, 0x56789abc, 0x1234}, {12345, stream}, 1);
        for (int pair = 0; pair < 2; pair++) {
            const uint32_t a = w[2*pair], b = w[2*pair+1];
            const double u = ldexp(2.0*((uint64_t) a<<8 | b>>24)+1, -41), r = sqrt(-2*log(u));
            const double angle = (2.0*(b&0x3fffff)+1-4194304)*M_PI/16777216;
            double x = r*cos(angle), y = r*sin(angle);
            if (b>>22&1)
                x = -x;
            if (b>>23&1)
                swap(x, y);
            checkClose(x, normals[4*i+2*pair], fabs(x), 1e-11, "normal number");
            checkClose(y, normals[4*i+2*pair+1], fabs(y), 1e-11, "normal number");
        }
    }
}

/** The same numbers for all instruction sets, alone or among others, to the bit. */
static void testBits() {
    uint64_t hash = 0xcbf29ce484222325ULL;
    for (uint32_t level : {0, 3}) {
        const NoiseKey key = {2024, level, 987654321987ULL};
        const int count = 20001;
        const Array all = normalsOfParts(key, NoiseKind::Segment, 5, count);
        for (double value : all) {
            uint64_t bits;
            memcpy(&bits, &value, sizeof(bits));
            hash = (hash^bits)*0x100000001b3ULL;
        }
        for (int width : {1, 2, 4, 7, 8, 13})
            for (int first = 0; first < 200; first += width) {
                Integers chains(width, 5), parts(width);
                for (int i = 0; i < width; i++)
                    parts[i] = first+i;
                const Array some = normalsOf(key, NoiseKind::Segment, chains, parts);
                check(equal(some.begin(), some.end(), all.begin()+4*first), "numbers depend on those beside them");
            }
    }
    char text[20];
    snprintf(text, sizeof(text), "%016llx", (unsigned long long) hash);
    check(string(text) == "3560a56ffd6684f9", "bits of normal numbers have changed: "+string(text));
}

static void testMoments() {
    const int count = 4000000;
    const double expected[] = {1, 0, 1, 0, 3, 0, 15, 0, 105, 0, 945, 0, 10395};
    const double limits[] = {3, 4, 5};
    for (uint32_t level : {0, 2}) {
        const Array values = normalsOfParts({3, level, 4}, NoiseKind::Particle, 0, count/4);
        double moments[7] = {}, beyond[3] = {};
        for (double v : values) {
            double power = 1;
            for (int k = 1; k < 7; k++)
                moments[k] += (power *= v)/count;
            for (int i = 0; i < 3; i++)
                beyond[i] += fabs(v) > limits[i];
        }
        for (int k = 1; k < 7; k++)
            checkClose(expected[k], moments[k], sqrt((expected[2*k]-expected[k]*expected[k])/count), 4,
                    "moment "+to_string(k));
        for (int i = 0; i < 3; i++) {
            const double tail = erfc(limits[i]/sqrt(2.0))*count;
            checkClose(tail, beyond[i], sqrt(tail), 4, "tail beyond "+to_string(limits[i]));
        }
    }
}

/** Numbers in equal places of different streams, and their squares, are not correlated. */
static void checkUncorrelated(const Array& one, const Array& other, const string& what) {
    double product = 0, squares = 0;
    for (size_t i = 0; i < one.size(); i++) {
        product += one[i]*other[i];
        squares += (one[i]*one[i]-1)*(other[i]*other[i]-1);
    }
    checkClose(0, product/sqrt(one.size()), 1, 4.5, "correlation between neighbouring "+what);
    checkClose(0, squares/sqrt(one.size()), 2, 4.5, "correlation of squares between neighbouring "+what);
}

static void testCorrelations() {
    const int count = 250000;
    const NoiseKey key = {31, 0, 1000};
    const Array base = normalsOfParts(key, NoiseKind::Segment, 6, count);
    for (int lag = 1; lag <= 8; lag++)
        checkUncorrelated(Array(base.begin()+lag, base.end()), Array(base.begin(), base.end()-lag), "draws and parts");
    for (uint32_t chain : {7, 8, 262})
        checkUncorrelated(base, normalsOfParts(key, NoiseKind::Segment, chain, count), "chains");
    for (uint64_t step : {1001ULL, 1002ULL, 2000ULL, 1000ULL+(1ULL<<32)})
        checkUncorrelated(base, normalsOfParts({31, 0, step}, NoiseKind::Segment, 6, count), "steps");
    for (uint32_t seed : {30u, 32u, 31u+(1u<<31)})
        checkUncorrelated(base, normalsOfParts({seed, 0, 1000}, NoiseKind::Segment, 6, count), "seeds");
    for (int kind = 1; kind <= 4; kind++)
        checkUncorrelated(base, normalsOfParts(key, (NoiseKind) kind, 6, count), "kinds");
    // A step and a part that are exchanged with each other would be the same if words were mixed up.
    Integers chains(count), parts(count, 6);
    for (int i = 0; i < count; i++)
        chains[i] = i;
    checkUncorrelated(base, normalsOf(key, NoiseKind::Segment, chains, parts), "chains and parts");

    // Steps at a level are independent of each other, and as much of those above as the path demands.
    const Array first = normalsOfParts({31, 1, 2000}, NoiseKind::Segment, 6, count);
    const Array second = normalsOfParts({31, 1, 2001}, NoiseKind::Segment, 6, count);
    checkUncorrelated(first, second, "halves of a step");
    checkUncorrelated(second, normalsOfParts({31, 1, 2002}, NoiseKind::Segment, 6, count), "steps at level 1");
    checkUncorrelated(base, normalsOfParts({31, 1, 1000}, NoiseKind::Segment, 6, count), "levels");
    for (uint64_t step = 4001; step < 4004; step++)
        checkUncorrelated(normalsOfParts({31, 2, 4000}, NoiseKind::Segment, 6, count),
                normalsOfParts({31, 2, step}, NoiseKind::Segment, 6, count), "quarters of a step");
}

static void testPaths() {
    const int count = 1000;
    for (uint32_t level = 0; level < 30; level++) {
        const uint64_t step = 123456789012ULL+level;
        const Array above = normalsOfParts({9, level, step}, NoiseKind::Bend, 3, count);
        const Array first = normalsOfParts({9, level+1, 2*step}, NoiseKind::Bend, 3, count);
        const Array second = normalsOfParts({9, level+1, 2*step+1}, NoiseKind::Bend, 3, count);
        double variance = 0;
        for (int i = 0; i < 4*count; i++) {
            checkClose(above[i], (first[i]+second[i])*M_SQRT1_2, 5, 1e-15, "halves of a step");
            variance += pow(first[i]-second[i], 2)/(8*count);
        }
        checkClose(1, variance, sqrt(2.0/(4*count)), 5, "difference of halves");
    }
}

/** p(u) ~ (1-u^2)^(kappa/2) for the relative extension u, of any stiffness kappa. */
static void testFeneLengths() {
    const int count = 400000;
    Integers chains(count, 2), segments(count);
    for (int i = 0; i < count; i++)
        segments[i] = i;
    for (double kappa : {0.0, 1e-12, 1e-3, 0.5, 2.0, 10.0, 300.0, 1e5, 1e12}) {
        Array x(count);
        drawFeneCoordinates({17, 0, 8}, chains.data(), segments.data(), Array(count, kappa).data(), count, x.data());
        // <u^2k> = prod (2j-1)/(kappa+2j+1)
        double exact[9] = {1}, moments[9] = {}, above = 0;
        for (int k = 1; k <= 8; k++)
            exact[k] = exact[k-1]*(2*k-1)/(kappa+2*k+1);
        for (double q : x) {
            double square = -expm1(-q*q), power = 1;
            for (int k = 1; k <= 4; k++)
                moments[k] += (power *= square)/count;
            above += q > 0;
        }
        for (int k = 1; k <= 4; k++)
            checkClose(exact[k], moments[k], sqrt((exact[2*k]-exact[k]*exact[k])/count), 4.5,
                    "moment "+to_string(2*k)+" of FENE extensions for a stiffness of "+to_string(kappa));
        checkClose(0.5*count, above, 0.5*sqrt(count), 4.5, "sign of FENE extensions");
        // The first candidate is the normal number of the path.
        const int looked = 2000;
        int kept = 0;
        for (int i = 0; i < looked; i++) {
            // It is the third of the second draw.
            const uint32_t stream = NoiseKey::streamOf(NoiseKind::Segment, 0, 1);
            const Integers w = philoxOf({segments[i], 2, 8, 0}, {17, stream}, 1);
            const double u = ldexp(2.0*((uint64_t) w[2]<<8 | w[3]>>24)+1, -41);
            const double angle = (2.0*(w[3]&0x3fffff)+1-4194304)*M_PI/16777216;
            const double along = w[3]>>23&1 ? sin(angle) : cos(angle)*(w[3]>>22&1 ? -1 : 1);
            kept += fabs(sqrt(-2*log(u)/(kappa+1.5))*along-x[i]) < 1e-10/sqrt(kappa+1.5);
        }
        // Gamma(kappa/2+1) (kappa/2+3/4)^(1/2)/Gamma(kappa/2+3/2) of them are accepted.
        const double accepted = kappa > 1e4 ? 1 : exp(lgamma(0.5*kappa+1)-lgamma(0.5*kappa+1.5))*sqrt(0.5*kappa+0.75);
        checkClose(accepted, (double) kept/looked, sqrt(accepted*(1-accepted)/looked)+1e-12, 4.5,
                "accepted candidates");
    }
}

/** A step of FENE segments that hardly resist, or hardly stretch, ends. */
static void testStepsOfFeneSegmentsOfAnyStiffness() {
    for (double kappa : {0.0, 1e-12, 1e-4, 1.0, 1e4, 1e8}) {
        Array x;
        vector<Chain> chains = makeChains(SEGMENTS, BendingModel::InscribedCircle, StretchingModel::FENE, x);
        for (Chain& chain : chains)
            for (Segment& segment : chain.segments)
                segment.stiffness = 2.5*kappa/(segment.maximumExtension*segment.maximumExtension);
        const Array change = stepOf(ChainEngine(chains), x, Array(x.size()), {Scheme::Implicit, 2.5, 1e-3, 3, 4});
        for (double value : change)
            check(isfinite(value), "step of FENE segments");
    }
}

/** Chains in different places of a pack, and alone, with noise of all kinds and at several levels. */
static void testStepsAtLevels() {
    Array x;
    vector<Chain> chains = makeAll(BendingModel::InscribedCircle, StretchingModel::FENE, x);
    for (Chain& chain : chains)
        chain.tethers = {{0, {0, 0, 0}, 0.3}, {(int) chain.nodes.size()-1, {3, 0, 0}, 0.2}};
    ChainEngine together(chains);
    const Array zero(x.size());
    for (Scheme scheme : {Scheme::Midpoint, Scheme::Implicit})
        for (int level : {0, 4}) {
            const StepSettings settings = {scheme, 2.5, 1e-3, 11, 6, level};
            const Array all = stepOf(together, x, zero, settings);
            // Another chain before it makes the number of the last one the same.
            vector<Chain> some(chains.size(), chains[0]);
            some.back() = chains.back();
            Array positions = x;
            for (size_t c = 0; c+1 < some.size(); c++)
                for (size_t node = 0; node < some[c].nodes.size(); node++) {
                    some[c].nodes[node] = positions.size()/3;
                    positions.insert(positions.end(), {x[3*chains[0].nodes[node]], x[3*chains[0].nodes[node]+1],
                            x[3*chains[0].nodes[node]+2]});
                }
            const Array alone = stepOf(ChainEngine(some), positions, Array(positions.size()), settings);
            for (int node : chains.back().nodes)
                for (int k = 0; k < 3; k++)
                    checkClose(all[3*node+k], alone[3*node+k], 1, 1e-9, "step of a chain among others");
        }
}

/** A step that is divided is the same as steps at higher levels, for all chains and with noise of all kinds. */
static void testDividedStepsFollowTheirPath() {
    for (StretchingModel stretching : {StretchingModel::Harmonic, StretchingModel::FENE}) {
        Array x;
        vector<Chain> chains = makeAll(BendingModel::InscribedCircle, stretching, x);
        for (Chain& chain : chains) {
            chain.tethers = {{0, {x[3*chain.nodes[0]], 0, 3}, 0.3}};
            // Close to the greatest extension, rounding would grow.
            for (Segment& segment : chain.segments)
                segment.maximumExtension = 9;
        }
        int compared = 0;
        for (int c = 0; c < (int) chains.size(); c++) {
            // Alone, so that what is divided and what is not can be told apart.
            Chain chain = chains[c];
            Array start;
            for (size_t node = 0; node < chain.nodes.size(); node++) {
                start.insert(start.end(), &x[3*chain.nodes[node]], &x[3*chain.nodes[node]]+3);
                chain.nodes[node] = node;
            }
            const ChainEngine engine({chain});
            const Array zero(start.size());
            for (uint64_t step = 5; step < 45; step++) {
                Array whole(start.size());
                const double h = 4, kT = 12;
                const Instability found = engine.step(0, start.data(), zero.data(), NULL,
                        {Scheme::Implicit, kT, h, 21, step, 1}, whole.data());
                if (found.divided == 0 || found.chain != -1)
                    continue;
                bool divided = true;
                for (int division = 1; divided; division++) {
                    check(division <= 10, "no parts of the step are what it was");
                    divided = false;
                    Array parts = start;
                    for (uint64_t part = 0; part < 1ULL<<division && !divided; part++) {
                        Array change(start.size());
                        divided = engine.step(0, parts.data(), zero.data(), NULL, {Scheme::Implicit, kT,
                                h/(1<<division), 21, (step<<division)+part, 1+division}, change.data()).divided > 0;
                        for (size_t i = 0; i < start.size(); i++)
                            parts[i] += change[i];
                    }
                    if (divided)
                        continue;
                    for (size_t i = 0; i < start.size(); i++)
                        checkClose(parts[i]-start[i], whole[i], 1, 1e-9, "step in parts");
                    compared++;
                }
            }
        }
        check(compared > 20, "too few steps were divided: "+to_string(compared));
    }
}

int main() {
    return runTests({
        testKnownAnswers,
        testNormalsAgainstDescription,
        testBits,
        testMoments,
        testCorrelations,
        testPaths,
        testFeneLengths,
        testStepsOfFeneSegmentsOfAnyStiffness,
        testStepsAtLevels,
        testDividedStepsFollowTheirPath
    });
}
