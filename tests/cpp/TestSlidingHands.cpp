/**
 * This tests hands that slide along chains which stand still: where they are, against quadrature, for steps over a
 * factor of a hundred; how fast they are under a load, and how they diffuse; and ends.
 */

#include "TestLinkerSystems.h"

static Hand slidingHand(double friction, const vector<int>& chains, bool holds = true) {
    Hand hand = handOf(0, 100, 0, chains);
    hand.slidingFriction = friction;
    hand.holdsAtEnds = holds;
    return hand;
}

/** Part of a filament, of segments that are stretched and have corners, and an anchor beside it. */
static Rods bentRod() {
    Rods rods;
    rods.add(ORIGIN, ALONG_X, 5, 20);
    const double nodes[] = {0, 0, 0, 22, 3, 0, 38, 15, 0, 60, 10, 4, 78, 12, -4, 99, 5, 0};
    copy(nodes, nodes+18, rods.x.begin());
    return rods;
}

/** The mean of a function of lengths along a rod, by the energy of a spring. */
template <class Function> double meanAlong(const Rods& rods, const LinkerSystem& system, Function function) {
    const Contours contours(rods.chains);
    const LinkerType& type = system.types[0];
    const int points = 4000;
    double sum = 0, norm = 0;
    for (int i = 0; i < points; i++) {
        const double s = contours.getLength(0)*(i+0.5)/points;
        double place[3], square = 0;
        locate(contours.findPlace(0, s), rods.x.data(), NULL, place);
        for (int k = 0; k < 3; k++)
            square += pow(place[k]-system.anchors[0].point[k], 2);
        const double weight = exp(-0.5*type.stiffness*pow(sqrt(square)-type.restLength, 2)/system.kT);
        norm += weight;
        sum += weight*function(s);
    }
    return sum/norm;
}

static void checkPlaces(const Rods& rods, double stiffness, double restLength, const double* point, double relaxed) {
    LinkerSystem system = anchoredSystem(slidingHand(1, {0}), stiffness, point);
    system.types[0].restLength = restLength;
    // By how much a step relaxes the spring.
    const double stepSize = relaxed/stiffness;
    LinkerKinetics kinetics(system, rods.chains);
    LinkerState state = boundLinkers(200, 50);
    // A spring of rest length has two minima, between which hands go.
    const int interval = max(1, (int) (2/relaxed)), start = (int) (60/relaxed);
    auto bin = [] (double s) {return (int) (s/20);};
    for (int i = 0; i < start; i++)
        kinetics.advance(state, stepOf(rods.x, stepSize), SERIAL);
    Mean first, second;
    vector<double> counts(5, 0);
    double all = 0;
    for (int block = 0; block < 20; block++) {
        for (int sample = 0; sample < 8; sample++) {
            for (int i = 0; i < interval; i++)
                kinetics.advance(state, stepOf(rods.x, stepSize), SERIAL);
            for (const Linker& linker : state.linkers) {
                const double s = linker.hands[1].position;
                check(s >= 0 && s <= 100, "beyond an end");
                first.add(s);
                second.add((s-50)*(s-50));
                counts[min(4, bin(s))]++;
                all++;
            }
        }
        first.endBlock();
        second.endBlock();
    }
    first.check("place", meanAlong(rods, system, [] (double s) {return s;}));
    second.check("square of the place", meanAlong(rods, system, [] (double s) {return (s-50)*(s-50);}));
    for (int i = 0; i < 5; i++)
        checkClose(meanAlong(rods, system, [&] (double s) {return bin(s) == i ? 1.0 : 0.0;}), counts[i]/all, 1, 0.02,
                "part "+to_string(i));
}

/** With steps in which springs relax by a twentieth, and by five. */
static void testPlaces() {
    Rods straight;
    straight.add(ORIGIN, ALONG_X, 4, 25);
    const Rods bent = bentRod();
    const double above[] = {40, 15, 20}, beyond[] = {118, 10, 0}, near[] = {40, 5, 0};
    for (double relaxed : {0.05, 0.5, 5.0}) {
        checkPlaces(straight, 0.02, 0, above, relaxed);
        checkPlaces(bent, 0.02, 0, above, relaxed);
        checkPlaces(bent, 0.02, 30, above, relaxed);
        checkPlaces(straight, 0.03, 20, near, relaxed);
        // The spring pulls beyond the end.
        checkPlaces(bent, 0.02, 0, beyond, relaxed);
    }
    checkPlaces(straight, 0.02, 0, above, 100);
}

