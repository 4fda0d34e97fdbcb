/**
 * This tests chains that begin, vanish and are cut while they stand still, and the states of their ends and monomers.
 */

#include "GrowingChains.h"
#include "couplings/EndContacts.h"
#include "couplings/EndLinks.h"
#include "couplings/EndWalls.h"
#include <set>

static const Weights WEIGHTS = {BendingModel::KratkyPorod, StretchingModel::Harmonic, false};

/** Chains that are not there yet. */
static Growing emptyChains(int number, int particles, const GrowingEnd& minus, const GrowingEnd& plus,
        const MonomerPool& pool) {
    mt19937_64 generator = generatorOf(5);
    Growing all;
    all.system.tables = {makeTable(false)};
    all.system.pools = {pool};
    for (int i = 0; i < number; i++) {
        all.add(WEIGHTS, {}, particles, minus, plus, generator);
        all.system.chains[i].leastMonomers = 4;
        all.system.chains[i].vanishes = true;
    }
    return all;
}

static Nucleator nucleatorOf(double rate, int monomers, int chains) {
    Nucleator nucleator;
    nucleator.rate = rate;
    nucleator.monomers = monomers;
    nucleator.region = NucleationRegion::Cuboid;
    nucleator.lower = {-50, -50, -50};
    nucleator.upper = {50, 50, 50};
    for (int i = 0; i < chains; i++)
        nucleator.chains.push_back(i);
    return nucleator;
}

/** Chains that begin, grow, shrink and vanish: a Poisson number of each length, (J/k) z^(N-N0). */
static void checkNucleation(double stepSize) {
    const double z = 0.9, off = 1.5+0.7, rate = 12;
    Growing all = emptyChains(300, 20, endOf(0.7*z/0.01, 0.7), endOf(1.5*z/0.01, 1.5), {0.01, 0});
    all.system.nucleators = {nucleatorOf(rate, 4, 300)};
    ChainGrowth growth = all.makeGrowth();
    const double number = rate/off/(1-z);
    Mean numbers, squares, lengths, bends;
    for (int block = -3; block < 40; block++) {
        Mean count, square, monomers;
        for (double time = 0; time < 200; time += stepSize) {
            all.advance(growth, stepSize, 3);
            int present = 0;
            for (const MonomerRange& range : all.state.ranges)
                if (range.size() > 0) {
                    present++;
                    monomers.add(range.size());
                }
            count.add(present);
            square.add((present-number)*(present-number));
        }
        if (block < 0)
            continue;
        numbers.add(count.mean());
        squares.add(square.mean());
        lengths.add(monomers.mean());
        for (const MonomerRange& range : all.state.ranges) {
            if (range.size() <= PER_SEGMENT)
                continue;
            const Chain& chain = all.chains.getChain(&range-all.state.ranges.data());
            auto at = [&] (int node) {
                const double* x = &all.x[3*chain.nodes[node]];
                return Vec3d {x[0], x[1], x[2]};
            };
            for (size_t joint = 0; joint < chain.joints.size(); joint++) {
                const Vec3d a = at(joint+1)-at(joint), b = at(joint+2)-at(joint+1);
                const double angle = acos(min(1.0, a.dot(b)/sqrt(a.squared()*b.squared())));
                bends.add(bendingByHand(WEIGHTS.bending, chain.joints[joint], angle)/
                        WEIGHTS.meanBending(chain.joints[joint]));
            }
        }
    }
    check(all.state.population.waited == 0, "too few chains for what begins");
    const PopulationEvents& events = all.state.population;
    int present = 0;
    set<long long> different;
    for (size_t i = 0; i < all.state.ranges.size(); i++)
        if (all.state.ranges[i].size() > 0) {
            present++;
            different.insert(all.state.identities[i]);
        }
    check(events.nucleated-events.vanished == present && static_cast<int>(different.size()) == present &&
            all.state.nextIdentity == events.nucleated, "all that began is there or has vanished");
    checkMean(number, numbers, 0.1, "the number of chains");
    checkMean(number, squares, 0.6, "the variance of the number of chains");
    checkMean(4+z/(1-z), lengths, 0.1, "the lengths of chains that begin and vanish");
    checkMean(1, bends, 0.2, "bends of chains that have begun");
}

