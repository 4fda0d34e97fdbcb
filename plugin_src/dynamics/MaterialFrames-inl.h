// Included into the namespace of an instruction set. It does not compile alone.

/**
 * Directions across chains, and how they are carried along: see ChainTwist.h.
 */

/** Whether there are packs with bends at rest: in double precision alone. */
constexpr bool HAS_BENDS_AT_REST = sizeof(Scalar) == sizeof(double);

/** A vector that is orthogonal to a unit vector, carried over to another one by parallel transport. */
template <class Real> CYLCHAIN_INLINE Vector<Real> transported(const Vector<Real>& vector, const Vector<Real>& from,
        const Vector<Real>& to) {
    return vector-(from+to)*(vector.dot(to)/(1+from.dot(to)+TINY));
}

/** The cosine and the sine of an angle. */
template <class Real> CYLCHAIN_INLINE void findCosineAndSine(const Real& angle, Real& cosine, Real& sine) {
    Real copy = angle;
    for (int i = 0; i < LANE_COUNT<Real>; i++) {
        lane(cosine, i) = std::cos(lane(copy, i));
        lane(sine, i) = std::sin(lane(copy, i));
    }
}

/**
 * Carry the frame of the first segment along chains.
 *
 * @param tangentOf  the direction of a segment
 * @param twists     by how much joints are twisted more than at rest
 * @param use        is called for each joint between two segments, with its number, the directions of both, its
 *                   bisector, and the first axis of the material half-way over it
 */
template <int W, class TangentOf, class Use> void carryFrames(const Pack& pack, const TangentOf& tangentOf,
        const typename Lanes<W>::Type* twists, const Use& use) {
    typedef typename Lanes<W>::Type Real;
    typedef Vector<Real> Vec;
    const PackTwist<Scalar>& twist = pack.twist;
    const Vec beyond = {loaded<Real>(twist.directions, 0), loaded<Real>(twist.directions, 1),
            loaded<Real>(twist.directions, 2)};
    Vec axis, other, tangent = tangentOf(0);
    Real cosine, sine;
    orthogonal(beyond, axis, other);
    axis = transported(axis, beyond, tangent);
    findCosineAndSine<Real>(twists[0], cosine, sine);
    axis = axis*cosine+crossProduct(tangent, axis)*sine;
    for (int s = 1; s < pack.segments+(pack.closed ? 1 : 0); s++) {
        const Vec before = tangent;
        tangent = tangentOf(s);
        const Vec sum = before+tangent, bisector = sum*(1/root(sum.dot(sum)+TINY));
        findCosineAndSine<Real>(0.5*(twists[s]+loaded<Real>(twist.rest, s)), cosine, sine);
        axis = transported(axis, before, bisector);
        axis = axis*cosine+crossProduct(bisector, axis)*sine;
        use(s, before, tangent, bisector, axis);
        axis = axis*cosine+crossProduct(bisector, axis)*sine;
        axis = transported(axis, bisector, tangent);
    }
}
