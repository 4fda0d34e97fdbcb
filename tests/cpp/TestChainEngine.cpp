/**
 * This tests the mechanics of chains on their own: forces against finite differences of the energy, steps against a
 * dense solution, noise against its covariance, and that no chain depends on its neighbours in a pack.
 */

#include "TestChains.h"
#include "dynamics/PackProperties.h"
#include "mechanics/BrokenSegment.h"

static void testForces() {
    for (int bending = 0; bending < countOf<BendingModel>(); bending++)
        for (int stretching = 0; stretching < countOf<StretchingModel>(); stretching++) {
            Array x;
            vector<Chain> chains = makeChains(SEGMENTS, (BendingModel) bending, (StretchingModel) stretching, x);
            for (const Chain& ring : makeRings(RINGS, (BendingModel) bending, (StretchingModel) stretching, false, x))
                chains.push_back(ring);
            ChainEngine engine(chains);
            const Array forces = forcesOf(engine, x);
            const double width = 1e-5;
            for (size_t i = 0; i < x.size(); i++) {
                Array moved = x;
                moved[i] += width;
                const double above = energyOf(engine, moved);
                moved[i] -= 2*width;
                const double below = energyOf(engine, moved);
                checkClose(-(above-below)/(2*width), forces[i], 100, 1e-6, "force");
            }
        }
}

static void testStraightAndFoldedChains() {
    for (int bending = 0; bending < countOf<BendingModel>() && !isLinear((BendingModel) bending); bending++)
        for (double angle : {0.0, 1e-9, 1e-5, 1e-2, 1.0, 3.0, 3.1}) {
            Array unused;
            vector<Chain> chains = makeChains({2}, (BendingModel) bending, StretchingModel::Harmonic, unused);
            const double length[] = {chains[0].segments[0].restLength, chains[0].segments[1].restLength};
            const Array x = {0, 0, 0, length[0], 0, 0, length[0]+length[1]*cos(angle), length[1]*sin(angle), 0};
            ChainEngine engine(chains);
            const BendByHand bend = bendByHand((BendingModel) bending, angle);
            const double expected = 0.5*chains[0].joints[0]*bend.length*bend.length;
            const double torque = chains[0].joints[0]*bend.length*bend.slope;
            checkClose(expected, energyOf(engine, x), expected+1e-20, 1e-9, "bending energy");
            const Array forces = forcesOf(engine, x);
            checkClose(torque/length[0], -forces[1], torque/length[0]+1e-12, 1e-8, "bending force");
        }
}

/** Velocities of all nodes from dense matrices. */
static Array denseVelocity(const vector<Chain>& chains, const Array& x, Array f, bool flows) {
    f = withoutHeld(chains, f);
    if (flows) {
        const Array drag = denseDrag(chains, x);
        for (size_t i = 0; i < x.size(); i++)
            f[i] += drag[i];
    }
    return denseSolution(denseResistance(chains, x), f);
}

static void testStepsWithoutNoise() {
    for (int kind = 0; kind < 4; kind++) {
        const bool flows = kind%2 == 1, beads = kind > 1;
        Array x;
        vector<Chain> chains = makeAll(BendingModel::InscribedCircle, StretchingModel::Harmonic, x);
        if (beads)
            chains = beaded(chains);
        ChainEngine engine(chains);
        Array f = forcesOf(engine, x);
        for (size_t i = 0; i < f.size(); i++)
            f[i] += sin(i);
        const double h = 0.005;
        const BackgroundFlow flow = flows ? FLOW : BackgroundFlow {};
        const Array velocity = denseVelocity(chains, x, f, flows);
        Array halfway = x;
        for (size_t i = 0; i < x.size(); i++)
            halfway[i] += 0.5*h*velocity[i];
        const Array later = denseVelocity(chains, halfway, f, flows);
        const Array euler = stepOf(engine, x, f, {Scheme::Euler, 0, h, 1, 1, 0, flow});
        const Array midpoint = stepOf(engine, x, f, {Scheme::Midpoint, 0, h, 1, 1, 0, flow});
        const double scale = flows ? 1000 : 1;
        for (size_t i = 0; i < x.size(); i++) {
            checkClose(h*velocity[i], euler[i], h*scale, 1e-11, "Euler step");
            checkClose(h*later[i], midpoint[i], h*scale, 1e-11, "midpoint step");
        }
    }
}

