/**
 * This tests linkers on chains that stand still: numbers and places in equilibrium against partition functions, for
 * steps over a factor of a hundred; laws of unbinding and walking; sites that hold one hand each.
 */

#include "TestLinkerSystems.h"
#include <map>
#include <set>

/** With steps over a factor of a hundred. */
static void testEquilibriumOnRods() {
    // All are 100 long, and in few pieces: of what is proposed, most is not taken.
    Rods crossed, parallel;
    const double a[] = {-50, 0, 0}, b[] = {0, -30, 20}, c[] = {-45, 0, 20}, y[] = {0.6, 0.8, 0};
    crossed.add(a, ALONG_X, 2, 50);
    crossed.add(b, y, 1, 100);
    parallel.add(a, ALONG_X, 1, 100);
    parallel.add(c, ALONG_X, 4, 25);
    checkEquilibrium(crossed, 0.02, 0, 120, 0, 0.1);
    checkEquilibrium(crossed, 0.02, 0, 120, 0, 10);
    checkEquilibrium(parallel, 0.05, 30, 70, 0.6, 0.2);
    // Where the spring counts beyond what is in reach, linkers do not get there while chains stand still.
    checkEquilibrium(crossed, 0.01, 0, 50, 0.3, 0.3);
}

static int countBound(const LinkerState& state) {
    return count_if(state.linkers.begin(), state.linkers.end(), [] (const Linker& linker) {
        return linker.hands[1].isBound();
    });
}

/** Bound linkers, none of which binds again, become fewer exponentially at all times, whatever the step is. */
static void checkLifetimes(const Hand& hand, double rate, const string& what) {
    Rods rods;
    rods.add(ORIGIN, ALONG_X, 2, 100);
    const double point[] = {50, 30, 40};
    LinkerKinetics kinetics(anchoredSystem(hand, 0.1, point), rods.chains);
    for (double stepSize : {0.02/rate, 0.7/rate}) {
        const int number = 40000, interval = (int) round(0.7/(stepSize*rate));
        LinkerState state = boundLinkers(number, 50);
        for (int lifetimes = 1; lifetimes <= 4; lifetimes++) {
            for (int i = 0; i < interval; i++)
                kinetics.advance(state, stepOf(rods.x, stepSize), SERIAL);
            const double share = exp(-0.7*lifetimes), error = sqrt(share*(1-share)/number);
            checkClose(share, countBound(state)/(double) number, 4*error, 1, what);
        }
    }
}

static void testUnbindingUnderLoad() {
    // The spring is 50 long, so that its force is 5 and its energy 125.
    Hand hand = handOf(0, 100, 0.3, {0});
    checkLifetimes(hand, 0.3, "no law");
    hand.unbindingForce = 2;
    checkLifetimes(hand, 0.3*exp(2.5), "Bell's law");
    hand.catchRate = 20;
    hand.catchForce = 1.5;
    checkLifetimes(hand, 0.3*exp(2.5)+20*exp(-5/1.5), "catch and slip");
    hand = handOf(0, 100, 0.3, {0});
    hand.strainShare = 0.1;
    checkLifetimes(hand, 0.3*exp(0.1*125/KT), "strain");
}

/** Under a spring so soft that its force stays what it is. */
static void testSpeedUnderLoad() {
    Rods rods;
    rods.add(ORIGIN, ALONG_X, 100, 10);
    for (double force : {-9.0, -3.0, -1.0, 0.0, 1.0, 30.0})
        for (int direction : {1, -1})
            for (bool backward : {false, true}) {
                Hand hand = handOf(0, 100, 0, {0});
                hand.speed = 2*direction;
                hand.stallForce = 4;
                hand.walksBackward = backward;
                const double far = 1e6;
                const double point[] = {500+(force*direction > 0 ? far : -far), 0, 0};
                LinkerKinetics kinetics(anchoredSystem(hand, fabs(force)/far, point), rods.chains);
                LinkerState state = boundLinkers(1, 500);
                for (int i = 0; i < 50; i++)
                    kinetics.advance(state, stepOf(rods.x, 0.5), SERIAL);
                const double speed = 2*min(2.0, max(backward ? -1.0 : 0.0, 1+force/4));
                checkClose(direction*speed, (state.linkers[0].hands[1].position-500)/25, 1, 1e-3, "speed");
            }
}

