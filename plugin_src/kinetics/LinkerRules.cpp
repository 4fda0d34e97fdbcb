#include "kinetics/LinkerKinetics.h"
#include "mechanics/SymmetricMatrices.h"
#include <algorithm>
#include <cmath>

using namespace cylchain;
using namespace std;

/** Whether the angle between the chains at two places is one at which a linker joins them. */
bool LinkerKinetics::isAligned(const HandPlace& first, const HandPlace& second, const LinkerType& type,
        const KineticStep& step) const {
    if (!first.isBound() || !second.isBound())
        return true;
    double u[3], v[3];
    contours.findTangent(first.chain, first.position, step.positions, step.boxes.segments, u);
    contours.findTangent(second.chain, second.position, step.positions, step.boxes.segments, v);
    const double size = sqrt(dot(u, u)*dot(v, v));
    // Parallel lines have a cosine that may be rounded to a number beyond one.
    const double cosine = min(1.0, max(-1.0, size > 0 ? dot(u, v)/size : 0));
    return cosine >= type.leastCosine && cosine <= type.largestCosine;
}

/** Whether a hand binds to a place by how near that is to an end. Rings have none. */
bool LinkerKinetics::isInRange(const Hand& hand, const HandPlace& place) const {
    const BindingRange& own = hand.bindingRange;
    bool isNear = false;
    for (int end = 0; end < 2 && !contours.isClosed(place.chain); end++)
        isNear = isNear || ((own.end == end || own.end == 2) &&
                fabs(place.position-contours.getEnd(place.chain, end)) <= own.range);
    return isNear != own.excluded;
}

/** Find where the second hand of a linker binds that loads as a pair; false if there is no free place. */
bool LinkerKinetics::findPartner(const LinkerType& type, const HandPlace& first, const Sites* sites,
        HandPlace& found) const {
    const int number = type.hands[1];
    const Hand& hand = system.hands[number];
    found = {first.chain, first.position+type.loadingDistance};
    if (contours.isClosed(found.chain))
        found.position -= contours.getLength(found.chain)*floor(found.position/contours.getLength(found.chain));
    else if (!contours.isWithin(found.chain, found.position))
        return false;
    if (binds[number][found.chain] == 0)
        return false;
    if (hand.siteSpacing > 0 && (!toSite(hand, found) || sites->count(siteOf(hand, found)) > 0))
        return false;
    return hand.bindingRange.end < 0 || isInRange(hand, found);
}
