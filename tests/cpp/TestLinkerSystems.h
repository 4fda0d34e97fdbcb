#ifndef CYLCHAIN_TEST_LINKER_SYSTEMS_H_
#define CYLCHAIN_TEST_LINKER_SYSTEMS_H_

/**
 * Linkers on chains that stand still, and what is expected of them in equilibrium.
 */

#include "TestChains.h"
#include "kinetics/LinkerKinetics.h"
#include <algorithm>

const double KT = 4.0;

/** Rods of some segments, and arcs of beam elements, that stand still. */
struct Rods {
    ChainList chains;
    Array x;
    void add(const double* start, const double* direction, int segments, double length) {
        Chain chain;
        chain.bending = (BendingModel) 0;
        chain.stretching = StretchingModel::Harmonic;
        for (int i = 0; i <= segments; i++) {
            chain.nodes.push_back(x.size()/3);
            chain.fixed.push_back(true);
            for (int k = 0; k < 3; k++)
                x.push_back(start[k]+i*length*direction[k]);
        }
        Segment segment = {length, 1, 0, 1, 1, 1, 1};
        chain.segments.assign(segments, segment);
        chain.joints.assign(segments-1, 1);
        chains.add(chain);
    }
    /** Part of a circle with a center, which begins along one of two vectors and goes towards the other one. */
    void addArc(const double* center, const double* from, const double* towards, double radius, int elements,
            double length) {
        BeamChain beam;
        beam.elementLength = length;
        for (int i = 0; i <= elements; i++) {
            const double angle = i*length/radius, c = cos(angle), s = sin(angle);
            const int first = x.size()/3;
            beam.particles.insert(beam.particles.end(), {first, first+1});
            for (double along : {0.0, length/3})
                for (int k = 0; k < 3; k++)
                    x.push_back(center[k]+(radius*c-along*s)*from[k]+(radius*s+along*c)*towards[k]);
        }
        beam.fixed.assign(beam.particles.size(), true);
        chains.add(beam);
    }
};

inline Hand handOf(double bindingRate, double reach, double unbindingRate, const vector<int>& chains) {
    Hand hand;
    hand.bindingRate = bindingRate;
    hand.reach = reach;
    hand.unbindingRate = unbindingRate;
    hand.chains = chains;
    return hand;
}

inline LinkerState freeLinkers(int count, int type = 0) {
    LinkerState state;
    for (int i = 0; i < count; i++) {
        Linker linker;
        linker.number = state.nextNumber++;
        linker.type = type;
        state.linkers.push_back(linker);
    }
    return state;
}

inline KineticStep stepOf(const Array& x, double size, const double* box = NULL) {
    KineticStep step = {x.data(), LinkBoxes(), 1e6, size, 11, 0};
    step.boxes.distances = box;
    return step;
}

/** Within four standard errors, of averages over blocks, and able to tell 5 %. */
struct Mean {
    vector<double> blocks;
    double sum = 0;
    long count = 0;
    void add(double value) {
        sum += value;
        count++;
    }
    void endBlock() {
        blocks.push_back(sum/count);
        sum = count = 0;
    }
    /** Within four standard errors, which must be below the share ``power`` of what is expected. */
    void check(const string& what, double expected, double power=0.05) const {
        double mean = 0, square = 0;
        for (double value : blocks)
            mean += value/blocks.size();
        for (double value : blocks)
            square += (value-mean)*(value-mean);
        const double error = sqrt(square/(blocks.size()*(blocks.size()-1.0)));
        // Written so that NaN fails.
        if (!(4*error < power*fabs(expected) && fabs(mean-expected) < 4*error))
            throw runtime_error(what+": found "+to_string(mean)+" +- "+to_string(error)+", expected "+
                    to_string(expected));
    }
};

/** What numbers and places are expected of a linker on two rods, by sums over places. */
struct Expected {
    double unbound, one, both, square;
};

