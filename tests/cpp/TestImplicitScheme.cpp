/**
 * This tests the implicit scheme on its own: steps without noise against a dense solution of its equations, written
 * down independently, that no chain depends on its neighbours in a pack, and that steps that cannot be taken are
 * divided.
 */

#include "TestChains.h"
#include <numeric>
#include <set>

/** The positions of nodes, one after the other, that begin with a node of a chain. */
static Array nodesFrom(const Chain& chain, int first, int count, const Array& x) {
    Array result;
    for (int i = first; i < first+count; i++) {
        const double* node = &x[3*chain.nodes[i%chain.nodes.size()]];
        result.insert(result.end(), node, node+3);
    }
    return result;
}

/** What belongs to the nodes of a chain, one node after the other. */
static Array ofNodes(const Chain& chain, const Array& x) {
    return nodesFrom(chain, 0, chain.nodes.size(), x);
}

static Chain withNodesFromZero(Chain chain) {
    iota(chain.nodes.begin(), chain.nodes.end(), 0);
    return chain;
}

/** The index of a component of a node of a chain that is so many components behind another node. */
static int componentFrom(const Chain& chain, int first, int component) {
    return 3*chain.nodes[(first+component/3)%chain.nodes.size()]+component%3;
}

/** A bend b = f (t2-t1), or the difference of the vectors of two segments, with the energy (stiffness/2) b^2. */
static Array bendOf(BendingModel model, const double* x) {
    double t1[3], t2[3], square1 = 0, square2 = 0, chordSquare = 0;
    for (int k = 0; k < 3; k++) {
        t1[k] = x[3+k]-x[k];
        t2[k] = x[6+k]-x[3+k];
        square1 += t1[k]*t1[k];
        square2 += t2[k]*t2[k];
    }
    Array bend(3);
    for (int k = 0; k < 3 && isLinear(model); k++)
        bend[k] = t2[k]-t1[k];
    if (isLinear(model))
        return bend;
    for (int k = 0; k < 3; k++) {
        bend[k] = t2[k]/sqrt(square2)-t1[k]/sqrt(square1);
        chordSquare += bend[k]*bend[k];
    }
    const double chord = sqrt(chordSquare), angle = 2*asin(0.5*chord);
    for (double& component : bend)
        component *= chord > 0 ? bendByHand(model, angle).length/chord : 1;
    return bend;
}

static double lengthOf(const double* x) {
    return sqrt((x[3]-x[0])*(x[3]-x[0])+(x[4]-x[1])*(x[4]-x[1])+(x[5]-x[2])*(x[5]-x[2]));
}

/** A coordinate with the energy (stiffness/2) q^2. */
static double stretchOf(StretchingModel model, const Segment& segment, double length) {
    const double e = length-segment.restLength, d = segment.maximumExtension;
    if (model == StretchingModel::Harmonic)
        return e;
    return copysign(d*sqrt(-log1p(-e*e/(d*d))), e);
}

/**
 * A stage of a step: all of it, or one of the two of second order, the second of which needs where the first has ended.
 */
struct Stage {
    int number = 0;
    Array first = {};
};

const double DIAGONAL = 1-sqrt(0.5);