/** However long the step is, a spring stops a hand at its stall force. */
static void testStalling() {
    Rods rods;
    rods.add(ORIGIN, ALONG_X, 100, 10);
    Hand hand = handOf(0, 1000, 0, {0});
    hand.speed = 2;
    hand.stallForce = 4;
    const double point[] = {500, 0, 0};
    for (double stepSize : {0.1, 1.0, 100.0}) {
        LinkerKinetics kinetics(anchoredSystem(hand, 0.05, point), rods.chains);
        LinkerState state = boundLinkers(1, 500);
        for (int i = 0; i < 10+6000/stepSize; i++) {
            kinetics.advance(state, stepOf(rods.x, stepSize), SERIAL);
            check(state.linkers[0].hands[1].position < 580.001, "it passes where it should stall");
        }
        checkClose(580, state.linkers[0].hands[1].position, 1, 0.01, "stall");
    }
}

/** Hands that walk side by side pull at nothing: no step is too long for their speed. */
static void testWalkingTogether() {
    Rods rods;
    const double beside[] = {0, 20, 0};
    rods.add(ORIGIN, ALONG_X, 10, 1000);
    rods.add(beside, ALONG_X, 10, 1000);
    LinkerSystem system;
    system.kT = KT;
    system.hands = {handOf(0, 100, 0, {0, 1})};
    system.hands[0].speed = 2;
    system.hands[0].stallForce = 4;
    LinkerType type;
    type.hands[0] = type.hands[1] = 0;
    type.stiffness = 0.05;
    system.types = {type};
    // The rate at which they relax to their stall force is 0.025.
    for (double stepSize : {4.0, 40.0, 400.0}) {
        LinkerKinetics kinetics(system, rods.chains);
        LinkerState state = freeLinkers(1);
        for (int side = 0; side < 2; side++)
            state.linkers[0].hands[side] = {side, 100};
        for (int i = 0; i < 2; i++)
            kinetics.advance(state, stepOf(rods.x, stepSize), SERIAL);
        for (const HandPlace& hand : state.linkers[0].hands)
            checkClose(100+4*stepSize, hand.position, 1, 1e-6, "walking together");
    }
}

/** A closed chain of segments along a regular polygon. */
static Rods ringOf(int segments, double length) {
    Rods ring;
    ring.add(ORIGIN, ALONG_X, segments-1, length);
    Chain& chain = ring.chains.getChain(0);
    chain.closed = true;
    chain.segments.push_back(chain.segments[0]);
    for (int i = 0; i < segments; i++) {
        ring.x[3*i] = 0.5*length/sin(M_PI/segments)*cos(2*M_PI*i/segments);
        ring.x[3*i+1] = 0.5*length/sin(M_PI/segments)*sin(2*M_PI*i/segments);
    }
    return ring;
}

/** Steps from site to site, of a hand on each rod, under springs so soft that their force stays what it is. */
static void testSpeedFromSiteToSite() {
    const int number = 100;
    const double far = 1e7;
    Rods rods;
    vector<int> all;
    for (int i = 0; i < number; i++) {
        const double start[] = {0, 10.0*i, 0};
        rods.add(start, ALONG_X, 100, 100);
        all.push_back(i);
    }
    for (double force : {-9.0, -2.0, 0.0, 2.0, 30.0})
        for (int direction : {1, -1})
            for (bool backward : {false, true}) {
                Hand hand = handOf(0, 100, 0, all);
                hand.speed = 2*direction;
                hand.stallForce = 4;
                hand.walksBackward = backward;
                hand.siteSpacing = 8;
                const double point[] = {force*direction > 0 ? far : -far, 0, 0};
                LinkerKinetics kinetics(anchoredSystem(hand, fabs(force)/far, point), rods.chains);
                LinkerState state = boundLinkers(number, 5004);
                for (int i = 0; i < number; i++)
                    state.linkers[i].hands[1].chain = i;
                // In each step, many from site to site.
                for (int i = 0; i < 25; i++)
                    kinetics.advance(state, stepOf(rods.x, 40), SERIAL);
                const double speed = 2*min(2.0, max(backward ? -1.0 : 0.0, 1+force/4));
                Mean found;
                for (const Linker& linker : state.linkers) {
                    found.add(direction*(linker.hands[1].position-5004)/1000);
                    found.endBlock();
                }
                if (speed == 0)
                    for (double own : found.blocks)
                        check(own == 0, "it walks where it should stall");
                else
                    found.check("speed from site to site", speed);
            }
}

