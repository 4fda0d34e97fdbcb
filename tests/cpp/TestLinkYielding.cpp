/**
 * This tests how a force moves a gap where links join chains: against dense solutions of all linear equations. With one
 * link between two chains, or a chain and a particle, responses are exact; of several links, and of one that joins a
 * chain to itself, what is left out is of a higher order in their stiffness.
 */

#include "TestChains.h"
#include "couplings/CapsuleGeometry.h"
#include "networks/ReflectedGaps.h"
#include <algorithm>
#include <memory>

const double STEP_SIZE = 0.5;
/** Of surfaces. */
const double STIFFNESS = 2;
const Vec3d ALONG = {0.48, -0.6, 0.64};

/** A place on a segment of a chain, or at a particle, by the numbers of chains; those of particles are behind. */
struct Spot {
    int chain, segment;
    double fraction;
};

/** A link that is stiffer along a direction. */
struct TestLink {
    TestLink(const Spot& first, const Spot& second, double stiffness) : spots {first, second}, stiffness(stiffness) {
    }
    Spot spots[2];
    double stiffness;
};

/** A gap that opens where a spot moves along a direction, against another one if there is one. */
struct TestGap {
    vector<Spot> spots;
    Vec3d gradient;
};

static TestGap gapOf(const Spot& spot, const Vec3d& gradient = {0.6, 0.64, 0.48}) {
    return {vector<Spot>(1, spot), gradient};
}

static TestGap gapBetween(const Spot& first, const Spot& second) {
    TestGap result = gapOf(first);
    result.spots.push_back(second);
    return result;
}

