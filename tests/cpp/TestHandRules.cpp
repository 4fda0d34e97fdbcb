/**
 * This tests rules for which hands of linkers bind, where, and in which order: numbers and places against sums over
 * the states that there are, for steps over a factor of a hundred; and with filaments that turn.
 */

#include "TestLinkerSystems.h"
#include <functional>
#include <random>

/** Of unbound linkers: so small that about as many of them hold nothing, one rod, and two. */
const double VOLUME = 1e8;

/** The weights of what a linker may hold, against nothing: by sums over places that a rule for pairs allows. */
struct Weights {
    double first = 0, second = 0, both = 0;
    double all() const {
        return 1+first+second+both;
    }
};

static Weights weightsOn(const Rods& rods, const LinkerSystem& system, double volume,
        const function<bool(int, double, int, double)>& joins, int points = 200) {
    const Hand &a = system.hands[0], &b = system.hands[1];
    const LinkerType& type = system.types[0];
    const Contours contours(rods.chains);
    const double inVolume = 4*M_PI/3*pow(a.reach*b.reach, 1.5)/volume;
    const double ofA = a.bindingRate/a.unbindingRate, ofB = b.bindingRate/b.unbindingRate;
    Weights weights;
    for (int i = 0; i < contours.getNumChains(); i++)
        for (int p = 0; p < points; p++) {
            const double s = contours.getLength(i)*(p+0.5)/points, ds = contours.getLength(i)/points;
            weights.first += inVolume*ofA*ds;
            weights.second += type.transActivated ? 0 : inVolume*ofB*ds;
            double u[3], v[3];
            locate(contours.findPlace(i, s), rods.x.data(), NULL, u);
            for (int j = 0; j < contours.getNumChains(); j++)
                for (int q = 0; q < points && j != i; q++) {
                    const double t = contours.getLength(j)*(q+0.5)/points, dt = contours.getLength(j)/points;
                    if (!joins(i, s, j, t))
                        continue;
                    locate(contours.findPlace(j, t), rods.x.data(), NULL, v);
                    double d = 0;
                    for (int k = 0; k < 3; k++)
                        d += (u[k]-v[k])*(u[k]-v[k]);
                    d = sqrt(d);
                    if (d <= min(a.reach, b.reach))
                        weights.both += inVolume*ofA*ofB*ds*dt*
                                exp(-0.5*type.stiffness*(d-type.restLength)*(d-type.restLength)/system.kT);
                }
        }
    return weights;
}

/** What linkers hold on rods that stand still. */
static void checkWeights(const Rods& rods, const LinkerSystem& system, double stepSize, const Weights& weights,
        const string& what) {
    KineticStep step = stepOf(rods.x, stepSize);
    step.volume = VOLUME;
    LinkerKinetics kinetics(system, rods.chains);
    LinkerState state = freeLinkers(1000);
    const int interval = max(1, (int) (2/stepSize));
    for (int i = 0; i < 10*interval; i++)
        kinetics.advance(state, step, SERIAL);
    Mean first, second, both;
    for (int block = 0; block < 20; block++) {
        for (int sample = 0; sample < 8; sample++) {
            for (int i = 0; i < interval; i++)
                kinetics.advance(state, step, SERIAL);
            for (const Linker& linker : state.linkers) {
                const bool isFirst = linker.hands[0].isBound(), isSecond = linker.hands[1].isBound();
                first.add(isFirst && !isSecond);
                second.add(isSecond && !isFirst);
                both.add(isFirst && isSecond);
            }
        }
        for (Mean* mean : {&first, &second, &both})
            mean->endBlock();
    }
    for (const auto& [mean, weight] : {make_pair(&first, weights.first), {&second, weights.second},
            {&both, weights.both}})
        if (weight > 0)
            mean->check(what, weight/weights.all());
        else
            for (double value : mean->blocks)
                check(value == 0, what+": found what a rule excludes");
}

/** A rod, and others beside it that are parallel, antiparallel, and across. */
static Rods fourRods() {
    Rods rods;
    const double a[] = {-50, 0, 0}, b[] = {-45, 0, 20}, c[] = {50, 20, 0}, d[] = {0, -50, -20};
    const double back[] = {-1, 0, 0}, across[] = {0, 1, 0};
    rods.add(a, ALONG_X, 2, 50);
    rods.add(b, ALONG_X, 1, 100);
    rods.add(c, back, 4, 25);
    rods.add(d, across, 1, 100);
    return rods;
}