inline Expected expectedOn(const Rods& rods, const LinkerSystem& system, double volume) {
    const Hand &a = system.hands[0], &b = system.hands[1];
    const LinkerType& type = system.types[0];
    const Contours contours(rods.chains);
    const double inVolume = 4*M_PI/3*pow(a.reach*b.reach, 1.5)/volume;
    const double ofA = a.bindingRate/a.unbindingRate, ofB = b.bindingRate/b.unbindingRate;
    const int points = 1500;
    Array places[] = {Array(3*points), Array(3*points)};
    for (int i = 0; i < 2; i++)
        for (int p = 0; p < points; p++)
            locate(contours.findPlace(i, contours.getLength(i)*(p+0.5)/points), rods.x.data(), NULL, &places[i][3*p]);
    double one = 0, both = 0, square = 0;
    for (int i = 0; i < 2; i++) {
        one += inVolume*contours.getLength(i)*(ofA+ofB);
        const double length = contours.getLength(i), other = contours.getLength(1-i);
        for (int p = 0; p < points; p++)
            for (int q = 0; q < points; q++) {
                const double *u = &places[i][3*p], *v = &places[1-i][3*q], s = length*(p+0.5)/points;
                double d = 0;
                for (int k = 0; k < 3; k++)
                    d += (u[k]-v[k])*(u[k]-v[k]);
                d = sqrt(d);
                if (d > min(a.reach, b.reach))
                    continue;
                const double energy = 0.5*type.stiffness*(d-type.restLength)*(d-type.restLength);
                const double weight = inVolume*ofA*ofB*exp(-energy/system.kT)*length*other/points/points;
                both += weight;
                square += weight*(s-0.5*length)*(s-0.5*length);
            }
    }
    const double all = 1+one+both;
    return {1/all, one/all, both/all, square/both};
}

/** Two different hands that bind to both rods, on a spring. */
inline LinkerSystem twoHands(double stiffness, double restLength, double reach, double other, double share) {
    LinkerSystem system;
    system.kT = KT;
    system.hands = {handOf(0.3, reach, 1, {0, 1}), handOf(0.6, other, 0.5, {0, 1})};
    system.hands[0].strainShare = share;
    system.hands[1].strainShare = 0.5*share;
    LinkerType type;
    type.hands[0] = 0;
    type.hands[1] = 1;
    type.stiffness = stiffness;
    type.restLength = restLength;
    system.types = {type};
    return system;
}

/** Linkers on two rods that are 100 long: how many hold nothing, and where. */
inline void checkEquilibrium(LinkerKinetics& kinetics, LinkerState& state, const KineticStep& step,
        const Expected& expected) {
    // Longer than a hand stays bound.
    const int interval = max(1, (int) (3/step.stepSize)), blocks = 20, samples = 5;
    for (int i = 0; i < 10*interval; i++)
        kinetics.advance(state, step, SERIAL);
    Mean unbound, one, both, square;
    for (int block = 0; block < blocks; block++) {
        for (int sample = 0; sample < samples; sample++) {
            for (int i = 0; i < interval; i++)
                kinetics.advance(state, step, SERIAL);
            for (const Linker& linker : state.linkers) {
                const int bound = linker.hands[0].isBound()+linker.hands[1].isBound();
                unbound.add(bound == 0);
                one.add(bound == 1);
                both.add(bound == 2);
                if (bound == 2) {
                    const double middle = 0.5*100;
                    square.add(pow(linker.hands[0].position-middle, 2));
                }
            }
        }
        for (Mean* mean : {&unbound, &one, &both, &square})
            mean->endBlock();
    }
    unbound.check("unbound", expected.unbound);
    one.check("one hand bound", expected.one);
    both.check("both hands bound", expected.both);
    square.check("places", expected.square);
}

inline void checkEquilibrium(const Rods& rods, double stiffness, double restLength, double reach, double share,
        double stepSize) {
    const LinkerSystem system = twoHands(stiffness, restLength, reach, reach, share);
    KineticStep step = stepOf(rods.x, stepSize);
    step.volume = 1.2e9;
    LinkerKinetics kinetics(system, rods.chains);
    LinkerState state = freeLinkers(2000);
    checkEquilibrium(kinetics, state, step, expectedOn(rods, system, step.volume));
}

const double ORIGIN[] = {0, 0, 0}, ALONG_X[] = {1, 0, 0};

/** A system of linkers with one hand, at anchors that are points. */
inline LinkerSystem anchoredSystem(const Hand& hand, double stiffness, const double* point) {
    LinkerSystem system;
    system.kT = KT;
    system.hands = {hand};
    LinkerType type;
    type.hands[1] = 0;
    type.stiffness = stiffness;
    system.types = {type};
    Place anchor;
    copy(point, point+3, anchor.point);
    system.anchors = {anchor};
    return system;
}

inline LinkerState boundLinkers(int count, double position) {
    LinkerState state = freeLinkers(count);
    for (Linker& linker : state.linkers) {
        linker.anchor = 0;
        linker.hands[1].chain = 0;
        linker.hands[1].position = position;
    }
    return state;
}

#endif /*CYLCHAIN_TEST_LINKER_SYSTEMS_H_*/
