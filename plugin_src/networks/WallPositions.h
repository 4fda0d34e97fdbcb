#ifndef CYLCHAIN_WALL_POSITIONS_H_
#define CYLCHAIN_WALL_POSITIONS_H_

#include "couplings/Walls.h"
#include "networks/ChainPlaces.h"
#include <algorithm>
#include <cstddef>
#include <vector>

namespace cylchain {

/** Where a particle of a wall is. */
struct WallPosition {
    double at[3];
};

inline WallPosition positionOf(const WallParticle& particle, const double* positions) {
    WallPosition result;
    if (particle.onCurve.isOnCurve())
        locate(particle.onCurve, positions, nullptr, result.at);
    else
        std::copy_n(positions+3*particle.particle, 3, result.at);
    return result;
}

/**
 * The particles that have passed a wall which keeps them outside. What is kept inside has no other side to get to.
 *
 * @param places  those of its particles; what does not move has passed nothing
 */
inline std::vector<int> findPassed(const WallSystem& system, const std::vector<PlaceOnChain>& places,
        const double* begun, const double* moved) {
    std::vector<int> passed;
    for (std::size_t i = 0; i < places.size() && system.wall.side == WallSide::Outside; i++)
        if (places[i].pack >= 0 && passesThrough(system.wall, positionOf(system.particles[i], begun).at,
                positionOf(system.particles[i], moved).at))
            passed.push_back(i);
    return passed;
}

/** Where a particle was, and the square of how far it may go from there before it is beyond another face. */
struct RoomBeforeWall {
    double from[3], square = -1;
    bool holds(const double* to) const {
        double way = 0;
        for (int k = 0; k < 3; k++)
            way += (to[k]-from[k])*(to[k]-from[k]);
        return way < square;
    }
};

} // namespace cylchain

#endif /*CYLCHAIN_WALL_POSITIONS_H_*/