/** Fewer proposals than twoHands() has take less time. */
static LinkerSystem weakHands(const vector<int>& chains) {
    LinkerSystem system = twoHands(0.05, 10, 70, 70, 0.4);
    for (Hand& hand : system.hands) {
        hand.chains = chains;
        hand.bindingRate *= 0.2;
    }
    return system;
}

/** With steps over a factor of a hundred. */
static void testAngles() {
    const Rods rods = fourRods();
    LinkerSystem system = weakHands({0, 1, 2, 3});
    // Cosines of the rods: with the first and the second one, the third is antiparallel; the fourth is across to all.
    auto kindOf = [] (int i, int j) {
        return i == 3 || j == 3 ? 0 : (i == 2) == (j == 2) ? 1 : -1;
    };
    const double windows[][2] = {{0.5, 1}, {-1, -0.5}, {-0.7, 0.7}};
    int number = 0;
    for (const double* window : windows) {
        system.types[0].leastCosine = window[0];
        system.types[0].largestCosine = window[1];
        // Where chains stand still, it makes no difference.
        system.types[0].reversible = number%2 == 0;
        const Weights weights = weightsOn(rods, system, VOLUME, [&] (int i, double, int j, double) {
            return kindOf(i, j) >= window[0] && kindOf(i, j) <= window[1];
        });
        checkWeights(rods, system, number%2 == 0 ? 0.03 : 3, weights, "angles");
        number++;
    }
}

static void testTransActivation() {
    const Rods rods = fourRods();
    LinkerSystem system = weakHands({0, 1, 2, 3});
    system.types[0].transActivated = true;
    const Weights weights = weightsOn(rods, system, VOLUME, [] (int, double, int, double) {return true;});
    for (double stepSize : {0.03, 3.0})
        checkWeights(rods, system, stepSize, weights, "trans-activation");
    // The first hand may unbind before the second one then.
    system.types[0].reversible = false;
    LinkerKinetics kinetics(system, rods.chains);
    LinkerState state = freeLinkers(1000);
    KineticStep step = stepOf(rods.x, 0.1);
    step.volume = VOLUME;
    int alone = 0;
    for (int i = 0; i < 500; i++) {
        kinetics.advance(state, step, SERIAL);
        for (const Linker& linker : state.linkers)
            alone += linker.hands[1].isBound() && !linker.hands[0].isBound();
    }
    check(alone > 100, "second hands are never alone");
}

/** Two rods, one of which turns about its middle, by Monte Carlo moves: all states have their weights. */
static void testTurning() {
    const int number = 6;
    LinkerSystem system = twoHands(0.003, 0, 300, 300, 0.3);
    const double volume = 4e11;
    Rods rods;
    const double a[] = {-50, 0, 0}, b[] = {-50, 0, 20};
    rods.add(a, ALONG_X, 1, 100);
    rods.add(b, ALONG_X, 1, 100);
    auto turn = [&] (double angle) {
        const double half[] = {50*cos(angle), 50*sin(angle)};
        for (int k = 0; k < 2; k++) {
            rods.x[6+k] = -half[k];
            rods.x[9+k] = half[k];
        }
    };
    auto everywhere = [] (int, double, int, double) {return true;};
    // By quadrature: the mean squared cosine, and how many linkers join both rods, within the rule and beyond.
    double norm = 0, cosine = 0, within = 0, beyond = 0;
    const int points = 60;
    for (int i = 0; i < points; i++) {
        const double angle = 2*M_PI*(i+0.5)/points;
        turn(angle);
        const Weights weights = weightsOn(rods, system, volume, everywhere, 60);
        const double weight = pow(weights.all(), number), share = weights.both/weights.all();
        norm += weight;
        cosine += weight*cos(angle)*cos(angle);
        (cos(angle) >= 0.2 ? within : beyond) += weight*share;
    }
    system.types[0].leastCosine = 0.2;
    const Contours contours(rods.chains);
    LinkerKinetics kinetics(system, rods.chains);
    LinkerState state = freeLinkers(number);
    mt19937_64 generator(5);
    uniform_real_distribution<double> uniform(0, 1);
    double angle = 0;
    auto energyAt = [&] (double at) {
        turn(at);
        double energy = 0;
        for (const Linker& linker : state.linkers)
            if (linker.pulls()) {
                double u[3], v[3], d = 0;
                locate(contours.findPlace(linker.hands[0].chain, linker.hands[0].position), rods.x.data(), NULL, u);
                locate(contours.findPlace(linker.hands[1].chain, linker.hands[1].position), rods.x.data(), NULL, v);
                for (int k = 0; k < 3; k++)
                    d += (u[k]-v[k])*(u[k]-v[k]);
                energy += 0.5*system.types[0].stiffness*pow(sqrt(d)-system.types[0].restLength, 2);
            }
        return energy;
    };
    Mean found, foundWithin, foundBeyond;
    for (int block = 0; block < 20; block++) {
        for (int i = 0; i < 8000; i++) {
            for (int move = 0; move < 2; move++) {
                const double before = energyAt(angle), changed = angle+M_PI*(2*uniform(generator)-1);
                if (uniform(generator) < exp((before-energyAt(changed))/KT))
                    angle = changed;
            }
            turn(angle);
            KineticStep step = stepOf(rods.x, 4);
            step.volume = volume;
            kinetics.advance(state, step, SERIAL);
            found.add(cos(angle)*cos(angle));
            const double share = count_if(state.linkers.begin(), state.linkers.end(), [] (const Linker& linker) {
                return linker.pulls();
            })/(double) number;
            foundWithin.add(cos(angle) >= 0.2 ? share : 0);
            foundBeyond.add(cos(angle) >= 0.2 ? 0 : share);
        }
        for (Mean* mean : {&found, &foundWithin, &foundBeyond})
            mean->endBlock();
    }
    found.check("angle", cosine/norm);
    foundWithin.check("joined within the rule", within/norm);
    foundBeyond.check("joined beyond the rule", beyond/norm);
}

