#include "couplings/EndLinks.h"
#include "mechanics/PeriodicBox.h"
#include <algorithm>
#include <cmath>

using namespace cylchain;
using namespace std;

namespace {

/** Find the place at a length along some nodes; false if it is beyond them. */
bool locateAlong(const vector<Vec3d>& nodes, const vector<double>& along, double length, Vec3d& place) {
    // Rounding does not take a hand off an end.
    const double slack = 1e-9*(fabs(length)+1);
    if (along.size() < 2 || length < along.front()-slack || length > along.back()+slack)
        return false;
    const SegmentPlace found = findAlong(along, length);
    place = nodes[found.segment]+(nodes[found.segment+1]-nodes[found.segment])*found.fraction;
    return true;
}

} // namespace

void EndLinks::begin(const double* ofStep, const ChainList&, const double* boxOfStep) {
    positions = ofStep;
    box = boxOfStep;
    links.clear();
    changed.clear();
    find(links);
    sortByChains();
}

void EndLinks::sortByChains() {
    ofChain.clear();
    for (size_t i = 0; i < links.size(); i++)
        for (int end = 0; end < 2; end++)
            if (links[i].ends[end].chain >= 0 && (end == 0 || links[i].ends[0].chain != links[i].ends[1].chain))
                ofChain[links[i].ends[end].chain].push_back(i);
}

/** Find where an end of a link is; false if it is beyond that of its chain. */
bool EndLinks::locateEnd(const LinkEnd& end, const EndChange* change, bool isAfter, Vec3d& place) const {
    if (change != nullptr && end.chain == change->chain)
        return isAfter ? locateAlong(change->after, change->alongAfter, end.along, place) :
                locateAlong(change->before, change->alongBefore, end.along, place);
    const auto found = changed.find(end.chain);
    if (end.chain >= 0 && found != changed.end())
        return locateAlong(found->second.nodes, found->second.along, end.along, place);
    double x[3];
    locate(end.place, positions, nearestParticles ? box : nullptr, x);
    place = {x[0], x[1], x[2]};
    return true;
}

double EndLinks::findEnergy(const GrowingLink& link, const EndChange& change, bool isAfter) const {
    Vec3d places[2];
    for (int end = 0; end < 2; end++)
        if (!locateEnd(link.ends[end], &change, isAfter, places[end]))
            return 0;
    const Vec3d between = places[1]-places[0];
    double v[] = {between.x, between.y, between.z};
    if (periodic)
        takeToNearestImage(v, box);
    const double extension = sqrt(v[0]*v[0]+v[1]*v[1]+v[2]*v[2])-link.restLength;
    return 0.5*link.stiffness*extension*extension;
}

double EndLinks::findChange(const EndChange& change) {
    const auto found = ofChain.find(change.chain);
    if (found == ofChain.end())
        return 0;
    // What is before the segments that change stays where it is.
    const size_t count = change.before.size();
    const double staying = change.isOfWhole() ? -HUGE_VAL :
            change.alongBefore[change.end == 1 ? count-1-change.segmentsBefore : change.segmentsBefore];
    double difference = 0;
    for (int i : found->second) {
        const bool isMoved = any_of(links[i].ends, links[i].ends+2, [&] (const LinkEnd& end) {
            return end.chain == change.chain && (change.end == 1 ? end.along > staying : end.along < staying);
        });
        if (isMoved)
            difference += findEnergy(links[i], change, true)-findEnergy(links[i], change, false);
    }
    return difference;
}

void EndLinks::show(int chain, const vector<Vec3d>& nodes, const vector<double>& along) {
    changed[chain] = {nodes, along};
}

void EndLinks::move(int chain, int other, double beyond) {
    for (GrowingLink& link : links)
        for (LinkEnd& end : link.ends)
            if (end.chain == chain && end.along > beyond)
                end.chain = other;
    sortByChains();
}
