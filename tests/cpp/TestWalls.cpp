/**
 * This tests walls: depths against formulas, energies against distances, gradients against differences of depths, and
 * the middles of shapes, where there is no direction.
 */

#include "TestChains.h"
#include "couplings/Walls.h"

static Wall wallOf(WallShape shape, const Array& point, const Array& vector, double length) {
    Wall wall;
    wall.shape = shape;
    copy(point.begin(), point.end(), wall.point);
    copy(vector.begin(), vector.end(), wall.vector);
    wall.length = length;
    return wall;
}

static const vector<Wall> WALLS = {
    wallOf(WallShape::Plane, {0.3, -0.2, 0.5}, {1./3, 2./3, -2./3}, 0),
    wallOf(WallShape::Slab, {0.1, 0.2, 0.3}, {0, 0.6, 0.8}, 3),
    wallOf(WallShape::Sphere, {0.1, 0.2, 0.3}, {0, 0, 0}, 2),
    wallOf(WallShape::Cylinder, {1, 0, 0}, {0.6, 0, 0.8}, 1.5),
    wallOf(WallShape::Box, {-1, -2, -1}, {2, 1, 1}, 0),
    wallOf(WallShape::Ellipsoid, {0.1, 0, 0}, {1, 2, 3}, 0),
    wallOf(WallShape::Capsule, {0.2, -0.1, 0.3}, {0.9, 0, -1.2}, 1),
    wallOf(WallShape::Torus, {0.2, 0.1, -0.3}, {1.6, 0, 1.2}, 1.3),
};

static double sumOfSquares(const Wall& wall, const double* x, double radius) {
    double sum = 0, gradient[3];
    for (int face = 0; face < countFaces(wall); face++) {
        const double depth = max(0.0, findDepth(wall, face, x, radius, gradient));
        sum += depth*depth;
    }
    return sum;
}

/** The squared depth of a point, from the formulas of shapes. */
static double squareByHand(const Wall& wall, const double* x) {
    const double *p = wall.point, *v = wall.vector;
    double r[3], along = 0, square = 0;
    for (int k = 0; k < 3; k++) {
        r[k] = x[k]-p[k];
        along += r[k]*v[k];
        square += r[k]*r[k];
    }
    auto beyond = [] (double depth) {
        return depth > 0 ? depth*depth : 0;
    };
    switch (wall.shape) {
    case WallShape::Plane:
        return beyond(-along);
    case WallShape::Slab:
        return beyond(fabs(along)-wall.length/2);
    case WallShape::Sphere:
        return beyond(sqrt(square)-wall.length);
    case WallShape::Cylinder:
        return beyond(sqrt(square-along*along)-wall.length);
    case WallShape::Box: {
        double sum = 0;
        for (int k = 0; k < 3; k++)
            sum += pow(x[k]-min(max(x[k], p[k]), v[k]), 2);
        return sum;
    }
    case WallShape::Ellipsoid: {
        double s = 0, q = 0;
        for (int k = 0; k < 3; k++) {
            s += pow(r[k]/v[k], 2);
            q += pow(r[k]/(v[k]*v[k]), 2);
        }
        return beyond((sqrt(s)-1)*sqrt(s)/sqrt(q));
    }
    case WallShape::Capsule: {
        // From the axis, or from the end of it that is nearer.
        double size = 0, toEnd = 0;
        for (int k = 0; k < 3; k++)
            size += v[k]*v[k];
        for (int k = 0; k < 3; k++)
            toEnd += pow(r[k]-(along > 0 ? v[k] : -v[k]), 2);
        return beyond(sqrt(fabs(along) < size ? square-along*along/size : toEnd)-wall.length);
    }
    case WallShape::Torus: {
        const double axial = along/2, radial = sqrt(square-axial*axial);
        return beyond(sqrt(pow(radial-2, 2)+axial*axial)-wall.length);
    }
    }
    throw runtime_error("The tests do not know a shape");
}

static void testDepths() {
    NormalNumbers normal(1);
    for (const Wall& wall : WALLS) {
        int outside = 0;
        for (int i = 0; i < 1000; i++) {
            Array x = normal(3);
            for (double& value : x)
                value *= 2;
            const double expected = squareByHand(wall, x.data());
            outside += expected > 0.01;
            checkClose(expected, sumOfSquares(wall, x.data(), 0), 1+expected, 1e-12, "the squared depth");
        }
        check(outside > 100 && outside < 950, "points inside and outside");
    }
}