/** Where hands bind: in proportion to what is near an end, or not, from solution and from another hand. */
static void testRanges() {
    Rods rods;
    const double a[] = {-50, 0, 0}, b[] = {-45, 0, 20};
    rods.add(a, ALONG_X, 4, 25);
    rods.add(b, ALONG_X, 1, 100);
    for (int end : {-1, 0, 1, 2})
        for (bool excluded : {false, true})
            for (double diffusion : {-1.0, 1e6}) {
                LinkerSystem system = weakHands({0, 1});
                for (Hand& hand : system.hands)
                    hand.bindingRange = {end, 30, excluded};
                if (end < 0)
                    system.hands[1].bindingRange = {1, 30, excluded};
                KineticStep step = stepOf(rods.x, 0.5);
                step.volume = VOLUME;
                const double edge = cbrt(step.volume), box[] = {edge, 0, 0, 0, edge, 0, 0, 0, edge};
                auto isIn = [&] (const BindingRange& own, double s) {
                    const bool isNear = (s <= 30 && own.end != 1) || (s >= 70 && own.end > 0);
                    return own.end < 0 || isNear != own.excluded;
                };
                if (diffusion >= 0) {
                    system.types[0].diffusion = diffusion;
                    step.boxes.distances = box;
                }
                LinkerKinetics kinetics(system, rods.chains);
                LinkerState state = freeLinkers(500);
                check(kinetics.placeFree(state, step), "no room");
                int joined = 0, bound = 0;
                for (int i = 0; i < 60; i++) {
                    kinetics.advance(state, step, SERIAL);
                    for (const Linker& linker : state.linkers) {
                        joined += linker.pulls();
                        for (int side = 0; side < 2; side++)
                            if (linker.hands[side].isBound()) {
                                bound++;
                                check(isIn(system.hands[side].bindingRange, linker.hands[side].position),
                                        "bound out of range");
                            }
                    }
                }
                check(bound > 1000 && joined > 100, "few are bound");
            }
    // How many, by their weights.
    LinkerSystem system = weakHands({0, 1});
    system.hands[0].bindingRange = {2, 20, true};
    system.hands[1].bindingRange = {1, 50, false};
    auto isInOne = [] (double s) {return s >= 20 && s <= 80;};
    auto isInTwo = [] (double s) {return s >= 50;};
    Weights weights = weightsOn(rods, system, VOLUME, [&] (int, double s, int, double t) {
        return isInOne(s) && isInTwo(t);
    });
    weights.first *= 0.6;
    weights.second *= 0.5;
    for (double stepSize : {0.03, 3.0})
        checkWeights(rods, system, stepSize, weights, "ranges");
}

int main() {
    return runTests({
        testAngles,
        testTransActivation,
        testRanges,
        testTurning
    });
}
