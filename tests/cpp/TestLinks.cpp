/**
 * This tests links: forces against differences of energies, for all kinds of places and in a box; and tables of links:
 * their digests, and that all changes can be taken back.
 */

#include "TestChains.h"
#include "couplings/LinkTable.h"
#include <map>

const double SMALL_BOX[] = {5, 0, 0, 0.8, 4.5, 0, -0.6, 1.1, 4};
const int PARTICLES = 8;

static Array randomNumbers(int count, double low, double high, int seed) {
    mt19937 generator(seed);
    uniform_real_distribution<double> uniform(low, high);
    Array numbers(count);
    for (double& number : numbers)
        number = uniform(generator);
    return numbers;
}

static Place at(int particle) {
    Place place;
    place.first = particle;
    return place;
}

static Place between(int first, int second, double fraction) {
    Place place = at(first);
    place.second = second;
    place.fraction = fraction;
    return place;
}

static Place point(double x, double y, double z) {
    Place place;
    place.point[0] = x;
    place.point[1] = y;
    place.point[2] = z;
    return place;
}

static LinkEntry entryOf(const Place& first, const Place& second, uint32_t number, double stiffness = 7,
        StretchingModel model = StretchingModel::Harmonic) {
    LinkEntry entry;
    entry.link.first = first;
    entry.link.second = second;
    entry.link.model = model;
    entry.link.stiffness = stiffness;
    entry.link.restLength = 0.3;
    entry.link.maximumExtension = 20;
    entry.link.number = number;
    return entry;
}

static double energyOf(const Link& link, const Array& x, const LinkBoxes& boxes) {
    return computePull(link, x.data(), boxes).energy;
}

static void testForcesAreDerivatives() {
    const Array x = randomNumbers(3*PARTICLES, -6, 6, 1);
    const vector<pair<Place, Place> > places = {{at(0), at(1)}, {between(0, 1, 0.3), at(2)}, {at(3), point(1, 2, -1)},
            {between(0, 1, 0.3), between(4, 5, 0.8)}, {between(6, 7, 1), point(0, 0.5, 0)},
            {between(0, 1, 0.2), between(1, 2, 0.6)}, {between(0, 1, 0.2), between(1, 0, 0.3)}};
    for (StretchingModel model : {StretchingModel::Harmonic, StretchingModel::FENE})
        for (const LinkBoxes& boxes : {LinkBoxes{nullptr, nullptr}, LinkBoxes{SMALL_BOX, nullptr},
                    LinkBoxes{SMALL_BOX, SMALL_BOX}})
            for (auto& one : places) {
                const Link link = entryOf(one.first, one.second, 0, 7, model).link;
                const LinkPull pull = computePull(link, x.data(), boxes);
                check(pull.inRange && pull.length > 0.01, "a link that pulls");
                Array forces(3*PARTICLES);
                addForce(link.first, pull.force, -1, forces.data());
                addForce(link.second, pull.force, 1, forces.data());
                for (int i = 0; i < 3*PARTICLES; i++) {
                    Array moved = x;
                    const double step = 1e-5;
                    moved[i] += step;
                    const double after = energyOf(link, moved, boxes);
                    moved[i] -= 2*step;
                    checkClose((energyOf(link, moved, boxes)-after)/(2*step), forces[i], 1, 1e-6, "force");
                }
            }
}

static void testNearestParticles() {
    // Two particles of a segment in neighboring boxes.
    const Array x = {0.1, 2, 2, 4.9, 2, 2, 0, 1, 2};
    const Link link = entryOf(between(0, 1, 0.5), at(2), 0).link;
    checkClose(1, computePull(link, x.data(), {SMALL_BOX, SMALL_BOX}).length, 1, 1e-12,
            "length from the nearest image");
    check(computePull(link, x.data(), {SMALL_BOX, nullptr}).length > 2, "length from positions as they are");
}

static void testRangesAndDirections() {
    const Array x = {0, 0, 0, 0, 0, 0, 30, 0, 0, NAN, 0, 0};
    for (StretchingModel model : {StretchingModel::Harmonic, StretchingModel::FENE}) {
        const LinkPull pull = computePull(entryOf(at(0), at(1), 0, 7, model).link, x.data(), {});
        check(pull.length == 0 && pull.inRange && pull.energy > 0, "places that coincide");
        check(pull.force[0] == 0 && pull.force[1] == 0 && pull.force[2] == 0, "a force without a direction");
    }
    const Link fene = entryOf(at(0), at(2), 0, 7, StretchingModel::FENE).link;
    check(!computePull(fene, x.data(), {}).inRange, "a length beyond the range");
    check(!computePull(entryOf(at(0), at(3), 0, 7, StretchingModel::FENE).link, x.data(), {}).inRange, "NaN and FENE");
    check(std::isnan(computePull(entryOf(at(0), at(3), 0).link, x.data(), {}).energy), "NaN");
}

