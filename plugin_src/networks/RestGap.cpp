#include "networks/RestGap.h"
#include <algorithm>
#include <cmath>

using namespace cylchain;
using namespace std;

namespace {

/** From which k c on a wall stands behind its surface. */
const double LEAST_STIFF = 1;
/** Corrections end: b has to settle. */
const int MOST_CORRECTIONS = 3;
/** By which factor a response may differ from that of a chain alone. */
const double LARGEST_FACTOR = 5;

} // namespace

RestGap::RestGap(double predicted, double before, double softness, double depth) : predicted(predicted),
        before(before), depth(depth) {
    if (softness < LEAST_STIFF) {
        // Within 2 % in the surface excess for a from 0.1 on.
        const double share = 0.6*sqrt(softness);
        value = max(0.0, -predicted)*share/(1+share);
    }
    else if (before > -depth) {
        value = -depth;
        if (predicted < -depth) {
            this->softness = softness;
            value = before+(before-predicted)/softness;
        }
    }
}

void RestGap::correct(double gap) {
    if (softness == 0 || corrections == MOST_CORRECTIONS || !(gap < value))
        return;
    corrections++;
    const double response = clamp((gap-predicted)/(value-gap), softness/LARGEST_FACTOR, softness*LARGEST_FACTOR);
    value = max(-depth, before+(before-predicted)/response);
}

double cylchain::findDepthOfWall(double kT, double stiffness) {
    return sqrt(0.5*M_PI*kT/stiffness);
}
