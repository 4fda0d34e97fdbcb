/**
 * This tests chains of beam elements: forces against differences of energies, cantilevers and columns against the
 * elastica, noise against the friction of the curve, rods, also in a flow, and what is refused.
 */

#include "TestBeamChains.h"
#include "couplings/CapsuleGeometry.h"
#include "mechanics/ElementHold.h"
#include <algorithm>

static void testForces() {
    NormalNumbers normalNumbers(1);
    for (bool planar : {false, true})
        for (double shortening : {0.0, 0.02}) {
            Array x;
            vector<BeamChain> chains;
            for (int elements : {5, 1, 3, 4, 4, 2}) {
                chains.push_back(beam(elements, 2+0.1*elements, 50, 7, x));
                chains.back().planar = planar;
                chains.back().shortening = shortening;
                const double* const last = &x[3*chains.back().particles[2*elements]];
                chains.back().tethers = {{elements, {last[0]+1, last[1]-0.5, planar ? last[2] : 0.7}, 0.9},
                        {0, {0.2, last[1], last[2]}, 0.4}};
            }
            const Array scatter = normalNumbers(x.size());
            for (size_t i = 0; i < x.size(); i++)
                if (!planar || i%3 < 2)
                    x[i] += 0.15*scatter[i];
            const BeamEngine engine(chains);
            Array f(x.size());
            double sum = 0;
            for (int pack = 0; pack < engine.getNumPacks(); pack++) {
                const ChainEnergy energy = engine.addForces(pack, x.data(), f.data(), NULL, true);
                sum += energy.stretching+energy.bending+energy.tethers;
            }
            checkClose(energyOf(engine, x), sum, sum, 1e-12, "energy");
            for (size_t i = 0; i < x.size(); i++) {
                Array plus = x, minus = x;
                plus[i] += 1e-5;
                minus[i] -= 1e-5;
                const double slope = (energyOf(engine, plus)-energyOf(engine, minus))/2e-5;
                if (!planar || i%3 < 2)
                    checkClose(-slope, f[i], 1, 1e-6, "force on coordinate "+to_string(i));
            }

            // The same in a periodic box, wherever the images of particles are.
            const double box[] = {40, 0, 0, 5, 45, 0, 0, 0, 50};
            Array wrapped = x;
            for (size_t i = 0; i < x.size()/3; i++)
                for (int k = 0; k < 3; k++)
                    wrapped[3*i+k] += (int) (i%3-1)*box[3*(i%2)+k];
            checkClose(sum, energyOf(engine, wrapped, box), sum, 1e-10, "energy in a box");
        }
}

/**
 * Stiff springs that hold two nodes further apart than the chain is long, in long steps without noise: the tension of
 * the chain is that of the springs, in a pack of several lanes, and the same where steps are divided.
 */
static void testTethers() {
    Array x;
    vector<BeamChain> chains;
    for (int elements : {3, 3, 2}) {
        chains.push_back(beam(elements, 2, 50, 7, x));
        const double* const first = &x[3*chains.back().particles[0]];
        const double end = 2*elements+1, stiffness = 10*(1+chains.size());
        chains.back().tethers = {{elements, {end, first[1], 3}, stiffness}, {0, {first[0]-1, first[1], 3}, stiffness}};
    }
    const BeamEngine engine(chains);
    StepSettings settings;
    settings.scheme = Scheme::Implicit;
    settings.stepSize = 1e4;
    settings.kT = 0;
    const Array f(x.size());
    for (int i = 0; i < 60; i++)
        advance(engine, x, f, settings);
    for (const BeamChain& chain : chains) {
        const int elements = chain.numNodes()-1;
        const double stiffness = chain.tethers[0].stiffness;
        const double *first = &x[3*chain.particles[0]], *last = &x[3*chain.particles[2*elements]];
        // Each of two springs is longer by T/k, and the chain by T L/K: all of it is the room of 2.
        const double tension = 2/(2/stiffness+2.0*elements/chain.stretchingModulus);
        checkClose(2*elements*(1+tension/chain.stretchingModulus), last[0]-first[0], 1, 1e-6, "length under tension");
        checkClose(chain.tethers[0].point[0]-tension/stiffness, last[0], 1, 1e-6, "the end of a spring");
        checkClose(3, first[2], 1, 1e-6, "height of the first node");
    }
}

