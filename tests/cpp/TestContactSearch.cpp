/**
 * This tests which pairs of capsules are found, against all pairs in all images, and what is refused.
 */

#include "TestCapsuleSystems.h"
#include "couplings/CandidateLoops.h"
#include <cstring>
#include <map>
#include <set>
#include <thread>

static bool excludedByHand(const CapsuleSystem& system, int a, int b) {
    const Capsule &one = system.capsules[a], &other = system.capsules[b];
    for (int i : {one.first, one.second})
        for (int j : {other.first, other.second})
            if (i >= 0 && i == j)
                return true;
    if (one.chain >= 0 && one.chain == other.chain) {
        const CapsuleChain& chain = system.chains[one.chain];
        for (int apart = 0; apart <= chain.excludedNeighbors; apart++)
            for (int sign : {-1, 1}) {
                int index = one.index+sign*apart;
                if (chain.closed)
                    index = (index+chain.numCapsules)%chain.numCapsules;
                if (index == other.index)
                    return true;
            }
    }
    for (const pair<int, int>& exclusion : system.exclusions)
        if (exclusion == make_pair(a, b) || exclusion == make_pair(b, a))
            return true;
    return false;
}

struct FoundPairs {
    int near = 0, crossing = 0;
};

/** Compare the pairs of a search with all pairs in all images. */
static FoundPairs comparePairs(const TestSystem& test, const vector<ContactPair>& pairs, const double* box,
        double reach) {
    map<pair<int, int>, const ContactPair*> found;
    for (size_t i = 0; i < pairs.size(); i++) {
        check(pairs[i].a < pairs[i].b, "a < b");
        if (i > 0)
            check(make_pair(pairs[i-1].a, pairs[i-1].b) < make_pair(pairs[i].a, pairs[i].b), "sorted, each one once");
        found[{pairs[i].a, pairs[i].b}] = &pairs[i];
    }
    FoundPairs result;
    const vector<Capsule>& capsules = test.system.capsules;
    const int images = box == NULL ? 0 : 12;
    int explained = 0;
    for (int a = 0; a < (int) capsules.size(); a++)
        for (int b = a+1; b < (int) capsules.size(); b++) {
            if (excludedByHand(test.system, a, b))
                continue;
            const Vec3d a0 = at(test.x, capsules[a].first), a1 = at(test.x, capsules[a].end());
            const Vec3d b0 = at(test.x, capsules[b].first), b1 = at(test.x, capsules[b].end());
            const Vec3d A0 = at(test.y, capsules[a].first), A1 = at(test.y, capsules[a].end());
            const Vec3d B0 = at(test.y, capsules[b].first), B1 = at(test.y, capsules[b].end());
            const double limit = capsules[a].radius+capsules[b].radius+reach;
            const double motion = max(max(length(A0-a0-B0+b0), length(A0-a0-B1+b1)),
                    max(length(A1-a1-B0+b0), length(A1-a1-B1+b1)));
            // Spheres pass through others at a distance, and iterations move all by the reach.
            const bool sphere = capsules[a].second < 0 || capsules[b].second < 0;
            const double farthest = motion+2*reach+(sphere ? 2*DEEP*(limit-reach) : 0);
            bool must = false, may = false, later = false;
            Vec3d image = {0, 0, 0};
            // Images that are far from each other need not be looked at one by one.
            const double largest = length(a1-a0)+length(b1-b0)+limit+2*farthest;
            for (int k = -images; k <= images; k++) {
                if (box != NULL && fabs(a0.z-b0.z+k*box[8]) > largest)
                    continue;
                for (int j = -images; j <= images; j++) {
                    if (box != NULL && fabs(a0.y-b0.y+j*box[4]+k*box[7]) > largest)
                        continue;
                    for (int i = -images; i <= images; i++) {
                        Vec3d shift = {0, 0, 0};
                        if (box != NULL)
                            shift = {i*box[0]+j*box[3]+k*box[6], j*box[4]+k*box[7], k*box[8]};
                        if (length(a0-b0+shift) > largest)
                            continue;
                        const double before = distanceByHand(a0+shift, a1+shift, b0, b1);
                        const double after = distanceByHand(A0+shift, A1+shift, B0, B1);
                        bool mustBe = before < limit-1e-9 || after < limit-1e-9;
                        if (!mustBe && before+after <= motion+1e-9) {
                            const Vec3d start[] = {a0+shift, a1+shift, b0, b1}, end[] = {A0+shift, A1+shift, B0, B1};
                            const CrossingByHand crossing = crossingsByHand(start, end);
                            mustBe = crossing.clear && crossing.count > 0;
                            result.crossing += mustBe;
                        }
                        if (mustBe || before < limit+1e-9 || after < limit+1e-9 || before+after <= motion+1e-9) {
                            check(!may, "a pair meets in one image");
                            may = true;
                            must = mustBe;
                            image = shift;
                        }
                        else if (before+after <= farthest+1e-9 && !may) {
                            later = true;
                            image = shift;
                        }
                    }
                }
            }
            const auto entry = found.find({a, b});
            const string name = "pair "+to_string(a)+", "+to_string(b);
            if (must)
                check(entry != found.end(), "lost "+name);
            if (entry == found.end())
                continue;
            check(may || later, "too far: "+name);
            explained++;
            const ContactPair& contact = *entry->second;
            const Vec3d shift = {contact.shift[0], contact.shift[1], contact.shift[2]};
            checkClose(0, length(shift-image), 1, 1e-9, "image of "+name);
            const Vec3d start[] = {a0+shift, a1+shift, b0, b1};
            const double before = distanceByHand(start[0], start[1], start[2], start[3]);
            check(contact.before <= before && contact.before >= before-5 && contact.before >= 0, "distance of "+name);
            const double volume = volumeByHand(start, start, 0);
            if (fabs(volume) > 1e-6)
                check((volume > 0 ? 1 : -1) == contact.side, "side of "+name);
            result.near += must;
        }
    check(explained == (int) pairs.size(), "excluded pairs were found");
    return result;
}

