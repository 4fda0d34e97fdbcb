#include "couplings/Links.h"
#include "mechanics/Inline.h"
#include "mechanics/PeriodicBox.h"
#include <cmath>
#include <cstdint>
#include <type_traits>

namespace cylchain {

namespace {

#include "lanes/VectorLanes-inl.h"
#include "mechanics/StretchingModels-inl.h"

} // namespace

LinkPull computePull(const Link& link, const double* positions, const LinkBoxes& boxes) {
    double between[3], first[3];
    locate(link.first, positions, boxes.segments, first);
    locate(link.second, positions, boxes.segments, between);
    for (int k = 0; k < 3; k++)
        between[k] -= first[k];
    if (boxes.distances != nullptr)
        takeToNearestImage(between, boxes.distances);
    LinkPull pull = {};
    pull.length = std::sqrt(between[0]*between[0]+between[1]*between[1]+between[2]*between[2]);
    const double extension = pull.length-link.restLength;
    const bool range = hasRange(link.model);
    pull.inRange = (!range || std::fabs(extension) < link.maximumExtension);
    if (!pull.inRange)
        return pull;
    const double inverse = range ? 1/link.maximumExtension : 0;
    pull.energy = stretchingEnergy(link.model, link.stiffness, extension, inverse);
    const double tension = stretchingTension(link.model, link.stiffness, extension, inverse);
    // Written so that NaN stays NaN.
    const double factor = pull.length == 0 ? 0 : -tension/pull.length;
    for (int k = 0; k < 3; k++)
        pull.force[k] = factor*between[k];
    return pull;
}

} // namespace cylchain
