/**
 * This tests chains that grow while they stand still: how monomers are divided into segments, rates and equilibrium of
 * free ends, a rod that grows against a wall, a pool that runs dry, and the energies of contacts at ends.
 */

#include "GrowingChains.h"
#include "couplings/ContactBodies.h"
#include "couplings/EndContacts.h"
#include "couplings/EndLinks.h"
#include "couplings/EndWalls.h"
#include <map>
#include <numeric>

static void testDivision() {
    for (int perSegment : {2, 3, 7, 12})
        for (int first = -30; first < 30; first++)
            for (int last = first+1; last < first+5*perSegment; last++) {
                const SegmentDivision division({first, last}, perSegment), longer({first, last+1}, perSegment);
                const int count = division.countSegments(), least = perSegment/2;
                int sum = 0;
                for (int s = 0; s < count; s++) {
                    const int monomers = division.getMonomers(s);
                    sum += monomers;
                    check(count == 1 ? monomers < 2*perSegment : monomers >= least && monomers < least+perSegment &&
                            (s == 0 || s == count-1 || monomers == perSegment), "the monomers of a segment");
                    check(s >= count-1 || monomers == longer.getMonomers(s) || longer.countSegments() > count,
                            "what growth changes");
                    check(division.getMonomersFrom(1, count-1-s) == monomers && division.getMonomersFrom(0, s) ==
                            monomers, "the monomers from an end");
                }
                check(sum == last-first, "all monomers");
            }
}

/** Rates, and energies of lengths and bends, of chains that have grown and shrunk, at a step of so many events. */
static void checkFreeEnds(const Weights& weights, double events) {
    const int number = 1800;
    mt19937_64 generator = generatorOf(5);
    Growing all;
    all.system.tables = {makeTable(hasRange(weights.stretching))};
    all.system.pools = {{0.02, 0}};
    // The plus end gains 3 and loses 2 per time, and the minus end 1 and 2.5.
    for (int i = 0; i < number; i++)
        all.add(weights, {-20-i%PER_SEGMENT, 24+i%7}, 14, endOf(50, 2.5), endOf(150, 2), generator);
    ChainGrowth growth = all.makeGrowth();
    const double time = 8, stepSize = events/8.5;
    const int steps = max(1.0, round(time/stepSize));
    for (int i = 0; i < steps; i++)
        all.advance(growth, time/steps, 7);
    Mean plus, minus, plusSquare, bends, lengths;
    for (int i = 0; i < number; i++) {
        const MonomerRange& range = all.state.ranges[i];
        const double gained = range.last-24-i%7, lost = range.first+20+i%PER_SEGMENT;
        plus.add(gained);
        minus.add(lost);
        plusSquare.add((gained-time)*(gained-time));
        const Chain& chain = all.chains.getChain(i);
        Vec3d before = {0, 0, 0};
        for (size_t s = 0; s < chain.segments.size(); s++) {
            const double *a = &all.x[3*chain.nodes[s]], *b = &all.x[3*chain.nodes[s+1]];
            const Vec3d along = {b[0]-a[0], b[1]-a[1], b[2]-a[2]};
            const double length = sqrt(along.squared());
            const Segment& segment = chain.segments[s];
            lengths.add(stretchingByHand(segment, weights.stretching, length-segment.restLength)/
                    weights.meanStretching(segment));
            if (s > 0) {
                const double stiffness = chain.joints[s-1];
                bends.add(bendingByHand(weights.bending, stiffness,
                        acos(max(-1.0, min(1.0, along.dot(before)/length))))/
                        weights.meanBending(stiffness));
            }
            before = along*(1/length);
            check(!weights.planar || along.z == 0, "a plane");
        }
        for (int spare : chain.spareNodes)
            check(equal(&all.x[3*spare], &all.x[3*spare]+3, &all.x[3*chain.nodes.back()]), "spare nodes at the tip");
    }
    check(plus.error() < 0.02*time && minus.error() < 0.02*time, "too few chains");
    checkClose(time, plus.mean(), 4*plus.error(), 1, "the plus end");
    checkClose(1.5*time, minus.mean(), 4*minus.error(), 1, "the minus end");
    checkClose(5*time, plusSquare.mean(), 4*plusSquare.error(), 1, "the variance of the plus end");
    checkMean(1, bends, 0.08, "the energy of bends");
    checkMean(1, lengths, 0.08, "the energy of lengths");
}