/** The residual of a stage's equations for new nodes y. */
static Array residualOf(const vector<Chain>& chains, const Array& x, const Array& y, const Array& f, double h,
            bool flows, const Stage& stage = {}) {
    const double share = stage.number == 1 ? DIAGONAL : 1;
    // The weights of what bends and tethers are after the step, before it and after the first stage.
    auto weighted = [&] (double theta, double after, double before, double first) {
        if (stage.number == 0)
            return theta*after+(1-theta)*before;
        return DIAGONAL*after+(stage.number == 2 ? (1-DIAGONAL)*first : 0);
    };
    const Array& first = stage.number == 2 ? stage.first : x;
    Array middle(x.size()), residual = f;
    for (size_t i = 0; i < x.size(); i++) {
        middle[i] = 0.5*(x[i]+y[i]);
        residual[i] *= share;
    }
    // Friction against turning depends on the segment before and after, and not on the length of the mean one.
    vector<Chain> withoutExtensional = chains;
    for (Chain& chain : withoutExtensional)
        for (size_t s = 0; s < chain.segments.size(); s++) {
            const Array before = nodesFrom(chain, s, 2, x), after = nodesFrom(chain, s, 2, y);
            const double lengths = lengthOf(before.data())*lengthOf(after.data());
            const double mean = lengthOf(nodesFrom(chain, s, 2, middle).data());
            double cosine = 0;
            for (int k = 0; k < 3; k++)
                cosine += (before[3+k]-before[k])*(after[3+k]-after[k])/lengths;
            chain.segments[s].extensional = 0;
            chain.segments[s].rotational *= pow(0.5+0.5*cosine, 0.25)*mean*mean/lengths;
        }
    const vector<Array> z = denseResistance(withoutExtensional, middle);
    for (size_t i = 0; i < x.size(); i++)
        for (size_t j = 0; j < x.size(); j++)
            residual[i] -= z[i][j]*(y[j]-x[j])/h;
    if (flows) {
        // What flow does to lengths is part of the tension, with the lengths before and after.
        const Array drag = denseDrag(withoutExtensional, middle);
        for (size_t i = 0; i < x.size(); i++)
            residual[i] += share*drag[i];
    }
    const double width = 1e-6;
    for (const Chain& chain : chains) {
        for (size_t s = 0; s < chain.segments.size(); s++) {
            const Segment& segment = chain.segments[s];
            const Array between2 = nodesFrom(chain, s, 2, middle);
            const double before = lengthOf(nodesFrom(chain, s, 2, x).data());
            const double after = lengthOf(nodesFrom(chain, s, 2, y).data());
            const double length = lengthOf(between2.data());
            double stretched = 0;
            for (int i = 0; i < 3 && flows; i++)
                for (int k = 0; k < 3; k++)
                    stretched += (between2[3+i]-between2[i])/length*FLOW.gradient[3*i+k]*(between2[3+k]-between2[k]);
            const double own = fmax(0.5,
                    1-(segment.extensional/(segment.restLength*segment.restLength)+0.25*chain.nodeFriction)/
                    (h*segment.stiffness));
            const double theta = stage.number == 1 ? DIAGONAL : own, rest = stage.number == 1 ? 0 : 1-own;
            const double between = 0.5*(before+after);
            const double slope = (stretchOf(chain.stretching, segment, between+width)-
                    stretchOf(chain.stretching, segment, between-width))/(2*width);
            const double tension = segment.stiffness*slope*(theta*stretchOf(chain.stretching, segment, after)+
                    rest*stretchOf(chain.stretching, segment, before))+
                    segment.extensional/(before*after)*((after-before)/h-share*stretched);
            for (int k = 0; k < 3; k++) {
                const double pull = tension*(between2[3+k]-between2[k])/length;
                residual[componentFrom(chain, s, k)] += pull;
                residual[componentFrom(chain, s, 3+k)] -= pull;
            }
        }
        for (size_t j = 0; j < chain.joints.size(); j++) {
            const int count = chain.segments.size(), start = chain.closed ? (j+count-1)%count : j;
            const Segment &one = chain.segments[start], &other = chain.segments[(start+1)%count];
            const double square = other.restLength*other.restLength, ofNodes = 0.25*chain.nodeFriction*square;
            const double friction = isLinear(chain.bending) ? (ofNodes+other.rotational)/square :
                    fmin(one.rotational, other.rotational)+ofNodes;
            const double theta = fmin(isLinear(chain.bending) ? 0.8 : 1, fmax(0.5, 1-friction/(4*h*chain.joints[j])));
            const Array before = bendOf(chain.bending, nodesFrom(chain, start, 3, x).data());
            const Array after = bendOf(chain.bending, nodesFrom(chain, start, 3, y).data());
            const Array between = bendOf(chain.bending, nodesFrom(chain, start, 3, first).data());
            for (int i = 0; i < 9; i++) {
                Array moved = nodesFrom(chain, start, 3, middle);
                moved[i] += width;
                const Array above = bendOf(chain.bending, moved.data());
                moved[i] -= 2*width;
                const Array below = bendOf(chain.bending, moved.data());
                for (int k = 0; k < 3; k++)
                    residual[componentFrom(chain, start, i)] -= chain.joints[j]*
                            weighted(theta, after[k], before[k], between[k])*(above[k]-below[k])/(2*width);
            }
        }
        for (const Tether& tether : chain.tethers) {
            double friction = chain.nodeFriction;
            const int count = chain.segments.size();
            for (int s = tether.node-1; s <= tether.node; s++)
                if (chain.closed || (s >= 0 && s < count)) {
                    const Segment& segment = chain.segments[(s+count)%count];
                    friction += 0.25*segment.parallel+segment.extensional/(segment.restLength*segment.restLength);
                }
            const double theta = fmax(0.5, 1-friction/(h*tether.stiffness));
            for (int k = 0; k < 3; k++) {
                const int i = 3*chain.nodes[tether.node]+k;
                const double p = tether.point[k];
                residual[i] -= tether.stiffness*weighted(theta, y[i]-p, x[i]-p, first[i]-p);
            }
        }
    }
    for (const Chain& chain : chains)
        for (size_t node = 0; node < chain.nodes.size(); node++)
            for (int k = 0; k < 3; k++)
                if (chain.fixed[node])
                    residual[3*chain.nodes[node]+k] = x[3*chain.nodes[node]+k]-y[3*chain.nodes[node]+k];
    return residual;
}

