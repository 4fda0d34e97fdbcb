#ifndef GROWING_CHAINS_H_
#define GROWING_CHAINS_H_

/**
 * Chains that grow, for tests: what they are made of, their equilibrium by hand, and means over them.
 */

#include "TestChains.h"
#include "growth/ChainGrowth.h"
#include <map>
#include <tuple>

static const int PER_SEGMENT = 12;
static const double MONOMER = 2, KT = 2.5;

/** What is soft enough to show: lengths fluctuate by 4 %, and joints bend by 0.5. */
inline MonomerTable makeTable(bool fene, double softness = 1) {
    MonomerTable table;
    table.monomersPerSegment = PER_SEGMENT;
    for (int m = 1; m <= 2*PER_SEGMENT; m++) {
        const double length = MONOMER*m;
        table.segments.push_back({length, 60/softness/length, fene ? 0.3*length : 0, 1, 2, 10, 10});
    }
    for (int both = 2; both <= 3*PER_SEGMENT; both++)
        table.joints.push_back(8*KT*2*PER_SEGMENT/both/softness);
    return table;
}

inline mt19937_64 generatorOf(int seed) {
    return mt19937_64(seed);
}

/** A number drawn by a density on a grid. */
template <class Density> double drawFrom(Density density, double from, double to, mt19937_64& generator) {
    const int count = 1000;
    static thread_local vector<double> sums;
    sums.assign(1, 0);
    for (int i = 0; i < count; i++)
        sums.push_back(sums.back()+density(from+(i+0.5)*(to-from)/count));
    const double chosen = uniform_real_distribution<double>(0, sums.back())(generator);
    const int i = upper_bound(sums.begin(), sums.end(), chosen)-sums.begin()-1;
    return from+(i+(chosen-sums[i])/(sums[i+1]-sums[i]))*(to-from)/count;
}

inline double bendingByHand(BendingModel model, double stiffness, double angle) {
    const double length = bendByHand(model, min(fabs(angle), M_PI-1e-6)).length;
    return 0.5*stiffness*length*length;
}

inline double stretchingByHand(const Segment& segment, StretchingModel model, double extension) {
    const double d = segment.maximumExtension;
    if (model == StretchingModel::Harmonic)
        return 0.5*segment.stiffness*extension*extension;
    return fabs(extension) < d ? -0.5*segment.stiffness*d*d*log(1-extension*extension/d/d) : HUGE_VAL;
}

/** Weights of the angle of a joint and of the extension of a segment, in equilibrium. */
struct Weights {
    BendingModel bending;
    StretchingModel stretching;
    bool planar;
    double ofAngle(double stiffness, double angle) const {
        return (planar ? 1 : sin(angle))*exp(-bendingByHand(bending, stiffness, angle)/KT);
    }
    double ofExtension(const Segment& segment, double extension) const {
        const double length = segment.restLength+extension;
        return length > 0 ? pow(length, planar ? 1 : 2)*exp(-stretchingByHand(segment, stretching, extension)/KT) : 0;
    }
    double meanBending(double stiffness) const {
        static map<tuple<int, bool, double>, double> known;
        double& found = known[{static_cast<int>(bending), planar, stiffness}];
        if (found > 0)
            return found;
        double sum = 0, norm = 0;
        for (int i = 0; i < 31415; i++) {
            const double angle = 1e-4*(i+0.5), weight = ofAngle(stiffness, angle);
            sum += weight*bendingByHand(bending, stiffness, angle);
            norm += weight;
        }
        return found = sum/norm;
    }
    double meanStretching(const Segment& segment) const {
        static map<tuple<int, bool, double, double>, double> known;
        double& found = known[{static_cast<int>(stretching), planar, segment.restLength, segment.stiffness}];
        if (found > 0)
            return found;
        double sum = 0, norm = 0;
        for (int i = -10000; i < 10000; i++) {
            const double extension = 1e-4*i*segment.restLength, weight = ofExtension(segment, extension);
            if (weight > 0) {
                sum += weight*stretchingByHand(segment, stretching, extension);
                norm += weight;
            }
        }
        return found = sum/norm;
    }
};

