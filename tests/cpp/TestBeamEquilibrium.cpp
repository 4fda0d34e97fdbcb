/**
 * This tests chains of beam elements in equilibrium, against linear theory and against draws of the same energy.
 */

#include "TestBeamChains.h"
#include <algorithm>
#include <array>
#include <random>

/** A stiff cantilever has the variances of linear theory at a step that is far longer than it takes to relax. */
static void testExactVariances() {
    const int elements = 3, chains = 16;
    const double h = 0.5, length = elements*h, rigidity = 2000;
    Array x;
    vector<BeamChain> all;
    for (int i = 0; i < chains; i++) {
        all.push_back(beam(elements, h, 1e5, rigidity, x));
        all.back().fixed[0] = all.back().fixed[1] = true;
    }
    const Array start = x, f(x.size());
    const BeamEngine engine(all);
    StepSettings settings = {Scheme::Implicit, 1, 0.03, 3, 0};
    double samples = 0, deflection = 0, angle = 0, both = 0, middle = 0;
    for (int i = 0; i < 4000; i++) {
        advance(engine, x, f, settings);
        for (int chain = 0; chain < chains && i > 50; chain++)
            for (int k = 1; k < 3; k++, samples++) {
                const size_t end = 6*((elements+1)*chain+elements)+k;
                const double y = x[end]-start[end], slope = 3*(x[end+3]-x[end])/h, inner = x[end-6]-start[end-6];
                deflection += y*y;
                angle += slope*slope;
                both += y*slope;
                middle += inner*inner;
            }
    }
    // k_B T/EI times L^3/3, L and L^2/2, and l^3/3 of a node inside. Steps are nearly independent.
    const double tolerance = 5*sqrt(2/samples), inner = length-h;
    check(tolerance < 0.03, "too few samples");
    checkClose(1, deflection/samples*3*rigidity/(length*length*length), 1, tolerance, "variance of a deflection");
    checkClose(1, angle/samples*rigidity/length, 1, tolerance, "variance of an angle");
    checkClose(1, both/samples*2*rigidity/(length*length), 1, tolerance, "covariance of deflection and angle");
    checkClose(1, middle/samples*3*rigidity/(inner*inner*inner), 1, tolerance, "variance inside");
}

/** Averages of one chain in equilibrium, and their standard errors. */
struct Averages {
    double bending, cosine, square;
};

/** Draw a direction next to another one, and add what belongs to it to the logarithm of a weight. */
static array<double, 3> drawnNextTo(const array<double, 3>& d, double stiffness, bool planar, mt19937_64& generator,
            double& logarithm) {
    uniform_real_distribution<double> uniform;
    if (planar) {
        const double turn = normal_distribution<double>(0, 1/sqrt(stiffness))(generator), c = cos(turn), s = sin(turn);
        logarithm += 0.5*stiffness*turn*turn;
        return {c*d[0]-s*d[1], s*d[0]+c*d[1], 0};
    }
    const double cosine = 1+log(1-uniform(generator)*(1-exp(-2*stiffness)))/stiffness;
    const double sine = sqrt(max(0.0, 1-cosine*cosine)), angle = 2*M_PI*uniform(generator);
    logarithm -= stiffness*cosine;
    const double size = hypot(d[0], d[1]);
    const array<double, 3> a = {d[1]/size, -d[0]/size, 0}, b = {-d[2]*a[1], d[2]*a[0], d[0]*a[1]-d[1]*a[0]};
    array<double, 3> result;
    for (int k = 0; k < 3; k++)
        result[k] = cosine*d[k]+sine*(cos(angle)*a[k]+sin(angle)*b[k]);
    return result;
}

/**
 * Averages over chains that are drawn one by one. Positions and control points are linear in the vectors r' at the
 * nodes and in the middles of elements, so the measure is flat in these. Directions are drawn one next to the other,
 * and strains from their normal distributions, with the length in the middle that has this strain; weights make up for
 * the difference from the Boltzmann factor.
 */