/** What couplings hold of an element: places, pieces of the curve, and tangents, which are derivatives of places. */
static void testPlacesOfElements() {
    auto at = [] (const BezierWeights& weights) {
        return Array {weights.position1, weights.control1, weights.position2, weights.control2};
    };
    const double length = 2.5;
    for (double x : {0.0, 0.1, 0.37, 0.5, 0.92, 1.0}) {
        const Array place = at(BezierWeights(x)), plus = at(BezierWeights(x+1e-6)), minus = at(BezierWeights(x-1e-6));
        const Array same = at(weightsOf({}, x, length));
        const Array tangent = at(weightsOf({1, 0}, x, length));
        const Array back = at(weightsOf({-1, 0}, x, length));
        const int pieces = 4;
        const Array piece = at(weightsOf({0, pieces}, x, length));
        const int left = min(pieces-1, (int) (x*pieces));
        const double share = x*pieces-left;
        const Array one = at(BezierWeights(left/4.0)), other = at(BezierWeights((left+1)/4.0));
        for (int i = 0; i < 4; i++) {
            checkClose(place[i], same[i], 1, 0, "weight of a place");
            checkClose((plus[i]-minus[i])/2e-6/length, tangent[i], 1, 1e-8, "weight of a tangent");
            checkClose(-tangent[i], back[i], 1, 1e-15, "weight of the opposite of a tangent");
            checkClose((1-share)*one[i]+share*other[i], piece[i], 1, 1e-14, "weight of a place on a piece");
        }
    }
}

/** The energy of a planar arc, of which the angle is linear, and of an angle that is quadratic along an element. */
static void testEnergyOfShapes() {
    const double h = 2, turn = 0.3, bow = 0.1;
    for (double second : {0.0, bow}) {
        // theta = turn x + 4 second x (1-x), x from 0 to 1; the chord is integrated by many points.
        double chord[2] = {};
        const int points = 20000;
        for (int i = 0; i < points; i++) {
            const double s = (i+0.5)/points, theta = turn*s+4*second*s*(1-s);
            chord[0] += h*cos(theta)/points;
            chord[1] += h*sin(theta)/points;
        }
        Array x;
        const BeamChain chain = beam(1, h, 1e4, 5, x);
        const double node[] = {0, 0, 0, h/3, 0, 0, chord[0], chord[1], 0, chord[0]+h/3*cos(turn),
                chord[1]+h/3*sin(turn), 0};
        copy(node, node+12, x.begin());
        const BeamEngine engine({chain});
        // (EI/2h) int (turn+4 second (1-2x))^2 dx
        const double expected = 5/(2*h)*(turn*turn+16*second*second/3);
        checkClose(expected, bendingEnergyOf(engine, x), expected, 1e-3, "bending energy of a curve");
        // An error of 10^-5 in the chord would be more than this.
        checkClose(0, energyOf(engine, x)-bendingEnergyOf(engine, x), 0.5*1e4*h*2.0/3, 2e-10, "length of a curve");
    }
}

/** A force across the end of a cantilever, and its weight, over EI/L^2: a length of one and a rigidity of one. */
struct Load {
    double force, weight;
};

