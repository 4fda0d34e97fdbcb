#include "couplings/Contours.h"
#include <algorithm>

using namespace cylchain;
using namespace std;

Contours::Contours(const ChainList& list) {
    for (int chain = 0; chain < list.size(); chain++)
        list.visit(chain, [&] (const auto& own) {add(own);});
}

void Contours::add(const Chain& own) {
    Contour contour = {static_cast<int>(segments.size()), static_cast<int>(own.segments.size()), own.start, 0, 0, 0,
            own.closed};
    for (size_t s = 0; s < own.segments.size(); s++) {
        const double length = own.segments[s].restLength;
        segments.push_back({getNumChains(), own.nodes[s], own.nodes[(s+1)%own.nodes.size()],
                own.start+contour.length, length, {-1, -1}});
        contour.length += length;
    }
    const size_t count = own.segments.size();
    auto areSame = [&] (size_t first, size_t last) {
        return all_of(own.segments.begin()+first, own.segments.begin()+last, [&] (const Segment& segment) {
            return segment.restLength == own.segments[first].restLength;
        });
    };
    if (count > 0 && areSame(0, count))
        contour.ofSegments = own.segments[0].restLength;
    else if (count > 1 && areSame(1, max<size_t>(2, count-1))) {
        contour.ofSegments = own.segments[1].restLength;
        contour.ofFirst = own.segments[0].restLength;
    }
    chains.push_back(contour);
}

void Contours::add(const BeamChain& own) {
    const int elements = own.numElements(), particles = own.particles.size();
    const double length = own.elementLength;
    for (int i = 0; i < elements; i++)
        segments.push_back({getNumChains(), own.particles[2*i], own.particles[(2*i+2)%particles], i*length, length,
                {own.particles[2*i+1], own.particles[(2*i+3)%particles]}});
    chains.push_back({static_cast<int>(segments.size())-elements, elements, 0, elements*length, length, 0,
            own.closed});
}

int Contours::findSegment(int chain, double position) const {
    const Contour& contour = chains[chain];
    int number;
    const double along = min(position-contour.begin, contour.length)-contour.ofFirst;
    if (contour.ofSegments > 0)
        number = along > 0 ? static_cast<int>(along/contour.ofSegments)+(contour.ofFirst > 0 ? 1 : 0) : 0;
    else {
        const auto first = segments.begin()+contour.firstSegment;
        number = upper_bound(first, first+contour.numSegments, position,
                [] (double value, const ContourSegment& segment) {return value < segment.start;})-first-1;
    }
    return contour.firstSegment+min(max(number, 0), contour.numSegments-1);
}

Place Contours::placeOn(int number, double fraction) const {
    const ContourSegment& segment = segments[number];
    Place place;
    place.first = segment.first;
    place.second = segment.second;
    place.fraction = min(1.0, max(0.0, fraction));
    copy(segment.controls, segment.controls+2, place.controls);
    return place;
}

void Contours::findTangent(int chain, double position, const double* positions, const double* box,
        double* tangent) const {
    const int number = findSegment(chain, position);
    const ContourSegment& segment = segments[number];
    if (isOnCurve(number)) {
        Place place = placeOn(number, (position-segment.start)/segment.length);
        place.tangent = 1/segment.length;
        locate(place, positions, box, tangent);
        return;
    }
    for (int k = 0; k < 3; k++)
        tangent[k] = positions[3*segment.second+k]-positions[3*segment.first+k];
    if (box != nullptr)
        takeToNearestImage(tangent, box);
    for (int k = 0; k < 3; k++)
        tangent[k] /= segment.length;
}
