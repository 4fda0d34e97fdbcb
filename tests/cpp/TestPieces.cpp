/**
 * This tests implicit steps of long chains that are taken piece by piece: that they are those of whole chains, that
 * energies are right where pieces are joined, and that steps are taken whole where pieces would not do.
 */

#include "TestChains.h"
#include "dynamics/ChainPieces.h"
#include "dynamics/PackFilling.h"
#include <algorithm>
#include <array>
#include <functional>
#include <numeric>

static const double KT = 2.5;
static const int LANES = 8, WIDE_LANES = 16;

/** A chain and the length of its steps. */
struct Case {
    string name;
    Chain chain;
    double h;
};

static Chain chainOf(int segments, const Segment& segment, double joint, BendingModel bending) {
    Chain chain;
    chain.bending = bending;
    chain.stretching = StretchingModel::Harmonic;
    for (int node = 0; node <= segments; node++)
        chain.nodes.push_back(node);
    chain.fixed.assign(segments+1, false);
    chain.segments.assign(segments, segment);
    chain.joints.assign(segments-1, joint);
    return chain;
}

/** DNA base pair by base pair; 1.6 ns is the recommended step. */
static Case dna(int segments, double h = 1557) {
    Chain chain = chainOf(segments, {0.33, 2217, 0, 0, 0, 0, 0}, 2586, BendingModel::BondDifference);
    chain.nodeFriction = 1150;
    return {"beads", chain, h};
}

/** F-actin in segments of 100 nm; its recommended step is a thousand times as long. */
static Case actin(int segments, double h = 1e6, BendingModel bending = BendingModel::InscribedCircle) {
    const Segment segment = {100, 29.33, 20, 239694, 349804, 455706798, 29326794508};
    return {"cylinders", chainOf(segments, segment, 439.5, bending), h};
}

/** A chain that is nearly in equilibrium, from the first node on. */
static Array positionsOf(const Chain& chain, int seed, const Array& first = {30, -20, 10}) {
    NormalNumbers normalNumbers(seed);
    Array x(first), t = {1, 0, 0};
    for (size_t s = 0; s < chain.segments.size(); s++) {
        const Segment& segment = chain.segments[s];
        const Array g = normalNumbers(4);
        double square = 0;
        for (int k = 0; k < 3 && s > 0; k++) {
            const double stiffness = chain.joints[s-1]*(isLinear(chain.bending) ? pow(segment.restLength, 2) : 1);
            t[k] += chain.planar && k == 2 ? 0 : g[k]*sqrt(KT/stiffness);
        }
        for (double component : t)
            square += component*component;
        const double length = segment.restLength+g[3]*sqrt(KT/segment.stiffness);
        for (int k = 0; k < 3; k++) {
            t[k] /= sqrt(square);
            x.push_back(x[x.size()-3]+t[k]*length);
        }
    }
    return x;
}

static Array someForces(const Array& x, double size) {
    Array f(x.size());
    for (size_t i = 0; i < f.size(); i++)
        f[i] = size*sin(0.37*i);
    return f;
}

static StepSettings settingsFor(double h, Precision precision, uint64_t step = 3, Scheme scheme = Scheme::Implicit) {
    StepSettings settings = {scheme, KT, h, 11, step};
    settings.precision = precision;
    return settings;
}

/** An engine that takes no chain in pieces: each is a piece itself, which is not cut again. */
static ChainEngine wholeChains(const vector<Chain>& chains) {
    vector<PieceOfChain> origins;
    for (size_t i = 0; i < chains.size(); i++) {
        origins.push_back({(int) i, 0, {}});
        for (size_t tether = 0; tether < chains[i].tethers.size(); tether++)
            origins.back().tethers.push_back(tether);
    }
    return ChainEngine(chains, origins);
}

