#include "mechanics/BeadModes.h"
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <sstream>

using namespace cylchain;
using namespace std;

/** Segments and joints are as they must be up to the rounding of those who have computed them. */
static const double TOLERANCE = 1e-9;

static bool isNearly(double expected, double found) {
    return fabs(found-expected) <= TOLERANCE*fabs(expected);
}

bool BeadModes::operator==(const BeadModes& other) const {
    return stiffness == other.stiffness && contourForce == other.contourForce &&
            bendingStiffness == other.bendingStiffness && nodeFriction == other.nodeFriction;
}

double BeadModes::bendingRate(int p, int nodes) const {
    const double s = sin(0.5*M_PI*p/nodes);
    return 16*bendingStiffness*s*s*s*s/nodeFriction;
}

double BeadModes::stretchingRate(int p, int nodes) const {
    const double s = sin(0.5*M_PI*p/nodes);
    return 4*stiffness*s*s/nodeFriction;
}

/** What is wrong with a chain but for its numbers, or nothing. */
static string findObstacle(const Chain& chain) {
    if (chain.closed)
        return "it is closed";
    if (any_of(chain.fixed.begin(), chain.fixed.end(), [] (bool fixed) {return fixed;}))
        return "it has a node that is fixed";
    if (!isLinear(chain.bending))
        return "its bending model is not \""+string(Names<BendingModel>::ALL[(int) BendingModel::BondDifference])+"\"";
    if (chain.stretching != StretchingModel::Harmonic)
        return "its segments are not harmonic";
    if (!(chain.nodeFriction > 0))
        return "its nodes have no friction of their own";
    for (size_t s = 0; s < chain.segments.size(); s++) {
        const Segment& segment = chain.segments[s];
        if (segment.parallel != 0 || segment.perpendicular != 0 || segment.rotational != 0 || segment.extensional != 0)
            return "its segment "+to_string(s)+" has friction";
    }
    return "";
}

optional<BeadModes> cylchain::findModes(const Chain& chain, string& reason) {
    reason = findObstacle(chain);
    if (!reason.empty())
        return nullopt;
    const size_t count = chain.segments.size();
    const double bending = chain.joints.empty() ? 0 : chain.joints[0];
    for (size_t joint = 1; joint < chain.joints.size(); joint++)
        if (!isNearly(bending, chain.joints[joint])) {
            reason = "its joint "+to_string(joint)+" has another stiffness than the first one";
            return nullopt;
        }
    // A segment in the middle, or what one would be.
    const Segment& middle = chain.segments[count > 2 ? 1 : 0];
    const double stiffness = middle.stiffness-(count == 2 ? bending : 0);
    const BeadModes modes = {stiffness, middle.stiffness*middle.restLength, bending, chain.nodeFriction};
    if (!(stiffness > 0)) {
        reason = "its segments are not stiffer than its joints";
        return nullopt;
    }
    for (size_t s = 0; s < count; s++) {
        const bool atEnd = (count > 1 && (s == 0 || s == count-1));
        const double expected = stiffness+(atEnd ? bending : 0), length = modes.contourForce/expected;
        if (!isNearly(expected, chain.segments[s].stiffness) || !isNearly(length, chain.segments[s].restLength)) {
            stringstream text;
            text << "its segment " << s << " has the stiffness " << chain.segments[s].stiffness <<
                    " and the rest length " << chain.segments[s].restLength << ", in place of " << expected <<
                    " and " << length;
            reason = text.str();
            return nullopt;
        }
    }
    return modes;
}
