#ifndef CYLCHAIN_WALLS_H_
#define CYLCHAIN_WALLS_H_

#include "couplings/Place.h"
#include "mechanics/Enumerators.h"
#include <vector>

/** Regions that walls enclose. Stored Systems hold their names. */
#define CYLCHAIN_WALL_SHAPES(ENTRY) \
    ENTRY(Plane, "plane") \
    ENTRY(Slab, "slab") \
    ENTRY(Sphere, "sphere") \
    ENTRY(Cylinder, "cylinder") \
    ENTRY(Box, "box") \
    ENTRY(Ellipsoid, "ellipsoid") \
    ENTRY(Capsule, "capsule") \
    ENTRY(Torus, "torus")

/** Where walls keep particles. */
#define CYLCHAIN_WALL_SIDES(ENTRY) \
    ENTRY(Inside, "inside") \
    ENTRY(Outside, "outside") \
    ENTRY(Surface, "surface")

namespace cylchain {

enum class WallShape {CYLCHAIN_WALL_SHAPES(CYLCHAIN_ENUMERATOR)};

template <> struct Names<WallShape> {
    static constexpr const char* ALL[] = {CYLCHAIN_WALL_SHAPES(CYLCHAIN_NAME)};
};

enum class WallSide {CYLCHAIN_WALL_SIDES(CYLCHAIN_ENUMERATOR)};

template <> struct Names<WallSide> {
    static constexpr const char* ALL[] = {CYLCHAIN_WALL_SIDES(CYLCHAIN_NAME)};
};

/**
 * A region that particles are kept in, kept out of, or on the surface of which they are held.
 *
 *     shape       point                     vector                          length
 *     Plane       on it                     its normal, into the region     -
 *     Slab        half-way between planes   their normal                    their distance
 *     Sphere      the center                -                               the radius
 *     Cylinder    on the axis               the axis                        the radius
 *     Box         the lower corner          the upper corner                -
 *     Ellipsoid   the center                the semi-axes                   -
 *     Capsule     the middle                from it to where a cap begins   the radius
 *     Torus       the center                the axis, as long as the        the radius of the tube
 *                                           radius of its circle
 *
 * Normals and axes are unit vectors. Its surface has one or more faces: each plane of a slab or box is one. With the
 * depth d of a particle's surface beyond each face, negative inside, the energy is (k/2) times the sum of d^2 over
 * faces with d > 0. For a box that is the squared distance from the box that the particle's center has to itself.
 *
 * Outside, d is that of a particle's surface within the region; on its surface, particles have the energy at each d, so
 * that their centers are held their radius inside. Both are for shapes with one face.
 */
struct Wall {
    WallShape shape = WallShape::Plane;
    WallSide side = WallSide::Inside;
    double point[3] = {}, vector[3] = {0, 0, 1};
    double length = 0;
};

/** What a wall keeps in: a particle, as a sphere around it. */
struct WallParticle {
    int particle;
    double radius;
    /** Where the particle is on the curve of a beam element, if it is a virtual site there. */
    Place onCurve = {};
    /** What moves it: the particle itself, or the curve. */
    Place getPlace() const {
        if (onCurve.isOnCurve())
            return onCurve;
        Place place;
        place.first = particle;
        return place;
    }
};

/** A wall and what it keeps in. */
struct WallSystem {
    Wall wall;
    double stiffness = 0;
    std::vector<WallParticle> particles;
};

/** The most faces that a wall has. */
const int MOST_FACES = 6;

/** Whether a point is where a wall would have it: everywhere, if it holds particles on its surface. */
bool encloses(const Wall& wall, const double* position);

/** The same for all walls. */
bool encloses(const std::vector<Wall>& walls, const double* position);

/** Find the corners of a box around a closed wall, or a cylinder and a slab across it; false if there is none. */
bool findBounds(const std::vector<Wall>& walls, double* lower, double* upper);

/**
 * Whether what is within all walls has a volume: a wall is closed, or a cylinder has a slab across it, or there is a
 * periodic box, and no wall but slabs and cylinders. A half space and a box have none, since walls have no periodic
 * images.
 */
bool isBounded(const std::vector<Wall>& walls, bool periodic);

/** The number of faces. */
int countFaces(const Wall& wall);

/** Whether faces are planes. */
bool isFlat(const Wall& wall);

/** Whether the face is round: as far as the length from the middle, which is a point, a line or a part of one. */
bool isRound(const Wall& wall);

/** Whether there is a force at a depth: on a surface always, else beyond it. NaN is not beyond. */
inline bool actsAt(const Wall& wall, double depth) {
    return wall.side == WallSide::Surface || depth > 0;
}

/**
 * The largest radius, exclusive, of a particle that fits in: infinite for a plane. That of an ellipsoid is its shortest
 * semi-axis.
 */
double getRoom(const Wall& wall);

/**
 * Find how deep a particle is beyond a face, negative where it is free. The depth of an ellipsoid is (s-1)/|grad s|
 * with s^2 the sum of (x_i/a_i)^2, that of its surface to first order.
 *
 * @param position       three numbers
 * @param radius         of the particle
 * @param[out] gradient  how the depth changes with the position: a unit vector, but for ellipsoids; where it has no
 *                       direction, in the middle, one is chosen
 * @return the depth
 */
double findDepth(const Wall& wall, int face, const double* position, double radius, double* gradient);

/**
 * Add how a force on a round face turns with the position: a size times 1-g g, without what is along a middle that is a
 * line or a circle, as a symmetric matrix.
 *
 * @param position     three numbers
 * @param gradient     g, that of the depth there
 * @param[out] turning  six numbers
 */
void addTurning(const Wall& wall, const double* position, const double* gradient, double size, double* turning);

/** Find the second derivatives of the depth beyond a surface with one face, as a symmetric matrix. */
void findCurvature(const Wall& wall, const double* position, double* curvature);

/**
 * Find the mean gradient J of the depth beyond a surface with one face from x to y: the depth changes by J.(y-x),
 * however far that is. It is the same from y to x.
 */
void findMeanGradient(const Wall& wall, const double* x, const double* y, double* gradient);

/** Whether a particle that a wall keeps outside has got from one side of it to the other by a way. */
bool passesThrough(const Wall& wall, const double* x, const double* y);

} // namespace cylchain

#endif /*CYLCHAIN_WALLS_H_*/
