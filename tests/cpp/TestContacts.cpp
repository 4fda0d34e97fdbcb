/**
 * This tests contacts between capsules: signed gaps along paths, and what is seen around joints.
 */

#include "TestCapsuleSystems.h"

static vector<Contact> evaluateAll(const ContactSearch& search, const vector<ContactPair>& pairs, const Array& x,
        const Array& y) {
    vector<Contact> contacts;
    for (const ContactPair& pair : pairs) {
        Contact found[2];
        const int count = search.evaluate(pair, x.data(), y.data(), found);
        check(count >= 0 && count <= 2, "at most two contacts");
        contacts.insert(contacts.end(), found, found+count);
    }
    return contacts;
}

/** A joint that goes through a rod in their plane, and a rod through a joint: one contact, which pushes back. */
static void testPlanarJoints() {
    mt19937_64 generator(12);
    for (int trial = 0; trial < 500; trial++) {
        // A chain with a bend whose joint points down, above a rod along x, in any plane.
        const double left = uniform(generator, 10, 30), right = uniform(generator, 10, 30);
        const double way = uniform(generator, 3, 8);
        const Vec3d a = randomVector(generator), b = a.cross(randomVector(generator));
        const Vec3d u = a*(1/length(a)), v = b*(1/length(b)), origin = randomVector(generator, 500);
        CapsuleSystem system = {{{0, 1, 5, 0, 0}, {1, 2, 5, 0, 1}, {3, 4, 5}}, {{2, false, 1}}, {}};
        Array x;
        for (const Vec3d& place : {Vec3d{-40, left, 0}, Vec3d{0, 2, 0}, Vec3d{40, right, 0}, Vec3d{-60, 0, 0},
                Vec3d{60, 0, 0}})
            add(x, origin+u*place.x+v*place.y);
        Array y = x;
        for (int particle = 0; particle < 3; particle++)
            for (int k = 0; k < 3; k++)
                y[3*particle+k] -= way*(k == 0 ? v.x : k == 1 ? v.y : v.z);
        ContactSearch search(system);
        vector<ContactPair> pairs;
        search.findPairs(x.data(), y.data(), NULL, 0, pairs);
        double weight = 0;
        for (const Contact& contact : evaluateAll(search, pairs, x, y)) {
            const Vec3d normal = {contact.normal[0], contact.normal[1], contact.normal[2]};
            const bool deepest = contact.gap < -10;
            if (deepest) {
                checkClose(2-way-10, contact.gap, 10, 1e-9, "signed gap");
                checkClose(1, normal.dot(v), 1, 1e-9, "it pushes back");
                check(contact.crossed, "it has crossed");
                weight += contact.weight;
            }
        }
        checkClose(1, weight, 1, 1e-12, "a joint counts once");
        for (const ContactPair& pair : pairs)
            if (pair.b == 2)
                check(search.crosses(pair, x.data(), y.data()), "both segments at the joint cross");
    }
}

/**
 * A sphere that goes through a rod or a sphere is pushed back; one that goes around it is not. One that is deep in a
 * rod has the side of it where it began, one that is deep in another sphere has its distance.
 */
