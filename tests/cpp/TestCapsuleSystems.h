#ifndef CYLCHAIN_TEST_CAPSULE_SYSTEMS_H_
#define CYLCHAIN_TEST_CAPSULE_SYSTEMS_H_

/**
 * Capsules to test, at random, and distances and crossings of segments to compare with.
 */

#include "TestChains.h"
#include "couplings/ContactSearch.h"
#include <algorithm>

inline double uniform(mt19937_64& generator, double lower = 0, double upper = 1) {
    return uniform_real_distribution<double>(lower, upper)(generator);
}

inline Vec3d randomVector(mt19937_64& generator, double scale = 1) {
    normal_distribution<double> normal;
    const double x = normal(generator), y = normal(generator), z = normal(generator);
    return Vec3d{x, y, z}*scale;
}

inline Vec3d at(const Array& x, int particle) {
    return {x[3*particle], x[3*particle+1], x[3*particle+2]};
}

inline void add(Array& x, const Vec3d& v) {
    x.insert(x.end(), {v.x, v.y, v.z});
}

inline double length(const Vec3d& v) {
    return sqrt(v.dot(v));
}

inline double distanceToSegment(const Vec3d& point, const Vec3d& from, const Vec3d& to) {
    const Vec3d along = to-from;
    const double square = along.dot(along);
    const double fraction = square > 0 ? min(1.0, max(0.0, (point-from).dot(along)/square)) : 0.0;
    return length(point-from-along*fraction);
}

/** The distance of two segments: that of an end from the other segment, or else that of the lines. */
inline double distanceByHand(const Vec3d& a0, const Vec3d& a1, const Vec3d& b0, const Vec3d& b1) {
    double result = min(min(distanceToSegment(a0, b0, b1), distanceToSegment(a1, b0, b1)),
            min(distanceToSegment(b0, a0, a1), distanceToSegment(b1, a0, a1)));
    const Vec3d n = (a1-a0).cross(b1-b0);
    const double nn = n.dot(n);
    if (nn > 1e-20*(a1-a0).dot(a1-a0)*(b1-b0).dot(b1-b0)) {
        // Where the lines are nearest, by Cramer's rule with the vector between them along n.
        const double s = (b0-a0).cross(b1-b0).dot(n)/nn, t = (b0-a0).cross(a1-a0).dot(n)/nn;
        if (s >= 0 && s <= 1 && t >= 0 && t <= 1)
            result = min(result, fabs((b0-a0).dot(n))/sqrt(nn));
    }
    return result;
}

/** The volume of four points as they are at a time, by a determinant. */
inline double volumeByHand(const Vec3d* start, const Vec3d* end, double u) {
    Vec3d r[4];
    for (int i = 0; i < 4; i++)
        r[i] = start[i]*(1-u)+end[i]*u;
    const Vec3d d[3] = {r[0]-r[2], r[1]-r[0], r[3]-r[2]};
    return d[0].x*(d[1].y*d[2].z-d[1].z*d[2].y)-d[0].y*(d[1].x*d[2].z-d[1].z*d[2].x)+
            d[0].z*(d[1].x*d[2].y-d[1].y*d[2].x);
}

struct CrossingByHand {
    int count = 0;
    double time = -1;
    /** Whether it can be told: nothing happens at an end. */
    bool clear = true;
};

/** Count crossings in many short parts of the time. */
inline CrossingByHand crossingsByHand(const Vec3d* start, const Vec3d* end) {
    CrossingByHand result;
    const int parts = 2000;
    double before = volumeByHand(start, end, 0);
    for (int i = 0; i < parts; i++) {
        const double after = volumeByHand(start, end, (i+1.0)/parts);
        if ((before < 0) != (after < 0)) {
            double lower = (double) i/parts, upper = (i+1.0)/parts;
            for (int turn = 0; turn < 60; turn++) {
                const double middle = 0.5*(lower+upper);
                ((volumeByHand(start, end, middle) < 0) == (before < 0) ? lower : upper) = middle;
            }
            Vec3d r[4];
            for (int k = 0; k < 4; k++)
                r[k] = start[k]*(1-lower)+end[k]*lower;
            // Do the segments meet there? A bit shorter or longer ones, too?
            double distances[3];
            for (int k = -1; k <= 1; k++) {
                const Vec3d p = (r[1]-r[0])*(1e-6*k), q = (r[3]-r[2])*(1e-6*k);
                distances[k+1] = distanceByHand(r[0]-p, r[1]+p, r[2]-q, r[3]+q);
            }
            const bool shorter = distances[0] < 1e-9, longer = distances[2] < 1e-9;
            if (shorter != longer)
                result.clear = false;
            if (longer && result.count++ == 0)
                result.time = lower;
        }
        before = after;
    }
    return result;
}

/** Capsules, and where their ends are before and after a motion. */
struct TestSystem {
    CapsuleSystem system;
    Array x, y;
};

/** Chains, rings and spheres; some of the chains lie in bundles. Whole chains are taken to other images of a box. */
inline TestSystem makeSystem(mt19937_64& generator, int chains, int segments, double extent, double segment,
            double diameter, double motion, const double* box) {
    TestSystem result;
    auto place = [&] {
        const double a = uniform(generator), b = uniform(generator), c = uniform(generator);
        if (box == NULL)
            return Vec3d{a*extent, b*extent, c*extent};
        const int i = generator()%5-2, j = generator()%5-2, k = generator()%5-2;
        return Vec3d{(a+i)*box[0]+(b+j)*box[3]+(c+k)*box[6], (b+j)*box[4]+(c+k)*box[7], (c+k)*box[8]};
    };
    Vec3d last = {1, 0, 0}, origin = place();
    for (int chain = 0; chain < chains; chain++) {
        Vec3d node = place(), direction = randomVector(generator);
        if (chain%3 == 0) {
            node = origin+randomVector(generator, diameter);
            direction = last+randomVector(generator, 1e-3);
        }
        origin = node;
        direction = direction*(1/length(direction));
        last = direction;
        const int first = result.x.size()/3;
        const bool closed = chain%5 == 4 && segments > 3;
        for (int s = 0; s < segments; s++) {
            add(result.x, node);
            direction = direction+randomVector(generator, chain%2 == 0 ? 0.002 : 0.2);
            if (closed)
                direction = randomVector(generator);
            direction = direction*(1/length(direction));
            node = node+direction*segment;
        }
        if (!closed)
            add(result.x, node);
        const int radiusClass = chain%4;
        for (int s = 0; s < segments; s++)
            result.system.capsules.push_back({first+s, closed && s == segments-1 ? first : first+s+1,
                    0.5*diameter*(1+0.1*radiusClass), chain, s});
        result.system.chains.push_back({segments, closed, 1+chain%2});
    }
    for (int sphere = 0; sphere < chains; sphere++) {
        result.system.capsules.push_back({(int) result.x.size()/3, -1, 0.3*diameter, -1, 0});
        add(result.x, place());
    }
    // Random order of capsules.
    shuffle(result.system.capsules.begin(), result.system.capsules.end(), generator);
    const int count = result.system.capsules.size();
    for (int i = 0; i < count; i++)
        result.system.exclusions.push_back({(int) (generator()%count), (int) (generator()%count)});
    result.y = result.x;
    normal_distribution<double> normal;
    for (double& coordinate : result.y)
        coordinate += motion*normal(generator);
    return result;
}

#endif /*CYLCHAIN_TEST_CAPSULE_SYSTEMS_H_*/