/**
 * Hands on the sites of a ring stand in each other's way: all arrangements of M on N sites are equally likely, so that
 * they have (N-M)/(N-1) of their speed. At an end, they let go or stay, and those behind them wait.
 */
static void testTrafficOnSites() {
    const Rods ring = ringOf(16, 25);
    Hand hand = handOf(0, 30, 0, {0});
    hand.speed = -40;
    hand.siteSpacing = 8;
    const double point[] = {0, 0, 0};
    for (int walking : {20, 35})
        for (double stepSize : {0.04, 0.5}) {
            LinkerKinetics kinetics(anchoredSystem(hand, 0, point), ring.chains);
            LinkerState state = freeLinkers(walking);
            for (int i = 0; i < walking; i++) {
                state.linkers[i].anchor = 0;
                state.linkers[i].hands[1] = {0, 8*(i+0.5)};
            }
            Mean speed;
            for (int block = 0; block < 25; block++) {
                double sum = 0;
                for (int i = 0; i < (int) (160/stepSize); i++) {
                    vector<double> before;
                    for (const Linker& linker : state.linkers)
                        before.push_back(linker.hands[1].position);
                    kinetics.advance(state, stepOf(ring.x, stepSize), SERIAL);
                    set<double> places;
                    for (int j = 0; j < walking; j++) {
                        const double place = state.linkers[j].hands[1].position;
                        double moved = before[j]-place;
                        moved -= 400*floor((moved+40)/400);
                        sum += moved;
                        check(places.insert(place).second, "two hands on a site");
                    }
                }
                speed.add(sum/(walking*stepSize*(int) (160/stepSize)));
                if (block > 0)
                    speed.endBlock();
                else
                    speed = Mean();
            }
            speed.check("speed in traffic", 40*(50-walking)/49.0);
        }
    Rods rod;
    rod.add(ORIGIN, ALONG_X, 4, 25);
    for (bool holds : {false, true}) {
        hand.holdsAtEnds = holds;
        LinkerKinetics kinetics(anchoredSystem(hand, 0, point), rod.chains);
        LinkerState state = freeLinkers(3);
        for (int i = 0; i < 3; i++) {
            state.linkers[i].anchor = 0;
            state.linkers[i].hands[1] = {0, 8*(2*i+5.5)};
        }
        for (int i = 0; i < 50; i++)
            kinetics.advance(state, stepOf(rod.x, 1), SERIAL);
        check(countBound(state) == (holds ? 3 : 0), "what they do at the end");
        for (int i = 0; i < 3 && holds; i++)
            check(state.linkers[i].hands[1].position == 8*(i+0.5), "where they wait");
    }
}

static void testRunLengthsAndEnds() {
    Rods rods;
    rods.add(ORIGIN, ALONG_X, 2000, 10);
    Hand hand = handOf(0, 100, 0.5, {0});
    hand.speed = 50;
    const double point[] = {0, 0, 0};
    LinkerKinetics kinetics(anchoredSystem(hand, 0, point), rods.chains);
    // Where they unbind is not kept: what is lost between two steps has run this far.
    Mean runs;
    for (int block = 0; block < 20; block++) {
        LinkerState state = boundLinkers(2000, 0);
        // Each block has random numbers of its own.
        state.steps = 1000*block;
        double sum = 0;
        for (int i = 0; i < 400; i++) {
            const int before = countBound(state);
            kinetics.advance(state, stepOf(rods.x, 0.1), SERIAL);
            sum += (before-countBound(state))*50*0.1*i;
        }
        runs.add(sum/2000);
        runs.endBlock();
    }
    // Within a step, it may unbind before it walks.
    runs.check("run length", 50*0.1/expm1(0.5*0.1));
    for (bool holds : {false, true}) {
        hand.unbindingRate = 0;
        hand.holdsAtEnds = holds;
        LinkerKinetics short_(anchoredSystem(hand, 0, point), rods.chains);
        LinkerState state = boundLinkers(1, 19990);
        for (int i = 0; i < 3; i++)
            short_.advance(state, stepOf(rods.x, 0.1), SERIAL);
        check(countBound(state) == (holds ? 1 : 0), "what it does at the end");
        check(!holds || state.linkers[0].hands[1].position == 20000, "where it stays");
    }
}