/** Solve the equations by Newton's method with differences for derivatives, beginning near the solution. */
static Array solutionNear(const vector<Chain>& chains, const Array& x, Array y, const Array& f, double h, bool flows,
            const Stage& stage = {}) {
    const int n = x.size();
    for (int iteration = 0; iteration < 6; iteration++) {
        const Array residual = residualOf(chains, x, y, f, h, flows, stage);
        double largest = 0;
        for (double r : residual)
            largest = fmax(largest, fabs(r));
        if (largest < 1e-6)
            break;
        vector<Array> jacobian(n, Array(n));
        for (int j = 0; j < n; j++) {
            Array moved = y;
            moved[j] += 1e-6;
            const Array changed = residualOf(chains, x, moved, f, h, flows, stage);
            for (int i = 0; i < n; i++)
                jacobian[i][j] = (residual[i]-changed[i])/1e-6;
        }
        const Array change = denseSolution(jacobian, residual);
        for (int i = 0; i < n; i++)
            y[i] += change[i];
    }
    return y;
}

static vector<Chain> tethered(vector<Chain> chains, const Array& x) {
    for (Chain& chain : chains)
        for (int node : set<int> {0, 2, (int) chain.nodes.size()-1})
            if (node < (int) chain.nodes.size()) {
                const double* position = &x[3*chain.nodes[node]];
                chain.tethers.push_back({node, {position[0]+1, position[1], position[2]-1}, 25});
            }
    return chains;
}

static void checkSteps(const vector<Chain>& chains, const Array& x, bool flows, const Array& steps, Scheme scheme) {
    ChainEngine engine(chains);
    Array f(x.size());
    for (size_t i = 0; i < f.size(); i++)
        f[i] = sin(i);
    for (double h : steps) {
        const BackgroundFlow flow = flows ? FLOW : BackgroundFlow {};
        const Array change = stepOf(engine, x, f, {scheme, 0, h, 1, 1, 0, flow});
        // The chains of a pack take their steps together; their equations have nothing to do with each other.
        for (const Chain& chain : chains) {
            const vector<Chain> alone = {withNodesFromZero(chain)};
            const Array begin = ofNodes(chain, x), force = ofNodes(chain, f), moved = ofNodes(chain, change);
            Array y = begin;
            for (size_t i = 0; i < y.size(); i++)
                y[i] += moved[i];
            Stage stage;
            if (scheme == Scheme::ImplicitSecondOrder)
                stage = {2, solutionNear(alone, begin, begin, force, h, flows, {1})};
            const Array solution = solutionNear(alone, begin, y, force, h, flows, stage);
            const Array residual = residualOf(alone, begin, solution, force, h, flows, stage);
            for (size_t i = 0; i < y.size(); i++) {
                checkClose(0, residual[i], 1, 1e-4, "residual of the dense solution");
                checkClose(solution[i], y[i], 10, 3e-3, "implicit step");
            }
        }
    }
}

