#include "openmm/internal/ContactDescription.h"
#include "openmm/OpenMMException.h"
#include <cmath>
#include <set>

using namespace cylchain;
using namespace std;

namespace OpenMM {

/** Parameters of curves that differ by less are the same. */
static const double SAME_PLACE = 1e-9;

CapsuleSystem describeCapsules(const ContactBodies& bodies, const System& system, const vector<bool>& isSpare) {
    for (const Capsule& capsule : bodies.getCapsules().capsules)
        for (int particle : {capsule.first, capsule.end()})
            if (particle >= system.getNumParticles())
                throw OpenMMException("CylinderChainContactForce: Illegal particle index: "+to_string(particle));
    return bodies.getCapsules(isSpare);
}

void findCurves(const vector<Capsule>& capsules, const PlaceResolver& places, vector<CapsuleOnCurve>& onCurves,
        vector<CurveSite>& sites) {
    set<int> known;
    for (size_t i = 0; i < capsules.size(); i++) {
        const Capsule& capsule = capsules[i];
        if (capsule.second < 0 || !places.getSystem().isVirtualSite(capsule.first) ||
                !places.getSystem().isVirtualSite(capsule.second))
            continue;
        Place ends[2];
        ends[0].first = capsule.first;
        ends[1].first = capsule.second;
        for (Place& end : ends)
            end = places.resolve(end);
        if (!ends[0].isOnCurve() || !ends[1].isOnCurve())
            continue;
        for (int side = 0; side < 2; side++) {
            const int particle = side == 0 ? capsule.first : capsule.second;
            if (known.insert(particle).second)
                sites.push_back({particle, ends[side]});
        }
        // A site at a node is on both of its elements.

        for (int side = 0; side < 2; side++) {
            Place &one = ends[side], &other = ends[1-side];
            if (one.first == other.first)
                continue;
            if (one.second == other.first && fabs(one.fraction-1) < SAME_PLACE) {
                one = other;
                one.fraction = 0;
            }
            else if (one.first == other.second && fabs(one.fraction) < SAME_PLACE) {
                one = other;
                one.fraction = 1;
            }
        }
        const double length = fabs(ends[1].fraction-ends[0].fraction), pieces = round(1/max(length, SAME_PLACE));
        const double first = ends[0].fraction*pieces;
        if (ends[0].first != ends[1].first || fabs(length*pieces-1) > SAME_PLACE ||
                fabs(first-round(first)) > SAME_PLACE)
            continue;
        onCurves.push_back({(int) i, ends[0], (int) pieces, ends[1].fraction > ends[0].fraction});
    }
}

} // namespace OpenMM
