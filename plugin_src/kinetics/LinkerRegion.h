#ifndef CYLCHAIN_LINKER_REGION_H_
#define CYLCHAIN_LINKER_REGION_H_

#include "couplings/Walls.h"
#include "kinetics/Linkers.h"
#include "kinetics/RandomNumbers.h"
#include <cstdint>
#include <vector>

namespace cylchain {

/** Where linkers are that diffuse: within walls, and in a periodic box. */
class LinkerRegion {
public:
    /**
     * @param walls  the walls, which must outlive this
     * @param box    the vectors of the periodic box, or NULL
     */
    LinkerRegion(const std::vector<Wall>& walls, const double* box) : walls(walls), box(box) {
    }
    bool encloses(const double* position) const {
        return cylchain::encloses(walls, position);
    }
    /** Whether a sphere is beyond a face of a wall. */
    bool isBeyond(const double* center, double radius) const;
    /** Draw a position, each with the same chance; false if none of a million drawn is within all walls. */
    bool draw(RandomNumbers& random, bool planar, double* position) const;
private:
    const std::vector<Wall>& walls;
    const double* box;
};

/** Draw a position in a sphere, or if planar in a circle around the projection of its center to the plane z = 0. */
void drawAround(RandomNumbers& random, const double* center, double radius, bool planar, double* position);

/**
 * Give positions to linkers that diffuse and are not bound, where they have none.
 *
 * @return false if the region has no room
 */
bool placeFreeLinkers(LinkerState& state, const LinkerSystem& system, const double* box, std::uint32_t seed,
        std::uint32_t force);

} // namespace cylchain

#endif /*CYLCHAIN_LINKER_REGION_H_*/