static void testNucleation() {
    checkNucleation(10);
}

/** What begins in a closed pool takes its monomers, and the law of mass action holds. */
static void testPool() {
    // Nuclei of four monomers, which neither grow nor shrink but vanish.
    const double atFirst = 60, rate = 2, off = 1;
    for (double stepSize : {0.1, 10.0}) {
        Growing all = emptyChains(20, 3, {}, endOf(0, off), {atFirst/1000, 1000});
        all.system.nucleators = {nucleatorOf(rate, 4, 20)};
        all.system.nucleators[0].order = 4;
        ChainGrowth growth = all.makeGrowth();
        double norm = 0, mean = 0, weight = 1;
        for (int chains = 0; 4*chains <= atFirst; chains++) {
            norm += weight;
            mean += chains*weight;
            double next = rate/off/(chains+1);
            for (int i = 0; i < 4; i++)
                next *= (atFirst-4*chains-i)/atFirst;
            weight *= next;
        }
        Mean found;
        for (int block = 0; block < 30; block++) {
            Mean numbers;
            for (int i = 0; i < max(400.0, 300/stepSize); i++) {
                all.advance(growth, stepSize, 3);
                int present = 0;
                for (const MonomerRange& range : all.state.ranges)
                    present += range.size() > 0;
                check(4*present+all.state.free[0] == atFirst, "all monomers");
                numbers.add(present);
            }
            found.add(numbers.mean());
        }
        checkMean(mean/norm, found, 0.08, "nuclei of a closed pool");
    }
}

/** What begins beside a wall, and in contacts, is as likely as its energy says. */
static void testNucleationAtWall() {
    const double depth = 3, stiffness = 2;
    Growing all = emptyChains(60, 3, {}, endOf(0, 1), {0.01, 0});
    for (GrowingChain& own : all.system.chains)
        own.leastMonomers = 8;
    Nucleator nucleator = nucleatorOf(20, 8, 60);
    nucleator.lower = {-depth, 0, 0};
    nucleator.upper = {20, 100, 100};
    nucleator.direction = {0, 1, 0};
    all.system.nucleators = {nucleator};
    EndWalls wall({WallShape::Plane, WallSide::Inside, {0, 0, 0}, {1, 0, 0}, 0}, stiffness, Array(60, 0.0));
    ChainGrowth growth = all.makeGrowth();
    // Both ends are at the same depth: the energy is twice that of one.
    double inside = 0;
    for (int i = 0; i < 3000; i++) {
        const double x = depth*(i+0.5)/3000;
        inside += exp(-stiffness*x*x/KT)*depth/3000;
    }
    Mean beyond, before;
    for (int block = 0; block < 40; block++) {
        Mean in, out;
        for (int i = 0; i < 100; i++) {
            all.advance(growth, 2, 3, {&wall});
            int counts[2] = {0, 0};
            for (size_t k = 0; k < all.state.ranges.size(); k++)
                if (all.state.ranges[k].size() > 0)
                    counts[all.x[3*all.chains.getChain(k).nodes[0]] > 0]++;
            in.add(counts[0]);
            out.add(counts[1]);
        }
        beyond.add(in.mean());
        before.add(out.mean());
    }
    check(all.state.population.waited == 0, "too few chains");
    checkMean(20*20/(20+depth), before, 0.08, "chains before a wall");
    checkMean(20*inside/(20+depth), beyond, 0.3, "chains in a wall");
}