/** Where a cantilever comes to rest: how far its end moves back, how far up, and its angle. */
static Array cantilever(int elements, const Load& load) {
    Array x;
    BeamChain chain = beam(elements, 1.0/elements, 1e6, 1, x);
    chain.fixed[0] = chain.fixed[1] = true;
    const BeamEngine engine({chain});
    StepSettings settings = {Scheme::Implicit, 0, 0.02, 1, 0};
    Array f(x.size());
    f[6*elements+1] = load.force;
    // A distributed load does the work of half of it on each node, and plus and minus a quarter on control vectors.
    for (int e = 0; e < elements; e++)
        for (int k = 0; k < 2; k++) {
            const double share = load.weight/elements, control = k == 0 ? 0.25*share : -0.25*share;
            f[6*(e+k)+1] += 0.5*share-control;
            f[6*(e+k)+4] += control;
        }
    for (int i = 0; i < 400; i++)
        advance(engine, x, f, settings);
    checkClose(0, x[1], 1, 0, "the clamped node");
    const double* const end = &x[6*elements];
    return {1-end[0], end[1], atan2(end[4]-end[1], end[3]-end[0])};
}

static void testCantilevers() {
    // The elastica theta'' = -(force+weight (1-s)) cos theta, by collocation to ten digits.
    const struct {
        Load load;
        Array exact;
    } loads[] = {{{1, 0}, {0.0564332363, 0.3017207738, 0.4613519497}},
            {{10, 0}, {0.5549955978, 0.8106090249, 1.4302855388}},
            {{0, 24}, {0.6035092822, 0.8515855597, 1.3939531638}},
            // The ruler of Chandran and Mofrad, Phys. Rev. E 2009, 79, 011906, Fig. 8: 3.40 and 12.63 cm of 30.
            {{1.47, 0.20775}, {0.1132354870, 0.4209029443, 0.6523828486}}};
    const struct {
        int elements, load;
        /** Relative errors, hardly larger than what they are. */
        double back, up, angle;
    } cases[] = {{1, 0, 1.2e-3, 2e-4, 1.5e-4}, {2, 0, 1e-4, 1e-4, 1e-4}, {2, 1, 1.5e-3, 1.1e-3, 7e-4},
            {3, 1, 2.7e-4, 2e-4, 1.6e-4}, {4, 1, 1e-4, 1e-4, 1e-4}, {3, 2, 7e-4, 1.6e-3, 7e-4},
            {4, 2, 1.5e-4, 5e-4, 2.5e-4}, {1, 3, 1.4e-3, 1.8e-3, 1.3e-3}, {2, 3, 1.5e-4, 1e-4, 1e-4}};
    for (const auto& one : cases) {
        const Array found = cantilever(one.elements, loads[one.load].load), &exact = loads[one.load].exact;
        const string name = " of a cantilever of "+to_string(one.elements)+" elements, load "+to_string(one.load);
        checkClose(exact[0], found[0], exact[0], one.back, "displacement"+name);
        checkClose(exact[1], found[1], exact[1], one.up, "deflection"+name);
        checkClose(exact[2], found[2], exact[2], one.angle, "angle"+name);
    }
}

/** A couple at the end, as a pair of forces on a node, bends a cantilever into an arc. */
static void testCouple() {
    Array x;
    BeamChain chain = beam(2, 0.5, 1e6, 1, x);
    chain.fixed[0] = chain.fixed[1] = true;
    const BeamEngine engine({chain});
    StepSettings settings = {Scheme::Implicit, 0, 0.02, 1, 0};
    Array f(x.size());
    for (int i = 0; i < 400; i++) {
        const double arm[] = {x[15]-x[12], x[16]-x[13]}, square = arm[0]*arm[0]+arm[1]*arm[1];
        f[15] = -arm[1]/square;
        f[16] = arm[0]/square;
        f[12] = -f[15];
        f[13] = -f[16];
        advance(engine, x, f, settings);
    }
    checkClose(1, atan2(x[16]-x[13], x[15]-x[12]), 1, 2e-4, "angle of an arc");
    checkClose(sin(1), x[12], 1, 2e-4, "end of an arc");
    checkClose(1-cos(1), x[13], 1, 2e-4, "height of an arc");
}

/**
 * A column of unit length and rigidity that is clamped at its foot, with a load along it: the sideways position and the
 * angle of its end after some time, having begun with a little bend.
 */
