#include "couplings/EndContacts.h"
#include "mechanics/PeriodicBox.h"
#include <algorithm>

using namespace cylchain;
using namespace std;

void EndContacts::Body::bound() {
    if (nodes.empty())
        return;
    Vec3d lower = nodes[0], upper = nodes[0];
    for (const Vec3d& node : nodes) {
        lower = {min(lower.x, node.x), min(lower.y, node.y), min(lower.z, node.z)};
        upper = {max(upper.x, node.x), max(upper.y, node.y), max(upper.z, node.z)};
    }
    centre = (lower+upper)*0.5;
    extent = 0.5*sqrt((upper-lower).squared())+radius;
}

Vec3d EndContacts::toNearestImage(const Vec3d& along) const {
    double v[] = {along.x, along.y, along.z};
    if (box != nullptr)
        takeToNearestImage(v, box);
    return {v[0], v[1], v[2]};
}

void EndContacts::begin(const double* positions, const ChainList& chains, const double* ofStep) {
    box = periodic ? ofStep : nullptr;
    known.assign(bodies.chains.size()+bodies.spheres.size(), Body());
    largestRadius = 0;
    auto add = [&] (Body& body, int particle) {
        const double* x = positions+3*(size_t) particle;
        body.nodes.push_back({x[0], x[1], x[2]});
    };
    for (size_t i = 0; i < known.size(); i++) {
        Body& body = known[i];
        if (i < bodies.chains.size()) {
            const ContactBodies::Chain& own = bodies.chains[i];
            for (int particle : growing[i] < 0 ? own.particles : chains.getChain(growing[i]).nodes)
                add(body, particle);
            if (own.closed)
                add(body, own.particles[0]);
            body.radius = 0.5*own.diameter;
        }
        else {
            const ContactBodies::Sphere& own = bodies.spheres[i-bodies.chains.size()];
            add(body, own.particle);
            body.radius = 0.5*own.diameter;
        }
        body.bound();
        largestRadius = max(largestRadius, body.radius);
    }
}

int EndContacts::findBody(int chain) const {
    return find(growing.begin(), growing.end(), chain)-growing.begin();
}

/** Find the capsules near the end, but for those there that change, and those beside them in their chains. */
void EndContacts::findNear(const EndChange& change, int own, Near& near) const {
    // The segments there, before and after, within a sphere; and how far what stays may be from where it passes.
    vector<Vec3d> starts, ends;
    const Vec3d centre = change.end == 1 ? change.before[change.before.size()-1-change.segmentsBefore] :
            change.before[change.segmentsBefore];
    double square = 0;
    auto addEnd = [&] (const vector<Vec3d>& nodes, int segments) {
        for (int i = 0; i < segments; i++) {
            const size_t tip = change.end == 1 ? nodes.size()-1-i : i;
            starts.push_back(nodes[tip]);
            ends.push_back(nodes[change.end == 1 ? tip-1 : tip+1]);
            square = max(square, (nodes[tip]-centre).squared());
        }
    };
    addEnd(change.before, change.segmentsBefore);
    addEnd(change.after, change.segmentsAfter);
    const double motion = change.isOfWhole() ? 0 : sqrt((starts[0]-starts[change.segmentsBefore]).squared());
    const double extent = sqrt(square)+known[own].radius;
    for (size_t i = 0; i < known.size(); i++) {
        const Body& body = known[i];
        if (body.nodes.empty())
            continue;
        const double room = extent+body.extent;
        // A chain longer than half a box has images on all sides of itself.
        const bool isWhole = box == nullptr || 2*body.extent < min({box[0], box[4], box[8]});
        if (isWhole && toNearestImage(body.centre-centre).squared() > room*room)
            continue;
        const int count = body.countCapsules(), changing = static_cast<int>(i) == own ? change.segmentsBefore : 0;
        auto changes = [&] (int capsule) {
            return change.end == 1 ? capsule >= count-changing : capsule < changing;
        };
        vector<char> mayTouch(count, 0);
        for (int capsule = 0; capsule < count; capsule++) {
            const Vec3d first = body.nodes[capsule], along = body.endOf(capsule)-first;
            const Vec3d middle = toNearestImage(first+along*0.5-centre);
            const double reach = extent+0.5*sqrt(along.squared())+body.radius;
            if (changes(capsule) || middle.squared() >= reach*reach)
                continue;
            const Vec3d image = centre+middle-along*0.5;
            const double limit = known[own].radius+body.radius+motion;
            for (size_t k = 0; k < starts.size() && !mayTouch[capsule]; k++)
                mayTouch[capsule] = findNearestPoints({ends[k]-starts[k], along, starts[k]-image}).squared <
                        limit*limit;
        }
        const bool isClosed = i < bodies.chains.size() && bodies.chains[i].closed;
        for (int capsule = 0; capsule < count; capsule++) {
            bool taken = mayTouch[capsule] != 0;
            for (int side : {capsule-1, capsule+1}) {
                const int other = isClosed ? (side+count)%count : side;
                taken = taken || (other >= 0 && other < count && mayTouch[other] != 0);
            }
            if (taken && !changes(capsule))
                near.push_back({static_cast<int>(i), capsule, mayTouch[capsule] != 0});
        }
    }
}