/** Under a spring so soft that its force stays what it is; without temperature, too. */
static void testSpeedUnderLoad() {
    Rods rods;
    rods.add(ORIGIN, ALONG_X, 100, 100);
    const double far = 1e7, point[] = {5000+far, 0, 0};
    for (double kT : {KT, 0.0})
        for (double stepSize : {1.0, 100.0}) {
            LinkerSystem system = anchoredSystem(slidingHand(3, {0}), 6/far, point);
            system.kT = kT;
            LinkerKinetics kinetics(system, rods.chains);
            LinkerState state = boundLinkers(1500, 5000);
            for (int i = 0; i < 200/stepSize; i++)
                kinetics.advance(state, stepOf(rods.x, stepSize), SERIAL);
            double sum = 0, square = 0;
            for (const Linker& linker : state.linkers) {
                const double moved = linker.hands[1].position-5000;
                sum += moved/1500;
                square += moved*moved/1500;
            }
            const double variance = 2*kT/3*200;
            checkClose(400, sum, 1, 4*sqrt(variance/1500)+1e-2, "force over friction");
            checkClose(variance, square-sum*sum, 1, variance*4*sqrt(2/1500.0)+1e-3, "diffusion");
        }
}

static LinkerState pairsOn(int count, double first, double second) {
    LinkerState state = freeLinkers(count);
    for (Linker& linker : state.linkers) {
        linker.hands[0] = {0, first};
        if (second >= 0)
            linker.hands[1] = {1, second};
    }
    return state;
}

/** Two hands on a spring diffuse together half as fast as one of them, and both forget where they were. */
static void testTwoHands() {
    Rods rods;
    const double beside[] = {0, 10, 0};
    rods.add(ORIGIN, ALONG_X, 20, 1000);
    rods.add(beside, ALONG_X, 20, 1000);
    LinkerSystem system = twoHands(0.04, 0, 100, 100, 0);
    for (Hand& hand : system.hands) {
        hand = slidingHand(2, {0, 1});
    }
    system.hands[1].slidingFriction = 1;
    const double duration = 2000;
    // Friction adds up.
    const double variance = 2*KT/3*duration;
    for (double stepSize : {2.0, 50.0}) {
        LinkerKinetics kinetics(system, rods.chains);
        LinkerState state = pairsOn(1500, 10000, 10000);
        for (int i = 0; i < duration/stepSize; i++)
            kinetics.advance(state, stepOf(rods.x, stepSize), SERIAL);
        double together = 0, apart = 0;
        for (const Linker& linker : state.linkers) {
            const double a = linker.hands[0].position-10000, b = linker.hands[1].position-10000;
            together += pow((2*a+b)/3, 2)/1500;
            apart += (a-b)*(a-b)/1500;
        }
        checkClose(variance, together, 1, 4*variance*sqrt(2/1500.0), "diffusion of both");
        checkClose(KT/0.04, apart, 1, 4*KT/0.04*sqrt(2/1500.0), "between both");
    }
}