static Array column(int elements, double load, int steps) {
    Array x;
    BeamChain chain = beam(elements, 1.0/elements, 1e7, 1, x);
    chain.fixed[0] = chain.fixed[1] = true;
    for (int node = 0; node <= elements; node++) {
        // y = c (1-cos(pi s/2)), the shape in which it buckles
        const double s = node/(double) elements, height = 0.02*(1-cos(0.5*M_PI*s));
        x[6*node+1] += height;
        x[6*node+4] += height+0.01*M_PI*sin(0.5*M_PI*s)/(3*elements);
    }
    const BeamEngine engine({chain});
    StepSettings settings = {Scheme::Implicit, 0, 0.5, 1, 0};
    Array f(x.size());
    f[6*elements] = -load;
    for (int i = 0; i < steps; i++)
        advance(engine, x, f, settings);
    const double* const end = &x[6*elements];
    return {end[1], atan2(end[4]-end[1], end[3]-end[0])};
}

/**
 * A column of one element buckles under 1.0075 (pi/2)^2 EI/L^2, which is also that of two elements and both ends
 * hinged, and one of two elements within 0.1 % of it. Above it, the end turns as far as the elastica: by 20 degrees
 * under 1.0154 times the load, and by 60 under 1.1517 times.
 */
static void testBuckling() {
    const double critical = 0.25*M_PI*M_PI;
    const struct {
        int elements;
        double below, above;
    } cases[] = {{1, 1.005, 1.010}, {2, 0.999, 1.0015}, {4, 0.9995, 1.0007}};
    for (const auto& one : cases) {
        const string name = " a column of "+to_string(one.elements)+" elements";
        check(column(one.elements, one.below*critical, 400)[0] < column(one.elements, one.below*critical, 50)[0],
                "below its load,"+name+" bends");
        check(column(one.elements, one.above*critical, 400)[0] > column(one.elements, one.above*critical, 50)[0],
                "above its load,"+name+" does not bend");
    }
    // From elliptic integrals: K(sin(angle/2)) = (pi/2) (load/critical)^(1/2).
    const double degree = M_PI/180;
    checkClose(20*degree, column(4, 1.015397*critical, 3000)[1], 20*degree, 0.02, "angle of a column");
    checkClose(60*degree, column(4, 1.151720*critical, 3000)[1], 60*degree, 0.003, "angle of a column that bends far");
}

/** Places between zero and one, and their weights. */
struct Quadrature {
    Array places, weights;
};

static Quadrature manyPoints() {
    const int points = 400;
    Quadrature result;
    for (int i = 0; i < points; i++) {
        result.places.push_back((i+0.5)/points);
        result.weights.push_back(1.0/points);
    }
    return result;
}

static Quadrature fourGaussPoints() {
    const double inner = sqrt(3.0/7-2.0/7*sqrt(6.0/5)), outer = sqrt(3.0/7+2.0/7*sqrt(6.0/5));
    const double more = (18+sqrt(30))/72, less = (18-sqrt(30))/72;
    return {{0.5*(1-outer), 0.5*(1-inner), 0.5*(1+inner), 0.5*(1+outer)}, {less, more, more, less}};
}

/** The friction of a curve as a dense matrix of positions and control vectors. */
static vector<Array> denseFriction(const BeamChain& chain, const Array& x, const Quadrature& points) {
    const int n = chain.particles.size();
    vector<Array> result(3*n, Array(3*n));
    for (int e = 0; e < chain.numNodes()-1; e++)
        for (size_t i = 0; i < points.places.size(); i++) {
            const double s = points.places[i], r = 1-s;
            const double weights[] = {r*r*(1+2*s), 3*s*r*r, s*s*(1+2*r), -3*s*s*r};
            const double slopes[] = {-6*s*r, 3*r*(1-3*s), 6*s*r, 3*s*(3*s-2)};
            double t[3] = {}, square = 0;
            for (int k = 0; k < 3; k++) {
                for (int node = 0; node < 2; node++) {
                    const double* const p = &x[6*(e+node)];
                    t[k] += slopes[2*node]*p[k]+slopes[2*node+1]*(p[3+k]-p[k]);
                }
                square += t[k]*t[k];
            }
            const double size = chain.elementLength*points.weights[i];
            for (int a = 0; a < 4; a++)
                for (int b = 0; b < 4; b++)
                    for (int k = 0; k < 3; k++)
                        for (int l = 0; l < 3; l++)
                            result[6*e+3*a+k][6*e+3*b+l] += size*weights[a]*weights[b]*
                                    (chain.perpendicularFriction*(k == l)+
                                    (chain.parallelFriction-chain.perpendicularFriction)*t[k]*t[l]/square);
        }
    return result;
}