/** The first iteration of a step of chains, rings and particles, with links and gaps. */
class Network {
public:
    Network(const vector<Chain>& chains, const Array& x, int numParticles, Precision precision = Precision::Double) :
            chains(chains), engine(chains), x(x), places(this->chains, beams, bodies, x.size()/3+numParticles) {
        vector<CoupledParticle> particles;
        for (int i = 0; i < numParticles; i++) {
            particles.push_back({(int) x.size()/3+i, 40.0+10*i});
            this->x.insert(this->x.end(), {3.0*i, 1, 2});
        }
        places.setParticles(particles);
        settings.scheme = Scheme::Implicit;
        settings.stepSize = STEP_SIZE;
        settings.precision = precision;
        // Without noise, there are no packs in single precision.
        settings.kT = 1;
        vector<vector<int> > lanes;
        for (int pack : engine.getPacksOfStep(settings)) {
            steps.push_back(engine.createStep(pack));
            lanes.push_back(engine.getChainsOfLanes(pack));
        }
        if (numParticles > 0) {
            steps.emplace_back(new ParticleStep(particles));
            lanes.emplace_back();
            for (int i = 0; i < numParticles; i++)
                lanes.back().push_back(chains.size()+i);
        }
        places.setPacks(lanes);
        for (size_t pack = 0; pack < steps.size(); pack++) {
            packs.push_back(steps[pack].get());
            counts.push_back(lanes[pack].size());
            unfinished.emplace_back(new bool[lanes[pack].size()]);
        }
    }
    bool isMixed() const {
        return engine.getNumMixedChains(engine.getPacksOfStep(settings)) > 0;
    }
    /** Check that gaps which forces push closed in the cold are where responses say after one iteration. */
    void checkPrediction(const vector<TestLink>& links, const vector<TestGap>& testGaps) {
        begin(0);
        for (size_t i = 0; i < testGaps.size(); i++)
            add(testGaps[i], GapLaw::SpringBehind, 0, -20.0-i);
        iterate(links);
        for (size_t i = 0; i < testGaps.size(); i++) {
            check(gaps.getForce(i) > 0, "a gap is pushed");
            gaps.get(i).end += along(i, coupled.getMoves().data()+3*firstGap);
        }
        check(!gaps.anyUnfinished(SERIAL), "the only iteration leads gaps to where responses do");
    }
    /** Get how a force moves a gap by itself, but for what links pass on between its two chains. */
    double findResponseOfChains(const vector<TestLink>& links, const TestGap& gap) {
        begin(0);
        add(gap, GapLaw::SpringBehind, 0, -20);
        iterate(links);
        check(gaps.getForce(0) > 0, "a gap is pushed");
        return -freeEnd/gaps.getForce(0)-1/STIFFNESS;
    }
    /** The same with that, from the law of reflection: see ReflectedMotion. Two gaps have the same random numbers. */
    double findResponse(const vector<TestLink>& links, const TestGap& gap) {
        const double ofChains = findResponseOfChains(links, gap);
        auto reflect = [&] (double start, double end) {
            begin(1);
            add(gap, GapLaw::Reflection, start, end);
            iterate(links);
        };
        reflect(0, 0);
        const double move = freeEnd;
        double forces[2], ends[2];
        const double starts[] = {0, 0.1};
        for (int i = 0; i < 2; i++) {
            reflect(starts[i], -0.1-move);
            forces[i] = gaps.getForce(0);
            ends[i] = freeEnd+ofChains*forces[i];
            check(forces[i] > 0, "a gap is pushed");
        }
        return (starts[0]*ends[0]-starts[1]*ends[1])/(forces[1]*ends[1]-forces[0]*ends[0]);
    }
    /** Check that forces on all terms of a pack that are given together move these as each by itself. */
    void checkResponsesTogether() {
        for (size_t pack = 0; pack < packs.size(); pack++) {
            const int terms = coupled.countTerms(pack);
            const size_t size = 3*TermBlocks::fill(terms);
            Array forces(3*terms*size), moves(forces.size()), move(size);
            for (int i = 0; i < 3*terms; i++)
                forces[i*size+TermBlocks::place(i/3, i%3)] = 1;
            packs[pack]->respondToEach(forces.data(), moves.data(), 3*terms, size);
            for (int i = 0; i < 3*terms; i++) {
                packs[pack]->respond(forces.data()+i*size, move.data());
                for (int k = 0; k < 3*terms; k++) {
                    const int place = TermBlocks::place(k/3, k%3);
                    check(fabs(moves[i*size+place]-move[place]) <= 1e-9*fabs(move[TermBlocks::place(i/3, i%3)]),
                            "forces that are given together move places as each by itself");
                }
            }
        }
    }
    /** The same from a dense solution of all linear equations. */
    double findExactResponse(const vector<TestLink>& links, const TestGap& gap) {
        // How all places move without links.
        begin(0);
        vector<CouplingEquation> equations;
        for (const TestLink& link : links)
            equations.push_back(equationOf(link, 0));
        for (const Spot& spot : gap.spots)
            equations.push_back(equationOf(spot));
        solve(equations);
        const int numLinks = links.size(), numPlaces = 2*numLinks+gap.spots.size();
        auto termOf = [&] (int place) {
            return place < 2*numLinks ? coupled.getTerm(place/2, place%2) : coupled.getTerm(place-numLinks, 0);
        };
        auto packOf = [&] (int place) {
            return place < 2*numLinks ? equations[place/2].places[place%2].pack :
                    equations[place-numLinks].places[0].pack;
        };
        vector<Array> mobility(3*numPlaces, Array(3*numPlaces));
        for (int from = 0; from < 3*numPlaces; from++) {
            const int pack = packOf(from/3), first = coupled.firstTerm(pack);
            Array force(3*TermBlocks::fill(coupled.countTerms(pack))), move(force.size());
            force[TermBlocks::place(termOf(from/3)-first, from%3)] = 1;
            packs[pack]->respond(force.data(), move.data());
            for (int to = 0; to < 3*numPlaces; to++)
                if (packOf(to/3) == pack)
                    mobility[to][from] = move[TermBlocks::place(termOf(to/3)-first, to%3)];
        }
        checkResponsesTogether();
        // (1+C S^T K S) move = C f.
        vector<Array> matrix(3*numPlaces, Array(3*numPlaces));
        Array moves(3*numPlaces);
        const double gradient[] = {gap.gradient.x, gap.gradient.y, gap.gradient.z};
        for (int row = 0; row < 3*numPlaces; row++) {
            matrix[row][row] = 1;
            for (int link = 0; link < numLinks; link++) {
                const vector<Array> stiffness = stiffnessOf(links[link]);
                for (int side = 0; side < 2; side++)
                    for (int k = 0; k < 3; k++)
                        for (int j = 0; j < 3; j++) {
                            const double own = mobility[row][3*(2*link+side)+k]*stiffness[k][j];
                            matrix[row][3*(2*link+side)+j] += own;
                            matrix[row][3*(2*link+1-side)+j] -= own;
                        }
            }
            for (size_t i = 0; i < gap.spots.size(); i++)
                for (int k = 0; k < 3; k++)
                    moves[row] += (i == 0 ? 1 : -1)*mobility[row][3*(2*numLinks+i)+k]*gradient[k];
        }
        moves = denseSolution(matrix, moves);
        double sum = 0;
        for (size_t i = 0; i < gap.spots.size(); i++)
            for (int k = 0; k < 3; k++)
                sum += (i == 0 ? 1 : -1)*moves[3*(2*numLinks+i)+k]*gradient[k];
        return sum;
    }
private:
    void begin(double kT) {
        settings.kT = kT;
        const Array forces(x.size());
        for (size_t pack = 0; pack < packs.size(); pack++) {
            const unique_ptr<bool[]> taken(new bool[counts[pack]]);
            fill_n(taken.get(), counts[pack], true);
            packs[pack]->begin(x.data(), forces.data(), NULL, settings, taken.get());
            packs[pack]->beginStage(0);
        }
        gaps.begin(settings, places);
    }
    void solve(const vector<CouplingEquation>& equations) {
        check(coupled.solve(packs, PackFlags(packs.size(), 1), equations, settings.kT, demands, SERIAL),
                "equations are solved");
    }
    void iterate(const vector<TestLink>& links) {
        vector<CouplingEquation> equations;
        for (const TestLink& link : links)
            equations.push_back(equationOf(link, 1));
        firstGap = equations.size();
        gaps.addEquations(equations, SERIAL);
        demands.tolerance = 1e-12;
        solve(equations);
        coupled.predictMoves(packs, firstGap, SERIAL);
        freeEnd = gaps.get(0).end+along(0, coupled.getMoves().data());
        gaps.push(packs, PackFlags(packs.size(), 1), vector<char>(places.getNumChains(), 1), coupled, demands, SERIAL);
        coupled.advance(packs, PackFlags(packs.size(), 1), ShareOfChange(), unfinished, SERIAL);
    }
    double along(int gap, const double* moves) const {
        const double* const gradient = gaps.get(gap).levers[0].gradient;
        return moves[3*gap]*gradient[0]+moves[3*gap+1]*gradient[1]+moves[3*gap+2]*gradient[2];
    }
    PlaceOnChain find(const Spot& spot) const {
        Place place;
        const int particle = spot.chain-(int) chains.size();
        if (particle >= 0)
            place.first = x.size()/3-places.getNumChains()+spot.chain;
        else {
            const vector<int>& nodes = chains[spot.chain].nodes;
            place.first = nodes[spot.segment];
            place.second = nodes[(spot.segment+1)%nodes.size()];
            place.fraction = spot.fraction;
        }
        PlaceOnChain result;
        check(places.find(place, result), "a spot is found");
        return result;
    }
    static vector<Array> stiffnessOf(const TestLink& link) {
        const double n[] = {ALONG.x, ALONG.y, ALONG.z};
        vector<Array> result(3, Array(3));
        for (int k = 0; k < 3; k++)
            for (int j = 0; j < 3; j++)
                result[k][j] = link.stiffness*(0.3*(j == k)+0.7*n[k]*n[j]);
        return result;
    }
    CouplingEquation equationOf(const TestLink& link, double share) const {
        CouplingEquation equation = {};
        for (int side = 0; side < 2; side++)
            equation.places[side] = find(link.spots[side]);
        const vector<Array> stiffness = stiffnessOf(link);
        int entry = 0;
        for (int k = 0; k < 3; k++)
            for (int j = k; j < 3; j++)
                equation.stiffness[entry++] = share*stiffness[k][j];
        return equation;
    }
    CouplingEquation equationOf(const Spot& spot) const {
        CouplingEquation equation = {};
        equation.places[0] = find(spot);
        return equation;
    }
    void add(const TestGap& own, GapLaw law, double start, double end) {
        Gap gap;
        for (size_t i = 0; i < own.spots.size(); i++)
            gap.levers[0].places[i] = find(own.spots[i]);
        const double gradient[] = {own.gradient.x, own.gradient.y, own.gradient.z};
        copy(gradient, gradient+3, gap.levers[0].gradient);
        gap.numLevers = 1;
        gap.law = law;
        gap.stiffness = STIFFNESS;
        gap.start = start;
        gap.end = end;
        gaps.add(gap);
    }
    const vector<Chain> chains;
    const vector<BeamChain> beams;
    const vector<RigidBody> bodies;
    const ChainEngine engine;
    Array x;
    ChainPlaces places;
    StepSettings settings = {};
    vector<unique_ptr<PackStep> > steps;
    vector<PackStep*> packs;
    vector<int> counts;
    LaneFlags unfinished;
    CoupledEquations coupled;
    CoupledEquations::Demands demands;
    ReflectedGaps gaps;
    size_t firstGap = 0;
    double freeEnd = 0;
};