/** All chains, the longest first. */
static vector<int> all(const vector<Chain>& chains) {
    vector<int> members;
    for (size_t i = 0; i < chains.size(); i++)
        members.push_back(i);
    stable_sort(members.begin(), members.end(), [&] (int a, int b) {
        return chains[a].nodes.size() > chains[b].nodes.size();
    });
    return members;
}

/** The largest difference of nodes, and of segments, over the lengths of segments. */
struct Difference {
    double ofNodes = 0, ofSegments = 0;
};

static Difference differenceOf(const Chain& chain, const Array& a, const Array& b) {
    Difference result;
    double last[3] = {};
    for (size_t node = 0; node+1 < chain.nodes.size(); node++) {
        const double length = chain.segments[node].restLength;
        double ofNode = 0, ofSegment = 0;
        for (int k = 0; k < 3; k++) {
            const double difference = a[3*chain.nodes[node]+k]-b[3*chain.nodes[node]+k];
            ofNode += difference*difference;
            ofSegment += (difference-last[k])*(difference-last[k]);
            last[k] = difference;
        }
        result.ofNodes = max(result.ofNodes, sqrt(ofNode)/length);
        if (node > 0)
            result.ofSegments = max(result.ofSegments, sqrt(ofSegment)/length);
    }
    return result;
}

/** A step by pieces is that of whole chains, as far as pieces may differ from each other. */
static void checkSteps(const string& name, const vector<Chain>& chains, const Array& x, const Array& f,
            const StepSettings& settings, const double* box = NULL) {
    ChainPieces pieces(chains, all(chains), LANES, WIDE_LANES);
    check(pieces.isUsed(settings), name+" is not cut");
    StepSettings reference = settings;
    reference.precision = Precision::Double;
    const ChainEngine whole = wholeChains(chains);
    for (uint64_t step = 0; step < 4; step++) {
        reference.step = step;
        StepSettings own = settings;
        own.step = step;
        Array found(x.size()), expected = stepOf(whole, x, f, reference, box);
        Instability result;
        check(pieces.step(x.data(), f.data(), box, own, found.data(), result), name+": pieces differ");
        check(result.chain < 0 && result.divided == 0 && result.iterations >= 3, name+": iterations");
        for (const Chain& chain : chains) {
            const Difference difference = differenceOf(chain, expected, found);
            const bool linear = isLinear(chain.bending);
            checkClose(0, difference.ofSegments, linear ? 0.009 : 0.003, 1, name+": segments");
            checkClose(0, difference.ofNodes, 0.03, 1, name+": nodes");
            for (size_t node = 0; node < chain.nodes.size(); node++) {
                check(!chain.fixed[node] || found[3*chain.nodes[node]] == 0, name+": fixed node that moves");
                check(!chain.planar || found[3*chain.nodes[node]+2] == 0, name+": chain that leaves its plane");
            }
        }
    }
}

static void checkChain(const string& name, const Chain& chain, double h, Scheme scheme = Scheme::Implicit,
            double force = 0) {
    const Array x = positionsOf(chain, 1), f = someForces(x, force);
    for (Precision precision : {Precision::Double, Precision::Automatic})
        checkSteps(name, {chain}, x, f, settingsFor(h, precision, 3, scheme));
}