static void testFreeEnds() {
    checkFreeEnds({BendingModel::KratkyPorod, StretchingModel::Harmonic, false}, 10);
    checkFreeEnds({BendingModel::Quadratic, StretchingModel::FENE, false}, 3);
    checkFreeEnds({BendingModel::InscribedCircle, StretchingModel::Harmonic, false}, 3);
    checkFreeEnds({BendingModel::Quadratic, StretchingModel::Harmonic, true}, 3);
}

/** One segment that grows against a wall in the direction that it has: the number of its monomers. */
static void checkRodBeforeWall(double events) {
    const double distance = 28, stiffness = 5, z = 3;
    mt19937_64 generator = generatorOf(3);
    Growing all;
    all.system.tables = {makeTable(false, 2)};
    all.system.pools = {{0.01, 0}};
    const Weights weights = {BendingModel::KratkyPorod, StretchingModel::Harmonic, false};
    for (int i = 0; i < 300; i++)
        all.add(weights, {0, 14}, 2, {}, endOf(100*z, 1), generator);
    // They have two segments from 18 monomers on, for which there are no nodes.
    EndWalls wall({WallShape::Plane, WallSide::Inside, {distance, 0, 0}, {-1, 0, 0}, 0}, stiffness, Array(300, 0.0));
    ChainGrowth growth = all.makeGrowth();
    vector<double> counts(18), exact(18);
    const int blocks = 20;
    vector<Array> ofBlocks(blocks, Array(18));
    const double stepSize = events/(1+z);
    const int steps = max(1.0, 4/stepSize);
    for (int block = -2; block < blocks; block++)
        for (int sample = 0; sample < 25; sample++) {
            for (int i = 0; i < steps; i++)
                all.advance(growth, 4.0/steps, 9, {&wall});
            for (const MonomerRange& range : all.state.ranges)
                if (block >= 0)
                    ofBlocks[block][range.size()] += 1;
        }
    for (int m = 2; m < 18; m++) {
        const Segment& segment = all.system.tables[0].getSegment(m);
        double sum = 0, norm = 0;
        for (int i = -10000; i < 20000; i++) {
            const double extension = 1e-4*i*segment.restLength;
            const double depth = max(0.0, segment.restLength+extension-distance);
            const double weight = weights.ofExtension(segment, extension);
            norm += weight;
            sum += weight*exp(-0.5*stiffness*depth*depth/KT);
        }
        exact[m] = pow(z, m)*sum/norm;
    }
    const double total = accumulate(exact.begin(), exact.end(), 0.0);
    Mean mean;
    double expected = 0;
    for (int m = 2; m < 18; m++)
        expected += m*exact[m]/total;
    for (const Array& block : ofBlocks) {
        double sum = 0, norm = 0;
        for (int m = 2; m < 18; m++) {
            sum += m*block[m];
            norm += block[m];
        }
        mean.add(sum/norm);
    }
    check(expected > 10 && expected < 15.5, "the wall does not count: "+to_string(expected));
    check(mean.error()*sqrt(blocks/(blocks-1.0)) < 0.02, "too few samples");
    checkClose(expected, mean.mean(), 0.02+4*mean.error(), 1, "a rod before a wall");
    for (int m = 8; m < 18; m++) {
        Mean share;
        for (const Array& block : ofBlocks)
            share.add(block[m]/accumulate(block.begin(), block.end(), 0.0));
        if (exact[m]/total > 0.02)
            checkClose(exact[m]/total, share.mean(), 5*share.error()+0.002, 1, "the monomers of a rod before a wall");
    }
}