static vector<ContactPair> findPairs(const TestSystem& test, const double* box, double reach,
        const Loop& run = Loop()) {
    ContactSearch search(test.system);
    vector<ContactPair> pairs;
    search.findPairs(test.x.data(), test.y.data(), box, reach, pairs, run);
    return pairs;
}

static void testPairs() {
    mt19937_64 generator(3);
    FoundPairs all;
    for (int trial = 0; trial < 30; trial++) {
        // Thin ones that cross must be found though they are far from each other at the start and at the end.
        const bool thin = trial >= 24;
        const double segment = trial%3 == 0 ? 30 : 100, motion = thin ? 25 : trial%4 == 0 ? 0 : 5;
        const double diameter = thin ? 0.5 : 30, reach = thin || trial%3 == 1 ? 0 : 15;
        // Random boxes, in reduced form.
        const double size = 900;
        const double tilt = trial%2 == 0 ? 0 : 0.5;
        double box[9] = {size*uniform(generator, 1, 1.3), 0, 0, 0, size*uniform(generator, 1, 1.3), 0, 0, 0,
                size*uniform(generator, 1, 1.3)};
        box[3] = tilt*box[0]*uniform(generator, -1, 1);
        box[6] = tilt*box[0]*uniform(generator, -1, 1);
        box[7] = tilt*box[4]*uniform(generator, -1, 1);
        const double* vectors = trial%6 < 4 ? box : NULL;
        TestSystem test = makeSystem(generator, 40, 8, size, segment, diameter, motion, vectors);
        if (motion == 0 && trial%8 == 0) {
            // The same array, too.
            ContactSearch search(test.system);
            vector<ContactPair> pairs, same = findPairs(test, vectors, reach);
            search.findPairs(test.x.data(), test.x.data(), vectors, reach, pairs);
            check(pairs.size() == same.size(), "one array or two");
        }
        const FoundPairs found = comparePairs(test, findPairs(test, vectors, reach), vectors, reach);
        all.near += found.near;
        all.crossing += found.crossing;
    }
    check(all.near > 3000 && all.crossing > 50, "many pairs were compared");
}

