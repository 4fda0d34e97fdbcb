#include "couplings/Walls.h"
#include "mechanics/SymmetricMatrices.h"
#include <algorithm>
#include <cmath>
#include <limits>

using namespace cylchain;
using namespace std;

/** The least distance from the middle of a shape, and the differences by which curvatures are found, over its size. */
static const double LEAST_DISTANCE = 1e-6, OF_DIFFERENCES = 1e-4;

/** A direction at right angles to a vector. */
static void findOrthogonal(const double* vector, double* result) {
    const double size = sqrt(dot(vector, vector));
    const double direction[] = {vector[0]/size, vector[1]/size, vector[2]/size};
    int least = 0;
    for (int k = 1; k < 3; k++)
        if (fabs(direction[k]) < fabs(direction[least]))
            least = k;
    double square = 0;
    for (int k = 0; k < 3; k++) {
        result[k] = (k == least ? 1 : 0)-direction[least]*direction[k];
        square += result[k]*result[k];
    }
    for (int k = 0; k < 3; k++)
        result[k] /= sqrt(square);
}

/** Find the way from the axis of a torus, and its length, for a vector from the center; some way on the axis. */
static double findWayFromAxis(const Wall& wall, const double* r, double* outward) {
    const double* v = wall.vector;
    const double along = dot(v, r)/dot(v, v);
    double way[3];
    for (int k = 0; k < 3; k++)
        way[k] = r[k]-along*v[k];
    const double distance = sqrt(dot(way, way));
    findOrthogonal(v, outward);
    for (int k = 0; k < 3 && distance > 0; k++)
        outward[k] = way[k]/distance;
    return distance;
}

/** Find how far a position is from the axis of a torus, and unit vectors from there and along the circle. */
static double findPlaceAround(const Wall& wall, const double* position, double* outward, double* aside) {
    double r[3];
    for (int k = 0; k < 3; k++)
        r[k] = position[k]-wall.point[k];
    const double* v = wall.vector;
    const double distance = findWayFromAxis(wall, r, outward), size = sqrt(dot(v, v));
    for (int k = 0; k < 3; k++)
        aside[k] = (v[(k+1)%3]*outward[(k+2)%3]-v[(k+2)%3]*outward[(k+1)%3])/size;
    return distance;
}

/** Take a vector that begins at the point of a wall to where the middle of its round face is nearest. */
static void beginInMiddle(const Wall& wall, double* r) {
    const double* v = wall.vector;
    double along = 0;
    if (wall.shape == WallShape::Torus) {
        double outward[3];
        findWayFromAxis(wall, r, outward);
        const double radius = sqrt(dot(v, v));
        for (int k = 0; k < 3; k++)
            r[k] -= radius*outward[k];
        return;
    }
    if (wall.shape == WallShape::Cylinder)
        along = dot(v, r);
    else if (wall.shape == WallShape::Capsule)
        along = max(-1.0, min(1.0, dot(v, r)/dot(v, v)));
    for (int k = 0; k < 3; k++)
        r[k] -= along*v[k];
}

/** Whether a point is in the region itself. */
static bool isInShape(const Wall& wall, const double* position) {
    const double* v = wall.vector;
    double r[3];
    for (int k = 0; k < 3; k++)
        r[k] = position[k]-wall.point[k];
    switch (wall.shape) {
        case WallShape::Plane:
            return dot(v, r) >= 0;
        case WallShape::Slab:
            return fabs(dot(v, r)) <= 0.5*wall.length;
        case WallShape::Sphere:
            return dot(r, r) <= wall.length*wall.length;
        case WallShape::Cylinder: {
            const double along = dot(v, r);
            return dot(r, r)-along*along <= wall.length*wall.length;
        }
        case WallShape::Capsule:
        case WallShape::Torus:
            beginInMiddle(wall, r);
            return dot(r, r) <= wall.length*wall.length;
        case WallShape::Box:
            return r[0] >= 0 && r[1] >= 0 && r[2] >= 0 && position[0] <= v[0] && position[1] <= v[1] &&
                    position[2] <= v[2];
        case WallShape::Ellipsoid:
            for (int k = 0; k < 3; k++)
                r[k] /= v[k];
            return dot(r, r) <= 1;
    }
    return false;
}