static void testRodBeforeWall() {
    checkRodBeforeWall(0.2);
    checkRodBeforeWall(20);
}

/** Two chains share a pool that runs dry. */
static void testPool() {
    mt19937_64 generator = generatorOf(4);
    Growing all;
    all.system.tables = {makeTable(false)};
    all.system.pools = {{0.03, 1000}};
    const Weights weights = {BendingModel::KratkyPorod, StretchingModel::Harmonic, false};
    const int least = 2, monomers = 30+2*10;
    for (int i = 0; i < 2; i++)
        all.add(weights, {0, 10}, 12, {}, endOf(30.0+10*i, 0.9), generator);
    ChainGrowth growth = all.makeGrowth();
    // P(N, M) is the product of k_on (free)/V/k_off over the monomers of both, one after the other.
    double norm = 0, first = 0, second = 0;
    vector<double> ways(monomers+1, 1);
    for (int a = least; a <= monomers; a++)
        for (int b = least; a+b <= monomers; b++) {
            double weight = 1;
            for (int i = 0; i < a+b-2*least; i++)
                weight *= (monomers-2*least-i)/1000.0/0.9*8;
            weight *= pow(30.0/8, a-least)*pow(40.0/8, b-least);
            norm += weight;
            first += a*weight;
            second += b*weight;
        }
    Mean ofFirst, ofSecond;
    for (int block = 0; block < 40; block++) {
        Mean one, other;
        for (int i = 0; i < 2500; i++) {
            all.advance(growth, 5, 3);
            one.add(all.state.ranges[0].size());
            other.add(all.state.ranges[1].size());
            check(all.state.ranges[0].size()+all.state.ranges[1].size()+all.state.free[0] == monomers, "all monomers");
        }
        ofFirst.add(one.mean());
        ofSecond.add(other.mean());
    }
    checkMean(first/norm, ofFirst, 0.07, "the first chain of a pool");
    checkMean(second/norm, ofSecond, 0.07, "the second chain of a pool");
}

/** Ends with dynamic instability: the law of their lengths where it is bounded, by the rates of single monomers. */
static void checkDynamicInstability(double stepSize) {
    mt19937_64 generator = generatorOf(6);
    Growing all;
    all.system.tables = {makeTable(false)};
    all.system.pools = {{1, 0}};
    const Weights weights = {BendingModel::KratkyPorod, StretchingModel::Harmonic, false};
    // Monomers come at 3 per time or go at 6, and ends turn at 0.5 and 0.2.
    GrowingEnd plus;
    plus.states = {{3, 0, 0, 0, {0, 0.5}}, {0, 6, 1, 1, {0.2, 0}}};
    for (int i = 0; i < 400; i++)
        all.add(weights, {0, 12}, 20, endOf(0, 0), plus, generator);
    ChainGrowth growth = all.makeGrowth();
    // The stationary law of 2, 3, ... monomers, from the balance of what crosses between n and n+1: 3 g = 6 s.
    // g(n) (0.5+3) = 3 g(n-1)+0.2 s(n), with s(n) = g(n-1)/2.
    double g = 1, norm = 0, mean = 0;
    // With two monomers, an end that shrinks waits: 0.2 s = 0.5 g+6 s(3), and s(3) = g/2.
    for (int n = 2; n < 2000; n++) {
        const double s = n == 2 ? (0.5*g+3*g)/0.2 : 0.5*g;
        const double next = n == 2 ? g : (3*g+0.2*0.5*g)/3.5;
        const double now = n == 2 ? g : next;
        norm += now+s;
        mean += n*(now+s);
        g = now;
    }
    mean /= norm;
    Mean found;
    for (int block = -4; block < 16; block++) {
        Mean lengths;
        for (int i = 0; i < 20/stepSize; i++) {
            all.advance(growth, stepSize, 3);
            if (i%max(1, static_cast<int>(1/stepSize)) == 0)
                for (const MonomerRange& range : all.state.ranges)
                    lengths.add(range.size());
        }
        if (block >= 0)
            found.add(lengths.mean());
    }
    checkMean(mean, found, 0.08, "lengths with dynamic instability");
}