/** A box that is as small as allowed: two cells in each direction. And one that is a bit smaller. */
static void testSmallBoxes() {
    mt19937_64 generator(4);
    int compared = 0;
    for (int trial = 0; trial < 30; trial++) {
        const double tilt = trial%2 == 0 ? 0 : 0.5;
        auto boxOfSize = [&] (double size, double* box) {
            const double vectors[9] = {size, 0, 0, tilt*size*0.7, 0.9*size, 0, -tilt*0.9*size, tilt*0.8*size,
                    0.95*size};
            copy(vectors, vectors+9, box);
        };
        double box[9];
        boxOfSize(400, box);
        TestSystem test = makeSystem(generator, 6, 1+trial%3, 0, 60, 20, 4, box);
        double lower = 100, upper = 1200;
        while (upper-lower > 1e-3) {
            const double size = 0.5*(lower+upper);
            boxOfSize(size, box);
            try {
                findPairs(test, box, 10);
                upper = size;
            }
            catch (const invalid_argument& error) {
                check(string(error.what()).find("too small") != string::npos, error.what());
                lower = size;
            }
        }
        check(upper < 500, "a box that is large enough is taken");
        boxOfSize(upper, box);
        compared += comparePairs(test, findPairs(test, box, 10), box, 10).near;
    }
    check(compared > 300, "many pairs were compared in small boxes");
}

/** Nearly parallel segments of all distances, far from the origin: none must be lost in single precision. */
static void testRounding() {
    mt19937_64 generator(5);
    for (double far : {0.0, 1e3, 1e6}) {
        int near = 0;
        for (int trial = 0; trial < 60; trial++) {
            TestSystem test;
            const Vec3d direction = randomVector(generator);
            const Vec3d along = direction*(100/length(direction)), across = randomVector(generator);
            const Vec3d origin = randomVector(generator, far);
            const double angle = pow(10, uniform(generator, -9, -0.5));
            for (int i = 0; i < 40; i++) {
                const Vec3d start = origin+across*uniform(generator, 0, 60)+along*uniform(generator, -2, 2);
                add(test.x, start);
                add(test.x, start+along+randomVector(generator, 100*angle));
                test.system.capsules.push_back({2*i, 2*i+1, trial%2 == 0 ? 15.0 : 0.01});
            }
            test.y = test.x;
            near += comparePairs(test, findPairs(test, NULL, 0), NULL, 0).near;
        }
        check(near > 1000, "many pairs were compared");
    }
}

/** What a first look says must be so. */
static void testOutlooks() {
    mt19937_64 generator(11);
    int crossing = 0, touching = 0, ofNeighbors = 0;
    for (int trial = 0; trial < 6; trial++) {
        const double box[9] = {700, 0, 0, 100, 700, 0, -50, 80, 700}, *vectors = trial%2 == 0 ? box : NULL;
        const TestSystem test = makeSystem(generator, 60, 8, 700, 50, 20, trial < 4 ? 6 : 0, vectors);
        const double *x = test.x.data(), *y = test.y.data();
        ContactSearch search(test.system);
        vector<ContactPair> pairs;
        search.findPairs(x, y, vectors, 10, pairs);
        vector<const ContactPair*> pointers;
        for (const ContactPair& pair : pairs)
            pointers.push_back(&pair);
        vector<PairOutlook> outlooks(pairs.size());
        search.setMotion(x, y, [] (int count, const function<void(int)>& iteration) {
            for (int i = 0; i < count; i++)
                iteration(i);
        });
        search.findOutlooks(pointers.data(), pointers.size(), outlooks.data());
        for (size_t i = 0; i < pairs.size(); i++) {
            const Capsule &a = test.system.capsules[pairs[i].a], &b = test.system.capsules[pairs[i].b];
            const Vec3d shift = {pairs[i].shift[0], pairs[i].shift[1], pairs[i].shift[2]};
            const double distance = distanceByHand(at(test.y, a.first)+shift, at(test.y, a.end())+shift,
                    at(test.y, b.first), at(test.y, b.end()));
            checkClose(distance-a.radius-b.radius, outlooks[i].gap, 1, 1e-6, "gap");
            const bool crosses = search.crosses(pairs[i], x, y);
            check(outlooks[i].mayCross || !crosses, "a pair that crosses may do so");
            Contact contacts[2];
            const int count = search.evaluate(pairs[i], x, y, contacts);
            check(!outlooks[i].isOfNeighbor || count == 0, "a neighbor's contact");
            crossing += crosses;
            touching += !outlooks[i].mayCross && !outlooks[i].isOfNeighbor && count > 0;
            ofNeighbors += outlooks[i].isOfNeighbor;
        }
    }
    check(crossing > 10 && touching > 100 && ofNeighbors > 100, "all of them occur");
}