/** The energies of what begins and vanishes are those of all contacts. */
static void testContactsOfWhole() {
    mt19937_64 generator = generatorOf(8);
    uniform_real_distribution<double> uniform(-8, 8);
    int touching = 0;
    for (int round = 0; round < 200; round++) {
        ContactBodies bodies;
        ChainList chains;
        Array x;
        for (int i = 0; i < 6; i++) {
            bodies.chains.push_back({{3*i, 3*i+1, 3*i+2}, 3, 1, false});
            Chain chain;
            chain.nodes = {3*i, 3*i+1, 3*i+2};
            for (int k = 0; k < 9; k++)
                x.push_back(uniform(generator));
            if (i == 5)
                chain.nodes.swap(chain.spareNodes);
            chains.add(chain);
        }
        ContactBodies others = bodies;
        others.chains.pop_back();
        vector<Vec3d> nodes;
        for (int node = 15; node < 18; node++)
            nodes.push_back({x[3*node], x[3*node+1], x[3*node+2]});
        EndContacts contacts(bodies, {0, -1, -1, -1, -1, 5}, 7, false);
        contacts.begin(x.data(), chains, NULL);
        const vector<Vec3d> start = {nodes[0]};
        const EndChange begins = {5, 1, start, nodes, 0, 2, {}, {}, 1};
        const EndChange vanishes = {5, 1, nodes, start, 2, 0, {}, {}, 1};
        const double expected = energyOfContacts(bodies, x, 7)-energyOfContacts(others, x, 7);
        touching += expected > 0;
        checkClose(expected, contacts.findChange(begins), 1+expected, 1e-9, "the contacts of what begins");
        contacts.show(5, nodes, {});
        checkClose(-expected, contacts.findChange(vanishes), 1+expected, 1e-9, "the contacts of what vanishes");
        contacts.show(5, start, {});
        checkClose(expected, contacts.findChange(begins), 1+expected, 1e-9, "the contacts of what begins again");
    }
    check(touching > 100, "too few contacts");
}

/**
 * Chains that grow at v and are cut at r between any two monomers, with the part at the plus end lost: lengths are
 * (r L/v) exp(-r L^2/2v) where they are many monomers.
 */
static void checkSeveringLengths(double stepSize) {
    const double speed = 40, rate = 0.004;
    const int number = 60, least = 4, most = 1200;
    // v p(n) is what comes back from all M > n to n or less, of which parts there are with four monomers or more.
    vector<double> p(most, 1e-200);
    double norm = 0, mean = 0;
    for (int n = most-2; n >= least; n--) {
        p[n] = 0;
        for (int m = n+1; m < most; m++)
            p[n] += p[m]*max(0, min(n, m-least)-least+1)*rate/speed;
    }
    for (int n = least; n < most; n++) {
        norm += p[n];
        mean += n*p[n];
    }
    mean /= norm;
    checkClose(sqrt(M_PI*speed/(2*rate)), mean, 1, 4, "the law in the limit of many monomers");
    mt19937_64 generator = generatorOf(6);
    Growing all;
    all.system.tables = {makeTable(false)};
    all.system.pools = {{1, 0}};
    // New minus ends lose monomers until nothing is left.
    GrowingEnd minus;
    minus.states = {{0, 0, 0, 0, {}}, {0, 1e6, 1, 1, {}}};
    for (int i = 0; i < 2*number; i++) {
        all.add(WEIGHTS, i < number ? MonomerRange {0, 125} : MonomerRange {}, 100, minus, endOf(speed, 0),
                generator);
        GrowingChain& own = all.system.chains[i];
        own.severing = {rate, {}, 1, 0};
        own.leastMonomers = least;
        own.vanishes = i >= number;
    }
    ChainGrowth growth = all.makeGrowth();
    Mean found;
    for (int block = -2; block < 14; block++) {
        Mean lengths;
        for (double time = 0; time < 40; time += stepSize) {
            all.advance(growth, stepSize, 3);
            for (int i = 0; i < number; i++) {
                check(all.state.ranges[i].first == 0, "the minus end stays");
                lengths.add(all.state.ranges[i].size());
            }
        }
        if (block >= 0)
            found.add(lengths.mean());
    }
    check(all.state.population.waited == 0 && all.state.population.severed > 1000, "parts have a place");
    checkMean(mean, found, 0.06, "lengths of chains that are cut");
}

static void testSeveringLengths() {
    checkSeveringLengths(5);
}

