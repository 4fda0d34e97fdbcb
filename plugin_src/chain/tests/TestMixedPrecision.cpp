/**
 * This tests chains in single precision: that a step is that in double precision but for rounding, that energies and motion
 * are right in the mean, and that double precision is used where single precision would not do.
 */

#include "TestChains.h"
#include "../ChainPack.h"
#include <algorithm>
#include <functional>

static const double KT = 2.5;


struct Result {
    Array displacements;
    int divided = 0;
};

static Result stepIn(const ChainEngine& engine, const Array& x, const Array& f, StepSettings settings, Precision precision,
            const double* box = NULL) {
    settings.precision = precision;
    Result result = {Array(x.size())};
    for (int pack : engine.getPacksOfStep(settings)) {
        const Instability found = engine.step(pack, x.data(), f.data(), box, settings, result.displacements.data());
        check(found.chain < 0, "unstable step");
        result.divided += found.divided;
    }
    return result;
}

static int mixedChains(const ChainEngine& engine, StepSettings settings, Precision precision) {
    settings.precision = precision;
    return engine.getNumMixedChains(engine.getPacksOfStep(settings));
}

/** The root of the mean square difference over that of the displacements. */
static double relativeDifference(const Array& a, const Array& b) {
    double difference = 0, all = 0;
    for (size_t i = 0; i < a.size(); i++) {
        difference += (a[i]-b[i])*(a[i]-b[i]);
        all += a[i]*a[i];
    }
    return sqrt(difference/all);
}

static const vector<int> LENGTHS = {5, 5, 4, 1, 2, 9, 5, 5, 5, 5, 3, 8, 9, 10, 9, 9, 9, 9, 10, 11, 9, 10};

static void forSchemes(const function<void(Scheme)>& function) {
    function(Scheme::Implicit);
    function(Scheme::ImplicitSecondOrder);
}

static StepSettings settingsFor(Scheme scheme, double h, uint64_t step = 1) {
    return {scheme, KT, h, 11, step};
}

/** Chains of all kinds that single precision is for. */
static void forKinds(const function<void(const string&, const vector<Chain>&, const Array&)>& use) {
    for (int bending = 0; bending < 3; bending++) {
        Array x;
        const vector<Chain> plain = makeChains(LENGTHS, (BendingModel) bending, StretchingModel::Harmonic, x);
        use("chains", plain, x);
        vector<Chain> tethered = plain, held = plain, propelled = plain, planar = plain;
        for (size_t i = 0; i < plain.size(); i++) {
            const double* position = &x[3*plain[i].nodes[1]];
            tethered[i].tethers.push_back({1, {position[0]+1, position[1], position[2]-1}, 25});
            tethered[i].tethers.push_back({0, {position[0]-9, position[1]+2, position[2]}, 400});
            held[i].fixed[i%held[i].nodes.size()] = true;
            for (Segment& segment : propelled[i].segments)
                segment.propulsion = 3;
            planar[i].planar = true;
        }
        use("tethered chains", tethered, x);
        use("chains with fixed nodes", held, x);
        use("propelled chains", propelled, x);
        Array flat = x;
        for (size_t i = 2; i < x.size(); i += 3)
            flat[i] = 3;
        use("chains in a plane", planar, flat);
    }
}

static Array someForces(const Array& x) {
    Array f(x.size());
    for (size_t i = 0; i < f.size(); i++)
        f[i] = sin(i);
    return f;
}

static void testStepsAreThoseOfDoublePrecision() {
    forKinds([] (const string& kind, const vector<Chain>& chains, const Array& x) {
        const ChainEngine engine(chains);
        const Array f = someForces(x);
        forSchemes([&] (Scheme scheme) {
            for (double h : {1e-3, 0.03, 0.5})
                for (uint64_t step = 0; step < 10; step++) {
                    const StepSettings settings = settingsFor(scheme, h, step);
                    check(mixedChains(engine, settings, Precision::Mixed) == (int) chains.size(), kind+": in mixed precision");
                    const Result expected = stepIn(engine, x, f, settings, Precision::Double);
                    const Result found = stepIn(engine, x, f, settings, Precision::Mixed);
                    const double difference = relativeDifference(expected.displacements, found.displacements);
                    printf("%s %g %d: %g (%d %d)\n", kind.c_str(), h, (int) scheme, difference, expected.divided, found.divided);
                    for (size_t i = 2; i < x.size() && chains[0].planar; i += 3)
                        check(found.displacements[i] == 0, "chain that leaves its plane");
                }
        });
    });
}

int main() {
    return runTests({
        testStepsAreThoseOfDoublePrecision,
    });
}