static void testSpheres() {
    mt19937_64 generator(13);
    for (bool rod : {true, false})
        for (int trial = 0; trial < 2000; trial++) {
            const bool sphereFirst = trial%2 == 0;
            const Vec3d a = randomVector(generator), b = a.cross(randomVector(generator));
            const Vec3d u = a*(1/length(a)), v = b*(1/length(b)), w = u.cross(v), origin = randomVector(generator, 100);
            const double height = uniform(generator, 11, 25), depth = uniform(generator, -25, 20);
            const double beside = uniform(generator, -18, 18), along = uniform(generator, -40, 40);
            Array x, y;
            CapsuleSystem system;
            const Vec3d from = origin+w*height+u*(rod ? along : 0), to = origin+w*depth+v*beside+u*(rod ? along : 0);
            auto addSphere = [&] {
                system.capsules.push_back({(int) x.size()/3, -1, 8});
                add(x, from);
                add(y, to);
            };
            auto addOther = [&] {
                const int first = x.size()/3;
                system.capsules.push_back({first, rod ? first+1 : -1, 2});
                for (int end = 0; end < (rod ? 2 : 1); end++)
                    for (Array* positions : {&x, &y})
                        add(*positions, rod ? origin+u*(end == 0 ? -50 : 50) : origin);
            };
            if (sphereFirst) {
                addSphere();
                addOther();
            }
            else {
                addOther();
                addSphere();
            }
            // How near it comes, in small parts of the way.
            double nearest = 1e9;
            for (int i = 0; i <= 2000; i++)
                nearest = min(nearest, hypot(height+(depth-height)*i/2000.0, beside*i/2000.0));
            if (fabs(nearest-7) < 0.01 || fabs(depth) < 1e-3)
                continue;
            const bool deep = nearest < 7, through = deep && depth < 0, hasSide = rod ? deep : through;
            ContactSearch search(system);
            vector<ContactPair> pairs;
            search.findPairs(x.data(), y.data(), NULL, 0, pairs);
            check(!deep || pairs.size() == 1, "what goes through is found");
            if (pairs.empty())
                continue;
            check(search.crosses(pairs[0], x.data(), y.data()) == through, "through or not");
            const vector<Contact> contacts = evaluateAll(search, pairs, x, y);
            check(contacts.size() == 1, "one contact");
            const Vec3d normal = Vec3d{contacts[0].normal[0], contacts[0].normal[1], contacts[0].normal[2]}*
                    (sphereFirst ? 1 : -1);
            check(contacts[0].crossed == through, "crossed");
            checkClose((hasSide ? depth : hypot(depth, beside))-10, contacts[0].gap, 10, 1e-9, "gap");
            if (hasSide)
                checkClose(1, normal.dot(w), 1, 1e-9, "normal of the start");
        }
}

/** A rod that moves through another: its gap goes on below what the distance alone can be. */
static void testSignedGap() {
    mt19937_64 generator(7);
    for (int trial = 0; trial < 200; trial++) {
        CapsuleSystem system = {{{0, 1, 15}, {2, 3, 10}}, {}, {}};
        const Vec3d p = randomVector(generator, 60), q = randomVector(generator, 60);
        const Vec3d n = p.cross(q)*(1/length(p.cross(q)));
        if (n.squared() < 0.9 || length(p.cross(q)) < 0.1*length(p)*length(q))
            continue;
        const double s = uniform(generator, 0.05, 0.95), t = uniform(generator, 0.05, 0.95);
        Array x;
        const Vec3d first = n*20-p*s, second = q*-t;
        add(x, first);
        add(x, first+p);
        add(x, second);
        add(x, second+q);
        ContactSearch search(system);
        for (double way : {0.0, 5.0, 19.9, 20.1, 27.0, 50.0}) {
            Array y = x;
            for (int particle = 0; particle < 2; particle++) {
                y[3*particle] -= way*n.x;
                y[3*particle+1] -= way*n.y;
                y[3*particle+2] -= way*n.z;
            }
            vector<ContactPair> pairs;
            search.findPairs(x.data(), y.data(), NULL, 0, pairs);
            check(pairs.size() == 1, "one pair");
            const vector<Contact> contacts = evaluateAll(search, pairs, x, y);
            check(contacts.size() == 1, "one contact");
            checkClose(20-way-25, contacts[0].gap, 100, 1e-11, "signed gap");
            check(contacts[0].crossed == (way > 20), "crossed or not");
            check(search.crosses(pairs[0], x.data(), y.data()) == (way > 20), "crosses or not");
            checkClose(s, contacts[0].s, 1, 1e-9, "s");
            checkClose(t, contacts[0].t, 1, 1e-9, "t");
            const double* normal = contacts[0].normal;
            checkClose(1, n.dot({normal[0], normal[1], normal[2]}), 1, 1e-9, "normal");
            checkClose(1, contacts[0].weight, 1, 0, "weight");
        }
    }
}