/** A chain that is cut: both parts have its equilibrium, and what is on it stays at its length along it. */
static void testSevering() {
    const int number = 3000;
    mt19937_64 generator = generatorOf(6);
    Growing all;
    all.system.tables = {makeTable(false)};
    all.system.pools = {{1, 0}};
    for (int i = 0; i < 2*number; i++) {
        all.add(WEIGHTS, i < number ? MonomerRange {-7, 61} : MonomerRange {}, 9, {}, {}, generator);
        all.system.chains[i].severing.rate = 0.02;
        all.system.chains[i].leastMonomers = 6;
    }
    ChainGrowth growth = all.makeGrowth();
    const vector<vector<int> > before = [&] {
        vector<vector<int> > nodes;
        for (int i = 0; i < number; i++)
            nodes.push_back(all.chains.getChain(i).nodes);
        return nodes;
    } ();
    const Array old = all.x;
    GrowthChanges changes = all.advance(growth, 0.5, 9);
    check(static_cast<long long>(changes.cuts.size()) == all.state.population.severed, "all cuts");
    // 67 places, of which 11 leave less than six monomers, are cut at 0.02 for 0.5: and parts again.
    check(changes.cuts.size() > 1000 && changes.cuts.size() < number, "how many were cut");
    map<int, int> firstCuts;
    for (const ChainCut& cut : changes.cuts) {
        const int index = cut.part;
        check(all.state.parents[index] >= 0 && all.state.parents[index] != all.state.identities[index], "a part");
        if (cut.chain < number)
            firstCuts[cut.chain]++;
    }
    Mean bends, lengths;
    Mean places;
    for (const ChainCut& cut : changes.cuts)
        places.add(cut.along/MONOMER);
    for (int i = 0; i < 2*number; i++) {
        const MonomerRange& range = all.state.ranges[i];
        if (range.size() == 0)
            continue;
        const Chain& chain = all.chains.getChain(i);
        check(range.size() >= 6 && range.first >= -7 && range.last <= 61, "a part with its monomers");
        check(chain.start == range.first*MONOMER, "where a part begins");
        for (size_t s = 0; s < chain.segments.size(); s++) {
            const double *a = &all.x[3*chain.nodes[s]], *b = &all.x[3*chain.nodes[s+1]];
            const Vec3d along = {b[0]-a[0], b[1]-a[1], b[2]-a[2]};
            const double rest = chain.segments[s].restLength;
            lengths.add(stretchingByHand(chain.segments[s], WEIGHTS.stretching, sqrt(along.squared())-rest)/
                    WEIGHTS.meanStretching(chain.segments[s]));
            if (s == 0)
                continue;
            const double* c = &all.x[3*chain.nodes[s-1]];
            const Vec3d last = {a[0]-c[0], a[1]-c[1], a[2]-c[2]};
            const double angle = acos(max(-1.0, min(1.0, along.dot(last)/sqrt(along.squared()*last.squared()))));
            bends.add(bendingByHand(WEIGHTS.bending, chain.joints[s-1], angle)/
                    WEIGHTS.meanBending(chain.joints[s-1]));
        }
    }
    checkMean(1, lengths, 0.1, "lengths of parts");
    checkMean(1, bends, 0.1, "bends of parts");
    // Where nothing else happened, what is far from the cut is where it was.
    int still = 0;
    for (const ChainCut& cut : changes.cuts) {
        if (cut.chain >= number || firstCuts[cut.chain] > 1 || all.state.ranges[cut.part].last != 61)
            continue;
        const Chain& part = all.chains.getChain(cut.part);
        const int last = part.nodes.back(), oldLast = before[cut.chain].back();
        if (part.nodes.size() > 2) {
            check(equal(&all.x[3*last], &all.x[3*last]+3, &old[3*oldLast]), "the plus end of a part");
            still++;
        }
        const int first = all.chains.getChain(cut.chain).nodes[0];
        if (all.chains.getChain(cut.chain).nodes.size() > 2)
            check(equal(&all.x[3*first], &all.x[3*first]+3, &old[3*before[cut.chain][0]]), "the minus end");
    }
    check(still > 300, "too few parts");
    checkClose(27, places.mean(), 4*places.error(), 1, "cuts are anywhere");
}

