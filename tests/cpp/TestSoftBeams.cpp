/**
 * This tests chains of beam elements that bend by a radian and more, in equilibrium, against integrals.
 *
 * Positions and control points are linear in the vectors r' at the nodes (t) and in the middles of elements (u), so the
 * measure is flat in these. Where strains are small, what is left is an integral over the angles alpha and beta from t
 * to u and from u to the next t, and over the angle phi between the planes in which they are. How an element bends does
 * not depend on the others, so the averages of a chain are those of one element.
 */

#include "TestBeamChains.h"
#include <algorithm>

/** The bending energy of an element, the cosine between its ends, and the square distance of the ends of the chain. */
struct Averages {
    double bending = 0, cosine = 0, square = 0;
};

/** The averages for h = 1 and k_B T = 1, from sums over the midpoints of equal intervals of the three angles. */
static Averages integrated(int elements, double rigidity, bool planar) {
    const int angles = 240, planes = planar ? 1 : 48;
    double sum = 0, chordSquare = 0, along = 0;
    Averages result;
    for (int i = 0; i < angles; i++)
        for (int j = 0; j < angles; j++)
            for (int k = 0; k < planes; k++) {
                // In a plane both angles have a sign.
                const double alpha = M_PI*(planar ? 2*(i+0.5)/angles-1 : (i+0.5)/angles);
                const double beta = M_PI*(planar ? 2*(j+0.5)/angles-1 : (j+0.5)/angles);
                const double c = planar ? 1 : cos(M_PI*(k+0.5)/planes);
                const double bends = alpha*alpha+beta*beta, both = 2*alpha*beta*c;
                const double cosine = cos(alpha)*cos(beta)-sin(alpha)*sin(beta)*c;
                const double t = 2+2*cosine, v = 2-2*cosine, direction = cos(alpha)+cos(beta);
                const double energy = rigidity/2*(bends+both+4.0/3*(bends-both)*pow(1+v/40+v*v/560+(bends-both)/84, 2));
                // The length u of the middle vector has no strain: u-1-|t1+t2-2u|^2/40+|t2-t1|^4/480 = 0.
                const double slope = 1+0.1*direction, root = sqrt(slope*slope-0.4*(1+t/40-v*v/480));
                const double u = 5*(slope-root);
                const double weight = exp(-energy)/root*(planar ? u : u*u*sin(alpha)*sin(beta));
                sum += weight;
                result.bending += weight*energy;
                result.cosine += weight*cosine;
                // The chord is (2/3) u+(t1+t2)/6, all divided by h.
                chordSquare += weight*(4*u*u/9+t/36+2*u*direction/9);
                along += weight*(2*u*direction/6+t/12);
            }
    result.bending /= sum;
    result.cosine /= sum;
    chordSquare /= sum;
    along /= sum;
    for (int i = 0; i < elements; i++) {
        result.square += chordSquare;
        for (int j = 0; j < i; j++)
            result.square += 2*along*along*pow(result.cosine, i-j-1);
    }
    return result;
}

/** The averages over steps of many chains, and their standard errors from blocks of steps. */
static Averages stepped(int elements, double rigidity, bool planar, double step, int steps, Averages& errors) {
    const int chains = 64, blocks = 20, discarded = steps/5;
    Array x;
    vector<BeamChain> all;
    for (int i = 0; i < chains; i++) {
        all.push_back(beam(elements, 1, 2e4, rigidity, x));
        all.back().planar = planar;
    }
    const Array f(x.size());
    const BeamEngine engine(all);
    StepSettings settings = {Scheme::Implicit, 1, step, 9, 0};
    int divided = 0;
    vector<Averages> means(blocks);
    for (int i = 0; i < steps+discarded; i++) {
        divided += advance(engine, x, f, settings);
        if (i < discarded)
            continue;
        Averages& mean = means[(i-discarded)*(long) blocks/steps];
        const double weight = blocks/((double) steps*chains);
        mean.bending += bendingEnergyOf(engine, x)*weight/elements;
        for (int chain = 0; chain < chains; chain++) {
            const double* const first = &x[6*(elements+1)*chain];
            for (int e = 0; e < elements; e++) {
                double dot = 0, square1 = 0, square2 = 0;
                for (int k = 0; k < 3; k++) {
                    const double a = first[6*e+3+k]-first[6*e+k], b = first[6*e+9+k]-first[6*e+6+k];
                    dot += a*b;
                    square1 += a*a;
                    square2 += b*b;
                }
                mean.cosine += dot/sqrt(square1*square2)*weight/elements;
            }
            for (int k = 0; k < 3; k++)
                mean.square += pow(first[6*elements+k]-first[k], 2)*weight;
        }
    }
    check(divided < 1e-3*chains*steps, "steps of soft elements are divided");
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

/** The step up to which soft elements have the right energy, by docs/design/beam_elements.md, for a friction of 2. */
static double longestStep(double rigidity) {
    return 2/rigidity*min(2.1e-3*rigidity, 2e-5*rigidity*rigidity*rigidity);
}

/** Without half of the metric forces, the energy of the softest elements would be lower by 2 %. */
static void compare(int elements, double rigidity, bool planar, int steps) {
    const double step = longestStep(rigidity);
    const Averages expected = integrated(elements, rigidity, planar);
    Averages errors;
    const Averages found = stepped(elements, rigidity, planar, step, steps, errors);
    auto compareOne = [&] (double Averages::*value, double largestError, const string& name) {
        const string what = name+" of "+to_string(elements)+" elements "+(planar ? "in a plane" : "in space");
        check(errors.*value < largestError*expected.*value, "too few samples: "+what);
        checkClose(expected.*value, found.*value, 1, 0.01*expected.*value+4*errors.*value, what);
    };
    compareOne(&Averages::bending, 0.008, "bending energy");
    compareOne(&Averages::cosine, 0.005, "cosine");
    compareOne(&Averages::square, 0.01, "square distance");
}

static void testOneElement() {
    compare(1, 1, true, 60000);
    compare(1, 1, false, 60000);
}

static void testSeveralElements() {
    compare(3, 2, true, 30000);
    compare(3, 2, false, 30000);
    compare(3, 10, false, 5000);
}

int main() {
    return runTests({testOneElement, testSeveralElements});
}