static void testRadii() {
    // A sphere around the particle touches where the particle is that far inside.
    NormalNumbers normal(2);
    for (const Wall& wall : WALLS)
        for (int i = 0; i < 100; i++) {
            const Array x = normal(3);
            for (int face = 0; face < countFaces(wall); face++) {
                double one[3], other[3];
                const double depth = findDepth(wall, face, x.data(), 0, one);
                checkClose(depth+0.25, findDepth(wall, face, x.data(), 0.25, other), 1, 1e-13, "a radius");
                for (int k = 0; k < 3; k++)
                    checkClose(one[k], other[k], 1, 0, "the direction with a radius");
            }
        }
}

static void testGradients() {
    NormalNumbers normal(3);
    const double width = 1e-5;
    for (const Wall& wall : WALLS)
        for (int i = 0; i < 200; i++) {
            Array x = normal(3);
            for (int face = 0; face < countFaces(wall); face++) {
                double gradient[3], unused[3], square = 0;
                findDepth(wall, face, x.data(), 0.1, gradient);
                for (int k = 0; k < 3; k++) {
                    const double here = x[k];
                    x[k] = here+width;
                    const double above = findDepth(wall, face, x.data(), 0.1, unused);
                    x[k] = here-width;
                    const double below = findDepth(wall, face, x.data(), 0.1, unused);
                    x[k] = here;
                    checkClose((above-below)/(2*width), gradient[k], 1, 1e-5, "a gradient");
                    square += gradient[k]*gradient[k];
                }
                if (wall.shape != WallShape::Ellipsoid)
                    checkClose(1, square, 1, 1e-12, "the length of a gradient");
            }
        }
}

/** Compare how the gradient of a depth changes with the position, a symmetric matrix, with differences of gradients. */
static void checkChangeOfGradient(const Wall& wall, Array x, const double* found, double scale, double tolerance,
        const string& what) {
    const double width = 1e-5;
    int entry = 0;
    for (int j = 0; j < 3; j++)
        for (int k = j; k < 3; k++) {
            const double here = x[k];
            double above[3], below[3];
            x[k] = here+width;
            findDepth(wall, 0, x.data(), 0, above);
            x[k] = here-width;
            findDepth(wall, 0, x.data(), 0, below);
            x[k] = here;
            checkClose((above[j]-below[j])/(2*width), found[entry++], scale, tolerance, what);
        }
}

/** How a force turns, against differences of gradients. */
static void testTurning() {
    NormalNumbers normal(4);
    int caps = 0;
    for (const Wall& wall : WALLS) {
        // The circle of a torus bends, too: see testCurvatures().
        if (!isRound(wall) || wall.shape == WallShape::Torus)
            continue;
        for (int i = 0; i < 200; i++) {
            Array x = normal(3);
            double g[3], turning[6] = {};
            const double distance = findDepth(wall, 0, x.data(), 0, g)+wall.length;
            if (distance < 0.1)
                continue;
            double along = 0;
            for (int k = 0; k < 3; k++)
                along += g[k]*wall.vector[k];
            caps += wall.shape == WallShape::Capsule && fabs(along) > 1e-9;
            addTurning(wall, x.data(), g, 1/distance, turning);
            checkChangeOfGradient(wall, x, turning, 1/distance, 1e-4, "a turning force");
        }
    }
    check(caps > 20 && caps < 180, "positions beside the cylinder and beside the caps");
}

/** Depths change by the mean gradient along a way, which is that of the way back. */
static void testMeanGradients() {
    NormalNumbers normal(5);
    for (Wall wall : WALLS) {
        if (countFaces(wall) > 1)
            continue;
        wall.side = WallSide::Surface;
        for (int i = 0; i < 300; i++) {
            Array x = normal(3), y = normal(3);
            double there[3], back[3], unused[3], change = 0;
            findMeanGradient(wall, x.data(), y.data(), there);
            findMeanGradient(wall, y.data(), x.data(), back);
            for (int k = 0; k < 3; k++) {
                change += there[k]*(y[k]-x[k]);
                checkClose(there[k], back[k], 1, 1e-9, "the way back");
            }
            const double expected = findDepth(wall, 0, y.data(), 0, unused)-findDepth(wall, 0, x.data(), 0, unused);
            checkClose(expected, change, 1, 1e-9, "the change of a depth");
        }
    }
}