/** The error of four points is that of the second order in the bend of an element, 0.2 % for a radian. */
static void testFriction() {
    for (double bend : {0.1, 0.5, 1.0}) {
        Array x;
        const BeamChain chain = beam(1, 1, 1, 1, x);
        const double end[] = {sin(bend)/bend, (1-cos(bend))/bend};
        const double node[] = {0, 0, 0, 1.0/3, 0, 0, end[0], end[1], 0, end[0]+cos(bend)/3, end[1]+sin(bend)/3, 0};
        const vector<Array> few = denseFriction(chain, Array(node, node+12), fourGaussPoints());
        const vector<Array> many = denseFriction(chain, Array(node, node+12), manyPoints());
        for (size_t i = 0; i < few.size(); i++)
            for (size_t j = 0; j < few.size(); j++)
                checkClose(many[i][j], few[i][j], sqrt(many[i][i]*many[j][j]), 2.5e-3*bend*bend+1e-5,
                        "friction of an arc");
    }
}

/** Of an element in the middle of two arrays of positions: r' by x at a place. */
static Vec3d slopeOf(const BeamChain& chain, int element, double place, const Array& x, const Array& y) {
    const BezierWeights w = BezierWeights::ofTangent(place, 1);
    Vec3d points[4];
    for (int i = 0; i < 4; i++) {
        const int particle = 3*chain.particles[2*element+i];
        points[i] = Vec3d {x[particle]+y[particle], x[particle+1]+y[particle+1], x[particle+2]+y[particle+2]}*0.5;
    }
    return points[0]*w.position1+(points[1]-points[0])*w.control1+points[2]*w.position2+
            (points[3]-points[2])*w.control2;
}

/**
 * Where friction is the same in all directions, the mean place of a curve moves with the mean of its tangents, in a
 * pack of chains with other propulsions, and without any.
 */
static void testPropulsion() {
    const double places[] = {0.06943184420297371, 0.33000947820757187}, shares[] = {0.17392742256872693,
            0.32607257743127307};
    for (bool planar : {false, true}) {
        NormalNumbers normalNumbers(7);
        Array x;
        vector<BeamChain> chains;
        for (int elements : {5, 1, 3, 4, 4, 2}) {
            chains.push_back(beam(elements, 2, 500, 70, x));
            chains.back().planar = planar;
            chains.back().parallelFriction = chains.back().perpendicularFriction = 1.7;
            chains.back().propulsion = 4*((int) chains.size()-3);
        }
        const Array scatter = normalNumbers(x.size());
        for (size_t i = 0; i < x.size(); i++)
            if (!planar || i%3 < 2)
                x[i] += 0.1*scatter[i];
        const BeamEngine engine(chains);
        const Array start = x, f(x.size());
        StepSettings settings = {Scheme::Implicit, 0, 0.002, 5, 0};
        check(advance(engine, x, f, settings) == 0, "a step is divided");
        for (const BeamChain& chain : chains) {
            double moved[3] = {}, expected[3] = {};
            for (int e = 0; e < chain.numNodes()-1; e++) {
                // The integral of the curve by x: half of each node, and a quarter of each control vector.
                const double weights[] = {0.25, 0.25, 0.75, -0.25};
                for (int i = 0; i < 4; i++)
                    for (int k = 0; k < 3; k++) {
                        const int number = 3*chain.particles[2*e+i]+k;
                        moved[k] += weights[i]*(x[number]-start[number]);
                    }
                for (int g = 0; g < 4; g++) {
                    const Vec3d slope = slopeOf(chain, e, g < 2 ? places[g] : 1-places[3-g], start, x);
                    const Vec3d part = slope*(shares[g < 2 ? g : 3-g]/sqrt(slope.squared()));
                    expected[0] += part.x;
                    expected[1] += part.y;
                    expected[2] += part.z;
                }
            }
            for (int k = 0; k < 3; k++)
                checkClose(expected[k]*chain.propulsion*settings.stepSize/(1.7*chain.elementLength), moved[k], 0.01,
                        2e-3, "how far propulsion takes a chain");
        }
    }
}