/** Chains of 5, 9 and 8 segments, a ring of 6, and two particles, which are numbers 4 and 5. */
static Network makeNetwork(Precision precision = Precision::Double) {
    Array x;
    vector<Chain> chains = makeChains({5, 9, 8}, BendingModel::KratkyPorod, StretchingModel::Harmonic, x);
    for (Chain& chain : chains)
        chain.fixed.assign(chain.nodes.size(), false);
    chains.push_back(makeRings({6}, BendingModel::KratkyPorod, StretchingModel::Harmonic, false, x)[0]);
    return Network(chains, x, 2, precision);
}

const Spot ON_FIRST = {0, 1, 0.3}, ON_SECOND = {1, 4, 0.8}, ON_RING = {3, 5, 0.6}, AT_PARTICLE = {4, 0, 0};
/** Without links, a force of one moves a place by about 0.04. */
const double SOFT = 1, MEDIUM = 1e3, STIFF = 1e6;

static void testOneLink() {
    Network network = makeNetwork();
    for (const Spot& other : {ON_SECOND, ON_RING, AT_PARTICLE})
        for (double stiffness : {SOFT, MEDIUM, STIFF})
            for (const bool turned : {false, true}) {
                const vector<TestLink> links = {turned ? TestLink(other, ON_FIRST, stiffness) :
                        TestLink(ON_FIRST, other, stiffness)};
                const string name = "a link to chain "+to_string(other.chain)+" of "+to_string(stiffness)+": ";
                for (const Spot& spot : {Spot {0, 1, 0.35}, Spot {0, 3, 0.5}, Spot {other.chain, 0, 0}}) {
                    const double exact = network.findExactResponse(links, gapOf(spot));
                    checkClose(exact, network.findResponseOfChains(links, gapOf(spot)), exact, 1e-7, name+"a gap");
                }
                const TestGap between = gapBetween({0, 2, 0.2}, {other.chain, 1, 0.4});
                const double exact = network.findExactResponse(links, between);
                checkClose(exact, network.findResponse(links, between), exact, 1e-7, name+"a gap between its chains");
                if (stiffness < STIFF)
                    network.checkPrediction(links, {gapOf({0, 1, 0.4}), gapOf({0, 4, 0.7}, ALONG),
                            gapOf({0, 0, 0.1}, ALONG)});
            }
}