/** Sites hold one hand each: of N sites with the weight w each, N w/(1+w) are taken where there is a concentration. */
static void testSites() {
    Rods rods;
    rods.add(ORIGIN, ALONG_X, 9, 11);
    LinkerSystem system;
    system.kT = KT;
    system.hands = {handOf(0.05, 10, 0.4, {0}), handOf(0, 10, 1, {})};
    system.hands[0].siteSpacing = 2.5;
    LinkerType type;
    type.hands[0] = 0;
    type.hands[1] = 1;
    type.concentration = 1e-3;
    system.types = {type};
    const double weight = 0.05*2.5/0.4*4*M_PI/3*1000*1e-3;
    for (double stepSize : {0.05, 2.0}) {
        LinkerKinetics kinetics(system, rods.chains);
        LinkerState state;
        Mean taken;
        for (int block = 0; block < 30; block++) {
            for (int i = 0; i < 200; i++) {
                kinetics.advance(state, stepOf(rods.x, stepSize), SERIAL);
                vector<double> places;
                for (const Linker& linker : state.linkers)
                    places.push_back(linker.hands[0].position);
                sort(places.begin(), places.end());
                check(adjacent_find(places.begin(), places.end()) == places.end(), "two hands on a site");
                check(places.empty() || (places[0] >= 1.25 && places.back() <= 39*2.5-1.25), "no site there");
                taken.add(state.linkers.size());
            }
            if (block > 0)
                taken.endBlock();
        }
        taken.check("sites that are taken", 39*weight/(1+weight));
    }
}

/**
 * Linkers of two types compete for the sites of two rods, which have one each: with the weights s of a linker that
 * holds one of them, and d of one that holds both, summed over types and hands, Z = (1+s)^2+d.
 */
static void testCompetitionForSites() {
    const int pairs = 60;
    Rods rods;
    vector<int> all;
    for (int i = 0; i < pairs; i++)
        for (int j = 0; j < 2; j++) {
            const double start[] = {0, 12.0*j, 100.0*i};
            rods.add(start, ALONG_X, 2, 5);
            all.push_back(2*i+j);
        }
    LinkerSystem system;
    system.kT = KT;
    system.hands = {handOf(0.05, 30, 1, all), handOf(0.07, 30, 0.7, all)};
    system.hands[0].strainShare = 0.4;
    for (Hand& hand : system.hands)
        hand.siteSpacing = 10;
    const double concentrations[] = {4e-6, 3e-6};
    vector<double> one, both;
    for (int i = 0; i < 2; i++) {
        LinkerType type;
        type.hands[0] = i;
        type.hands[1] = 1;
        type.stiffness = 0.1;
        type.restLength = 8;
        type.concentration = concentrations[i];
        system.types.push_back(type);
        const double first = 10*system.hands[i].bindingRate/system.hands[i].unbindingRate, second = 10*0.07/0.7;
        const double outside = 4*M_PI/3*27000*concentrations[i];
        one.push_back(outside*(first+second));
        both.push_back(2*outside*first*second*exp(-0.5*0.1*16/KT));
    }
    const double s = one[0]+one[1], d = both[0]+both[1], z = (1+s)*(1+s)+d;
    for (double stepSize : {0.05, 5.0}) {
        LinkerKinetics kinetics(system, rods.chains);
        LinkerState state;
        vector<Mean> found(4);
        const int interval = max(1, (int) (1.5/stepSize));
        for (int block = 0; block < 25; block++) {
            for (int sample = 0; sample < 120; sample++) {
                for (int i = 0; i < interval; i++)
                    kinetics.advance(state, stepOf(rods.x, stepSize), SERIAL);
                double counts[4] = {};
                for (const Linker& linker : state.linkers)
                    counts[2*linker.type+linker.pulls()]++;
                for (int i = 0; i < 4; i++)
                    found[i].add(counts[i]/pairs);
            }
            for (Mean& own : found)
                if (block > 0)
                    own.endBlock();
                else
                    own = Mean();
        }
        for (int i = 0; i < 2; i++) {
            found[2*i].check("linkers that hold a site", 2*one[i]*(1+s)/z);
            found[2*i+1].check("linkers that hold two", both[i]/z);
        }
    }
}

static Rods besideEachOther() {
    Rods rods;
    const double a[] = {-100, 0, 0}, b[] = {-90, 0, 20};
    rods.add(a, ALONG_X, 4, 50);
    rods.add(b, ALONG_X, 5, 40);
    return rods;
}