static Averages drawn(int elements, double modulus, double rigidity, bool planar, int samples, Averages& errors) {
    Array x;
    BeamChain chain = beam(elements, 1, modulus, rigidity, x);
    chain.planar = planar;
    const BeamEngine engine({chain});
    const int vectors = 2*elements+1;
    mt19937_64 generator(17);
    normal_distribution<double> normal;
    // A bend between two vectors has a variance of 7/16 h k_B T/EI or so; those drawn are wider.
    const double stiffness = rigidity/0.6;
    vector<Averages> all(samples);
    Array logarithms(samples), unused(x.size());
    for (int sample = 0; sample < samples; sample++) {
        const int powerOfLength = planar ? 1 : 2;
        double logarithm = 0, strains = 0;
        vector<array<double, 3> > v(vectors);
        v[0] = {1, 0, 0};
        for (int i = 1; i < vectors; i++)
            v[i] = drawnNextTo(v[i-1], stiffness, planar, generator, logarithm);
        auto stretch = [&] (int i, double length) {
            logarithm += powerOfLength*log(max(length, 1e-9));
            for (double& component : v[i])
                component *= length;
        };
        auto drawnStrain = [&] (double share) {
            const double one = normal(generator);
            strains += 0.5*one*one;
            return one/sqrt(modulus*share);
        };
        for (int i = 0; i < vectors; i += 2)
            stretch(i, 1+drawnStrain(i == 0 || i == vectors-1 ? 1.0/6 : 1.0/3));
        for (int i = 1; i < vectors; i += 2) {
            // e = |u|-1-|t1+t2-2u|^2/40+|t2-t1|^4/480, solved for the length of u
            double sum = 0, difference = 0, along = 0;
            for (int k = 0; k < 3; k++) {
                sum += pow(v[i-1][k]+v[i+1][k], 2);
                difference += pow(v[i+1][k]-v[i-1][k], 2);
                along += v[i][k]*(v[i-1][k]+v[i+1][k]);
            }
            const double slope = 1+0.1*along, rest = 1+sum/40-difference*difference/480+drawnStrain(2.0/3);
            const double discriminant = sqrt(slope*slope-0.4*rest);
            logarithm -= log(discriminant);
            stretch(i, 5*(slope-discriminant));
        }
        double end[3] = {};
        for (int node = 0; node <= elements; node++)
            for (int k = 0; k < 3; k++) {
                // u = 3/2 chord/h-(t1+t2)/4
                if (node > 0)
                    end[k] += (v[2*node-1][k]+0.25*(v[2*node-2][k]+v[2*node][k]))/1.5;
                x[6*node+k] = end[k];
                x[6*node+3+k] = end[k]+v[2*node][k]/3;
            }
        const ChainEnergy energy = engine.addForces(0, x.data(), unused.data(), NULL, true);
        checkClose(strains, energy.stretching, 1+strains, 1e-9, "energy of strains that are drawn");
        const array<double, 3>& t1 = v[0], t2 = v[vectors-1];
        all[sample] = {energy.bending, (t1[0]*t2[0]+t1[1]*t2[1]+t1[2]*t2[2])/
                sqrt((t1[0]*t1[0]+t1[1]*t1[1]+t1[2]*t1[2])*(t2[0]*t2[0]+t2[1]*t2[1]+t2[2]*t2[2])),
                end[0]*end[0]+end[1]*end[1]+end[2]*end[2]};
        logarithms[sample] = logarithm-energy.bending;
    }
    const double largest = *max_element(logarithms.begin(), logarithms.end());
    double sum = 0;
    for (double& logarithm : logarithms)
        sum += logarithm = exp(logarithm-largest);
    auto meanOf = [&] (double Averages::*value, double& error) {
        double mean = 0, variance = 0;
        for (int i = 0; i < samples; i++)
            mean += logarithms[i]/sum*(all[i].*value);
        for (int i = 0; i < samples; i++)
            variance += pow(logarithms[i]/sum*(all[i].*value-mean), 2);
        error = sqrt(variance);
        return mean;
    };
    return {meanOf(&Averages::bending, errors.bending), meanOf(&Averages::cosine, errors.cosine),
            meanOf(&Averages::square, errors.square)};
}

