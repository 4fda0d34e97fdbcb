/**
 * Forces of capsules that touch each other: see evaluate() of couplings/ContactSearch.h, for positions that are those of
 * the start and of the end, and couplings/CapsuleGeometry.h.
 */

/** Those of couplings/ContactPlaces.cpp. */
#define LARGEST_PARALLEL 1e-3
#define AT_END 1e-9
#define LEAST_DIFFERENCE 1e-10

/** Two segments: p along a, q along b, w from the first end of b to that of a. */
typedef struct {Vector p, q, w;} SegmentPair;

/** Fractions along both, and the square of the distance of the points there. */
typedef struct {double s, t, squared;} NearestPoints;

/** Where two segments touch. */
typedef struct {int count; double s[2], t[2], distance;} TouchingPlaces;

inline DEVICE double clampToUnit(double fraction) {
    return fraction > 0 ? fmin(fraction, 1.0) : 0.0;
}

/** What is at an end but for rounding is there. */
inline DEVICE double takenToEnd(double fraction) {
    return fraction < AT_END ? 0.0 : fraction > 1-AT_END ? 1.0 : fraction;
}

/** The fraction of a segment that is nearest to a point, which is at -w from its first end; 0 if it has no length. */
inline DEVICE double nearestFraction(Vector along, Vector w) {
    const double square = product(along, along);
    return square > 0 ? clampToUnit(-product(along, w)/square) : 0.0;
}

/** From the point at fraction t of b to that at s of a. */
inline DEVICE Vector betweenPoints(SegmentPair pair, double s, double t) {
    return pair.w+pair.p*s-pair.q*t;
}

DEVICE NearestPoints findNearestPoints(SegmentPair pair) {
    const double a = product(pair.p, pair.p), b = product(pair.p, pair.q), e = product(pair.q, pair.q);
    const double c = product(pair.p, pair.w), f = product(pair.q, pair.w), determinant = a*e-b*b;
    NearestPoints nearest;
    nearest.s = 0;
    if (determinant > 0) {
        nearest.s = clampToUnit((b*f-c*e)/determinant);
        nearest.t = (b*nearest.s+f)/e;
        if (!(nearest.t > 0)) {
            nearest.t = 0;
            nearest.s = clampToUnit(-c/a);
        }
        else if (nearest.t > 1) {
            nearest.t = 1;
            nearest.s = clampToUnit((b-c)/a);
        }
    }
    else
        nearest.t = nearestFraction(pair.q, pair.w*-1.0);
    Vector r = betweenPoints(pair, nearest.s, nearest.t);
    nearest.squared = product(r, r);
    // Where the equations are nearly singular, rounding spoils their solution, and an end is as near.
    if (!(determinant > 1e-6*a*e))
        for (int i = 0; i < 4; i++) {
            const double end = i&1;
            const double s = i < 2 ? end : nearestFraction(pair.p, pair.w-pair.q*end);
            const double t = i < 2 ? nearestFraction(pair.q, (pair.w+pair.p*end)*-1.0) : end;
            r = betweenPoints(pair, s, t);
            if (product(r, r) < nearest.squared) {
                nearest.s = s;
                nearest.t = t;
                nearest.squared = product(r, r);
            }
        }
    return nearest;
}

/** Where segments are nearest to each other, or if they are nearly parallel, both ends of their overlap. */
DEVICE TouchingPlaces findPlaces(SegmentPair pair) {
    const NearestPoints nearest = findNearestPoints(pair);
    TouchingPlaces places;
    places.count = 1;
    places.s[0] = takenToEnd(nearest.s);
    places.t[0] = takenToEnd(nearest.t);
    places.s[1] = places.t[1] = 0;
    places.distance = sqrt(nearest.squared);
    const double a = product(pair.p, pair.p), b = product(pair.p, pair.q), e = product(pair.q, pair.q);
    if (a > 0 && e > 0 && a*e-b*b < LARGEST_PARALLEL*a*e) {
        // The ends of b, as fractions of a.
        const double c = product(pair.p, pair.w), f = product(pair.q, pair.w), first = -c/a, second = (b-c)/a;
        const double lower = fmax(0.0, fmin(first, second)), upper = fmin(1.0, fmax(first, second));
        if (upper > lower) {
            places.count = 2;
            for (int i = 0; i < 2; i++) {
                const double s = i == 0 ? lower : upper;
                places.s[i] = takenToEnd(s);
                places.t[i] = s == first ? 0 : s == second ? 1 : takenToEnd(clampToUnit((b*s+f)/e));
            }
        }
    }
    return places;
}

/** A unit vector across both segments, or across one of them if they are parallel or the other has no length. */
inline DEVICE Vector normalAcross(SegmentPair pair, int side) {
    Vector normal = crossProduct(pair.p, pair.q)*(side < 0 ? -1.0 : 1.0);
    if (!(product(normal, normal) > 0)) {
        const Vector along = product(pair.p, pair.p) > 0 ? pair.p : pair.q;
        const double x = fabs(along.x), y = fabs(along.y), z = fabs(along.z);
        normal = crossProduct(along, make_double3(x <= y && x <= z ? 1 : 0, y < x && y <= z ? 1 : 0,
                z < x && z < y ? 1 : 0));
    }
    const double square = product(normal, normal);
    return square > 0 ? normal*(1/sqrt(square)) : make_double3(1, 0, 0);
}

/**
 * Get whether a contact belongs to its pair, or to a neighbor of a, or of b, in its chain.
 *
 * @param own   the particles of the pair: those of a, those of b, and of either the one before it and the one behind
 *              it, or -1 where no neighbor can have the contact
 */