static void testStepsWithoutNoise(Scheme scheme) {
    for (int bending = 0; bending < countOf<BendingModel>(); bending++)
        for (int stretching = 0; stretching < 2; stretching++)
            for (bool tethers : {false, true})
                for (int kind = 0; kind < 4; kind++) {
                    const bool flows = kind%2 == 1, beads = kind > 1;
                    // Friction of nodes has nothing to do with lengths and tethers, and little with bends.
                    if (beads && (stretching == 1 || !tethers || bending%2 == 0))
                        continue;
                    const Array shortSteps = {0.001, 0.005}, steps = flows ? shortSteps : Array {0.001, 0.03, 1.0};
                    auto check = [&] (vector<Chain> chains, const Array& x, const Array& steps) {
                        if (beads)
                            chains = beaded(chains);
                        checkSteps(tethers ? tethered(chains, x) : chains, x, flows, steps, scheme);
                    };
                    Array x, y, z;
                    const BendingModel b = (BendingModel) bending;
                    const StretchingModel s = (StretchingModel) stretching;
                    check(makeChains({3, 5, 1}, b, s, x), x, steps);
                    check(makeRings({6, 7, 9}, b, s, false, y), y, steps);
                    // The joints of a square are bent so much that long steps are divided.
                    check(makeRings({4}, b, s, false, z), z, shortSteps);
                }
}

static void testStepsWithoutNoise() {
    testStepsWithoutNoise(Scheme::Implicit);
    testStepsWithoutNoise(Scheme::ImplicitSecondOrder);
}

static void testConvergenceToExplicitSteps() {
    Array x;
    const vector<Chain> chains = makeChains(SEGMENTS, BendingModel::Quadratic, StretchingModel::FENE, x);
    ChainEngine engine(chains);
    const Array f(x.size(), 0.5), own = forcesOf(engine, x);
    Array all = f;
    for (size_t i = 0; i < x.size(); i++)
        all[i] += own[i];
    double difference[2];
    for (int halved = 0; halved < 2; halved++) {
        const double h = halved ? 5e-4 : 1e-3;
        const Array implicit = stepOf(engine, x, f, {Scheme::Implicit, 0, h, 1, 1});
        const Array midpoint = stepOf(engine, x, all, {Scheme::Midpoint, 0, h, 1, 1});
        difference[halved] = 0;
        for (size_t i = 0; i < x.size(); i++)
            difference[halved] = fmax(difference[halved], fabs(implicit[i]-midpoint[i])/h);
    }
    checkClose(0.5*difference[0], difference[1], difference[0], 0.05, "difference from midpoint, of first order");
}

static void testChainsDoNotDependOnTheirPack() {
    for (bool rings : {false, true}) {
        Array x;
        const BendingModel bending = BendingModel::InscribedCircle;
        const StretchingModel stretching = StretchingModel::FENE;
        vector<Chain> chains = tethered(rings ? makeRings(RINGS, bending, stretching, false, x) :
                makeChains(SEGMENTS, bending, stretching, x), x);
        chains[3].nodeFriction = 2;
        ChainEngine together(chains), alone({chains[0]});
        // Some of its neighbours are taut.
        Array f(x.size(), 0.5);
        for (int chain : {2, 7}) {
            const vector<int>& nodes = chains[chain].nodes;
            f[3*nodes.front()] -= 600;
            f[3*nodes[rings ? nodes.size()/2 : nodes.size()-1]] += 600;
        }
        for (uint64_t step = 0; step < 500; step++) {
            const StepSettings settings = {Scheme::Implicit, 2.5, 0.05, 11, step};
            const Array a = stepOf(together, x, f, settings);
            Array b(x.size());
            alone.step(0, x.data(), f.data(), NULL, settings, b.data());
            for (int i = 0; i < 3*6; i++)
                checkClose(a[i], b[i], 1, 1e-9, "chain alone");
        }
    }
}