static void testStepsAreThoseOfWholeChains() {
    for (const Case& own : {dna(6000), actin(2500), actin(8000, 1e9)})
        checkChain(own.name, own.chain, own.h, Scheme::Implicit, own.name == "beads" ? 5 : 0.1);
    for (BendingModel bending : {BendingModel::KratkyPorod, BendingModel::Quadratic})
        checkChain("bending model", actin(1500, 1e6, bending).chain, 1e6);
    checkChain("beads, second order", dna(4000).chain, 500, Scheme::ImplicitSecondOrder);
    checkChain("cylinders, second order", actin(1500).chain, 1e6, Scheme::ImplicitSecondOrder);

    Chain chain = actin(1500).chain;
    // All kinds of random bends: none, those of soft joints, and those that are drawn again if they are rejected.
    for (size_t joint = 0; joint < chain.joints.size(); joint++)
        chain.joints[joint] *= joint%4 == 0 ? 0.004 : joint%4 == 1 ? 0.03 : 1;
    checkChain("soft joints", chain, 1e4);

    chain = actin(1500).chain;
    chain.stretching = StretchingModel::FENE;
    checkChain("FENE lengths", chain, 1e6);

    chain = actin(1500).chain;
    chain.planar = true;
    checkChain("chain in a plane", chain, 1e6);

    chain = actin(1500).chain;
    for (Segment& segment : chain.segments)
        segment.propulsion = 0.05;
    chain.fixed[700] = true;
    const Array x = positionsOf(chain, 1);
    for (int node : {900, 3, 1400, 650})
        chain.tethers.push_back({node, {x[3*node]+5, x[3*node+1], x[3*node+2]}, 0.2});
    checkChain("tethered chain", chain, 1e6);
}

/** DNA in segments of 5 nm, whose ends are free, held, or turn against a friction. */
static Case twistedDna(int segments, double h, const char* ends = "free") {
    const Segment segment = {5, 2062, 0, 40300, 35900, 287000, 84000};
    Chain chain = chainOf(segments, segment, 25, BendingModel::KratkyPorod);
    chain.twist.stiffness.assign(segments-1, 50);
    chain.twist.rest.assign(segments-1, 0.2);
    chain.twist.friction.assign(segments, 64700);
    for (EndFrame& frame : chain.twist.ends) {
        const bool turns = string(ends) == "turning";
        if (string(ends) == "free")
            continue;
        frame.direction[0] = 1;
        frame.stiffness = 100;
        frame.friction = turns ? 1e6 : 0;
        (turns ? frame.torque : frame.angularVelocity) = turns ? 10 : 1e-7;
    }
    return {"twisted "+string(ends), chain, h};
}

/**
 * Twists of a chain in pieces are those of a whole one, and their sum changes by the areas that tangents have swept,
 * and by the turns of frames that are held, to rounding.
 */
static void checkTwists(const Case& own, Precision precision, const double* box = NULL) {
    const Chain& chain = own.chain;
    const size_t segments = chain.segments.size();
    ChainPieces pieces({chain}, {0}, LANES, WIDE_LANES);
    const ChainEngine whole = wholeChains({chain});
    const Array x = positionsOf(chain, 4), f(x.size());
    NormalNumbers normalNumbers(6);
    // Wound by a few k_B T of torque.
    Array twists = normalNumbers(segments+1);
    for (double& twist : twists)
        twist = 0.4+0.2*twist;
    vector<Array> ofChains = {twists}, changes = {Array(segments+1)};
    StepSettings settings = settingsFor(own.h, precision);
    settings.twists = &ofChains;
    settings.twistChanges = &changes;
    check(pieces.isUsed(settings), own.name+" is not cut");
    Array found(x.size()), expected(x.size());
    Instability result;
    check(pieces.step(x.data(), f.data(), box, settings, found.data(), result), own.name+": pieces differ");
    const Array ofPieces = changes[0];
    settings.precision = Precision::Double;
    whole.step(0, x.data(), f.data(), box, settings, expected.data());
    for (size_t joint = 0; joint <= segments; joint++)
        checkClose(changes[0][joint], ofPieces[joint], 0.003, 2, own.name+": twist");
    if (chain.twist.ends[0].stiffness == 0 || chain.twist.ends[0].friction > 0)
        return;
    double sum = 0;
    array<double, 3> tangents[2] = {{1, 0, 0}, {1, 0, 0}};
    for (size_t s = 0; s <= segments; s++) {
        array<double, 3> next[2] = {{1, 0, 0}, {1, 0, 0}};
        for (int k = 0; k < 3 && s < segments; k++) {
            next[0][k] = x[3*s+3+k]-x[3*s+k];
            next[1][k] = next[0][k]+(found[3*s+3+k]-found[3*s+k]);
        }
        sum += bestKernels().findSweptArea(tangents[0].data(), next[0].data(), tangents[1].data(), next[1].data());
        copy_n(next, 2, tangents);
    }
    // Both frames turn in the same way.
    checkClose(sum, accumulate(ofPieces.begin(), ofPieces.end(), 0.0), 1e-12, 10, own.name+": sum of twists");
}