/** Whether all that is near are segments of the chain itself that never touch those that change. */
bool EndContacts::isAlone(const EndChange& change, const Near& near, int own) const {
    const int count = static_cast<int>(change.before.size())-1;
    const int come = max(0, change.segmentsAfter-change.segmentsBefore);
    return all_of(near.begin(), near.end(), [&] (const NearCapsule& one) {
        const int fromEnd = change.end == 1 ? count-1-one.capsule : one.capsule;
        return !one.mayTouch || (one.body == own && fromEnd+come <= bodies.chains[own].excludedNeighbors);
    });
}

/** Add capsules that follow each other in a body: from one of its nodes to another. */
void EndContacts::addRun(Neighborhood& all, int body, int first, int last, const vector<Vec3d>& nodes,
        const vector<Vec3d>& after, int numCapsules) const {
    if (all.chainOf.empty())
        all.chainOf.assign(known.size(), -1);
    const bool isChain = body < static_cast<int>(bodies.chains.size());
    if (isChain && all.chainOf[body] < 0) {
        all.chainOf[body] = all.system.chains.size();
        const ContactBodies::Chain& own = bodies.chains[body];
        all.system.chains.push_back({numCapsules, own.closed, own.excludedNeighbors});
    }
    const int particle = all.before.size()/3, ends = isChain ? 1 : 0;
    for (int i = first; i <= last+ends; i++) {
        all.before.insert(all.before.end(), {nodes[i].x, nodes[i].y, nodes[i].z});
        all.after.insert(all.after.end(), {after[i].x, after[i].y, after[i].z});
    }
    for (int i = first; i <= last; i++)
        all.system.capsules.push_back({particle+i-first, isChain ? particle+i-first+1 : -1, known[body].radius,
                isChain ? all.chainOf[body] : -1, i});
}

void EndContacts::addOthers(const Near& near, Neighborhood& all, int own) const {
    for (size_t i = 0; i < near.size();) {
        size_t end = i+1;
        while (end < near.size() && near[end].body == near[i].body && near[end].capsule == near[end-1].capsule+1)
            end++;
        const Body& body = known[near[i].body];
        if (near[i].body != own)
            addRun(all, near[i].body, near[i].capsule, near[end-1].capsule, body.nodes, body.nodes,
                    body.countCapsules());
        i = end;
    }
}