static void testPeriodicImages() {
    Array x;
    const vector<Chain> chains = tethered(makeChains(SEGMENTS, BendingModel::KratkyPorod, StretchingModel::Harmonic, x),
            x);
    ChainEngine engine(chains);
    const Array wrapped = acrossBox(x);
    const Array f(x.size(), 0.5);
    const Array a = stepOf(engine, x, f, {Scheme::Implicit, 1, 0.1, 1, 1});
    const Array b = stepOf(engine, wrapped, f, {Scheme::Implicit, 1, 0.1, 1, 1}, BOX);
    for (size_t i = 0; i < x.size(); i++)
        checkClose(a[i], b[i], 1, 1e-8, "step across the box");
}

static void testLongChainsOfShortSegments(bool closed) {
    // Joints that are stiff and a step that is long: the matrix is as ill-conditioned as it gets.
    Chain chain;
    Array x;
    const int count = 300;
    const double radius = 0.5/sin(M_PI/count);
    for (int node = 0; node < count+(closed ? 0 : 1); node++) {
        const double angle = 2*M_PI*node/count;
        chain.nodes.push_back(node);
        chain.fixed.push_back(false);
        if (closed)
            x.insert(x.end(), {radius*cos(angle), radius*sin(angle), 0});
        else
            x.insert(x.end(), {(double) node, 0, 0});
    }
    chain.closed = closed;
    chain.segments.assign(count, {1, 1e4, 0, 1, 1.5, 0.1, 0.08});
    chain.joints.assign(closed ? count : count-1, 5e3);
    chain.bending = BendingModel::InscribedCircle;
    chain.stretching = StretchingModel::Harmonic;
    ChainEngine engine({chain});
    const Array f(x.size());
    Array forces(x.size()), displacements(x.size());
    double energy = 0;
    const int steps = 400, first = 100;
    for (int step = 0; step < steps; step++) {
        Instability found = engine.step(0, x.data(), f.data(), NULL, {Scheme::Implicit, 1, 10, 5, (uint64_t) step},
                displacements.data());
        check(found.chain == -1 && found.divided == 0, "long chain");
        for (size_t i = 0; i < x.size(); i++)
            x[i] += displacements[i];
        const ChainEnergy now = engine.addForces(0, x.data(), forces.data(), NULL, true);
        if (step >= first)
            energy += (now.stretching+now.bending)/(0.5*count+count-1)/(steps-first);
    }
    // A ring is bent on average, and cannot bend and stretch in the six ways that would open it.
    const double excess = closed ? 0.5*5e3*count*pow(2*tan(M_PI/count), 2)-0.5*6 : 0;
    checkClose(1, energy-excess/(0.5*count+count-1), 1, 0.03, "energy of a long chain");
}

static void testLongChainsOfShortSegments() {
    testLongChainsOfShortSegments(false);
    testLongChainsOfShortSegments(true);
}

static void testDivision() {
    Array x;
    const vector<Chain> chains = makeChains(SEGMENTS, BendingModel::InscribedCircle, StretchingModel::Harmonic, x);
    ChainEngine engine(chains);
    Array moved = x, f(x.size()), displacements(x.size());
    moved[3*chains[5].nodes[4]+2] += 30;
    int divided = 0;
    for (int pack = 0; pack < engine.getNumPacks(); pack++) {
        const Instability found = engine.step(pack, moved.data(), f.data(), NULL, {Scheme::Implicit, 0, 1, 1, 1},
                displacements.data());
        check(found.chain == -1, "a node that was moved");
        divided += found.divided;
    }
    check(divided == 1, "one chain should take its step in parts");
    Array after = moved;
    for (size_t i = 0; i < x.size(); i++)
        after[i] += displacements[i];
    check(energyOf(engine, after) < energyOf(engine, x), "energy should fall");
    f[3*chains[5].nodes[4]] = NAN;
    for (int pack = 0; pack < engine.getNumPacks(); pack++) {
        const Instability found = engine.step(pack, x.data(), f.data(), NULL, {Scheme::Implicit, 1, 0.1, 1, 1},
                displacements.data());
        check(found.chain == -1 || found.chain == 5, "wrong chain");
        if (found.chain == 5)
            return;
    }
    throw runtime_error("instability not found");
}

