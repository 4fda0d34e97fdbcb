/**
 * This tests linkers that load as pairs and extrude loops: their lengths against closed forms and a lattice on which
 * extruders stand in each other's way, and barriers against their probabilities and rates.
 */

#include "TestLinkerSystems.h"
#include <random>
#include <set>

/** A rod that is so long that hardly any extruder comes to an end. */
static Rods rodOf(double length) {
    Rods rods;
    rods.add(ORIGIN, ALONG_X, 10, 0.1*length);
    return rods;
}

/** The first hand walks to the minus end, the second one to the plus end. */
static LinkerSystem extruders(double firstSpeed, double secondSpeed, double firstRate, double secondRate,
        double siteSpacing) {
    LinkerSystem system;
    system.kT = KT;
    system.hands = {handOf(1, 20, firstRate, {0}), handOf(0, 20, secondRate, {0})};
    system.hands[0].speed = -firstSpeed;
    system.hands[1].speed = secondSpeed;
    for (Hand& hand : system.hands)
        hand.siteSpacing = siteSpacing;
    LinkerType type;
    type.hands[0] = 0;
    type.hands[1] = 1;
    type.sameChain = true;
    type.loadingDistance = 10;
    system.types = {type};
    return system;
}

static double loopOf(const Linker& linker) {
    check(linker.hands[0].chain == 0 && linker.hands[1].chain == 0, "half of a pair is bound");
    return linker.hands[1].position-linker.hands[0].position;
}

/**
 * Sparse extruders: loops are d+(v1+v2)/k long, with the rate k = k1+k2. Those that bind in a step walk for all of it:
 * they have taken n steps with the probability (1-x) x^(n-1), where x = exp(-k h). Hands on sites step at random times.
 */
static void checkLoops(double stepSize) {
    const Rods rods = rodOf(1e6);
    for (double spacing : {0.0, 10.0})
        for (double second : {40.0, 0.0}) {
            const LinkerSystem system = extruders(20, second, 0.3, 0.2, spacing);
            KineticStep step = stepOf(rods.x, stepSize);
            step.volume = 4*M_PI/3*pow(20, 3)*1e6;
            LinkerKinetics kinetics(system, rods.chains);
            LinkerState state = freeLinkers(spacing > 0 ? 50 : 500);
            // The sites of many would not be free.
            const int interval = max(1, (int) (2/stepSize)), blocks = 20, samples = spacing > 0 ? 100 : 10;
            for (int i = 0; i < 10*interval; i++)
                kinetics.advance(state, step, SERIAL);
            Mean loop, bound;
            for (int block = 0; block < blocks; block++) {
                for (int sample = 0; sample < samples; sample++) {
                    for (int i = 0; i < interval; i++)
                        kinetics.advance(state, step, SERIAL);
                    for (const Linker& linker : state.linkers) {
                        bound.add(linker.pulls());
                        if (linker.pulls())
                            loop.add(loopOf(linker));
                    }
                }
                loop.endBlock();
                bound.endBlock();
            }
            const double rate = 0.5, time = spacing > 0 ? 1/rate : stepSize/-expm1(-rate*stepSize);
            loop.check("loop", 10+(20+second)*time, 0.03);
            bound.check("bound", 1/(1+rate), 0.03);
        }
}

static void testLoops() {
    checkLoops(0.2);
    checkLoops(2);
}