/** Rods side by side: a contact at each end of their overlap, with half of the stiffness. */
static void testParallel() {
    CapsuleSystem system = {{{0, 1, 10}, {2, 3, 10}}, {}, {}};
    ContactSearch search(system);
    for (double offset : {-120.0, -90.0, -30.0, 0.0, 20.0, 99.0, 110.0})
        for (bool reversed : {false, true}) {
            const double from = reversed ? 100+offset : offset, to = reversed ? offset : 100+offset;
            const Array x = {0, 0, 0, 100, 0, 0, from, 0, 12, to, 0, 12};
            vector<ContactPair> pairs;
            search.findPairs(x.data(), x.data(), NULL, 50, pairs);
            check(pairs.size() == 1, "one pair");
            const vector<Contact> contacts = evaluateAll(search, pairs, x, x);
            const bool overlap = fabs(offset) < 100;
            check(contacts.size() == (overlap ? 2 : 1), "contacts at the ends of the overlap");
            double places = 0;
            for (const Contact& contact : contacts) {
                const double apart = overlap ? 0 : fabs(offset)-100;
                checkClose(sqrt(144+apart*apart)-20, contact.gap, 10, 1e-12, "gap");
                checkClose(overlap ? 0.5 : 1, contact.weight, 1, 0, "weight");
                check(!contact.crossed, "they do not cross");
                places += contact.s;
            }
            if (overlap)
                checkClose((max(0.0, offset)+min(100.0, 100+offset))/100, places, 1, 1e-12, "ends of the overlap");
        }
    // Segments that meet in a point.
    const Array x = {0, 0, 0, 100, 0, 0, 50, -50, 0, 50, 50, 0};
    vector<ContactPair> pairs;
    search.findPairs(x.data(), x.data(), NULL, 0, pairs);
    const vector<Contact> contacts = evaluateAll(search, pairs, x, x);
    check(contacts.size() == 1 && fabs(contacts[0].gap+20) < 1e-12 && fabs(fabs(contacts[0].normal[2])-1) < 1e-12,
            "segments that meet");
}

/** Something slides along a chain with bends: its energy is that of the nearest place of the chain, at joints, too. */
static void testJoints() {
    const double stiffness = 2;
    mt19937_64 generator(8);
    double largestJump = 0;
    int several = 0;
    for (double bend : {0.0, 1e-4, 0.05, 0.3, 0.8, 1.5})
        for (int side : {-1, 1})
            for (bool rod : {false, true})
                for (bool chainFirst : {false, true}) {
                    // A chain that turns to and fro in the plane z = 0, and a sphere, or a rod across the plane.
                    Array x;
                    CapsuleSystem system;
                    double angle = -0.5*bend;
                    Vec3d node = {0, 0, 0};
                    const int segments = 6;
                    for (int s = 0; s <= segments; s++) {
                        add(x, node);
                        node = node+Vec3d{cos(angle), sin(angle), 0}*40;
                        angle += s%2 == 0 ? bend : -bend;
                        if (s < segments)
                            system.capsules.push_back({s, s+1, 10, 0, s});
                    }
                    system.chains.push_back({segments, false, 1});
                    system.capsules.push_back({segments+1, rod ? segments+2 : -1, 5});
                    if (!chainFirst)
                        rotate(system.capsules.begin(), system.capsules.end()-1, system.capsules.end());
                    ContactSearch search(system);
                    double last = -1;
                    for (double place = -5; place < 240; place += 0.01) {
                        Array y = x;
                        const Vec3d body = {place, side*12.0, 0};
                        add(y, rod ? body+Vec3d{3, 2, -30} : body);
                        if (rod)
                            add(y, body+Vec3d{-3, -2, 30});
                        vector<ContactPair> pairs;
                        search.findPairs(y.data(), y.data(), NULL, 0, pairs);
                        double energy = 0, least = 1e9;
                        int count = 0;
                        for (const Contact& contact : evaluateAll(search, pairs, y, y))
                            if (contact.gap < 0) {
                                energy += 0.5*stiffness*contact.weight*contact.gap*contact.gap;
                                count++;
                            }
                        for (int s = 0; s < segments; s++)
                            least = min(least, distanceByHand(at(y, s), at(y, s+1), at(y, segments+1),
                                    at(y, rod ? segments+2 : segments+1))-15);
                        const double expected = least < 0 ? 0.5*stiffness*least*least : 0;
                        checkClose(expected, energy, 1, 1e-9, "energy beside a joint");
                        if (last >= 0)
                            largestJump = max(largestJump, fabs(energy-last));
                        last = energy;
                        several += pairs.size() > 1;
                    }
                }
    check(several > 1000, "joints were passed");
    // The force times a step of the place.
    check(largestJump < 15*stiffness*0.01*1.01, "the energy is continuous");
}