static void testPropulsion() {
    Array x;
    vector<Chain> chains = makeAll(BendingModel::InscribedCircle, StretchingModel::Harmonic, x);
    const Array passive = forcesOf(ChainEngine(chains), x);
    Array expected = passive;
    for (size_t c = 0; c < chains.size(); c += 2)
        for (size_t s = 0; s < chains[c].segments.size(); s++) {
            const int first = chains[c].nodes[s], second = chains[c].nodes[(s+1)%chains[c].nodes.size()];
            const double propulsion = chains[c].segments[s].propulsion = (s%3)-1.3;
            double square = 0;
            for (int k = 0; k < 3; k++)
                square += (x[3*second+k]-x[3*first+k])*(x[3*second+k]-x[3*first+k]);
            for (int k = 0; k < 3; k++)
                for (int end : {first, second})
                    expected[3*end+k] += 0.5*propulsion*(x[3*second+k]-x[3*first+k])/sqrt(square);
        }
    const Array found = forcesOf(ChainEngine(chains), x);
    for (size_t i = 0; i < x.size(); i++)
        checkClose(expected[i], found[i], 100, 1e-13, "propulsion");
}

static void testPlanarChainsKeepTheirHeight() {
    Array x;
    vector<Chain> chains = makeRings(RINGS, BendingModel::InscribedCircle, StretchingModel::Harmonic, true, x);
    for (Chain& chain : chains)
        chain.tethers.push_back({2, {x[3*chain.nodes[2]], x[3*chain.nodes[2]+1], 50}, 3});
    ChainEngine engine(chains);
    const Array f(x.size(), 7);
    for (Scheme scheme : {Scheme::Euler, Scheme::Midpoint, Scheme::Implicit})
        for (uint64_t step = 0; step < 20; step++) {
            const Array change = stepOf(engine, x, f, {scheme, 2.5, 1e-3, 5, step, 0, FLOW});
            for (size_t i = 2; i < x.size(); i += 3)
                check(change[i] == 0, "height in a plane");
        }
}

static void testPeriodicImages() {
    Array x;
    ChainEngine engine(makeAll(BendingModel::InscribedCircle, StretchingModel::Harmonic, x));
    const Array wrapped = acrossBox(x);
    const Array f = forcesOf(engine, x), g = forcesOf(engine, wrapped, BOX);
    const Array a = stepOf(engine, x, f, {Scheme::Midpoint, 1, 0.001, 1, 1});
    const Array b = stepOf(engine, wrapped, f, {Scheme::Midpoint, 1, 0.001, 1, 1}, BOX);
    for (size_t i = 0; i < x.size(); i++) {
        checkClose(f[i], g[i], 100, 1e-10, "force across the box");
        checkClose(a[i], b[i], 1, 1e-10, "step across the box");
    }
}

