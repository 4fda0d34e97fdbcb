#include "mechanics/RigidBody.h"
#include "mechanics/SymmetricMatrices.h"
#include <algorithm>
#include <cmath>
#include <cstddef>

using namespace cylchain;
using namespace std;

namespace {

/** Corners that span less than this of the square of a body's size are on one line. */
const double LEAST_AREA = 1e-6;

void subtract(const double* a, const double* b, double* result) {
    for (int k = 0; k < 3; k++)
        result[k] = a[k]-b[k];
}

void normalize(double* vector) {
    const double length = sqrt(dot(vector, vector));
    for (int k = 0; k < 3; k++)
        vector[k] /= length;
}

/** The axes of a triangle: along its first side, in its plane, and across it. */
void findAxes(const double* a, const double* b, const double* c, double* axes) {
    double other[3];
    subtract(b, a, axes);
    normalize(axes);
    subtract(c, a, other);
    cross(axes, other, axes+6);
    normalize(axes+6);
    cross(axes+6, axes, axes+3);
}

double areaOf(const double* a, const double* b, const double* c) {
    double first[3], second[3], both[3];
    subtract(b, a, first);
    subtract(c, a, second);
    cross(first, second, both);
    return sqrt(dot(both, both));
}

double squareOf(const double* a, const double* b) {
    double between[3];
    subtract(b, a, between);
    return dot(between, between);
}

} // namespace

double RigidBody::findRadius() const {
    double largest = 0;
    for (size_t i = 0; i < places.size(); i += 3)
        largest = max(largest, dot(&places[i], &places[i]));
    return sqrt(largest);
}

void RigidFrame::turn(const double* vector, double* result) const {
    for (int i = 0; i < 3; i++)
        result[i] = dot(rotation+3*i, vector);
}

void RigidFrame::turnBack(const double* vector, double* result) const {
    for (int i = 0; i < 3; i++)
        result[i] = rotation[i]*vector[0]+rotation[3+i]*vector[1]+rotation[6+i]*vector[2];
}

void RigidFrame::turnMatrix(const double* matrix, double* result) const {
    // R (R M)^T, for a symmetric M.
    double half[9];
    for (int i = 0; i < 3; i++)
        multiply(matrix, rotation+3*i, half+3*i);
    int entry = 0;
    for (int row = 0; row < 3; row++)
        for (int column = row; column < 3; column++)
            result[entry++] = dot(rotation+3*row, half+3*column);
}

RigidFrameFinder::RigidFrameFinder(const RigidBody& body) {
    const int count = body.particles.size();
    const double* const places = body.places.data();
    if (count == 0)
        return;
    // The first corner is far from the centre, the second far from the first one, the third far from their line.
    for (int i = 0; i < count; i++)
        if (dot(places+3*i, places+3*i) > dot(places+3*corners[0], places+3*corners[0]))
            corners[0] = i;
    const double* const first = places+3*corners[0];
    corners[1] = corners[0];
    for (int i = 0; i < count; i++)
        if (squareOf(first, places+3*i) > squareOf(first, places+3*corners[1]))
            corners[1] = i;
    const double* const second = places+3*corners[1];
    for (int i = 0; i < count; i++)
        if (areaOf(first, second, places+3*i) > area) {
            area = areaOf(first, second, places+3*i);
            corners[2] = i;
        }
    const double square = squareOf(first, second);
    area = square > 0 ? area/square : 0;
    if (!isOnLine())
        findAxes(first, second, places+3*corners[2], axes);
}

bool RigidFrameFinder::isOnLine() const {
    return !(area > LEAST_AREA);
}

RigidFrame RigidFrameFinder::find(const RigidBody& body, const double* positions) const {
    const double* points[3];
    for (int i = 0; i < 3; i++)
        points[i] = positions+3*body.particles[corners[i]];
    double now[9];
    findAxes(points[0], points[1], points[2], now);
    RigidFrame frame;
    for (int row = 0; row < 3; row++)
        for (int column = 0; column < 3; column++)
            frame.rotation[3*row+column] = now[row]*axes[column]+now[3+row]*axes[3+column]+now[6+row]*axes[6+column];
    // The middle of the three corners is where it was found.
    for (int i = 0; i < 3; i++) {
        double arm[3];
        frame.turn(&body.places[3*corners[i]], arm);
        for (int k = 0; k < 3; k++)
            frame.centre[k] += (points[i][k]-arm[k])/3;
    }
    return frame;
}

double cylchain::findDeformation(const RigidBody& body, const RigidFrame& frame, const double* positions) {
    double largest = 0;
    for (size_t i = 0; i < body.particles.size(); i++) {
        double arm[3], found[3];
        frame.turn(&body.places[3*i], arm);
        subtract(positions+3*body.particles[i], frame.centre, found);
        largest = max(largest, squareOf(arm, found));
    }
    return sqrt(largest);
}

void GibbsVector::turn(const double* g, const double* vector, double* result) {
    const double share = 1/(1+0.25*dot(g, g));
    double once[3], twice[3];
    cross(g, vector, once);
    cross(g, once, twice);
    for (int k = 0; k < 3; k++)
        result[k] = vector[k]+share*(once[k]+0.5*twice[k]);
}

void GibbsVector::turn(const double* g, const RigidFrame& frame, RigidFrame& result) {
    for (int column = 0; column < 3; column++) {
        double axis[3], turned[3];
        for (int row = 0; row < 3; row++)
            axis[row] = frame.rotation[3*row+column];
        turn(g, axis, turned);
        for (int row = 0; row < 3; row++)
            result.rotation[3*row+column] = turned[row];
    }
}

bool GibbsVector::follow(const double* next, double* g) {
    const double cosine = 1-0.25*dot(next, g);
    double both[3];
    cross(next, g, both);
    for (int k = 0; k < 3; k++)
        g[k] = (next[k]+g[k]+0.5*both[k])/cosine;
    return cosine > 0;
}

void GibbsVector::halve(const double* g, double* half) {
    const double share = 1/(1+sqrt(1+0.25*dot(g, g)));
    for (int k = 0; k < 3; k++)
        half[k] = share*g[k];
}

void GibbsVector::fromRotationVector(const double* vector, double* g) {
    const double angle = sqrt(dot(vector, vector));
    const double factor = angle > 0 ? 2*tan(0.5*angle)/angle : 1;
    for (int k = 0; k < 3; k++)
        g[k] = factor*vector[k];
}