/** Second derivatives of depths, against differences of gradients. */
static void testCurvatures() {
    NormalNumbers normal(6);
    for (const Wall& wall : WALLS) {
        if (countFaces(wall) > 1)
            continue;
        for (int i = 0; i < 100; i++) {
            Array x = normal(3);
            double curvature[6];
            for (int k = 0; k < 3; k++)
                x[k] += wall.point[k]+(x[k] > 0 ? 1 : -1);
            findCurvature(wall, x.data(), curvature);
            checkChangeOfGradient(wall, x, curvature, 1, 2e-4, "a second derivative");
        }
    }
}

/** What is outside has the opposite depth and gradient, and is enclosed where others are not. */
static void testSides() {
    NormalNumbers normal(7);
    for (const Wall& wall : WALLS) {
        if (countFaces(wall) > 1)
            continue;
        Wall outside = wall, surface = wall;
        outside.side = WallSide::Outside;
        surface.side = WallSide::Surface;
        int passed = 0;
        for (int i = 0; i < 100; i++) {
            const Array x = normal(3), y = normal(3);
            double inwards[3], outwards[3];
            const double depth = findDepth(wall, 0, x.data(), 0, inwards);
            checkClose(0.25-depth, findDepth(outside, 0, x.data(), 0.25, outwards), 1, 1e-13, "a depth outside");
            for (int k = 0; k < 3; k++)
                checkClose(-inwards[k], outwards[k], 1, 0, "a direction outside");
            check(encloses(wall, x.data()) != encloses(outside, x.data()), "one of both sides");
            check(encloses(surface, x.data()) && actsAt(surface, depth), "a surface is everywhere");
            check(!passesThrough(wall, x.data(), y.data()), "nothing to pass through");
            passed += passesThrough(outside, x.data(), y.data());
        }
        check(isFlat(wall) ? passed == 0 : passed > 10 && passed < 80, "ways to the other side");
        double lower[3], upper[3];
        check(!findBounds({outside}, lower, upper), "the outside has no bounds");
    }
}

/** Across the hole of a torus there is a way, but not through its tube. */
static void testWaysThroughTorus() {
    Wall wall = wallOf(WallShape::Torus, {0, 0, 0}, {0, 0, 3}, 1);
    wall.side = WallSide::Outside;
    const double left[] = {-0.9, 0, 0}, right[] = {0.9, 0, 0}, beyond[] = {4.5, 0.1, 0}, above[] = {3, 0, 1.5};
    const double below[] = {3, 0.1, -1.5}, far[] = {-4.5, 0, 0};
    check(!passesThrough(wall, left, right), "a way across the hole");
    check(passesThrough(wall, right, beyond), "a way outward through the tube");
    check(passesThrough(wall, above, below), "a way down through the tube");
    check(passesThrough(wall, right, far), "a way to the other side through the tube");
}

static void testMiddles() {
    for (const Wall& wall : WALLS) {
        if (wall.shape == WallShape::Box || wall.shape == WallShape::Plane)
            continue;
        double gradient[3], middle[3];
        for (int k = 0; k < 3; k++)
            middle[k] = wall.point[k]+(wall.shape == WallShape::Torus ? (k == 1 ? 2 : 0) : 0);
        const double depth = findDepth(wall, 0, middle, 0, gradient);
        checkClose(-getRoom(wall), depth, 1, 1e-12, "the depth in the middle");
        double square = 0, along = 0;
        for (int k = 0; k < 3; k++) {
            square += gradient[k]*gradient[k];
            along += gradient[k]*wall.vector[k];
        }
        checkClose(1, square, 1, 1e-12, "a direction in the middle");
        if (wall.shape == WallShape::Cylinder || wall.shape == WallShape::Capsule)
            checkClose(0, along, 1, 1e-12, "a direction across the axis");
    }
    checkClose(1, getRoom(WALLS[4]), 1, 0, "the room in a box");
    check(isinf(getRoom(WALLS[0])), "the room before a plane");
}

int main() {
    return runTests({testDepths, testRadii, testGradients, testTurning, testMeanGradients, testCurvatures, testSides,
            testWaysThroughTorus, testMiddles});
}