static void testCovarianceOfNoise() {
    Array x;
    vector<Chain> chains = makeChains({3, 2}, BendingModel::KratkyPorod, StretchingModel::Harmonic, x);
    chains.push_back(makeRings({5}, BendingModel::KratkyPorod, StretchingModel::Harmonic, false, x)[0]);
    ChainEngine engine(chains);
    const int n = x.size(), draws = 40000;
    const double kT = 2.5, h = 1e-6;
    const vector<Array> z = denseResistance(chains, x);
    vector<Array> sum(n, Array(n)), successive(n, Array(n));
    Array before(n), zero(n);
    for (int draw = 0; draw < draws; draw++) {
        // Forces, not displacements, so that the expectation needs no inverse: cov(Z dx) = 2 kT h Z.
        const Array dx = stepOf(engine, x, zero, {Scheme::Midpoint, kT, h, 7, (uint64_t) draw});
        Array f(n);
        for (int i = 0; i < n; i++)
            for (int j = 0; j < n; j++)
                f[i] += z[i][j]*dx[j];
        for (int i = 0; i < n; i++)
            for (int j = 0; j < n; j++) {
                sum[i][j] += f[i]*f[j]/draws;
                successive[i][j] += f[i]*before[j]/draws;
            }
        before = f;
    }
    for (int i = 0; i < n; i++)
        for (int j = 0; j < n; j++) {
            const double scale = 2*kT*h;
            const double error = scale*sqrt((z[i][i]*z[j][j]+z[i][j]*z[i][j])/draws);
            checkClose(scale*z[i][j], sum[i][j], error, 5, "covariance");
            checkClose(0, successive[i][j], scale*sqrt(z[i][i]*z[j][j]/draws), 5, "covariance of successive steps");
        }
}

static void testChainsDoNotDependOnTheirPack() {
    Array x;
    const vector<Chain> chains = makeChains(SEGMENTS, BendingModel::InscribedCircle, StretchingModel::Harmonic, x);
    ChainEngine together(chains), alone({chains[0]});
    const Array f(x.size(), 0.5);
    for (uint64_t step = 0; step < 2000; step++) {
        const StepSettings settings = {Scheme::Midpoint, 2.5, 1e-4, 11, step};
        const Array a = stepOf(together, x, f, settings);
        Array b(x.size());
        alone.step(0, x.data(), f.data(), NULL, settings, b.data());
        for (int i = 0; i < 3*6; i++)
            checkClose(a[i], b[i], 1, 1e-13, "chain alone");
    }
}

/** The models, schemes and precisions follow from their lists, and there are no others. */
static void testLists() {
    check(isEntry(BendingModel::InscribedCircle) && !isEntry<BendingModel>(-1), "entries of bending models");
    check(namesOf<Scheme>()[(int) Scheme::ImplicitSecondOrder] == "implicit-second-order", "names of schemes");
    check(isImplicit(Scheme::Implicit) && !isImplicit(Scheme::Midpoint), "implicit schemes");
    check(hasRange(StretchingModel::FENE) && !hasRange(StretchingModel::Harmonic), "stretching models with a range");
    Array x;
    vector<Chain> chains = makeChains({2, 3}, BendingModel::Quadratic, StretchingModel::Harmonic, x);
    for (bool bending : {true, false}) {
        vector<Chain> wrong = chains;
        if (bending)
            wrong[1].bending = (BendingModel) countOf<BendingModel>();
        else
            wrong[1].stretching = (StretchingModel) -1;
        bool refused = false;
        try {
            ChainEngine engine(wrong);
        }
        catch (const invalid_argument&) {
            refused = true;
        }
        check(refused, "a model that there is not");
    }
}

static void testInstability() {
    Array x;
    const vector<Chain> chains = makeChains(SEGMENTS, BendingModel::InscribedCircle, StretchingModel::Harmonic, x);
    ChainEngine engine(chains);
    for (double force : {1e9, (double) NAN}) {
        Array f(x.size()), displacements(x.size());
        f[3*chains[5].nodes[9]] = force;
        for (int pack = 0; pack < engine.getNumPacks(); pack++) {
            Instability found = engine.step(pack, x.data(), f.data(), NULL, {Scheme::Euler, 0, 1, 1, 1},
                    displacements.data());
            check(found.chain == -1 || found.chain == 5, "wrong chain");
            if (found.chain == 5)
                return;
        }
    }
    throw runtime_error("instability not found");
}