static void testDynamicInstability() {
    checkDynamicInstability(5);
}

/** Ends at which monomers come and go at regular times: as many as their speed says, whatever the step is. */
static void testRegularTimes() {
    for (double stepSize : {0.01, 0.37, 10.0}) {
        mt19937_64 generator = generatorOf(6);
        Growing all;
        all.system.tables = {makeTable(false)};
        all.system.pools = {{1, 0}};
        const Weights weights = {BendingModel::KratkyPorod, StretchingModel::Harmonic, false};
        GrowingEnd plus = endOf(3.5, 1), minus = endOf(0.2, 0.7);
        plus.timing.isRegular = minus.timing.isRegular = true;
        for (int i = 0; i < 5; i++)
            all.add(weights, {0, 60}, 20, minus, plus, generator);
        ChainGrowth growth = all.makeGrowth();
        const int steps = round(20/stepSize);
        for (int i = 0; i < steps; i++)
            all.advance(growth, stepSize, 3);
        for (const MonomerRange& range : all.state.ranges) {
            check(fabs(range.last-60-2.5*steps*stepSize) <= 1, "what a plus end gains");
            check(fabs(range.first-0.5*steps*stepSize) <= 1, "what a minus end loses");
        }
    }
}

/** A rod that grows towards a wall with another share of the load: its speed is exp(-dV/E) of the free one. */
static void testEnergyOfLoad() {
    mt19937_64 generator = generatorOf(3);
    Growing all;
    all.system.tables = {makeTable(false, 0.0001)};
    all.system.pools = {{1, 0}};
    const Weights weights = {BendingModel::KratkyPorod, StretchingModel::Harmonic, false};
    GrowingEnd plus = endOf(1, 0);
    plus.timing.energyOfLoad = 2*KT;
    const int number = 4000;
    for (int i = 0; i < number; i++)
        all.add(weights, {0, 10}, 2, {}, plus, generator);
    // The next monomer is 2 nm deep in it: 2 k_B T, of which E leaves exp(-1).
    EndWalls wall({WallShape::Plane, WallSide::Inside, {20, 0, 0}, {-1, 0, 0}, 0}, KT, Array(number, 0.0));
    ChainGrowth growth = all.makeGrowth();
    all.advance(growth, 0.5, 9, {&wall});
    Mean gained;
    for (const MonomerRange& range : all.state.ranges)
        gained.add(range.last > 10);
    checkClose(1-exp(-0.5*exp(-1.0)), gained.mean(), 4*gained.error(), 1, "the speed under a load");
    check(gained.error() < 0.04*gained.mean(), "too few rods");
}

/** An end before a wall that turns by itself, and more often the fewer monomers come. */
static void testBlockedGrowth() {
    mt19937_64 generator = generatorOf(3);
    Growing all;
    all.system.tables = {makeTable(false, 0.0001)};
    all.system.pools = {{1, 0}};
    const Weights weights = {BendingModel::KratkyPorod, StretchingModel::Harmonic, false};
    // One that has turned, or got a monomer, does nothing any more. The wall lets a share exp(-1) of monomers come. The
    // rate of turning is 0.2 of a rod of half its length, and grows by 0.35 where nothing comes.
    for (bool isRegular : {false, true}) {
        GrowingEnd plus;
        plus.states = {{1, 0, 2, 0, {0, 0.2, 0}, {0, 0.35, 0}, 10}, {0, 0, 0, 0, {0, 0, 0}}, {0, 0, 0, 0, {0, 0, 0}}};
        plus.timing = {isRegular, 2*KT};
        Growing own = all;
        const int number = 4000;
        for (int i = 0; i < number; i++)
            own.add(weights, {0, 10}, 2, {}, plus, generator);
        EndWalls wall({WallShape::Plane, WallSide::Inside, {20, 0, 0}, {-1, 0, 0}, 0}, KT, Array(number, 0.0));
        ChainGrowth growth = own.makeGrowth();
        const double time = 1.5, came = exp(-1.0), turned = 2*0.2+2*0.35*(1-came);
        own.advance(growth, time, 9, {&wall});
        Mean found;
        for (int i = 0; i < number; i++)
            found.add(own.state.endStates[2*i+1] == 1);
        // At regular times, a monomer is tried once, at a time of 1.
        const double until = 1-exp(-2*0.2), after = 1-exp(-2*0.2*0.5), tried = 0.7*(1-came);
        const double expected = isRegular ? until+(1-until)*(tried+(1-came-tried)*after) :
                turned/(turned+came)*(1-exp(-(turned+came)*time));
        checkMean(expected, found, 0.1, "ends that turn where their growth is blocked");
    }
}