/** Check by how much less responses are wrong where links are softer by a factor of four. */
static void checkOrder(const vector<TestLink>& links, const TestGap& gap, double factor, const string& name) {
    Network network = makeNetwork();
    double errors[2];
    for (int i = 0; i < 2; i++) {
        vector<TestLink> own = links;
        for (TestLink& link : own)
            link.stiffness *= i == 0 ? 1 : 0.25;
        const double exact = network.findExactResponse(own, gap), without = network.findExactResponse({}, gap);
        errors[i] = fabs(network.findResponse(own, gap)-exact);
        check(errors[i] < 1e-3*fabs(without-exact), name+": what links do is found");
    }
    check(errors[0] > factor*errors[1], name+": an error of a higher order, "+to_string(errors[0]/errors[1]));
}

/** Where links are parallel, or join a chain to itself, the error is of second order; else it is of third order. */
static void testSeveralLinks() {
    const vector<TestLink> parallel = {{ON_FIRST, ON_SECOND, SOFT}, {{0, 4, 0.4}, {1, 7, 0.3}, SOFT}};
    checkOrder(parallel, gapOf({0, 3, 0.2}), 12, "parallel links, one of their chains");
    checkOrder(parallel, gapBetween({0, 3, 0.2}, {1, 5, 0.5}), 12, "parallel links, between their chains");
    const vector<TestLink> inRow = {{ON_FIRST, ON_SECOND, SOFT}, {{1, 6, 0.4}, {2, 5, 0.3}, SOFT}};
    checkOrder(inRow, gapOf({0, 3, 0.2}), 50, "links in a row, the first chain");
    checkOrder(inRow, gapOf({1, 5, 0.5}), 50, "links in a row, the second chain");
    checkOrder({{{3, 1, 0.4}, {3, 4, 0.3}, SOFT}}, gapOf({3, 5, 0.5}), 12, "a ring with itself");
}

/** The stiffness of links that steps in single precision may have. */
static void testSinglePrecision() {
    Network network = makeNetwork(Precision::Mixed), twice = makeNetwork();
    check(network.isMixed() && !twice.isMixed(), "packs are in single precision");
    for (double stiffness : {10.0, 1e3, 1.6e4})
        for (const Spot& spot : {ON_FIRST, Spot {0, 3, 0.5}, ON_SECOND}) {
            const vector<TestLink> links = {{ON_FIRST, ON_SECOND, stiffness}};
            const double exact = twice.findExactResponse(links, gapOf(spot));
            checkClose(exact, network.findResponseOfChains(links, gapOf(spot)), exact, 2e-3, "in single precision");
        }
}

int main() {
    return runTests({testOneLink, testSeveralLinks, testSinglePrecision});
}
