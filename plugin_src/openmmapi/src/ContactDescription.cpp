#include "openmm/internal/ContactDescription.h"
#include "openmm/OpenMMException.h"
#include <cmath>
#include <set>

using namespace cylchain;
using namespace std;

namespace OpenMM {

/** Parameters of curves that differ by less are the same. */
static const double SAME_PLACE = 1e-9;

int countSegments(const CylinderChainContactForce& owner, int chain) {
    return owner.getChainParticles(chain).size()-(owner.isChainClosed(chain) ? 0 : 1);
}

CapsuleSystem describeCapsules(const CylinderChainContactForce& owner, int numParticles) {
    auto checkParticle = [&] (int particle) {
        if (particle >= numParticles)
            throw OpenMMException("CylinderChainContactForce: Illegal particle index: "+to_string(particle));
    };
    CapsuleSystem capsules;
    vector<int> firstOfChain;
    for (int chain = 0; chain < owner.getNumChains(); chain++) {
        const vector<int>& particles = owner.getChainParticles(chain);
        for (int particle : particles)
            checkParticle(particle);
        const int segments = countSegments(owner, chain);
        firstOfChain.push_back(capsules.capsules.size());
        for (int segment = 0; segment < segments; segment++)
            capsules.capsules.push_back({particles[segment], particles[(segment+1)%particles.size()],
                    0.5*owner.getChainDiameter(chain), chain, segment});
        capsules.chains.push_back({segments, owner.isChainClosed(chain), owner.getChainExcludedNeighbors(chain)});
    }
    firstOfChain.push_back(capsules.capsules.size());
    for (int sphere = 0; sphere < owner.getNumSpheres(); sphere++) {
        checkParticle(owner.getSphereParticle(sphere));
        capsules.capsules.push_back({owner.getSphereParticle(sphere), -1, 0.5*owner.getSphereDiameter(sphere), -1,
                sphere});
    }
    for (int exclusion = 0; exclusion < owner.getNumExclusions(); exclusion++) {
        int chain1, segment1, chain2, segment2;
        owner.getExclusion(exclusion, chain1, segment1, chain2, segment2);
        // Spheres come after the segments of all chains.

        const int first = firstOfChain[chain1 == -1 ? owner.getNumChains() : chain1]+segment1;
        const int second = firstOfChain[chain2 == -1 ? owner.getNumChains() : chain2]+segment2;
        capsules.exclusions.push_back({first, second});
    }
    return capsules;
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