/** Chains that hands cut, where these are bound; those of which both parts are too short vanish. */
static void testSeveringHands() {
    for (bool isShort : {false, true}) {
        const int number = 1000, last = isShort ? 3 : 61;
        mt19937_64 generator = generatorOf(6);
        Growing all;
        all.system.tables = {makeTable(false)};
        all.system.pools = {{1, 1e6}};
        for (int i = 0; i < 2*number; i++) {
            all.add(WEIGHTS, i < number ? MonomerRange {-7, last} : MonomerRange {}, 9, {}, {}, generator);
            all.system.chains[i].leastMonomers = 6;
            all.system.chains[i].vanishes = true;
        }
        ChainGrowth growth = all.makeGrowth();
        // Two on each chain, of which one is at its end.
        GrowthStep step = {KT, 0.5, 9};
        for (int i = 0; i < number; i++) {
            step.hands.push_back({i, isShort ? -2*MONOMER : 30*MONOMER+0.3, 1.5, -1});
            step.hands.push_back({i, -7*MONOMER, 1e3, -1});
        }
        const long long free = all.state.free[0];
        const GrowthChanges changes = growth.advance(all.state, step, all.chains, all.x.data(), {});
        Mean cut;
        for (int i = 0; i < number; i++) {
            const MonomerRange& range = all.state.ranges[i];
            cut.add(range.last != last);
            check(range.last == last || range.last == (isShort ? 0 : 30), "where a hand cuts");
            check((range.size() == 0) == all.chains.getChain(i).nodes.empty(), "the nodes of what has vanished");
        }
        check(static_cast<long>(changes.cuts.size()) == lround(cut.sum), "all cuts");
        for (const ChainCut& own : changes.cuts)
            check(isShort ? own.part == -1 : own.along == 30*MONOMER && all.state.ranges[own.part].size() == 31,
                    "the other part");
        check(all.state.free[0] == free+(isShort ? 10*lround(cut.sum) : 0), "monomers of short parts are free");
        checkMean(1-exp(-0.75), cut, 0.13, "how many are cut by hands");
    }
}

/** The cap of two units, each of which may be hydrolysed: the mean time to the first catastrophe (Brun et al. 2009). */
static void checkCapOfTwoUnits(double stepSize) {
    const double g = 3, h = 0.43;
    GrowingEnd plus;
    // Both GTP, the last one GTP alone, the one before it GTP alone, and none.
    plus.states = {{g, 0, 0, 0, {0, h, h, 0}}, {g, 0, 0, 0, {0, 0, 0, h}}, {g, 0, 1, 0, {0, 0, 0, h}},
            {0, 0, 3, 3, {0, 0, 0, 0}}};
    const double expected = 1/h+(g+h)*(g+h)/(h*h*(3*g+2*h));
    mt19937_64 generator = generatorOf(6);
    Growing all;
    all.system.tables = {makeTable(false)};
    all.system.pools = {{1, 0}};
    const int number = 1000;
    for (int i = 0; i < number; i++)
        all.add(WEIGHTS, {0, 12}, 40, {}, plus, generator);
    ChainGrowth growth = all.makeGrowth();
    Mean times;
    vector<char> has(number, 0);
    for (double time = 0; time < 80; time += stepSize) {
        all.advance(growth, stepSize, 3);
        for (int i = 0; i < number; i++)
            if (!has[i] && all.state.endStates[2*i+1] == 3) {
                has[i] = 1;
                times.add(time+0.5*stepSize);
                check(all.state.events[2*i+1].switches[3] == 1, "one catastrophe");
            }
    }
    check(times.count > 0.999*number, "all have a catastrophe");
    checkClose(expected, times.mean(), 4*times.error(), 1, "the time to a catastrophe");
    check(times.error() < 0.04*expected, "too few chains");
}

static void testCapOfTwoUnits() {
    checkCapOfTwoUnits(1);
}

/**
 * Monomers that change from a first to a second and a third state, while chains treadmill: the states of the last ones,
 * and the monomers that ends lose, against a list of all monomers that is followed in full.
 */