static void testTwist() {
    for (Precision precision : {Precision::Double, Precision::Automatic})
        for (const char* ends : {"free", "held", "turning"})
            for (double h : {100.0, 1000.0})
                checkTwists(twistedDna(1500, h, ends), precision);
}

static void testFlowAndPeriodicBox() {
    const Case own = actin(1500);
    const Array x = positionsOf(own.chain, 1), f = someForces(x, 0);
    StepSettings settings = settingsFor(own.h, Precision::Automatic);
    settings.flow.present = true;
    settings.flow.gradient[1] = 1e-8;
    checkSteps("chain in a flow", {own.chain}, x, f, settings);

    const double box[] = {500, 0, 0, 100, 600, 0, -50, 70, 700};
    Array images = x;
    for (size_t node = 0; node < own.chain.nodes.size(); node++)
        for (int k = 0; k < 3; k++)
            images[3*node+k] += box[k]*((int) node%3)-box[3+k]*((int) node%5);
    checkSteps("chain in a box", {own.chain}, images, f, settingsFor(own.h, Precision::Automatic), box);
}

/** Two chains, the second of which is the longer one. */
static vector<Chain> twoChains(int first, int second, Array& x) {
    vector<Chain> chains = {actin(first).chain, actin(second).chain};
    x = positionsOf(chains[0], 2);
    const Array others = positionsOf(chains[1], 3, {0, 500, 500});
    for (int& node : chains[1].nodes)
        node += x.size()/3;
    x.insert(x.end(), others.begin(), others.end());
    return chains;
}

static void testChainsOfAPack() {
    Array x;
    const vector<Chain> chains = twoChains(2700, 3000, x);
    checkSteps("chains of a pack", chains, x, someForces(x, 0.1), settingsFor(1e6, Precision::Automatic));
}

static void testChainsOfAnEngine() {
    Array x;
    const vector<Chain> chains = twoChains(3000, 5000, x);
    const Array f = someForces(x, 0.1);
    const StepSettings settings = settingsFor(1e6, Precision::Automatic);
    const ChainEngine engine(chains), whole = wholeChains(chains);
    const Array expected = stepOf(whole, x, f, settings), found = stepOf(engine, x, f, settings);
    check(found != expected, "chains that are not cut");
    check(engine.getNumMixedChains(engine.getPacksOfStep(settings), settings) == 2, "chains in mixed precision");
    check(engine.getNumMixedChains(engine.getPacksOfStep(settings)) == 0, "coupled chains in mixed precision");
    for (const Chain& chain : chains) {
        const Difference difference = differenceOf(chain, expected, found);
        check(difference.ofSegments < 0.003 && difference.ofNodes < 0.03, "chain beside another");
    }
    // What was done before does not matter.
    StepSettings longer = settings;
    longer.stepSize *= 1000;
    stepOf(engine, x, f, longer);
    check(stepOf(engine, x, f, settings) == found, "step after a longer one");
    check(stepOf(ChainEngine(chains), x, f, settings) == found, "step of another engine");
}