bool cylchain::encloses(const Wall& wall, const double* position) {
    return wall.side == WallSide::Surface || isInShape(wall, position) == (wall.side == WallSide::Inside);
}

bool cylchain::encloses(const vector<Wall>& walls, const double* position) {
    for (const Wall& wall : walls)
        if (!encloses(wall, position))
            return false;
    return true;
}

/** The corners of a box around a closed wall; false if it is open. */
static bool findBoundsOf(const Wall& wall, double* lower, double* upper) {
    if (wall.side != WallSide::Inside || wall.shape == WallShape::Plane || wall.shape == WallShape::Slab ||
            wall.shape == WallShape::Cylinder)
        return false;
    const double* v = wall.vector;
    for (int k = 0; k < 3; k++) {
        double ofVector = wall.shape == WallShape::Sphere ? 0 : fabs(v[k]);
        if (wall.shape == WallShape::Torus)
            ofVector = sqrt(max(0.0, dot(v, v)-v[k]*v[k]));
        const double half = ofVector+(wall.shape == WallShape::Ellipsoid ? 0 : wall.length);
        lower[k] = wall.shape == WallShape::Box ? wall.point[k] : wall.point[k]-half;
        upper[k] = wall.shape == WallShape::Box ? wall.vector[k] : wall.point[k]+half;
    }
    return true;
}

/** The corners of a box around what is in a cylinder and in a slab across it; false if they are others. */
static bool findBoundsOf(const Wall& cylinder, const Wall& slab, double* lower, double* upper) {
    if (cylinder.shape != WallShape::Cylinder || slab.shape != WallShape::Slab ||
            cylinder.side != WallSide::Inside || fabs(dot(cylinder.vector, slab.vector)) < 1-1e-9)
        return false;
    double between[3];
    for (int k = 0; k < 3; k++)
        between[k] = slab.point[k]-cylinder.point[k];
    const double along = dot(cylinder.vector, between);
    for (int k = 0; k < 3; k++) {
        const double axis = cylinder.vector[k], middle = cylinder.point[k]+along*axis;
        const double half = 0.5*slab.length*fabs(axis)+cylinder.length*sqrt(max(0.0, 1-axis*axis));
        lower[k] = middle-half;
        upper[k] = middle+half;
    }
    return true;
}

bool cylchain::findBounds(const vector<Wall>& walls, double* lower, double* upper) {
    for (const Wall& wall : walls)
        if (findBoundsOf(wall, lower, upper))
            return true;
    for (const Wall& cylinder : walls)
        for (const Wall& slab : walls)
            if (findBoundsOf(cylinder, slab, lower, upper))
                return true;
    return false;
}

bool cylchain::isBounded(const vector<Wall>& walls, bool periodic) {
    double lower[3], upper[3];
    return findBounds(walls, lower, upper) || (periodic && none_of(walls.begin(), walls.end(), [] (const Wall& wall) {
        return wall.shape == WallShape::Plane && wall.side != WallSide::Surface;
    }));
}

int cylchain::countFaces(const Wall& wall) {
    switch (wall.shape) {
        case WallShape::Slab:
            return 2;
        case WallShape::Box:
            return 6;
        default:
            return 1;
    }
}

bool cylchain::isFlat(const Wall& wall) {
    return wall.shape == WallShape::Plane || wall.shape == WallShape::Slab || wall.shape == WallShape::Box;
}

bool cylchain::isRound(const Wall& wall) {
    return wall.shape == WallShape::Sphere || wall.shape == WallShape::Cylinder || wall.shape == WallShape::Capsule ||
            wall.shape == WallShape::Torus;
}

double cylchain::getRoom(const Wall& wall) {
    const double *p = wall.point, *v = wall.vector;
    switch (wall.shape) {
        case WallShape::Plane:
            return numeric_limits<double>::infinity();
        case WallShape::Slab:
            return 0.5*wall.length;
        case WallShape::Sphere:
        case WallShape::Cylinder:
        case WallShape::Capsule:
        case WallShape::Torus:
            return wall.length;
        case WallShape::Box:
            return 0.5*min(min(v[0]-p[0], v[1]-p[1]), v[2]-p[2]);
        case WallShape::Ellipsoid:
            return min(min(v[0], v[1]), v[2]);
    }
    return 0;
}