/** Two bodies across each other count once, however their chains are divided. */
static void testDivision() {
    double expected = 0;
    for (int segments : {1, 2, 5, 17})
        for (int otherSegments : {1, 4}) {
            Array x;
            CapsuleSystem system;
            for (int s = 0; s <= segments; s++)
                add(x, {200.0*s/segments, 0, 0});
            for (int s = 0; s < segments; s++)
                system.capsules.push_back({s, s+1, 10, 0, s});
            // They meet at joints of both.
            for (int s = 0; s <= otherSegments; s++)
                add(x, {100, -100+200.0*s/otherSegments, 12});
            for (int s = 0; s < otherSegments; s++)
                system.capsules.push_back({segments+1+s, segments+2+s, 10, 1, s});
            system.chains = {{segments, false, segments}, {otherSegments, false, otherSegments}};
            ContactSearch search(system);
            vector<ContactPair> pairs;
            search.findPairs(x.data(), x.data(), NULL, 0, pairs);
            double energy = 0;
            for (const Contact& contact : evaluateAll(search, pairs, x, x))
                energy += contact.weight*contact.gap*contact.gap;
            if (expected == 0)
                expected = energy;
            checkClose(64, energy, 64, 1e-9, "energy of divided chains");
        }
}

/** A rod is carried through a chain, at joints or beside them: what crosses is seen, and pushed back. */
static void testCrossingChains() {
    mt19937_64 generator(10);
    int crossed = 0, atJoints = 0, wrong = 0;
    for (int trial = 0; trial < 4000; trial++) {
        CapsuleSystem system;
        Array x;
        Vec3d node = {0, 0, 0}, direction = {1, 0, 0};
        const int segments = 5;
        for (int s = 0; s <= segments; s++) {
            add(x, node);
            direction = direction+randomVector(generator, 0.3);
            direction = direction*(1/length(direction));
            node = node+direction*40;
            if (s < segments)
                system.capsules.push_back({s, s+1, 8, 0, s});
        }
        system.chains.push_back({segments, false, 1});
        // Through a place of the chain, half of the time near a joint.
        const int segment = 1+generator()%3;
        const bool joint = trial%2 == 0;
        const double fraction = joint ? uniform(generator, -0.02, 0.02) : uniform(generator, 0.1, 0.9);
        const Vec3d place = at(x, segment)+(at(x, segment+1)-at(x, segment))*max(0.0, fraction)+
                (at(x, segment)-at(x, segment-1))*min(0.0, fraction);
        const Vec3d along = Vec3d{uniform(generator, -0.5, 0.5), 1, uniform(generator, -0.5, 0.5)}*60;
        const Vec3d way = {uniform(generator, -2, 2), uniform(generator, -2, 2), uniform(generator, 4, 16)};
        const double before = uniform(generator, 0.1, 0.9);
        add(x, place-along*0.5-way*before);
        add(x, place+along*0.5-way*before);
        Array y = x;
        for (int particle = segments+1; particle <= segments+2; particle++)
            for (int k = 0; k < 3; k++)
                y[3*particle+k] += k == 0 ? way.x : k == 1 ? way.y : way.z;
        system.capsules.push_back({segments+1, segments+2, 8});
        ContactSearch search(system);
        vector<ContactPair> pairs;
        search.findPairs(x.data(), y.data(), NULL, 0, pairs);
        int throughs = 0;
        bool clear = true, seen = false;
        for (int s = 0; s < segments; s++) {
            const Vec3d start[] = {at(x, s), at(x, s+1), at(x, segments+1), at(x, segments+2)};
            const Vec3d end[] = {at(y, s), at(y, s+1), at(y, segments+1), at(y, segments+2)};
            const CrossingByHand one = crossingsByHand(start, end);
            throughs += one.count;
            clear = clear && one.clear;
        }
        Vec3d force = {0, 0, 0};
        for (const Contact& contact : evaluateAll(search, pairs, x, y)) {
            seen = seen || contact.crossed;
            // On the rod, which is b.
            if (contact.gap < 0)
                force = force+Vec3d{contact.normal[0], contact.normal[1], contact.normal[2]}*
                        (contact.weight*contact.gap);
        }
        if (!clear || throughs != 1)
            continue;
        bool verified = false;
        for (const ContactPair& pair : pairs)
            verified = verified || search.crosses(pair, x.data(), y.data());
        check(seen && verified, "what crosses a chain is seen");
        crossed++;
        atJoints += joint;
        wrong += force.dot(way) >= 0;
    }
    check(crossed > 2000 && atJoints > 800, "chains were crossed");
    check(wrong == 0, "what has crossed is pushed back");
}