/** What comes to one chain does not depend on others. */
static void testOrder() {
    const Weights weights = {BendingModel::KratkyPorod, StretchingModel::Harmonic, false};
    auto grown = [&] (int number) {
        mt19937_64 generator = generatorOf(4);
        Growing all;
        all.system.tables = {makeTable(false)};
        all.system.pools = {{0.02, 0}};
        for (int i = 0; i < number; i++)
            all.add(weights, {0, 30}, 14, endOf(50, 1), endOf(150, 2), generator);
        ChainGrowth growth = all.makeGrowth();
        for (int i = 0; i < 20; i++)
            all.advance(growth, 0.3, 3);
        return Array(all.x.begin(), all.x.begin()+42);
    };
    check(grown(1) == grown(5), "a chain by itself and among others");
}

/** The change at an end is that of the energy of all contacts. */
static void testContacts() {
    mt19937_64 generator = generatorOf(8);
    normal_distribution<double> normal;
    int touching = 0, passing = 0;
    for (int round = 0; round < 2000; round++) {
        // Chains that wind through a small ball, and spheres.
        vector<vector<Vec3d> > nodes;
        const int numChains = 5;
        for (int i = 0; i < numChains; i++) {
            Vec3d node = {5*normal(generator), 5*normal(generator), 5*normal(generator)};
            Vec3d along = {normal(generator), normal(generator), normal(generator)};
            nodes.push_back({node});
            for (int s = 0; s < 6; s++) {
                along = along*(1/sqrt(along.squared()))+Vec3d {0.4*normal(generator), 0.4*normal(generator),
                        0.4*normal(generator)};
                node = node+along*(8/sqrt(along.squared()));
                nodes.back().push_back(node);
            }
        }
        const int excluded = 1+round%2;
        ContactBodies bodies;
        Array x;
        ChainList chains;
        auto describe = [&] (const vector<vector<Vec3d> >& all, bool fills) {
            bodies = ContactBodies();
            x.clear();
            for (const vector<Vec3d>& own : all) {
                ContactBodies::Chain chain = {{}, 3, excluded, false};
                Chain mechanics;
                for (const Vec3d& node : own) {
                    chain.particles.push_back(x.size()/3);
                    x.insert(x.end(), {node.x, node.y, node.z});
                }
                bodies.chains.push_back(chain);
                mechanics.nodes = chain.particles;
                if (fills)
                    chains.add(mechanics);
            }
            for (int i = 0; i < 2; i++) {
                bodies.spheres.push_back({static_cast<int>(x.size()/3), 4});
                x.insert(x.end(), {4.0*i, 1, 5});
            }
        };
        describe(nodes, true);
        EndContacts contacts(bodies, {0, 1, -1, -1, 4}, 5, false);
        contacts.begin(x.data(), chains, NULL);
        const double energy = energyOfContacts(bodies, x, 5);

        // A tip that moves, a joint that comes, or one that goes, at either end.
        const int chain = round%3 == 2 ? 4 : round%3, kind = round/3%3, end = round/9%2;
        vector<Vec3d> after = nodes[chain];
        if (end == 0)
            reverse(after.begin(), after.end());
        auto jump = [&] {
            return Vec3d {1.5*normal(generator), 1.5*normal(generator), 1.5*normal(generator)};
        };
        if (kind == 0)
            after.back() = after.back()+jump();
        if (kind == 1) {
            const Vec3d along = after[6]-after[5];
            after[6] = after[5]+along*0.7+jump();
            after.push_back(after[6]+along*0.5+jump());
        }
        if (kind == 2) {
            after.pop_back();
            after.back() = after.back()+jump();
        }
        if (end == 0)
            reverse(after.begin(), after.end());
        const EndChange change = {chain, end, nodes[chain], after, kind == 2 ? 2 : 1, kind == 1 ? 2 : 1,
                {}, {}, 0.6};
        const double found = contacts.findChange(change);
        vector<vector<Vec3d> > others = nodes;
        others[chain] = after;
        describe(others, false);
        if (isinf(found)) {
            passing++;
            continue;
        }
        const double difference = energyOfContacts(bodies, x, 5)-energy;
        touching += difference != 0;
        checkClose(difference, found, 1+fabs(energy), 1e-9, "the contacts of an end");
        contacts.show(chain, after, {});
        const EndChange back = {chain, end, after, nodes[chain], kind == 1 ? 2 : 1, kind == 2 ? 2 : 1,
                {}, {}, 0.6};
        checkClose(-difference, contacts.findChange(back), 1+fabs(energy), 1e-9,
                "the contacts of an end that goes back");
    }
    check(touching > 350 && passing > 25, "too few contacts: "+to_string(touching)+", "+to_string(passing));
}