/** Find the energy of all that is near with the nodes of the chain where they are given. */
double EndContacts::findEnergy(const EndChange& change, const Near& near, int own,
        const vector<Vec3d>& nodes) const {
    Neighborhood all;
    const bool isAfter = &nodes == &change.after;
    const int count = nodes.size()-1, changing = isAfter ? change.segmentsAfter : change.segmentsBefore;
    const int shift = change.end == 0 ? count-(static_cast<int>(change.before.size())-1) : 0;
    // Those of the chain itself, in one order: the ones that change are at an end.
    vector<int> ofChain;
    for (const NearCapsule& one : near)
        if (one.body == own)
            ofChain.push_back(one.capsule+shift);
    for (int i = 0; i < changing; i++)
        ofChain.push_back(change.end == 1 ? count-1-i : i);
    sort(ofChain.begin(), ofChain.end());
    for (size_t i = 0; i < ofChain.size();) {
        size_t end = i+1;
        while (end < ofChain.size() && ofChain[end] == ofChain[end-1]+1)
            end++;
        addRun(all, own, ofChain[i], ofChain[end-1], nodes, nodes, count);
        i = end;
    }
    addOthers(near, all, own);
    for (const ContactBodies::Exclusion& exclusion : bodies.exclusions) {
        int found[] = {-1, -1};
        for (size_t i = 0; i < all.system.capsules.size(); i++) {
            const Capsule& capsule = all.system.capsules[i];
            auto is = [&] (int chain, int segment) {
                return chain >= 0 && capsule.chain >= 0 && capsule.chain == all.chainOf[chain] &&
                        capsule.index == segment;
            };
            if (is(exclusion.chain1, exclusion.segment1))
                found[0] = i;
            if (is(exclusion.chain2, exclusion.segment2))
                found[1] = i;
        }
        if (found[0] >= 0 && found[1] >= 0)
            all.system.exclusions.push_back({found[0], found[1]});
    }
    ContactSearch search(all.system);
    vector<ContactPair> pairs;
    search.findPairs(all.before.data(), all.before.data(), box, 0, pairs);
    double energy = 0;
    for (const ContactPair& pair : pairs) {
        Contact contacts[2];
        const int found = search.evaluate(pair, all.before.data(), all.before.data(), contacts, 0);
        for (int i = 0; i < found; i++)
            energy += 0.5*stiffness*contacts[i].weight*contacts[i].gap*contacts[i].gap;
    }
    return energy;
}

/** Whether the end would pass through something on its way. */
bool EndContacts::crosses(const EndChange& change, const Near& near, int own) const {
    // Both with the same joints, of which one may be on a straight segment.
    auto divided = [&] (const vector<Vec3d>& nodes, int segments) {
        vector<Vec3d> result = nodes;
        if (segments == max(change.segmentsBefore, change.segmentsAfter))
            return result;
        const int count = nodes.size();
        const Vec3d inner = nodes[change.end == 1 ? count-2 : 1], outer = nodes[change.end == 1 ? count-1 : 0];
        result.insert(change.end == 1 ? result.end()-1 : result.begin()+1, inner+(outer-inner)*change.joint);
        return result;
    };
    const vector<Vec3d> before = divided(change.before, change.segmentsBefore),
            after = divided(change.after, change.segmentsAfter);
    const int count = before.size()-1, changing = max(change.segmentsBefore, change.segmentsAfter);
    Neighborhood all;
    if (change.end == 1)
        addRun(all, own, count-changing, count-1, before, after, count);
    else
        addRun(all, own, 0, changing-1, before, after, count);
    const int numOwn = all.system.capsules.size();
    addOthers(near, all, own);
    // Spheres do not say the same on the way back, which must be as possible.
    ContactSearch search(all.system);
    auto passes = [&] (const vector<double>& from, const vector<double>& to) {
        vector<ContactPair> pairs;
        search.findPairs(from.data(), to.data(), box, 0, pairs);
        return any_of(pairs.begin(), pairs.end(), [&] (const ContactPair& pair) {
            return min(pair.a, pair.b) < numOwn && max(pair.a, pair.b) >= numOwn &&
                    search.crosses(pair, from.data(), to.data());
        });
    };
    return passes(all.before, all.after) || passes(all.after, all.before);
}

double EndContacts::findChange(const EndChange& change) {
    const int own = findBody(change.chain);
    if (own == static_cast<int>(growing.size()))
        return 0;
    Near near;
    findNear(change, own, near);
    if (isAlone(change, near, own))
        return 0;
    if (!change.isOfWhole() && crosses(change, near, own))
        return HUGE_VAL;
    return findEnergy(change, near, own, change.after)-findEnergy(change, near, own, change.before);
}

void EndContacts::show(int chain, const vector<Vec3d>& nodes, const vector<double>&) {
    const int own = findBody(chain);
    if (own == static_cast<int>(growing.size()))
        return;
    known[own].nodes = nodes;
    if (nodes.size() < 2)
        known[own].nodes.clear();
    known[own].bound();
}