/** The same averages over steps of many chains, and their standard errors from blocks of steps. */
static Averages stepped(int elements, double modulus, double rigidity, bool planar, double step, int steps,
            Averages& errors) {
    const int chains = 16, blocks = 20;
    Array x;
    vector<BeamChain> all;
    for (int i = 0; i < chains; i++) {
        all.push_back(beam(elements, 1, modulus, rigidity, x));
        all.back().planar = planar;
    }
    const Array f(x.size());
    const BeamEngine engine(all);
    StepSettings settings = {Scheme::Implicit, 1, step, 9, 0};
    const int discarded = steps/10;
    int divided = 0;
    vector<Averages> means(blocks, Averages {0, 0, 0});
    for (int i = 0; i < steps+discarded; i++) {
        divided += advance(engine, x, f, settings);
        if (i < discarded)
            continue;
        Averages& mean = means[(i-discarded)*(long) blocks/steps];
        const double weight = blocks/((double) steps*chains);
        mean.bending += bendingEnergyOf(engine, x)*weight;
        for (int chain = 0; chain < chains; chain++) {
            const double* const first = &x[6*(elements+1)*chain];
            const double* const last = first+6*elements;
            double dot = 0, square1 = 0, square2 = 0;
            for (int k = 0; k < 3; k++) {
                dot += (first[3+k]-first[k])*(last[3+k]-last[k]);
                square1 += (first[3+k]-first[k])*(first[3+k]-first[k]);
                square2 += (last[3+k]-last[k])*(last[3+k]-last[k]);
                mean.square += (last[k]-first[k])*(last[k]-first[k])*weight;
            }
            mean.cosine += dot/sqrt(square1*square2)*weight;
        }
    }
    check(divided < 1e-3*chains*steps, "steps in equilibrium are divided");
    auto meanOf = [&] (double Averages::*value, double& error) {
        double mean = 0, square = 0;
        for (const Averages& block : means)
            mean += block.*value/blocks;
        for (const Averages& block : means)
            square += pow(block.*value-mean, 2);
        error = sqrt(square/(blocks*(blocks-1)));
        return mean;
    };
    return {meanOf(&Averages::bending, errors.bending), meanOf(&Averages::cosine, errors.cosine),
            meanOf(&Averages::square, errors.square)};
}

static void compareEquilibrium(int elements, double rigidity, bool planar, double step, int steps) {
    const double modulus = 2e4;
    Averages errorsOfDraws, errors;
    const Averages expected = drawn(elements, modulus, rigidity, planar, 40000, errorsOfDraws);
    const Averages found = stepped(elements, modulus, rigidity, planar, step, steps, errors);
    const string name = " of "+to_string(elements)+" elements of rigidity "+to_string(rigidity);
    auto compare = [&] (double Averages::*value, const string& what) {
        const double error = hypot(errorsOfDraws.*value, errors.*value);
        check(error < 0.01*expected.*value, "too few samples: "+what+name);
        checkClose(expected.*value, found.*value, 1, 0.01*expected.*value+4*error, what+name);
    };
    compare(&Averages::bending, "bending energy");
    compare(&Averages::cosine, "cosine between the ends");
    compare(&Averages::square, "mean square distance of the ends");
}

/** Chains whose elements bend by 0.2 and by 0.7 radians, and draws of the continuous filament. */
static void testEquilibriumInPlane() {
    Averages errors;
    const Averages stiff = drawn(3, 2e4, 20, true, 40000, errors);
    checkClose(exp(-3/40.0), stiff.cosine, 1, 0.002+4*errors.cosine, "cosine of a continuous filament in a plane");
    compareEquilibrium(3, 20, true, 1e-3, 5000);
    compareEquilibrium(1, 2, true, 1e-4, 10000);
}

/** In space these are 0.3 and 1 radian. */
static void testEquilibriumInSpace() {
    Averages errors;
    const Averages stiff = drawn(3, 2e4, 20, false, 40000, errors);
    checkClose(exp(-3/20.0), stiff.cosine, 1, 0.002+4*errors.cosine, "cosine of a continuous filament");
    compareEquilibrium(3, 20, false, 1e-3, 5000);
    compareEquilibrium(1, 2, false, 1e-4, 10000);
}

int main() {
    return runTests({testExactVariances, testEquilibriumInPlane, testEquilibriumInSpace});
}