/** The change at an end is that of the energy of all links, whose places stay where they are along chains. */
static void testLinks() {
    mt19937_64 generator = generatorOf(8);
    normal_distribution<double> normal;
    uniform_real_distribution<double> uniform;
    int moved = 0;
    for (int round = 0; round < 500; round++) {
        const vector<double> along[] = {{-3, 5, 15, 25, 32}, {0, 10, 20, 27}};
        vector<vector<Vec3d> > nodes(2);
        Array x;
        ChainList chains;
        for (int i = 0; i < 2; i++) {
            Chain chain;
            for (size_t node = 0; node < along[i].size(); node++) {
                nodes[i].push_back({5*normal(generator), 5*normal(generator), 5*normal(generator)});
                chain.nodes.push_back(x.size()/3);
                x.insert(x.end(), {nodes[i][node].x, nodes[i][node].y, nodes[i][node].z});
            }
            chains.add(chain);
        }
        auto placeOn = [&] (int chain, double length, const vector<Vec3d>& at, const vector<double>& lengths,
                Vec3d& found) {
            if (length < lengths.front() || length > lengths.back())
                return false;
            size_t s = 0;
            while (s+2 < lengths.size() && length > lengths[s+1])
                s++;
            const double fraction = (length-lengths[s])/(lengths[s+1]-lengths[s]);
            found = at[s]*(1-fraction)+at[s+1]*fraction;
            check(chain >= 0, "a chain");
            return true;
        };
        vector<GrowingLink> links;
        for (int i = 0; i < 20; i++) {
            GrowingLink link = {{}, 0.3+uniform(generator), 4*uniform(generator)};
            for (int end = 0; end < 2; end++) {
                LinkEnd& own = link.ends[end];
                own.chain = i%5 == 0 && end == 1 ? -1 : (i+end)%2;
                for (int k = 0; k < 3 && own.chain < 0; k++)
                    own.place.point[k] = 5*normal(generator);
                if (own.chain < 0)
                    continue;
                const vector<double>& lengths = along[own.chain];
                own.along = lengths.front()+uniform(generator)*(lengths.back()-lengths.front());
                size_t s = 0;
                while (s+2 < lengths.size() && own.along > lengths[s+1])
                    s++;
                own.place.first = chains.getChain(own.chain).nodes[s];
                own.place.second = chains.getChain(own.chain).nodes[s+1];
                own.place.fraction = (own.along-lengths[s])/(lengths[s+1]-lengths[s]);
            }
            links.push_back(link);
        }
        vector<vector<Vec3d> > now = nodes;
        vector<vector<double> > lengths(along, along+2);
        auto energy = [&] {
            double sum = 0;
            for (const GrowingLink& link : links) {
                Vec3d ends[2];
                bool holds = true;
                for (int end = 0; end < 2; end++) {
                    const LinkEnd& own = link.ends[end];
                    ends[end] = {own.place.point[0], own.place.point[1], own.place.point[2]};
                    if (own.chain >= 0)
                        holds = placeOn(own.chain, own.along, now[own.chain], lengths[own.chain], ends[end]) && holds;
                }
                const double extension = sqrt((ends[1]-ends[0]).squared())-link.restLength;
                sum += holds ? 0.5*link.stiffness*extension*extension : 0;
            }
            return sum;
        };
        EndLinks felt([&] (vector<GrowingLink>& found) {found = links;}, false, false);
        felt.begin(x.data(), chains, NULL);
        // Changes that are made one after the other: a tip moves, a joint comes at the plus end, the minus end shrinks.
        for (int i = 0; i < 4; i++) {
            const int chain = i%2, end = i/2 == 0 ? 1 : 0;
            vector<Vec3d> after = now[chain];
            vector<double> alongAfter = lengths[chain];
            int segments[] = {1, 1};
            const Vec3d jump = {normal(generator), normal(generator), normal(generator)};
            if (end == 1 && round%2 == 0) {
                after.back() = after.back()+jump;
                alongAfter.back() += 1;
            }
            else if (end == 1) {
                after.push_back(after.back()+jump*4);
                alongAfter.back() -= 1;
                alongAfter.push_back(alongAfter.back()+5);
                segments[1] = 2;
            }
            else {
                after.front() = after.front()+jump;
                alongAfter.front() += 1.5;
            }
            const EndChange change = {chain, end, now[chain], after, segments[0], segments[1], lengths[chain],
                    alongAfter, 0.7};
            const double found = felt.findChange(change), before = energy();
            felt.show(chain, after, alongAfter);
            now[chain] = after;
            lengths[chain] = alongAfter;
            moved += found != 0;
            checkClose(energy()-before, found, 1+fabs(before), 1e-9, "the links of an end");
        }
    }
    check(moved > 1000, "too few links");
}