/** Segments taken as their shortest images give the same contacts as whole chains, around joints, too. */
static void testNearestImages() {
    mt19937_64 generator(9);
    const double box[9] = {800, 0, 0, 100, 800, 0, -150, 200, 800};
    int crossed = 0;
    for (int trial = 0; trial < 10; trial++) {
        TestSystem whole = makeSystem(generator, 40, 6, 0, 60, 30, 10, box), images = whole;
        for (size_t i = 0; i < whole.x.size(); i += 3) {
            const double a = (int) (generator()%3)-1, b = (int) (generator()%3)-1, c = (int) (generator()%3)-1;
            const double shift[] = {a*box[0]+b*box[3]+c*box[6], b*box[4]+c*box[7], c*box[8]};
            for (int k = 0; k < 3; k++) {
                images.x[i+k] += shift[k];
                images.y[i+k] += shift[k];
            }
        }
        ContactSearch search(whole.system), nearest(images.system, true);
        vector<ContactPair> expected, found;
        search.findPairs(whole.x.data(), whole.y.data(), box, 10, expected);
        nearest.findPairs(images.x.data(), images.y.data(), box, 10, found);
        check(expected.size() == found.size() && found.size() > 50, "the same pairs");
        for (size_t i = 0; i < found.size(); i++) {
            check(expected[i].a == found[i].a && expected[i].b == found[i].b, "the same pair");
            Contact one[2], other[2];
            const int count = search.evaluate(expected[i], whole.x.data(), whole.y.data(), one);
            check(count == nearest.evaluate(found[i], images.x.data(), images.y.data(), other), "as many contacts");
            for (int k = 0; k < count; k++) {
                checkClose(one[k].gap, other[k].gap, 100, 1e-9, "gap");
                checkClose(one[k].normal[0], other[k].normal[0], 1, 1e-6, "normal");
                check(one[k].crossed == other[k].crossed, "crossed or not");
                crossed += one[k].crossed;
            }
        }
    }
    check(crossed > 3, "some crossed");
}

int main() {
    return runTests({testPlanarJoints, testSpheres, testSignedGap, testParallel, testJoints, testDivision,
            testCrossingChains, testNearestImages});
}