/**
 * A force moves a chain without stiffness, which is bent, by the inverse of the friction: Z dx = h f. Its control
 * vectors take the forces on control points, and positions those on both particles of a node.
 */
static void testMobility() {
    Array x;
    const BeamChain chain = beam(2, 2, 0, 0, x);
    NormalNumbers normalNumbers(6);
    const Array scatter = normalNumbers(x.size()), f = normalNumbers(x.size());
    for (size_t i = 0; i < x.size(); i++)
        x[i] += 0.2*scatter[i];
    const BeamEngine engine({chain});
    const StepSettings settings = {Scheme::Implicit, 0, 1e-8, 1, 0};
    Array moves(x.size());
    engine.step(0, x.data(), f.data(), NULL, settings, moves.data());
    const vector<Array> friction = denseFriction(chain, x, fourGaussPoints());
    for (int node = 0; node < 3; node++)
        for (int k = 0; k < 3; k++)
            moves[6*node+3+k] -= moves[6*node+k];
    for (size_t i = 0; i < x.size(); i++) {
        double sum = 0;
        for (size_t j = 0; j < x.size(); j++)
            sum += friction[i][j]*moves[j]/settings.stepSize;
        checkClose(i%6 < 3 ? f[i]+f[i+3] : f[i], sum, 1, 1e-5, "force against friction");
    }
}

/** Without stiffness, displacements have the covariance 2 k_B T h Z^-1: in terms of a root of Z, they are white. */
static void testNoise() {
    Array x;
    const BeamChain chain = beam(2, 2, 0, 0, x);
    NormalNumbers normalNumbers(5);
    const Array scatter = normalNumbers(x.size());
    for (size_t i = 0; i < x.size(); i++)
        x[i] += 0.2*scatter[i];
    const BeamEngine engine({chain});
    vector<Array> root = denseFriction(chain, x, fourGaussPoints());
    const int n = root.size();
    for (int j = 0; j < n; j++)
        for (int i = j; i < n; i++) {
            double value = root[i][j];
            for (int k = 0; k < j; k++)
                value -= root[i][k]*root[j][k];
            root[i][j] = i == j ? sqrt(value) : value/root[j][j];
        }
    StepSettings settings = {Scheme::Implicit, 1, 1e-9, 11, 0};
    vector<Array> sums(n, Array(n));
    Array moves(x.size()), f(x.size()), white(n);
    const int samples = 30000;
    for (; settings.step < samples; settings.step++) {
        engine.step(0, x.data(), f.data(), NULL, settings, moves.data());
        for (int i = 0; i < n; i++)
            moves[i] = moves[i]/sqrt(2*settings.kT*settings.stepSize);
        for (int node = 0; node < 3; node++)
            for (int k = 0; k < 3; k++)
                moves[6*node+3+k] -= moves[6*node+k];
        for (int i = 0; i < n; i++) {
            white[i] = 0;
            for (int k = i; k < n; k++)
                white[i] += root[k][i]*moves[k];
        }
        for (int i = 0; i < n; i++)
            for (int j = 0; j <= i; j++)
                sums[i][j] += white[i]*white[j]/samples;
    }
    for (int i = 0; i < n; i++)
        for (int j = 0; j <= i; j++)
            // A variance has twice the error; there are 171 of them.
            checkClose(i == j, sums[i][j], sqrt((i == j ? 2.0 : 1.0)/samples), 4.5, "covariance of white noise");
}