inline GrowingEnd endOf(double onRate, double offRate) {
    GrowingEnd end;
    end.states[0].onRate = onRate;
    end.states[0].offRate = offRate;
    return end;
}

/** Chains that grow, where they are and what they have become. */
struct Growing {
    ChainList chains;
    Array x;
    GrowthSystem system;
    GrowthState state;
    vector<MonomerRange> ranges;
    vector<BendingModel> bending;
    vector<StretchingModel> stretching;
    vector<char> planar;
    /** Add a chain in equilibrium. */
    void add(const Weights& weights, MonomerRange range, int particles, const GrowingEnd& minus,
            const GrowingEnd& plus, mt19937_64& generator, int pool = 0) {
        const MonomerTable& table = system.tables[0];
        Chain chain;
        chain.bending = weights.bending;
        chain.stretching = weights.stretching;
        chain.planar = weights.planar;
        for (int i = 0; i < particles; i++)
            chain.nodes.push_back(x.size()/3+i);
        chain.fixed.assign(particles, false);
        setMonomers(chain, table, range);
        // One that is to begin is somewhere.
        Vec3d node = {0, 0, 0}, along = {1, 0, 0};
        auto put = [&] {
            x.insert(x.end(), {node.x, node.y, node.z});
        };
        if (range.size() > 0)
            put();
        for (size_t s = 0; s < chain.segments.size(); s++) {
            if (s > 0) {
                const double stiffness = chain.joints[s-1];
                const double angle = drawFrom([&] (double a) {return weights.ofAngle(stiffness, fabs(a));},
                        weights.planar ? -M_PI : 0, M_PI, generator);
                const double azimuth = uniform_real_distribution<double>(0, 2*M_PI)(generator);
                const Vec3d first = weights.planar ? Vec3d {-along.y, along.x, 0} :
                        along.cross(fabs(along.x) < 0.5 ? Vec3d {1, 0, 0} : Vec3d {0, 1, 0});
                const Vec3d across = first*(1/sqrt(first.squared())), other = along.cross(across);
                along = along*cos(angle)+(weights.planar ? across : across*cos(azimuth)+other*sin(azimuth))*sin(angle);
            }
            const double rest = chain.segments[s].restLength;
            const double extension = drawFrom([&] (double e) {return weights.ofExtension(chain.segments[s], e);},
                    -0.6*rest, 0.6*rest, generator);
            node = node+along*(rest+extension);
            put();
        }
        for (size_t i = 0; i < chain.spareNodes.size(); i++)
            put();
        GrowingChain own;
        own.chain = chains.add(chain);
        own.pool = pool;
        own.ends[0] = minus;
        own.ends[1] = plus;
        system.chains.push_back(own);
        ranges.push_back(range);
        bending.push_back(weights.bending);
        stretching.push_back(weights.stretching);
        planar.push_back(weights.planar);
    }
    /** Begin: chains, and what is known of them, must not be added any more. */
    ChainGrowth makeGrowth() {
        state = GrowthState(system, ranges);
        return ChainGrowth(system, bending, stretching, planar);
    }
    GrowthChanges advance(ChainGrowth& growth, double stepSize, int seed, const vector<Surroundings*>& around = {}) {
        const GrowthChanges changes = growth.advance(state, {KT, stepSize, static_cast<uint32_t>(seed)}, chains,
                x.data(), around);
        check(changes.failed == -1, "a step");
        return changes;
    }
};

struct Mean {
    double sum = 0, squares = 0;
    long long count = 0;
    void add(double value) {
        sum += value;
        squares += value*value;
        count++;
    }
    double mean() const {
        return sum/count;
    }
    double variance() const {
        return squares/count-mean()*mean();
    }
    double error() const {
        return sqrt(variance()/count);
    }
};

inline void checkMean(double expected, const Mean& found, double power, const string& what) {
    check(found.error() < power*fabs(expected)/4, what+": too few samples");
    checkClose(expected, found.mean(), 4*found.error(), 1, what);
}

#endif /*GROWING_CHAINS_H_*/