static void testStatesOfMonomers() {
    // Plus ends gain, minus ends lose; off rates depend on the state.
    const double on = 4, first = 0.3, second = 0.1;
    const double plusOff[] = {1, 0.5, 3}, minusOff[] = {0.4, 0.2, 5};
    const int number = 400;
    auto endWith = [&] (double onRate, const double* off) {
        GrowingEnd end;
        end.states.clear();
        for (int state = 0; state < 3; state++)
            end.states.push_back({onRate, off[state], 0, 0, {0, state == 0 ? first : 0, state == 1 ? second : 0}});
        end.initialState = 2;
        return end;
    };
    // By hand: all monomers of one chain at a time.
    Mean gained, lost;
    Mean shares[3];
    const double duration = 15;
    {
        mt19937_64 generator = generatorOf(2);
        exponential_distribution<double> wait(1);
        uniform_real_distribution<double> uniform;
        for (int i = 0; i < 6*number; i++) {
            vector<int> monomers(30, 2);
            int plus = 0, minus = 0;
            double time = 0;
            while (true) {
                double total = on+plusOff[monomers.back()]+minusOff[monomers.front()];
                for (int state : monomers)
                    total += state == 0 ? first : state == 1 ? second : 0;
                time += wait(generator)/total;
                if (time > duration)
                    break;
                double chosen = uniform(generator)*total;
                auto is = [&] (double rate) {
                    chosen -= rate;
                    return chosen < 0;
                };
                if (is(on)) {
                    monomers.push_back(0);
                    plus++;
                }
                else if (is(plusOff[monomers.back()])) {
                    if (monomers.size() > 2) {
                        monomers.pop_back();
                        plus--;
                    }
                }
                else if (is(minusOff[monomers.front()])) {
                    if (monomers.size() > 2) {
                        monomers.erase(monomers.begin());
                        minus--;
                    }
                }
                else
                    for (int& state : monomers)
                        if (is(state == 0 ? first : state == 1 ? second : 0)) {
                            state++;
                            break;
                        }
            }
            gained.add(plus);
            lost.add(minus);
            for (int state = 0; state < 3; state++)
                shares[state].add(monomers.back() == state);
        }
    }
    for (double stepSize : {0.1, 15.0}) {
        mt19937_64 generator = generatorOf(6);
        Growing all;
        all.system.tables = {makeTable(false)};
        all.system.pools = {{1, 0}};
        for (int i = 0; i < 4*number; i++) {
            all.add(WEIGHTS, {0, 30}, 14, endWith(0, minusOff), endWith(on, plusOff), generator);
            all.system.chains[i].monomersHaveStates = true;
        }
        ChainGrowth growth = all.makeGrowth();
        for (int i = 0; i < duration/stepSize-0.5; i++)
            all.advance(growth, stepSize, 3);
        Mean plus, minus, found[3];
        for (int i = 0; i < 4*number; i++) {
            check(static_cast<int>(all.state.monomers[i].size()) == all.state.ranges[i].size(), "all monomers");
            plus.add(all.state.ranges[i].last-30);
            minus.add(-all.state.ranges[i].first);
            for (int state = 0; state < 3; state++)
                found[state].add(all.state.endStates[2*i+1] == state);
        }
        auto compare = [&] (const Mean& a, const Mean& b, const string& what) {
            checkClose(a.mean(), b.mean(), 4*sqrt(a.error()*a.error()+b.error()*b.error()), 1, what);
        };
        compare(gained, plus, "what plus ends gain");
        compare(lost, minus, "what minus ends lose");
        for (int state = 0; state < 3; state++)
            compare(shares[state], found[state], "the states of plus ends");
        check(plus.error() < 0.03*fabs(gained.mean()) && minus.error() < 0.05*fabs(lost.mean()), "too few chains");
    }
}

static void testShortSteps() {
    checkNucleation(0.1);
    checkNucleation(1);
    checkSeveringLengths(0.1);
    checkCapOfTwoUnits(0.02);
}

int main() {
    return runTests({testNucleation, testPool, testNucleationAtWall, testContactsOfWhole, testSeveringLengths,
            testSevering, testSeveringHands, testCapOfTwoUnits, testStatesOfMonomers}, {testShortSteps});
}
