#ifndef CYLCHAIN_RIGID_BODY_H_
#define CYLCHAIN_RIGID_BODY_H_

#include <vector>

namespace cylchain {

/** Particles outside chains that move as one: a rigid body. */
struct RigidBody {
    std::vector<int> particles;
    /**
     * Where they are in the frame of the body, three numbers each. Its origin is the centre of the body, where friction
     * against motion and against turning are independent.
     */
    std::vector<double> places;
    /** Against motion of the centre, in any direction. */
    double friction = 0;
    /** Against turning, in the frame of the body: a symmetric matrix (xx, xy, xz, yy, yz, zz). */
    double rotationalFriction[6] = {};
    /** Whether it moves in a plane of constant z alone, and turns about z alone. */
    bool planar = false;
    /** The largest distance of a particle from the centre. */
    double findRadius() const;
};

/** Where a rigid body is, and how it is turned. */
struct RigidFrame {
    double centre[3] = {};
    /** Row by row: it takes vectors from the frame of the body to that of space. */
    double rotation[9] = {1, 0, 0, 0, 1, 0, 0, 0, 1};
    /** Find where a vector of the body's frame points to. */
    void turn(const double* vector, double* result) const;
    /** Find the vector in the frame of the body. */
    void turnBack(const double* vector, double* result) const;
    /** Find where a symmetric matrix of the body's frame is in that of space. */
    void turnMatrix(const double* matrix, double* result) const;
};

/**
 * Finds where rigid bodies are from the positions of three of their particles, which lie as far from one line as may
 * be.
 */
class RigidFrameFinder {
public:
    explicit RigidFrameFinder(const RigidBody& body);
    /** Whether all particles are on one line, so that they do not tell how the body is turned. */
    bool isOnLine() const;
    /** @param positions  three numbers for each particle of the System */
    RigidFrame find(const RigidBody& body, const double* positions) const;
private:
    int corners[3] = {0, 0, 0};
    double area = 0;
    /** Three unit vectors, row by row, in the frame of the body. */
    double axes[9] = {};
};

/** Find how far a particle is from where it belongs, for the one for which that is most. */
double findDeformation(const RigidBody& body, const RigidFrame& frame, const double* positions);

/**
 * Turns as vectors g with g = 2 tan(angle/2) along the axis, after Gibbs. They turn a vector from a to a' with
 *
 *     a'-a = g x (a+a')/2.
 */
namespace GibbsVector {

/** Turn a vector. */
void turn(const double* g, const double* vector, double* result);
/** Turn a frame. */
void turn(const double* g, const RigidFrame& frame, RigidFrame& result);
/** Let a turn g be followed by another one; false if both make half a turn or more. */
bool follow(const double* next, double* g);
/** Find the turn about the same axis by half the angle. */
void halve(const double* g, double* half);
/** The turn by the length of a vector, in rad, about its direction. */
void fromRotationVector(const double* vector, double* g);

} // namespace GibbsVector

} // namespace cylchain

#endif /*CYLCHAIN_RIGID_BODY_H_*/