static void testBrokenSegments() {
    Array x;
    const vector<Chain> chains = makeRings({5}, BendingModel::Quadratic, StretchingModel::Harmonic, false, x);
    const Chain& ring = chains[0];
    auto find = [&] (const Array& f, const Array& displacements, bool implicit) {
        return findBrokenSegment(ring, x.data(), f.data(), displacements.data(), NULL, implicit);
    };
    Array f(x.size()), displacements(x.size());

    // The last segment joins the last node and the first.
    f[3*ring.nodes[0]] = f[3*ring.nodes[4]] = 10;
    displacements[3*ring.nodes[0]+1] = 1000;
    for (bool implicit : {false, true}) {
        const BrokenSegment broken = find(f, displacements, implicit);
        check(broken.segment == 4, "segment of the greatest force");
        check(broken.reason == (implicit ? BrokenSegment::NotSolved : BrokenSegment::MovesTooFar), "reason");
        checkClose(1000, broken.value, 1, 1e-9, "change");
    }
    const BrokenSegment unmoved = find(f, Array(x.size()), true);
    check(unmoved.segment < 5 && unmoved.reason == BrokenSegment::NotSolved, "equations that were not solved");

    // A force that is not finite spoils the displacements of all nodes.
    f[3*ring.nodes[3]+2] = INFINITY;
    const BrokenSegment broken = find(f, Array(x.size(), NAN), false);
    check(broken.segment == 2 && broken.reason == BrokenSegment::NotFinite, "a force that is not finite");
}

static void testLengthsThatLeaveTheirRange() {
    Array x;
    vector<Chain> chains = makeChains(SEGMENTS, BendingModel::InscribedCircle, StretchingModel::FENE, x);
    for (double extension : {6.0, 0.5}) {
        // Of chain 5, one length is taken to the end of its range and beyond, by less than the change that is too much.
        Segment& segment = chains[5].segments[7];
        segment.maximumExtension = extension;
        Array f(x.size()), displacements(x.size());
        const int first = chains[5].nodes[7], second = chains[5].nodes[8];
        for (int k = 0; k < 3; k++) {
            f[3*first+k] = -500*(x[3*second+k]-x[3*first+k]);
            f[3*second+k] = -f[3*first+k];
        }
        bool found = false;
        for (bool fene : {false, true}) {
            for (Chain& chain : chains)
                chain.stretching = fene ? StretchingModel::FENE : StretchingModel::Harmonic;
            ChainEngine engine(chains);
            for (int pack = 0; pack < engine.getNumPacks(); pack++) {
                const Instability one = engine.step(pack, x.data(), f.data(), NULL, {Scheme::Midpoint, 0, 1e-4, 1, 1},
                        displacements.data());
                check(one.chain == -1 || (fene && one.chain == 5), "wrong chain");
                if (one.chain == 5) {
                    const BrokenSegment broken = findBrokenSegment(chains[5], x.data(), f.data(), displacements.data(),
                            NULL, false);
                    check(broken.segment == 7 && broken.reason == BrokenSegment::LeavesRange, "wrong segment");
                    checkClose(segment.restLength+extension, broken.value, 1, 1, "length after the step");
                }
                found |= one.chain == 5;
            }
        }
        check(found == (extension < 1), "a length that leaves its range");
    }
}

/** Rows of properties that are equal are there once, in a pack and in all packs. */
static void testSharedProperties() {
    PropertyTables<double> tables;
    vector<int> rows, ofOther;
    const auto first = tables.find({1, 2, 3, 4, 1, 2}, 2, rows);
    check(*first == Array {1, 2, 3, 4} && rows == vector<int> {0, 1, 0}, "rows that are equal are there once");
    check(tables.find({1, 2, 3, 4}, 2, ofOther) == first && ofOther == vector<int> {0, 1}, "tables are shared");
    check(tables.find({1, 2, 3, 5}, 2, ofOther) != first, "others are not");
}

int main() {
    return runTests({
        testSharedProperties,
        testForces,
        testStraightAndFoldedChains,
        testStepsWithoutNoise,
        testPropulsion,
        testPlanarChainsKeepTheirHeight,
        testPeriodicImages,
        testCovarianceOfNoise,
        testChainsDoNotDependOnTheirPack,
        testLists,
        testInstability,
        testBrokenSegments,
        testLengthsThatLeaveTheirRange
    });
}