/** One of the two hands walks. */
static LinkerSystem walkersOnBoth() {
    LinkerSystem system = twoHands(0.05, 0, 60, 60, 0);
    system.hands[1].speed = 0.5;
    return system;
}

/** Neither threads nor the box in which positions are given matter. */
static void testThreadsAndImages() {
    const Rods rods = besideEachOther();
    const LinkerSystem system = walkersOnBoth();
    const double box[] = {500, 0, 0, 70, 500, 0, -60, 40, 500};
    Array wrapped = rods.x;
    for (size_t node = 5; node < rods.x.size()/3; node++)
        for (int k = 0; k < 3; k++)
            wrapped[3*node+k] += 2*box[3+k]-box[6+k];
    vector<LinkerState> states(3, freeLinkers(1500));
    for (int i = 0; i < 60; i++) {
        const KineticStep steps[] = {stepOf(rods.x, 0.2, box), stepOf(rods.x, 0.2, box), stepOf(wrapped, 0.2, box)};
        for (int copy = 0; copy < 3; copy++) {
            LinkerKinetics kinetics(system, rods.chains);
            KineticStep own = steps[copy];
            own.volume = 1e8;
            kinetics.advance(states[copy], own, copy == 1 ? BACKWARDS : SERIAL);
        }
    }
    check(states[0].events[0].bindings > 1000 && states[0].events[0].unbindings > 500, "nothing happens");
    for (size_t i = 0; i < states[0].linkers.size(); i++)
        for (int side = 0; side < 2; side++) {
            const HandPlace& place = states[0].linkers[i].hands[side];
            for (int copy = 1; copy < 3; copy++) {
                const HandPlace& other = states[copy].linkers[i].hands[side];
                // Of a point, those around it are drawn in the order of cells, which the box shifts.
                if (copy == 1)
                    check(place.chain == other.chain && place.position == other.position, "threads");
            }
        }
    const auto both = [] (const LinkerState& state) {
        return (double) count_if(state.linkers.begin(), state.linkers.end(), [] (const Linker& linker) {
            return linker.pulls();
        });
    };
    check(both(states[0]) > 100, "few are bound");
    checkClose(both(states[0]), both(states[2]), 4*sqrt(2*both(states[0])), 1, "images");
}

/** What a linker does depends neither on which others there are nor on where it is stored. */
static void testOrderOfStorage() {
    const Rods rods = besideEachOther();
    const LinkerSystem system = walkersOnBoth();
    LinkerState all = freeLinkers(900), some, reversed = all;
    for (size_t i = 0; i < all.linkers.size(); i += 3)
        some.linkers.push_back(all.linkers[i]);
    reverse(reversed.linkers.begin(), reversed.linkers.end());
    KineticStep step = stepOf(rods.x, 0.2);
    step.volume = 1e8;
    LinkerKinetics kinetics(system, rods.chains);
    // All by one, so that what it keeps of a state belongs to another one each time.
    for (int i = 0; i < 60; i++)
        for (LinkerState* state : {&all, &some, &reversed})
            kinetics.advance(*state, step, SERIAL);
    check(all.events[0].unbindings > 300, "nothing happens");
    const auto same = [] (const Linker& one, const Linker& other) {
        bool same = one.number == other.number;
        for (int side = 0; side < 2; side++)
            same = same && one.hands[side].chain == other.hands[side].chain &&
                    one.hands[side].position == other.hands[side].position;
        return same;
    };
    for (size_t i = 0; i < all.linkers.size(); i++) {
        check(same(all.linkers[i], reversed.linkers[all.linkers.size()-1-i]), "the order of storage");
        check(i%3 != 0 || same(all.linkers[i], some.linkers[i/3]), "which others there are");
    }
}

/** Hands that hardly reach anything, and those that walk around a ring more often than can be counted. */
static void testExtremes() {
    Rods rods;
    rods.add(ORIGIN, ALONG_X, 3, 25);
    const Contours contours(rods.chains);
    SegmentCells cells;
    cells.build(contours, rods.x.data(), 1e-9, NULL, NULL, true);
    check(cells.getNumPieces() == 3000, "too many pieces, or none");
    check(cells.lookAround(cells.findPiece(contours, 1, 12.5)).numPieces >= 1, "a piece does not find itself");
    const Rods ring = ringOf(8, 100);
    const double point[] = {0, 0, 0};
    for (double speed : {30.0, 1e6, 1e13, -1e300}) {
        Hand hand = handOf(0, 100, 0, {0});
        hand.speed = speed;
        LinkerKinetics kinetics(anchoredSystem(hand, 0, point), ring.chains);
        LinkerState state = boundLinkers(1, 50);
        const long long failed = kinetics.advance(state, stepOf(ring.x, 10), SERIAL);
        check(failed == (fabs(speed) > 1e7 ? 0 : -1), "too many rounds of a ring");
        const double position = state.linkers[0].hands[1].position;
        if (failed == -1)
            check(position >= 0 && position <= 800, "where it is on the ring");
        if (speed == 30)
            checkClose(350, position, 1, 1e-9, "on the ring");
    }
}