DEVICE int isOwned(double s, double t, double gap, double sum, int isParallel, int ofA, SegmentPair pair,
        GLOBAL const int* RESTRICT own, GLOBAL const double* RESTRICT positions) {
    const double fraction = ofA ? s : t, least = LEAST_DIFFERENCE*(sum+fabs(gap));
    const Vector ownAlong = ofA ? pair.p : pair.q, otherAlong = ofA ? pair.q : pair.p;
    const int first = ofA ? 0 : 2;
    for (int atEnd = 0; atEnd < 2; atEnd++) {
        const int far = own[4+first+atEnd], atJoint = fraction == (double) atEnd;
        if (far < 0 || (isParallel && !atJoint))
            continue;
        // From the joint into the neighbor, and from the other capsule to the joint.
        const Vector into = positionOfParticle(positions, far)-positionOfParticle(positions, own[first+atEnd]);
        const Vector joint = (ofA ? pair.w : pair.w*-1.0)+ownAlong*(double) atEnd;
        const Vector fromOther = joint-otherAlong*nearestFraction(otherAlong, joint*-1.0);
        const double distance = sqrt(product(fromOther, fromOther));
        if (!atJoint && product(fromOther, into) >= 0 && distance-sum > gap+2*least)
            continue;
        const Vector beside = atEnd ? into : into*-1.0;
        SegmentPair other = pair;
        if (ofA) {
            other.p = beside;
            other.w = atEnd ? pair.w+pair.p : pair.w-beside;
        }
        else {
            other.q = beside;
            other.w = atEnd ? pair.w-pair.q : pair.w+beside;
        }
        const TouchingPlaces places = findPlaces(other);
        int endsThere = 0;
        if (places.count == 2)
            for (int i = 0; i < 2; i++)
                endsThere = endsThere || (ofA ? places.s[i] : places.t[i]) == (double) (1-atEnd);
        if (endsThere) {
            // The neighbor has a contact at the joint.
            if (isParallel ? !atEnd : !(gap < distance-sum-least))
                return 0;
            continue;
        }
        const double gapBeside = places.distance-sum;
        // What differs by rounding is equal. Then the one that ends there counts.
        if (isParallel || atEnd ? gapBeside < gap-least : !(gap < gapBeside-least))
            return 0;
    }
    return 1;
}

/** Count the particles that have moved by a distance or more since their positions were taken note of. */
KERNEL void countMoved(int count, double square, GLOBAL const double* RESTRICT positions,
        GLOBAL const double* RESTRICT before, GLOBAL mm_ulong* RESTRICT summary) {
    for (int i = GLOBAL_ID; i < count; i += GLOBAL_SIZE) {
        const Vector moved = positionOfParticle(positions, i)-positionOfParticle(before, i);
        // NaN has moved.
        if (!(product(moved, moved) < square))
            ATOMIC_ADD(&summary[0], (mm_ulong) 1);
    }
}

/** Find the forces and energies of pairs of capsules. */
KERNEL void computeContacts(int count, int includesForces, double stiffness, int paddedNumAtoms,
        GLOBAL mm_ulong* RESTRICT forceBuffers, GLOBAL const int* RESTRICT images, GLOBAL int* RESTRICT marks,
        GLOBAL const double* RESTRICT positions, GLOBAL const int* RESTRICT pairs,
        GLOBAL const double* RESTRICT numbers, GLOBAL double* RESTRICT energies) {
    for (int i = GLOBAL_ID; i < count; i += GLOBAL_SIZE) {
        GLOBAL const int* own = pairs+i*NUM_CONTACT_ENDS;
        GLOBAL const double* number = numbers+(size_t) i*NUM_CONTACT_NUMBERS;
        const Vector a = positionOfParticle(positions, own[0]), b = positionOfParticle(positions, own[2]);
        const double sum = number[CONTACT_RADII];
        SegmentPair pair;
        pair.p = positionOfParticle(positions, own[1])-a;
        pair.q = positionOfParticle(positions, own[3])-b;
        pair.w = a-b+make_double3(number[CONTACT_SHIFT], number[CONTACT_SHIFT+1], number[CONTACT_SHIFT+2]);
        energies[i] = 0;
        const TouchingPlaces places = findPlaces(pair);
        if (places.distance-sum >= 0)
            continue;
        const double k = stiffness/places.count;
        for (int place = 0; place < places.count; place++) {
            const double s = places.s[place], t = places.t[place];
            const Vector r = betweenPoints(pair, s, t);
            const double length = sqrt(product(r, r)), gap = length-sum;
            if (gap >= 0 || !isOwned(s, t, gap, sum, places.count == 2, 1, pair, own, positions) ||
                    !isOwned(s, t, gap, sum, places.count == 2, 0, pair, own, positions))
                continue;
            energies[i] += 0.5*k*gap*gap;
            if (!includesForces)
                continue;
            const Vector normal = length > 0 ? r*(1/length) : normalAcross(pair, own[CONTACT_SIDE]);
            const Vector force = normal*(-k*gap);
            addToParticle(own[0], force*(1-s), paddedNumAtoms, forceBuffers, images, marks);
            addToParticle(own[1], force*s, paddedNumAtoms, forceBuffers, images, marks);
            addToParticle(own[2], force*(t-1), paddedNumAtoms, forceBuffers, images, marks);
            addToParticle(own[3], force*-t, paddedNumAtoms, forceBuffers, images, marks);
        }
    }
}