/** A tip does not jump over what is in its way, and a rod that grows towards another one stops before it. */
static void testRodInTheWay() {
    mt19937_64 generator = generatorOf(3);
    Growing all;
    all.system.tables = {makeTable(false)};
    all.system.pools = {{0.01, 0}};
    const Weights weights = {BendingModel::KratkyPorod, StretchingModel::Harmonic, false};
    all.add(weights, {0, 10}, 2, {}, endOf(400, 1), generator);
    Chain other;
    other.nodes = {2, 3};
    other.fixed = {true, true};
    all.chains.add(other);
    all.x.insert(all.x.end(), {31, -20, 0.3, 31, 20, 0.3});
    ContactBodies bodies;
    bodies.chains = {{{0, 1}, 2, 1, false}, {{2, 3}, 2, 1, false}};
    EndContacts contacts(bodies, {0, -1}, 1000, false);
    ChainGrowth growth = all.makeGrowth();
    double farthest = 0;
    for (int i = 0; i < 20000; i++) {
        all.advance(growth, 1, 3, {&contacts});
        farthest = max(farthest, all.x[3]);
    }
    check(farthest > 26 && farthest < 29.7, "a rod in the way");
}

static void testShortSteps() {
    for (double events : {0.1, 1.0})
        checkFreeEnds({BendingModel::KratkyPorod, StretchingModel::Harmonic, false}, events);
    checkDynamicInstability(0.05);
}

int main() {
    return runTests({testDivision, testFreeEnds, testPool, testDynamicInstability, testRegularTimes, testEnergyOfLoad,
            testBlockedGrowth, testOrder, testContacts, testLinks, testRodInTheWay},
            {testRodBeforeWall, testShortSteps});
}