/** Hands without a load are anywhere, or let go at ends; on rings, they go on. */
static void testEnds() {
    Rods rods;
    rods.add(ORIGIN, ALONG_X, 4, 25);
    for (double stepSize : {1.0, 100.0, 1e4}) {
        LinkerSystem system = twoHands(0.04, 0, 100, 100, 0);
        for (bool holds : {true, false}) {
            for (Hand& hand : system.hands)
                hand = slidingHand(1, {0}, holds);
            LinkerKinetics kinetics(system, rods.chains);
            LinkerState state = pairsOn(10000, 50, -1);
            const int steps = max(1, (int) (300/stepSize));
            for (int i = 0; i < steps; i++)
                kinetics.advance(state, stepOf(rods.x, stepSize), SERIAL);
            const double t = steps*stepSize;
            // Modes of diffusion, between walls or to ends that take all.
            double expected = 0, near = 0;
            for (int n = 1; n < 200; n++) {
                const double decay = exp(-KT*t*pow(n*M_PI/100, 2));
                expected += n%2 == 1 ? 4/(n*M_PI)*sin(n*M_PI/2)*decay : 0;
                near += 2*cos(n*M_PI/2)*decay*sin(n*M_PI/4)/(n*M_PI);
            }
            int bound = 0, first = 0;
            for (const Linker& linker : state.linkers) {
                bound += linker.hands[0].isBound();
                first += (linker.hands[0].isBound() && linker.hands[0].position < 25);
            }
            if (holds) {
                check(bound == 10000, "hands that are held let go");
                checkClose(0.25+near, first/1e4, 1, 4*sqrt(0.25/1e4), "places between ends");
            }
            else if (stepSize == 1)
                // Those that go beyond an end and come back in a step are missed.
                checkClose(expected, bound/1e4, 1, 0.06, "not yet released");
        }
    }
    Rods ring;
    Chain chain;
    chain.bending = (BendingModel) 0;
    chain.stretching = StretchingModel::Harmonic;
    for (int i = 0; i < 20; i++) {
        chain.nodes.push_back(i);
        chain.fixed.push_back(true);
        for (double x : {cos(i*M_PI/10), sin(i*M_PI/10), 0.0})
            ring.x.push_back(x*5/sin(M_PI/20));
    }
    chain.segments.assign(20, {10, 1, 0, 1, 1, 1, 1});
    chain.joints.assign(20, 1);
    chain.closed = true;
    ring.chains.add(chain);
    const double point[] = {40, 0, 0};
    LinkerSystem system = anchoredSystem(slidingHand(1, {0}, false), 2e-3, point);
    for (double relaxed : {0.05, 5.0}) {
        LinkerKinetics kinetics(system, ring.chains);
        LinkerState state = boundLinkers(200, 3);
        for (int i = 0; i < 20/relaxed; i++)
            kinetics.advance(state, stepOf(ring.x, relaxed/2e-3), SERIAL);
        Mean second;
        for (int block = 0; block < 20; block++) {
            for (int i = 0; i < 12; i++) {
                for (int j = 0; j < max(1, (int) (1/relaxed)); j++)
                    kinetics.advance(state, stepOf(ring.x, relaxed/2e-3), SERIAL);
                for (const Linker& linker : state.linkers) {
                    check(linker.hands[1].isBound() && linker.hands[1].position >= 0 &&
                            linker.hands[1].position <= 200, "off the ring");
                    second.add(pow(linker.hands[1].position-100, 2));
                }
            }
            second.endBlock();
        }
        second.check("places on a ring", meanAlong(ring, system, [] (double s) {return (s-100)*(s-100);}));
    }
}

/** Binding and sliding together: as without sliding. */
static void testEquilibriumOfAll() {
    Rods crossed;
    const double a[] = {-50, 0, 0}, b[] = {0, -30, 20}, y[] = {0.6, 0.8, 0};
    crossed.add(a, ALONG_X, 2, 50);
    crossed.add(b, y, 1, 100);
    for (double stepSize : {0.1, 10.0}) {
        LinkerSystem system = twoHands(0.02, 0, 120, 120, 0.3);
        for (Hand& hand : system.hands) {
            hand.slidingFriction = 0.05;
            hand.holdsAtEnds = true;
        }
        system.types[0].leastCosine = 0;
        KineticStep step = stepOf(crossed.x, stepSize);
        step.volume = 8e8;
        LinkerKinetics kinetics(system, crossed.chains);
        LinkerState state = freeLinkers(800);
        checkEquilibrium(kinetics, state, step, expectedOn(crossed, system, step.volume));
    }
}

int main() {
    return runTests({
        testPlaces,
        testSpeedUnderLoad,
        testTwoHands,
        testEnds,
        testEquilibriumOfAll
    });
}