static void testSamePlaces() {
    check(areSame(between(0, 1, 0.25), between(1, 0, 0.75)), "turned");
    check(areSame(between(0, 1, 0.3), between(1, 0, 1-0.3)), "turned, and rounded");
    check(areSame(between(0, 1, 0), at(0)) && areSame(between(0, 1, 1), at(1)), "at ends");
    check(areSame(point(1, 2, 3), point(1, 2, 3)) && !areSame(point(1, 2, 3), point(1, 2, 4)), "points");
    check(!areSame(between(0, 1, 0.25), between(0, 1, 0.3)) && !areSame(between(0, 1, 0.5), between(0, 2, 0.5)),
            "places that differ");
    check(!areSame(at(0), at(1)) && !areSame(at(0), point(0, 0, 0)), "particles that differ");
}

/** What a table holds, as text. */
static string describe(const LinkTable& table) {
    string text = to_string(table.getNextNumber());
    for (const LinkEntry& entry : table.getEntries())
        text += " "+to_string(entry.link.number)+":"+to_string(entry.link.first.first)+"-"+
                to_string(entry.link.second.first)+","+to_string(entry.link.stiffness)+(entry.active ? "+" : "-");
    return text;
}

static LinkChange randomChange(const LinkTable& table, mt19937& generator) {
    LinkChange change;
    change.nextNumber = table.getNextNumber();
    for (const LinkEntry& entry : table.getEntries()) {
        const int choice = generator()%8;
        if (choice == 0)
            change.removed.push_back(entry.link.number);
        if (choice == 1) {
            change.put.push_back(entry);
            change.put.back().active = !entry.active;
            change.put.back().link.stiffness = generator()%5;
        }
    }
    for (int i = generator()%4; i > 0; i--)
        change.put.push_back(entryOf(at(generator()%4), at(4+generator()%4), change.nextNumber++));
    return change;
}

static void testChangesAreTakenBack() {
    mt19937 generator(3);
    LinkHistory history;
    vector<pair<uint64_t, string> > past;
    map<string, uint64_t> digests;
    for (int i = 0; i < 2000; i++) {
        past.emplace_back(history.getTable().getDigest(), describe(history.getTable()));
        // A digest belongs to what a table holds, and not to the way to it.
        const auto known = digests.emplace(past.back().second, past.back().first);
        check(known.first->second == past.back().first, "digest of equal tables");
        if (i%7 == 3) {
            const auto& back = past[max<int>(0, past.size()-1-generator()%100)];
            check(history.goBack(back.first), "a table that is known");
            check(describe(history.getTable()) == back.second, "the table of a digest");
            check(history.getTable().getDigest() == back.first, "the digest of a table that was restored");
        }
        else
            history.change(randomChange(history.getTable(), generator));
    }
    map<uint64_t, string> tables;
    for (auto& one : digests)
        check(tables.emplace(one.second, one.first).second, "tables that differ have different digests");
    check(tables.size() > 1000, "many tables");
    check(!history.goBack(past[10].first), "changes that are too old");
}

static void testChangesBetweenTables() {
    mt19937 generator(4);
    LinkTable first, second;
    for (int i = 0; i < 50; i++) {
        first.apply(randomChange(first, generator));
        second.apply(randomChange(second, generator));
    }
    check(first.getDigest() != second.getDigest(), "two tables");
    const string before = describe(first);
    const LinkChange back = first.apply(first.changeTo(second));
    check(describe(first) == describe(second) && first.getDigest() == second.getDigest(), "the change to a table");
    first.apply(back);
    check(describe(first) == before, "the change back");
    check(first.find(first.getNextNumber()) == nullptr, "a number that is not there");
}

static void testMemoryIsBounded() {
    // Changes of all links together: no more than LINKS of them are kept.
    const int count = LinkHistory::LINKS/4;
    LinkHistory history;
    LinkChange change;
    change.nextNumber = count;
    for (int i = 0; i < count; i++)
        change.put.push_back(entryOf(at(0), at(1), i));
    vector<uint64_t> digests;
    for (int i = 0; i < 8; i++) {
        for (LinkEntry& entry : change.put)
            entry.link.stiffness = i;
        history.change(change);
        digests.push_back(history.getTable().getDigest());
    }
    LinkHistory other = history;
    check(other.goBack(digests[4]), "a change that is kept");
    check(!history.goBack(digests[1]), "a change that is not");
}

int main() {
    return runTests({
        testForcesAreDerivatives,
        testNearestParticles,
        testRangesAndDirections,
        testSamePlaces,
        testChangesAreTakenBack,
        testChangesBetweenTables,
        testMemoryIsBounded
    });
}
