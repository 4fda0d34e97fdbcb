#include "couplings/ContactBodies.h"

namespace cylchain {

CapsuleSystem ContactBodies::getCapsules(const std::vector<bool>& isSpare) const {
    CapsuleSystem system;
    std::vector<int> firstOfChain;
    for (const Chain& chain : chains) {
        const int number = firstOfChain.size();
        int segments = chain.countSegments();
        while (!isSpare.empty() && segments > 0 && isSpare[chain.particles[segments%chain.particles.size()]])
            segments--;
        firstOfChain.push_back(system.capsules.size());
        for (int segment = 0; segment < segments; segment++)
            system.capsules.push_back({chain.particles[segment], chain.particles[(segment+1)%chain.particles.size()],
                    0.5*chain.diameter, number, segment});
        system.chains.push_back({segments, chain.closed, chain.excludedNeighbors});
    }
    const int firstSphere = system.capsules.size();
    for (const Sphere& sphere : spheres) {
        const int number = system.capsules.size()-firstSphere;
        system.capsules.push_back({sphere.particle, -1, 0.5*sphere.diameter, -1, number});
    }
    for (const Exclusion& exclusion : exclusions) {
        auto find = [&] (int chain, int segment) {
            return (chain == -1 ? firstSphere : firstOfChain[chain])+segment;
        };
        auto isThere = [&] (int chain, int segment) {
            return chain == -1 || segment < system.chains[chain].numCapsules;
        };
        if (isThere(exclusion.chain1, exclusion.segment1) && isThere(exclusion.chain2, exclusion.segment2))
            system.exclusions.push_back({find(exclusion.chain1, exclusion.segment1),
                    find(exclusion.chain2, exclusion.segment2)});
    }
    return system;
}

} // namespace cylchain