/** Extruders on a lattice with the same rates, one event after the other: the mean loop, and how many are bound. */
static pair<double, double> onLattice(int sites, int count, double binding, double unbinding, double hopping,
        int events) {
    mt19937_64 generator(5);
    uniform_real_distribution<double> uniform(0, 1);
    vector<pair<int, int> > hands(count, {-1, -1});
    vector<char> taken(sites, 0);
    double time = 0, loops = 0, numbers = 0;
    vector<int> bound, unbound;
    for (int i = 0; i < count; i++)
        unbound.push_back(i);
    double sum = 0;
    for (int event = 0; event < events; event++) {
        const double rates[] = {binding*unbound.size(), unbinding*bound.size(), 2*hopping*bound.size()};
        const double total = rates[0]+rates[1]+rates[2];
        const double passes = -log(1-uniform(generator))/total;
        if (event > events/10) {
            time += passes;
            loops += passes*sum;
            numbers += passes*bound.size();
        }
        double chosen = uniform(generator)*total;
        if (chosen < rates[0]) {
            const int first = (int) (uniform(generator)*sites);
            if (first+1 < sites && !taken[first] && !taken[first+1]) {
                const int own = unbound.back();
                unbound.pop_back();
                bound.push_back(own);
                hands[own] = {first, first+1};
                taken[first] = taken[first+1] = 1;
                sum++;
            }
            continue;
        }
        const size_t which = (size_t) (uniform(generator)*bound.size());
        auto& [left, right] = hands[bound[which]];
        const bool isLeft = uniform(generator) < 0.5;
        const int next = isLeft ? left-1 : right+1;
        const bool unbinds = chosen < rates[0]+rates[1];
        if (!unbinds && next >= 0 && next < sites) {
            if (!taken[next]) {
                taken[isLeft ? left : right] = 0;
                taken[next] = 1;
                (isLeft ? left : right) = next;
                sum++;
            }
            continue;
        }
        // It lets go at an end, too.
        taken[left] = taken[right] = 0;
        sum -= right-left;
        unbound.push_back(bound[which]);
        bound[which] = bound.back();
        bound.pop_back();
    }
    return {loops/numbers, numbers/time/count};
}

/** So many extruders that they stop each other: numbers and loops of the lattice. */
static void testDense() {
    const int sites = 1000, count = 100;
    const Rods rods = rodOf(10*sites);
    const LinkerSystem system = extruders(40, 40, 0.05, 0.05, 10);
    KineticStep step = stepOf(rods.x, 0.5);
    step.volume = 4*M_PI/3*pow(20, 3)*10*sites;
    LinkerKinetics kinetics(system, rods.chains);
    LinkerState state = freeLinkers(count);
    for (int i = 0; i < 200; i++)
        kinetics.advance(state, step, SERIAL);
    Mean loop, bound;
    for (int block = 0; block < 20; block++) {
        for (int sample = 0; sample < 60; sample++) {
            for (int i = 0; i < 6; i++)
                kinetics.advance(state, step, SERIAL);
            set<int> taken;
            for (const Linker& linker : state.linkers) {
                bound.add(linker.pulls());
                if (!linker.pulls())
                    continue;
                loop.add(loopOf(linker)/10);
                for (const HandPlace& hand : linker.hands)
                    check(taken.insert((int) floor(hand.position/10)).second, "two hands are on one site");
            }
        }
        loop.endBlock();
        bound.endBlock();
    }
    const auto [meanLoop, meanBound] = onLattice(sites, count, 1, 0.1, 4, 4000000);
    // A third of what they would be alone.
    check(meanLoop < 0.4*80, "extruders are sparse");
    loop.check("loop among others", meanLoop, 0.03);
    bound.check("bound among others", meanBound, 0.03);
}