static vector<vector<SegmentForces> > placesFor(const vector<Chain>& chains) {
    vector<vector<SegmentForces> > places;
    for (const Chain& chain : chains)
        places.push_back(vector<SegmentForces>(chain.segments.size()));
    return places;
}

/** What the segments of chains exert on nodes. */
static Array onNodes(const vector<Chain>& chains, const vector<vector<SegmentForces> >& forces, size_t size) {
    Array sum(size);
    for (size_t chain = 0; chain < chains.size(); chain++)
        for (size_t s = 0; s < forces[chain].size(); s++)
            for (int k = 0; k < 3; k++) {
                sum[componentFrom(chains[chain], s, k)] += forces[chain][s].minus[k];
                sum[componentFrom(chains[chain], s, 3+k)] += forces[chain][s].plus[k];
            }
    return sum;
}

/**
 * On every mobile node, forces of segments balance those from outside, in a step that is taken as a whole or in parts.
 */
static void checkBalance(const vector<Chain>& chains, const Array& x, const StepSettings& given, const Array& f,
        bool divided = false) {
    vector<vector<SegmentForces> > forces = placesFor(chains);
    StepSettings settings = given;
    settings.segmentForces = &forces;
    ChainEngine engine(chains);
    const Array change = stepOf(engine, x, f, settings), unrecorded = stepOf(engine, x, f, given);
    const Array sum = onNodes(chains, forces, x.size()), outside = withoutHeld(chains, f);
    for (size_t chain = 0; chain < chains.size(); chain++) {
        double scale = 0;
        for (const SegmentForces& one : forces[chain])
            for (int k = 0; k < 3; k++)
                scale = fmax(scale, fabs(one.plus[k]));
        vector<bool> held = chains[chain].fixed;
        for (const Tether& tether : chains[chain].tethers) {
            held[tether.node] = true;
            double total = 0, expected = 0;
            for (int k = 0; k < (chains[chain].planar ? 2 : 3) && !chains[chain].fixed[tether.node] &&
                    given.kT == 0; k++) {
                const int i = componentFrom(chains[chain], tether.node, k);
                // Between those at the start and the end of the step.
                const double before = -tether.stiffness*(x[i]-tether.point[k]);
                const double after = before-tether.stiffness*change[i];
                const double pull = -sum[i]-f[i];
                total += pow(pull-before, 2);
                expected += pow(after-before, 2);
                if (!divided)
                    checkClose(0, fmin(0, (pull-before)*(after-pull)), 1+after*after+before*before, 0.02,
                            "force of a tether");
            }
            check(total <= 1.2*expected+1e-9*scale*scale, "force of a tether");
        }
        for (size_t node = 0; node < held.size(); node++)
            for (int k = 0; k < 3 && !held[node]; k++) {
                const int i = componentFrom(chains[chain], node, k);
                checkClose(0, sum[i]+outside[i], scale+fabs(f[i])+1e-3, 1e-6, "balance of a node");
            }
        for (const SegmentForces& one : forces[chain])
            if (!divided)
                checkClose(1, one.direction[0]*one.direction[0]+one.direction[1]*one.direction[1]+
                        one.direction[2]*one.direction[2], 1, 1e-12, "direction");
    }
    for (size_t i = 0; i < x.size(); i++)
        checkClose(unrecorded[i], change[i], 0, 0, "step that is recorded");
}