static void testSegmentsAround() {
    NormalNumbers normal(3);
    const double box[] = {300, 0, 0, 70, 280, 0, -60, 40, 310};
    Rods rods;
    for (int i = 0; i < 80; i++) {
        Array start = normal(3), direction = normal(3);
        double size = 0;
        for (double value : direction)
            size += value*value;
        for (int k = 0; k < 3; k++) {
            start[k] *= 200;
            direction[k] /= sqrt(size);
        }
        rods.add(start.data(), direction.data(), 3, 25);
    }
    const Contours contours(rods.chains);
    for (const double* ofCells : {(const double*) NULL, box})
        for (double reach : {5.0, 40.0, 90.0}) {
            SegmentCells cells;
            cells.build(contours, rods.x.data(), reach, ofCells, NULL, true);
            for (int i = 0; i < 200; i++) {
                Array point = normal(3);
                for (double& value : point)
                    value *= 250;
                // Half of them are on pieces, which are looked around themselves.
                const int onPiece = i%2 == 0 ? -1 : cells.findPiece(contours, i%240, 25*(i%13)/13.0);
                if (onPiece >= 0)
                    for (int k = 0; k < 3; k++) {
                        const double fraction = i%13/13.0;
                        point[k] = (1-fraction)*rods.x[3*contours.getFirst(i%240)+k]+
                                fraction*rods.x[3*contours.getSecond(i%240)+k];
                    }
                const SegmentCells::Around found = onPiece < 0 ? cells.lookAround(point.data()) :
                        cells.lookAround(onPiece);
                check(onPiece < 0 || cells.countAround(onPiece) == found.numPieces, "their number");
                check(found.numPieces == 0 || cells.isNear(cells.findMark(point.data())), "what is near");
                // By their middles.
                map<pair<int, double>, SegmentPiece> around;
                set<int> chainsAround;
                for (int number = 0; number < found.numPieces; number++) {
                    const SegmentPiece& piece = cells.getAround(found, number);
                    check(around.insert({{piece.segment, piece.start}, piece}).second, "a piece is there twice");
                    check(piece.length <= min(25.0, reach)*(1+1e-12) && piece.length <= cells.getLongest(),
                            "its length");
                    chainsAround.insert(contours.getChain(piece.segment));
                }
                check(onPiece < 0 || cells.countOthersAround(onPiece) ==
                        (chainsAround.size() > 1 ? found.numPieces : 0), "those of other chains");
                for (int s = 0; s < contours.getNumSegments(); s++)
                    for (double fraction = 0; fraction < 1.01; fraction += 0.125) {
                        double vector[3], square = 0;
                        for (int k = 0; k < 3; k++)
                            vector[k] = (1-fraction)*rods.x[3*contours.getFirst(s)+k]+
                                    fraction*rods.x[3*contours.getSecond(s)+k]-point[k];
                        if (ofCells != NULL)
                            takeToNearestImage(vector, ofCells);
                        for (double component : vector)
                            square += component*component;
                        const double along = 25*fraction;
                        const bool known = any_of(around.begin(), around.end(), [&] (const auto& entry) {
                            const SegmentPiece& piece = entry.second;
                            return piece.segment == s && along > piece.start-1e-9 &&
                                    along < piece.start+piece.length+1e-9;
                        });
                        check(square > reach*reach || known, "a place in reach is not found");
                    }
            }
        }
}

int main() {
    return runTests({
        testSegmentsAround,
        testUnbindingUnderLoad,
        testSpeedUnderLoad,
        testStalling,
        testWalkingTogether,
        testSpeedFromSiteToSite,
        testTrafficOnSites,
        testExtremes,
        testRunLengthsAndEnds,
        testSites,
        testCompetitionForSites,
        testThreadsAndImages,
        testOrderOfStorage,
        testEquilibriumOnRods
    });
}