/** Pairs that a search has not found come to be known when one of their capsules has moved by half of the reach. */
static void testSearchingAgain() {
    mt19937_64 generator(12);
    const double reach = 10;
    int added = 0;
    for (int trial = 0; trial < 4; trial++) {
        const double box[9] = {900, 0, 0, 100, 900, 0, -50, 80, 900}, *vectors = trial%2 == 0 ? box : NULL;
        const TestSystem test = makeSystem(generator, 60, 8, 900, 50, 20, 5, vectors);
        ContactSearch search(test.system);
        vector<ContactPair> pairs, others;
        search.findPairs(test.x.data(), test.y.data(), vectors, reach, pairs);
        set<pair<int, int> > known;
        for (const ContactPair& one : pairs)
            known.insert({one.a, one.b});
        // In some chains, all nodes move far, and more than once.
        vector<double> y = test.y;
        for (int turn = 0; turn < 3; turn++) {
            vector<int> moved;
            for (int i = 0; i < (int) test.system.capsules.size(); i++) {
                const Capsule& capsule = test.system.capsules[i];
                if (capsule.chain < 0 || capsule.chain%3 != turn%2)
                    continue;
                moved.push_back(i);
                for (int k = 0; k < 3 && capsule.index == 0; k++)
                    y[3*capsule.first+k] += 30;
                for (int k = 0; k < 3; k++)
                    y[3*capsule.end()+k] += 30;
            }
            search.findPairsOf(moved, test.x.data(), y.data(), others);
            vector<ContactPair> all, unknown, allUnknown;
            const PairFilter isKnown = [&] (int a, int b) {return known.count({a, b}) == 1;};
            search.findPairsOf(moved, test.x.data(), y.data(), unknown, Loop(), isKnown);
            ContactSearch again(test.system);
            again.findPairs(test.x.data(), y.data(), vectors, reach, all);
            again.findPairs(test.x.data(), y.data(), vectors, reach, allUnknown, Loop(), isKnown);
            for (auto lists : {make_pair(others, unknown), make_pair(all, allUnknown)}) {
                vector<ContactPair>& left = lists.first;
                left.erase(remove_if(left.begin(), left.end(), [&] (const ContactPair& one) {
                    return isKnown(one.a, one.b);
                }), left.end());
                check(equal(left.begin(), left.end(), lists.second.begin(), lists.second.end(),
                        [] (const ContactPair& one, const ContactPair& other) {
                            return one.a == other.a && one.b == other.b;
                        }), "known pairs are left out, and no others");
            }
            for (const ContactPair& one : others)
                added += known.insert({one.a, one.b}).second;
            const set<int> movers(moved.begin(), moved.end());
            for (const ContactPair& one : all)
                check(known.count({one.a, one.b}) == 1 || (movers.count(one.a) == 0 && movers.count(one.b) == 0),
                        "lost pair "+to_string(one.a)+", "+to_string(one.b));
        }
    }
    check(added > 100, "pairs were added");
}

