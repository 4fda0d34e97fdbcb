#include "couplings/Contours.h"
#include <algorithm>

using namespace cylchain;
using namespace std;

Contours::Contours(const vector<Chain>& ofChains) {
    for (size_t chain = 0; chain < ofChains.size(); chain++) {
        const Chain& own = ofChains[chain];
        Contour contour = {static_cast<int>(segments.size()), static_cast<int>(own.segments.size()), 0, 0, own.closed};
        bool same = true;
        for (size_t s = 0; s < own.segments.size(); s++) {
            const double length = own.segments[s].restLength;
            segments.push_back({static_cast<int>(chain), own.nodes[s], own.nodes[(s+1)%own.nodes.size()],
                    contour.length, length});
            contour.length += length;
            same = same && length == own.segments[0].restLength;
        }
        contour.ofSegments = same ? own.segments[0].restLength : 0;
        chains.push_back(contour);
    }
}

int Contours::findSegment(int chain, double position) const {
    const Contour& contour = chains[chain];
    int number;
    if (contour.ofSegments > 0)
        number = position > 0 ? static_cast<int>(min(position, contour.length)/contour.ofSegments) : 0;
    else {
        const auto first = segments.begin()+contour.firstSegment;
        number = upper_bound(first, first+contour.numSegments, position,
                [] (double value, const ContourSegment& segment) {return value < segment.start;})-first-1;
    }
    return contour.firstSegment+min(max(number, 0), contour.numSegments-1);
}

Place Contours::findPlace(int chain, double position) const {
    const ContourSegment& segment = segments[findSegment(chain, position)];
    Place place;
    place.first = segment.first;
    place.second = segment.second;
    place.fraction = min(1.0, max(0.0, (position-segment.start)/segment.length));
    return place;
}