/** The depth (s-1) s/q with q^2 the sum of x_i^2/a_i^4. */
static double findDepthInEllipsoid(const Wall& wall, const double* r, double* gradient) {
    const double* a = wall.vector;
    double square = 0, steepness = 0;
    for (int k = 0; k < 3; k++) {
        const double share = r[k]/a[k];
        square += share*share;
        steepness += share*share/(a[k]*a[k]);
    }
    const double s = sqrt(square), q = sqrt(steepness);
    if (!(s > 1e-12)) {
        const int shortest = min_element(a, a+3)-a;
        for (int k = 0; k < 3; k++)
            gradient[k] = k == shortest ? 1 : 0;
        return -a[shortest];
    }
    const double depth = (square-s)/q;
    for (int k = 0; k < 3; k++) {
        const double ofSquare = 2*r[k]/(a[k]*a[k]);
        gradient[k] = (1-0.5/s)*ofSquare/q-0.5*depth/steepness*ofSquare/(a[k]*a[k]);
    }
    return depth;
}

/** The depth of a point beyond a face of the region. */
static double findDepthBeyond(const Wall& wall, int face, const double* position, double* gradient) {
    const double* v = wall.vector;
    double r[3];
    for (int k = 0; k < 3; k++)
        r[k] = position[k]-wall.point[k];
    switch (wall.shape) {
        case WallShape::Plane:
            for (int k = 0; k < 3; k++)
                gradient[k] = -v[k];
            return -dot(v, r);
        case WallShape::Slab: {
            const double sign = face == 0 ? 1 : -1;
            for (int k = 0; k < 3; k++)
                gradient[k] = sign*v[k];
            return sign*dot(v, r)-0.5*wall.length;
        }
        case WallShape::Sphere:
        case WallShape::Cylinder:
        case WallShape::Capsule:
        case WallShape::Torus: {
            const bool hasAxis = wall.shape == WallShape::Cylinder || wall.shape == WallShape::Capsule;
            beginInMiddle(wall, r);
            const double distance = sqrt(dot(r, r)), size = sqrt(dot(v, v));
            double up[] = {0, 0, 1};
            for (int k = 0; k < 3 && wall.shape == WallShape::Torus; k++)
                up[k] = v[k]/size;
            if (!(distance > 1e-12*wall.length) && hasAxis)
                findOrthogonal(v, gradient);
            else
                for (int k = 0; k < 3; k++)
                    gradient[k] = distance > 1e-12*wall.length ? r[k]/distance : up[k];
            return distance-wall.length;
        }
        case WallShape::Box: {
            const int axis = face/2;
            const double sign = face%2 == 0 ? -1 : 1;
            for (int k = 0; k < 3; k++)
                gradient[k] = k == axis ? sign : 0;
            return sign < 0 ? wall.point[axis]-position[axis] : position[axis]-v[axis];
        }
        case WallShape::Ellipsoid:
            return findDepthInEllipsoid(wall, r, gradient);
    }
    return 0;
}

double cylchain::findDepth(const Wall& wall, int face, const double* position, double radius, double* gradient) {
    const double depth = findDepthBeyond(wall, face, position, gradient);
    if (wall.side != WallSide::Outside)
        return depth+radius;
    for (int k = 0; k < 3; k++)
        gradient[k] = -gradient[k];
    return radius-depth;
}

void cylchain::addTurning(const Wall& wall, const double* position, const double* g, double size, double* turning) {
    double axis[] = {wall.vector[0], wall.vector[1], wall.vector[2]};
    bool hasAxis = wall.shape == WallShape::Cylinder || wall.shape == WallShape::Torus;
    if (wall.shape == WallShape::Torus) {
        // Around the tube, as of a cylinder: what the circle bends is less.
        double outward[3];
        findPlaceAround(wall, position, outward, axis);
    }
    const double square = dot(axis, axis);
    // The caps of a capsule are those of a sphere: there, the gradient has a part along the axis.
    if (wall.shape == WallShape::Capsule)
        hasAxis = fabs(dot(axis, g)) < 1e-9*sqrt(square);
    const double along = hasAxis ? 1/square : 0;
    int entry = 0;
    for (int i = 0; i < 3; i++)
        for (int k = i; k < 3; k++)
            turning[entry++] += size*((i == k ? 1 : 0)-g[i]*g[k]-along*axis[i]*axis[k]);
}