static void testWhichChainsAreCut() {
    auto isCut = [] (const Case& own, double h, int count = 1) {
        const vector<Chain> chains(count, own.chain);
        return ChainPieces::mayBeUsed(chains, all(chains), WIDE_LANES) &&
                ChainPieces(chains, all(chains), LANES, WIDE_LANES).isUsed(settingsFor(h, Precision::Automatic));
    };
    check(isCut(dna(10000), 1557), "long chain");
    check(!isCut(dna(1000), 1557), "short chain");
    check(!isCut(dna(10000), 1557, 8), "chains that fill lanes");
    check(!isCut(dna(10000), HUGE_VAL) && !isCut(dna(10000), NAN), "step that is not finite");
    // What a force does decays over the distance that a step lets it.
    check(isCut(actin(1500), 1e6) && !isCut(actin(1500), 1e9), "chain that is long for short steps");
    Case straight = actin(1500);
    for (double& joint : straight.chain.joints)
        joint *= 1e4;
    check(isCut(actin(3500), 1e9) && !isCut(straight, 1e9), "chain that does not bend");
    Case ring = dna(10000);
    ring.chain.closed = true;
    check(!isCut(ring, 1557), "ring");
    check(isCut(twistedDna(400, 1000), 1000) && !isCut(twistedDna(400, 1e5), 1e5), "chain that is wound");
    Case bent = twistedDna(400, 1000);
    bent.chain.twist.bends.assign(2*bent.chain.joints.size(), 0.1);
    check(!isCut(bent, 1000), "chain with bends at rest");
    StepSettings settings = settingsFor(1557, Precision::Automatic);
    const vector<vector<TurnedPair> > pairs(1);
    settings.turnedPairs = &pairs;
    check(!ChainPieces({twistedDna(400, 1000).chain}, {0}, LANES, WIDE_LANES).isUsed(settings), "hands on the helix");
    settings.turnedPairs = NULL;
    vector<vector<SegmentForces> > recorded;
    settings.segmentForces = &recorded;
    check(!ChainPieces({dna(10000).chain}, {0}, LANES, WIDE_LANES).isUsed(settings), "step that is recorded");
    settings = settingsFor(1, Precision::Automatic, 1, Scheme::Euler);
    check(!ChainPieces({dna(10000).chain}, {0}, LANES, WIDE_LANES).isUsed(settings), "explicit step");
}

/** A step that pieces cannot take is that of the whole chain to the bit. */
static void checkTakenWhole(const string& name, const Chain& chain, const Array& x, const Array& f, double h,
            bool divided) {
    const StepSettings settings = settingsFor(h, Precision::Automatic);
    ChainPieces pieces({chain}, {0}, LANES, WIDE_LANES);
    check(pieces.isUsed(settings), name+" is not cut");
    Array found(x.size());
    Instability result;
    check(!pieces.step(x.data(), f.data(), NULL, settings, found.data(), result), name+" in pieces");
    const ChainEngine engine({chain}), whole = wholeChains({chain});
    check(engine.getNumMixedChains(engine.getPacksOfStep(settings), settings) == 1, name+": engine does not cut");
    result = engine.step(0, x.data(), f.data(), NULL, settings, found.data());
    check(result.chain < 0 && result.divided == divided, name+": divided");
    check(found == stepOf(whole, x, f, settings), name+" is not as the whole chain");
}

static void testWherePiecesWouldNotDo() {
    const Case own = actin(5000);
    Array x = positionsOf(own.chain, 1), f(x.size());
    f[3*2400+1] = 1000;
    f[3*2401+1] = -1000;
    checkTakenWhole("segment that turns far", own.chain, x, f, own.h, true);

    // A straight chain that is pulled at its ends: nothing decays there but along stiff lengths.
    Case taut = actin(9000, 1e9);
    for (Segment& segment : taut.chain.segments)
        segment.stiffness *= 100;
    x.clear();
    for (size_t node = 0; node < taut.chain.nodes.size(); node++)
        x.insert(x.end(), {100.0*node, 0, 0});
    f.assign(x.size(), 0);
    f[f.size()-3] = 2000;
    f[0] = -2000;
    checkTakenWhole("taut chain", taut.chain, x, f, taut.h, false);
}