/** A rod of one element and of several diffuses as a uniform line of friction does. */
static void testRods() {
    for (int elements : {1, 5}) {
        const double length = 2, h = length/elements;
        Array x;
        vector<BeamChain> all;
        const int chains = 16;
        for (int i = 0; i < chains; i++)
            all.push_back(beam(elements, h, 1e6, 2e6, x));
        const Array start = x, f(x.size());
        const BeamEngine engine(all);
        StepSettings settings = {Scheme::Implicit, 1, 1e-4, 21, 0};
        double along = 0, across = 0, turned = 0, longest = 0;
        const int steps = 1500;
        for (int i = 0; i < steps; i++) {
            x = start;
            advance(engine, x, f, settings);
            for (int chain = 0; chain < chains; chain++) {
                const double* const first = &x[6*(elements+1)*chain];
                const double* const last = first+6*elements;
                const double* const before = &start[6*(elements+1)*chain];
                const double middle = 0.5*(first[0]+last[0])-0.5*length;
                double span = (last[0]-first[0])*(last[0]-first[0]);
                along += middle*middle;
                for (int k = 1; k < 3; k++) {
                    const double mean = 0.5*(first[k]+last[k])-before[k], difference = last[k]-first[k];
                    across += mean*mean;
                    turned += difference*difference/(length*length);
                    span += difference*difference;
                }
                longest = max(longest, fabs(sqrt(span)/length-1));
            }
        }
        const double samples = steps*chains, h2 = 2*settings.stepSize;
        // D = k_B T/(zeta L), k_B T/(2 zeta L) across, and 12 of that over L^2 for turning.
        checkClose(1/length, along/samples/h2, 1/length, 5*sqrt(2/samples)+0.01, "diffusion along a rod");
        checkClose(0.5/length, across/(2*samples)/h2, 0.5/length, 5*sqrt(1/samples)+0.01, "diffusion across a rod");
        checkClose(6/pow(length, 3), turned/(2*samples)/h2, 6/pow(length, 3), 5*sqrt(1/samples)+0.01,
                "rotation of a rod");
        check(longest < 0.02, "a rod changes its length");
    }
}

/** Chains move in a pack of several as they do alone, with the noise of their numbers. */
static void testNeighbours() {
    Array x;
    vector<BeamChain> chains;
    for (int elements : {6, 5, 6, 2, 5})
        chains.push_back(beam(elements, 1, 1e4, 20, x));
    chains[2].fixed[0] = true;
    chains[4].fixed[0] = chains[4].fixed[1] = true;
    const Array together = checkNeighbours(chains, x, "a chain among others");
    checkClose(x[3*chains[2].particles[0]], together[3*chains[2].particles[0]], 1, 0, "a hinge");
    checkClose(x[3*chains[4].particles[1]], together[3*chains[4].particles[1]], 1, 0, "a clamp");
}

/** Chains that stay in a plane do, and parts of a step follow its path. */
static void testPlaneAndParts() {
    Array x;
    BeamChain chain = beam(3, 1, 1e4, 20, x);
    chain.planar = true;
    const BeamEngine engine({chain});
    const Array f(x.size());
    StepSettings settings = {Scheme::Implicit, 1, 1e-8, 5, 0};
    Array whole = x, parts = x;
    advance(engine, whole, f, settings);
    settings.stepSize = 0.25e-8;
    settings.level = 2;
    for (settings.step = 0; settings.step < 4;)
        advance(engine, parts, f, settings);
    double largest = 0, apart = 0;
    for (size_t i = 0; i < x.size(); i++) {
        largest = max(largest, fabs(whole[i]-x[i]));
        apart = max(apart, fabs(whole[i]-parts[i]));
        if (i%3 == 2)
            checkClose(0, whole[i], 1, 0, "z in a plane");
    }
    check(apart < 0.1*largest, "parts of a step leave its path");
}