/** Hands that walk past a barrier are captured with a probability, and released with a rate; others pass it. */
static void checkBarriers(double stepSize) {
    const Rods rods = rodOf(1e5);
    const double where = 50040, from = 50000, release = 0.2, speed = 20, time = 6;
    for (double spacing : {0.0, 10.0})
        for (double probability : {1.0, 0.6}) {
            LinkerSystem system = extruders(speed, speed, 0, 0, spacing);
            // The second one is in the way of hands that walk to the minus end.
            system.barriers = {{0, where, 1, probability, release}, {0, from-1000, 1, 1, 0}};
            KineticStep step = stepOf(rods.x, stepSize);
            Mean held;
            for (int block = 0; block < 20; block++) {
                step.seed = 100+block;
                // One linker each, or they would take the sites of others.
                const int trials = spacing > 0 ? 1 : 5000;
                for (int trial = 0; trial < (spacing > 0 ? 4000 : 1); trial++) {
                    step.force = trial;
                    LinkerKinetics kinetics(system, rods.chains);
                    LinkerState state = freeLinkers(trials);
                    for (Linker& linker : state.linkers)
                        for (int side = 0; side < 2; side++)
                            linker.hands[side] = {0, spacing > 0 ? from-15+20*side : from-10+10*side};
                    const int steps = (int) (time/stepSize+0.5);
                    for (int i = 0; i < steps; i++)
                        kinetics.advance(state, step, SERIAL);
                    for (const Linker& linker : state.linkers) {
                        const double along = linker.hands[1].position;
                        held.add(spacing > 0 ? floor(along/10) == where/10 : along == where);
                        check(spacing > 0 || linker.hands[0].position < from-120, "what walks on is captured");
                    }
                }
                held.endBlock();
            }
            // They come to it in a step, or after four steps of a hand, each of which takes 1/(v/a) on average.
            const double rate = speed/10, arrival = ceil((where-from)/speed/stepSize-1e-9)*stepSize;
            double expected = probability*exp(-release*(time-arrival));
            if (spacing > 0) {
                // Four steps of a hand take T, and another one leads past the barrier: this is exp(-release (time-T)),
                // and exp(-rate (time-T)), where T is below the time.
                const double x = (rate-release)*time, waits = pow(rate*time, 4)/24*exp(-rate*time);
                const double stays = exp(-release*time)*pow(rate/(rate-release), 4)*
                        (1-exp(-x)*(1+x+x*x/2+x*x*x/6));
                expected = probability*(rate*stays-release*waits)/(rate-release)+(1-probability)*waits;
            }
            held.check("held by a barrier", expected, 0.03);
        }
}

static void testBarriers() {
    checkBarriers(0.6);
}

static void testShortSteps() {
    checkLoops(0.02);
    checkBarriers(0.06);
}

/** A ring has no ends: hands come around to a barrier, and a pair loads across the place where it is closed. */
static void testRing() {
    Rods rods;
    Chain chain;
    chain.bending = (BendingModel) 0;
    chain.stretching = StretchingModel::Harmonic;
    chain.closed = true;
    for (int i = 0; i < 8; i++) {
        chain.nodes.push_back(i);
        chain.fixed.push_back(true);
        for (double x : {50*cos(i*M_PI/4), 50*sin(i*M_PI/4), 0.0})
            rods.x.push_back(x);
    }
    Segment segment = {40, 1, 0, 1, 1, 1, 1};
    chain.segments.assign(8, segment);
    chain.joints.assign(8, 1);
    rods.chains.add(chain);
    LinkerSystem system = extruders(0, 20, 0, 0, 0);
    system.barriers = {{0, 5, 0, 1, 0}};
    KineticStep step = stepOf(rods.x, 0.3);
    LinkerKinetics kinetics(system, rods.chains);
    LinkerState state = freeLinkers(1);
    state.linkers[0].hands[0] = {0, 300};
    state.linkers[0].hands[1] = {0, 310};
    for (int i = 0; i < 10; i++)
        kinetics.advance(state, step, SERIAL);
    check(state.linkers[0].hands[1].position == 5, "not captured across the place where a ring is closed");
    step.volume = 4*M_PI/3*pow(20, 3)*320;
    system.barriers.clear();
    system.hands[1].speed = 0;
    LinkerKinetics loading(system, rods.chains);
    LinkerState many = freeLinkers(500);
    for (int i = 0; i < 30; i++)
        loading.advance(many, step, SERIAL);
    int across = 0;
    for (const Linker& linker : many.linkers) {
        check(linker.pulls(), "a pair has not loaded");
        across += loopOf(linker) < 0;
    }
    check(across > 3 && across < 40, "pairs do not load where a ring is closed");
}

int main() {
    return runTests({
        testLoops,
        testDense,
        testBarriers,
        testRing
    }, {
        testShortSteps
    });
}