/** Add the curvature of a torus along its circle. */
static void addBendOfCircle(const Wall& wall, const double* position, const double* g, double* curvature) {
    double outward[3], aside[3];
    const double least = LEAST_DISTANCE*sqrt(dot(wall.vector, wall.vector));
    const double distance = max(findPlaceAround(wall, position, outward, aside), least);
    int entry = 0;
    for (int i = 0; i < 3; i++)
        for (int k = i; k < 3; k++)
            curvature[entry++] += dot(g, outward)/distance*aside[i]*aside[k];
}

void cylchain::findCurvature(const Wall& wall, const double* position, double* curvature) {
    fill_n(curvature, 6, 0.0);
    if (isFlat(wall))
        return;
    double gradient[3];
    if (isRound(wall)) {
        const double distance = findDepthBeyond(wall, 0, position, gradient)+wall.length;
        addTurning(wall, position, gradient, 1/max(distance, LEAST_DISTANCE*wall.length), curvature);
        if (wall.shape == WallShape::Torus)
            addBendOfCircle(wall, position, gradient, curvature);
    }
    else {
        double rows[3][3];
        for (int axis = 0; axis < 3; axis++) {
            double before[3], after[3], moved[3] = {position[0], position[1], position[2]};
            const double way = OF_DIFFERENCES*wall.vector[axis];
            moved[axis] = position[axis]-way;
            findDepthBeyond(wall, 0, moved, before);
            moved[axis] = position[axis]+way;
            findDepthBeyond(wall, 0, moved, after);
            for (int k = 0; k < 3; k++)
                rows[axis][k] = (after[k]-before[k])/(2*way);
        }
        int entry = 0;
        for (int i = 0; i < 3; i++)
            for (int k = i; k < 3; k++)
                curvature[entry++] = 0.5*(rows[i][k]+rows[k][i]);
    }
}

void cylchain::findMeanGradient(const Wall& wall, const double* x, const double* y, double* gradient) {
    double way[3], ofX[3], ofY[3];
    const double before = findDepth(wall, 0, x, 0, ofX), after = findDepth(wall, 0, y, 0, ofY);
    for (int k = 0; k < 3; k++)
        way[k] = y[k]-x[k];
    if (isRound(wall)) {
        // As of the vector r from the middle: (r(x)+r(y))/(|r(x)|+|r(y)|).
        const double fromX = wall.length+before, fromY = wall.length+after;
        const double sum = max(fromX+fromY, LEAST_DISTANCE*wall.length);
        for (int k = 0; k < 3; k++)
            gradient[k] = (fromX*ofX[k]+fromY*ofY[k])/sum;
        if (wall.shape == WallShape::Sphere || wall.shape == WallShape::Cylinder)
            return;
    }
    else {
        double middle[3];
        for (int k = 0; k < 3; k++)
            middle[k] = 0.5*(x[k]+y[k]);
        findDepth(wall, 0, middle, 0, gradient);
        if (isFlat(wall))
            return;
    }
    // O. Gonzalez, J. Nonlinear Sci. 1996, 6, 449. Rounding would be divided by what is next to nothing.
    const double square = dot(way, way);
    if (!(square > LEAST_DISTANCE*LEAST_DISTANCE*getRoom(wall)*getRoom(wall)))
        return;
    const double lacks = (after-before-dot(gradient, way))/square;
    for (int k = 0; k < 3; k++)
        gradient[k] += lacks*way[k];
}

bool cylchain::passesThrough(const Wall& wall, const double* x, const double* y) {
    if (wall.side != WallSide::Outside || isFlat(wall))
        return false;
    double before[3], after[3];
    findDepth(wall, 0, x, 0, before);
    findDepth(wall, 0, y, 0, after);
    if (wall.shape != WallShape::Torus)
        return dot(before, after) < 0;
    // Through the hole, and around all of it, there are ways to the other half of the circle, but for long ones.
    double outward[3], other[3], aside[3], square = 0;
    for (int k = 0; k < 3; k++)
        square += (y[k]-x[k])*(y[k]-x[k]);
    findPlaceAround(wall, x, outward, aside);
    findPlaceAround(wall, y, other, aside);
    const double hole = sqrt(dot(wall.vector, wall.vector))-wall.length;
    return dot(outward, other) > 0 ? dot(before, after) < 0 : square > hole*hole;
}