/**
 * A thin rod in a shear flow that also moves as a whole: its centre goes with the flow, and the cotangent of its angle
 * with the flow grows at the rate of the shear, while it is pushed together and while it is pulled.
 */
static void testFlow() {
    const int elements = 3;
    const double rate = 0.1, velocity = 0.7, direction = -1/sqrt(2.0);
    Array x;
    const BeamChain chain = beam(elements, 1, 1e4, 20, x);
    for (size_t i = 0; i < x.size(); i += 3) {
        x[i+1] = -x[i]*direction;
        x[i] *= direction;
    }
    const BeamEngine engine({chain});
    StepSettings settings = {Scheme::Implicit, 0, 0.1, 5, 0};
    settings.flow.present = true;
    settings.flow.velocity[0] = velocity;
    settings.flow.gradient[1] = rate;
    const Array f(x.size());
    const int last = 3*chain.particles[2*elements];
    Array before = x;
    for (int step = 0; step < 200; step++)
        check(advance(engine, x, f, settings) == 0, "a step of a rod in a flow is divided");
    const double time = 200*settings.stepSize, height = 0.5*(before[1]+before[last+1]);
    checkClose(height, 0.5*(x[1]+x[last+1]), 1, 1e-3, "height of the centre of a rod in a flow");
    checkClose(0.5*(before[0]+before[last])+(velocity+rate*height)*time, 0.5*(x[0]+x[last]), 1, 0.02,
            "centre of a rod in a flow");
    checkClose(-1+rate*time, (x[last]-x[0])/(x[last+1]-x[1]), 1, 0.005, "cotangent of the angle of a rod in a flow");
    checkClose(elements, hypot(x[last]-x[0], x[last+1]-x[1]), 1, 1e-3, "length of a rod in a flow");
}

static void testFailures() {
    Array x;
    const BeamChain chain = beam(3, 1, 1e4, 20, x);
    const BeamEngine engine({chain});
    Array f(x.size()), moves(x.size());
    StepSettings settings = {Scheme::Implicit, 1, 1e-3, 5, 0};
    // Too much for the whole step, but not for parts of it.
    f[1] = 6e3;
    Instability found = engine.step(0, x.data(), f.data(), NULL, settings, moves.data());
    check(found.divided == 1 && found.chain == -1, "a step is not divided");
    settings.mayDivide = false;
    found = engine.step(0, x.data(), f.data(), NULL, settings, moves.data());
    check(found.chain == 0, "a step that must be divided has not failed");
    settings.mayDivide = true;
    f[1] = NAN;
    found = engine.step(0, x.data(), f.data(), NULL, settings, moves.data());
    check(found.chain == 0, "a force that is not a number goes unnoticed");

    auto isRefused = [&] (auto function) {
        try {
            function();
        }
        catch (const invalid_argument&) {
            return true;
        }
        return false;
    };
    BeamChain wrong = chain;
    wrong.fixed[3] = true;
    check(isRefused([&] {BeamEngine({wrong});}), "a control point is fixed alone");
    wrong = chain;
    wrong.particles.pop_back();
    wrong.fixed.pop_back();
    check(isRefused([&] {BeamEngine({wrong});}), "half a node");
    wrong = chain;
    wrong.bendingRigidity = 0.4;
    const BeamEngine soft({wrong});
    check(isRefused([&] {soft.step(0, x.data(), f.data(), NULL, settings, moves.data());}),
            "elements longer than a persistence length");
    settings.scheme = Scheme::Midpoint;
    check(isRefused([&] {engine.step(0, x.data(), f.data(), NULL, settings, moves.data());}), "an explicit scheme");
}

int main() {
    return runTests({testForces, testTethers, testPlacesOfElements, testEnergyOfShapes, testCantilevers, testCouple,
            testBuckling, testFriction, testPropulsion, testMobility, testNoise, testRods, testNeighbours,
            testPlaneAndParts, testFlow, testFailures});
}
