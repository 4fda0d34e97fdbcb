#ifndef CYLCHAIN_LINKER_REGION_H_
#define CYLCHAIN_LINKER_REGION_H_

#include "couplings/Walls.h"
#include "kinetics/Linkers.h"
#include "kinetics/RandomNumbers.h"
#include <cmath>
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
        for (const Wall& wall : walls)
            if (!cylchain::encloses(wall, position))
                return false;
        return true;
    }
    /** Whether a sphere is beyond a face of a wall. */
    bool isBeyond(const double* center, double radius) const;
    /**
     * Whether it has a volume: a wall is closed, or a cylinder has a slab across it, or there is a box, and no wall but
     * slabs and cylinders. A half space and a box have none, since walls have no periodic images.
     */
    bool isBounded() const {
        double lower[3], upper[3];
        if (findBounds(lower, upper))
            return true;
        bool anyPlane = false;
        for (const Wall& wall : walls)
            anyPlane = anyPlane || wall.shape == WallShape::Plane;
        return box != nullptr && !anyPlane;
    }
    /** Draw a position, each with the same chance; false if none of a million drawn is within all walls. */
    bool draw(RandomNumbers& random, bool planar, double* position) const;
private:
    /** The corners of a box around a closed wall, or a cylinder and a slab across it; false if there is none. */
    bool findBounds(double* lower, double* upper) const {
        for (const Wall& wall : walls)
            if (wall.shape != WallShape::Plane && wall.shape != WallShape::Slab && wall.shape != WallShape::Cylinder) {
                for (int k = 0; k < 3; k++) {
                    const double ofVector = wall.shape == WallShape::Sphere ? 0 : std::fabs(wall.vector[k]);
                    const double half = ofVector+(wall.shape == WallShape::Ellipsoid ? 0 : wall.length);
                    lower[k] = wall.shape == WallShape::Box ? wall.point[k] : wall.point[k]-half;
                    upper[k] = wall.shape == WallShape::Box ? wall.vector[k] : wall.point[k]+half;
                }
                return true;
            }
        for (const Wall& cylinder : walls)
            for (const Wall& slab : walls)
                if (cylinder.shape == WallShape::Cylinder && slab.shape == WallShape::Slab) {
                    double cosine = 0, along = 0;
                    for (int k = 0; k < 3; k++) {
                        cosine += cylinder.vector[k]*slab.vector[k];
                        along += cylinder.vector[k]*(slab.point[k]-cylinder.point[k]);
                    }
                    if (std::fabs(cosine) < 1-1e-9)
                        continue;
                    for (int k = 0; k < 3; k++) {
                        const double axis = cylinder.vector[k], middle = cylinder.point[k]+along*axis;
                        const double half = 0.5*slab.length*std::fabs(axis)+
                                cylinder.length*std::sqrt(std::fmax(0, 1-axis*axis));
                        lower[k] = middle-half;
                        upper[k] = middle+half;
                    }
                    return true;
                }
        return false;
    }
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