static void testFailingChainIsNamed() {
    Array x;
    const vector<Chain> chains = twoChains(3000, 5000, x);
    Array f(x.size());
    f[3*chains[1].nodes[3000]] = NAN;
    const ChainEngine engine(chains);
    Array displacements(x.size());
    const StepSettings settings = settingsFor(1e6, Precision::Automatic);
    int failed = 0;
    for (int pack : engine.getPacksOfStep(settings)) {
        const Instability found = engine.step(pack, x.data(), f.data(), NULL, settings, displacements.data());
        check(found.chain < 0 || found.chain == 1, "chain that fails");
        failed += found.chain == 1;
    }
    check(failed == 1, "no chain that fails");
}

/** Mean energies of the lengths and bends, over k_BT, of some segments and of the others. */
struct MeanEnergies {
    double sum[2] = {}, square[2] = {};
    int count[2] = {};
    void add(bool joined, double value) {
        sum[joined] += value;
        square[joined] += value*value;
        count[joined]++;
    }
    double mean(bool joined) const {
        return sum[joined]/count[joined];
    }
    double error(bool joined) const {
        return sqrt((square[joined]/count[joined]-mean(joined)*mean(joined))/count[joined]);
    }
};

/** Lengths and bends have the same energies where pieces are joined as elsewhere. */
static void checkEnergies(const Case& own, int steps) {
    const int segments = own.chain.segments.size(), apart = 4;
    const StepSettings settings = settingsFor(own.h, Precision::Automatic);
    ChainPieces pieces({own.chain}, {0}, LANES, WIDE_LANES);
    Array x = positionsOf(own.chain, 5), f(x.size()), moved(x.size());
    const vector<bool> joined = pieces.findJoined(settings)[0];
    check(count(joined.begin(), joined.end(), true) >= 100, own.name+": joints of pieces");
    MeanEnergies lengths, bends;
    for (int step = 0; step < steps; step++) {
        StepSettings now = settings;
        now.step = step;
        Instability result;
        check(pieces.step(x.data(), f.data(), NULL, now, moved.data(), result), own.name+": pieces differ");
        for (size_t i = 0; i < x.size(); i++)
            x[i] += moved[i];
        if (step%apart != apart-1)
            continue;
        for (int s = 50; s < segments-50; s++) {
            double square = 0, before = 0, product = 0, bend = 0;
            for (int k = 0; k < 3; k++) {
                const double a = x[3*s+k]-x[3*s-3+k], b = x[3*s+3+k]-x[3*s+k];
                square += b*b;
                before += a*a;
                product += a*b;
                bend += (b-a)*(b-a);
            }
            const double extension = sqrt(square)-own.chain.segments[s].restLength;
            lengths.add(joined[s], 0.5*own.chain.segments[s].stiffness*extension*extension/KT);
            const double tangent = tan(0.5*acos(min(1.0, product/sqrt(square*before))));
            const double ofBend = isLinear(own.chain.bending) ? bend : 4*tangent*tangent;
            bends.add(joined[s], 0.5*own.chain.joints[s-1]*ofBend/KT);
        }
    }
    for (const MeanEnergies& energies : {lengths, bends}) {
        // Neighbours, and the same segment in other frames, have nearly nothing in common.
        const double error = hypot(energies.error(true), energies.error(false));
        check(error < 0.012*energies.mean(false), own.name+": error of energies "+to_string(error));
        checkClose(energies.mean(false), energies.mean(true), error, 4, own.name+": energies where pieces are joined");
    }
}

static void testEnergiesWherePiecesAreJoined() {
    checkEnergies(dna(4000), 240);
    checkEnergies(actin(2500), 360);
}

int main() {
    return runTests({
        testStepsAreThoseOfWholeChains,
        testTwist,
        testFlowAndPeriodicBox,
        testChainsOfAPack,
        testChainsOfAnEngine,
        testWhichChainsAreCut,
        testWherePiecesWouldNotDo,
        testFailingChainIsNamed,
        testEnergiesWherePiecesAreJoined
    });
}