static void testBalanceOfNodes() {
    for (int bending = 0; bending < countOf<BendingModel>(); bending++)
        for (int stretching = 0; stretching < 2; stretching++)
            for (bool tethers : {false, true})
                for (bool flows : {false, true})
                    for (double kT : {0.0, 2.5})
                        for (double h : {0.001, 0.03, 1.0}) {
                            Array x;
                            vector<Chain> chains = makeAll((BendingModel) bending, (StretchingModel) stretching, x);
                            if (tethers)
                                chains = tethered(chains, x);
                            for (size_t chain = 0; chain < chains.size(); chain += 2)
                                for (Segment& segment : chains[chain].segments)
                                    segment.propulsion = 3;
                            Array f(x.size());
                            for (size_t i = 0; i < f.size(); i++)
                                f[i] = sin(i);
                            // One of them is taut, so that it gets friction of its own.
                            f[3*chains[5].nodes.front()] -= 600;
                            f[3*chains[5].nodes.back()] += 600;
                            BackgroundFlow flow = flows ? FLOW : BackgroundFlow {};
                            for (double& derivative : flow.gradient)
                                derivative *= 0.05/h*0.03;
                            for (Scheme scheme : {Scheme::Implicit, Scheme::ImplicitSecondOrder})
                                checkBalance(chains, x, {scheme, kT, h, 3, 7, 0, flow}, f, h > 0.9);
                        }
}

static void testTensionsOfStraightChains() {
    // A chain at rest that is held at one end and pulled at the other has one tension, and so has a hanging one at
    // rest.
    Chain chain;
    Array x;
    for (int node = 0; node <= 6; node++) {
        chain.nodes.push_back(node);
        chain.fixed.push_back(node == 0);
        x.insert(x.end(), {10.5*node, 0, 0});
    }
    chain.segments.assign(6, {10, 30, 6, 5, 8, 70, 200});
    chain.joints.assign(5, 20);
    chain.bending = BendingModel::Quadratic;
    chain.stretching = StretchingModel::Harmonic;
    ChainEngine engine({chain});
    Array f(x.size());
    f[18] = 15;
    for (double h : {0.01, 100.0}) {
        vector<vector<SegmentForces> > forces = placesFor({chain});
        StepSettings settings = {Scheme::Implicit, 0, h, 1, 1};
        settings.segmentForces = &forces;
        stepOf(engine, x, f, settings);
        for (const SegmentForces& one : forces[0]) {
            checkClose(15, one.tension, 15, 1e-9, "tension");
            checkClose(15, one.minus[0], 15, 1e-9, "force on the minus end");
            checkClose(-15, one.plus[0], 15, 1e-9, "force on the plus end");
        }
    }
}

static void testForcesOfDividedSteps() {
    Array x;
    const vector<Chain> chains = makeChains(SEGMENTS, BendingModel::InscribedCircle, StretchingModel::Harmonic, x);
    Array moved = x, f(x.size());
    moved[3*chains[5].nodes[4]+2] += 30;
    checkBalance(chains, moved, {Scheme::Implicit, 0, 1, 1, 1}, f, true);
    checkBalance(chains, moved, {Scheme::Implicit, 2.5, 1, 1, 1}, f, true);
    // Chains beside the one that is divided have the forces of the whole step.
    vector<vector<SegmentForces> > together = placesFor(chains), alone = placesFor(chains);
    StepSettings settings = {Scheme::Implicit, 2.5, 1, 1, 1};
    for (auto forces : {&together, &alone}) {
        settings.segmentForces = forces;
        stepOf(ChainEngine(chains), forces == &together ? moved : x, f, settings);
    }
    for (size_t chain = 0; chain < chains.size(); chain++)
        for (size_t s = 0; s < chains[chain].segments.size() && chain != 5; s++)
            checkClose(alone[chain][s].tension, together[chain][s].tension, 1, 1e-9, "tension beside a divided chain");
}

int main() {
    return runTests({
        testStepsWithoutNoise,
        testConvergenceToExplicitSteps,
        testChainsDoNotDependOnTheirPack,
        testPeriodicImages,
        testLongChainsOfShortSegments,
        testDivision,
        testBalanceOfNodes,
        testTensionsOfStraightChains,
        testForcesOfDividedSteps
    });
}