static void testLoops() {
    mt19937_64 generator(6);
    const double box[9] = {1200, 0, 0, 300, 1200, 0, -100, 200, 1200};
    const TestSystem test = makeSystem(generator, 100, 10, 0, 100, 30, 8, box);
    const vector<ContactPair> expected = findPairs(test, box, 20);
    for (int numThreads : {1, 2, 3, 5}) {
        const Loop run = [numThreads] (int count, const function<void(int)>& iteration) {
            vector<thread> threads;
            for (int t = 0; t < numThreads; t++)
                threads.emplace_back([=, &iteration] {
                    for (int i = t; i < count; i += numThreads)
                        iteration(i);
                });
            for (thread& worker : threads)
                worker.join();
        };
        for (const Loop& runner : {run, BACKWARDS}) {
            const vector<ContactPair> pairs = findPairs(test, box, 20, runner);
            check(pairs.size() == expected.size(), "as many pairs");
            for (size_t i = 0; i < pairs.size(); i++)
                check(pairs[i].a == expected[i].a && pairs[i].b == expected[i].b && pairs[i].side == expected[i].side &&
                        memcmp(pairs[i].shift, expected[i].shift, sizeof(pairs[i].shift)) == 0, "the same pairs");
        }
    }
    // A search may be used again, with other positions and boxes.
    ContactSearch search(test.system);
    vector<ContactPair> pairs;
    for (int turn = 0; turn < 2; turn++) {
        search.findPairs(test.x.data(), test.y.data(), NULL, 5, pairs);
        search.findPairs(test.x.data(), test.y.data(), box, 20, pairs);
        check(pairs.size() == expected.size(), "a search that was used before");
    }
}

static void checkRefused(const function<void()>& function, const string& reason) {
    try {
        function();
    }
    catch (const invalid_argument& error) {
        check(string(error.what()).find(reason) != string::npos, string("not for this reason: ")+error.what());
        return;
    }
    throw runtime_error("not refused: "+reason);
}

static void testRefusals() {
    auto make = [] (const vector<Capsule>& capsules, const vector<pair<int, int> >& exclusions) {
        ContactSearch search({capsules, {{1, false, 1}}, exclusions});
    };
    checkRefused([&] {make({{-1, 0, 1}}, {});}, "particle");
    checkRefused([&] {make({{2, 2, 1}}, {});}, "particle");
    checkRefused([&] {make({{0, 1, -1}}, {});}, "radius");
    checkRefused([&] {make({{0, 1, NAN}}, {});}, "radius");
    checkRefused([&] {make({{0, 1, 1, 1, 0}}, {});}, "chain");
    checkRefused([&] {make({{0, 1, 1, 0, 1}}, {});}, "number in its chain");
    checkRefused([&] {make({{0, 1, 1, 0, 0}}, {{0, 1}});}, "capsule 1");
    CapsuleSystem system = {{{0, 1, 1}, {2, -1, 1}}, {}, {}};
    ContactSearch search(system);
    vector<ContactPair> pairs;
    const double x[] = {0, 0, 0, 10, 0, 0, 5, 0, 1}, box[] = {100, 0, 0, 0, 100, 0, 0, 0, 100};
    const double notReduced[] = {100, 10, 0, 0, 100, 0, 0, 0, 100};
    checkRefused([&] {search.findPairs(x, x, box, -1, pairs);}, "reach");
    checkRefused([&] {search.findPairs(x, x, notReduced, 1, pairs);}, "reduced");
    for (double bad : {(double) NAN, (double) INFINITY})
        for (const double* vectors : {box, (const double*) NULL}) {
            const double y[] = {0, 0, 0, 10, 0, 0, 5, bad, 1};
            checkRefused([&] {search.findPairs(x, y, vectors, 1, pairs);}, "particle 2");
        }
    search.findPairs(x, x, box, 1, pairs);
    check(pairs.size() == 1, "one pair");
    ContactSearch empty((CapsuleSystem()));
    empty.findPairs(x, x, box, 1, pairs);
    check(pairs.empty(), "nothing there");
}

int main() {
    return runTests({testPairs, testSmallBoxes, testRounding, testOutlooks, testSearchingAgain, testLoops,
            testRefusals});
}
