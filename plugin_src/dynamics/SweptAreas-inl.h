// Included into the namespace of an instruction set. It does not compile alone.

/**
 * Areas on the unit sphere that the joints of a chain sweep, by which the angles between frames that are carried along
 * change. Numbers may be those of packs, or doubles.
 */

/** Whether a comparison holds in all lanes: the words of its result, or that of two numbers. */
template <class Mask> CYLCHAIN_INLINE bool inAllLanes(const Mask& holds) {
    std::uint64_t words[sizeof(Mask)/8], all = -1;
    std::memcpy(words, &holds, sizeof(Mask));
    for (std::uint64_t word : words)
        all &= word;
    return all == std::uint64_t(-1);
}
CYLCHAIN_INLINE bool inAllLanes(bool holds) {
    return holds;
}

/** The angle whose tangent is within 0.2, to rounding there. */
template <class Real> CYLCHAIN_INLINE Real arctangent(Real tangent) {
    constexpr int most = sizeof(NumberOf<Real>) == sizeof(double) ? 19 : 7;
    const Real square = tangent*tangent;
    Real result = splat<Real>(1.0/(most+2));
#pragma GCC unroll 10
    for (int k = most; k > 0; k -= 2)
        result = splat<Real>(1.0/k)-square*result;
    return result*tangent;
}

/** The angle of a complex number x+iy, in (-pi, pi). */
template <class Real> CYLCHAIN_INLINE Real argument(Real x, Real y) {
    const Real zero = Real{}, tangent = y/x;
    const Real square = x > zero ? tangent*tangent : splat<Real>(1);
    if (inAllLanes(square < splat<Real>(0.04)))
        return arctangent<Real>(tangent);
    // Of an angle within pi/4, half of what it is beyond pi/8.
    const Real tangentOfEighth = splat<Real>(M_SQRT2-1);
    const Real across = y < zero ? -y : y, along = x < zero ? -x : x;
    const Real least = lesser<Real>(across, along), most = larger<Real>(across, along)+TINY;
    const Real beyond = (least-tangentOfEighth*most)/(most+tangentOfEighth*least);
    Real angle = splat<Real>(M_PI/8)+2*arctangent<Real>(beyond/(1+root(1+beyond*beyond)));
    angle = across > along ? splat<Real>(M_PI/2)-angle : angle;
    angle = x < zero ? splat<Real>(M_PI)-angle : angle;
    return y < zero ? -angle : angle;
}

/** A vector, of whose direction a joint has the area, and its length. */
template <class Real> struct SweptVector {
    Vector<Real> vector;
    Real length;
};

/**
 * The area on the unit sphere that the great circle from a to b sweeps as it moves to that from newA to newB: positive
 * if a, b, newB, newA go around it counterclockwise, as seen from outside.
 */
template <class Real> CYLCHAIN_INLINE Real sweptArea(const SweptVector<Real>& a, const SweptVector<Real>& b,
        const SweptVector<Real>& newA, const SweptVector<Real>& newB) {
    // The sum of two triangles.
    const Real across = a.length*newB.length+a.vector.dot(newB.vector);
    const Real x1 = b.length*across+newB.length*a.vector.dot(b.vector)+a.length*b.vector.dot(newB.vector);
    const Real y1 = a.vector.dot(crossProduct(b.vector, newB.vector));
    const Real x2 = newA.length*across+a.length*newA.vector.dot(newB.vector)+newB.length*a.vector.dot(newA.vector);
    const Real y2 = a.vector.dot(crossProduct(newB.vector, newA.vector));
    return 2*argument<Real>(x1*x2-y1*y2, x1*y2+x2*y1);
}

/** The same for unit vectors. */
template <class Real> CYLCHAIN_INLINE Real sweptArea(const Vector<Real>& a, const Vector<Real>& b,
        const Vector<Real>& newA, const Vector<Real>& newB) {
    const Real one = splat<Real>(1);
    return sweptArea<Real>({a, one}, {b, one}, {newA, one}, {newB, one});
}

/**
 * Find the areas that the joints of a pack sweep in a step, in double precision: an error would stay in the twists, and
 * sums of areas along a chain are what its linking number is kept by.
 *
 * @param directions  those of the frames beyond ends, [end][axis][lane]
 * @param y           how far nodes move
 * @param areas       receives those of the joint at each node
 */
template <int W, bool CLOSED> void findSweptAreas(const Pack& pack, const std::vector<double>& directions,
            const StepStart<W>& start, const Vector<typename Lanes<W>::Type>* y, typename DoubleLanes<W>::Type* areas) {
    constexpr int REGISTERS = DoubleLanes<W>::REGISTERS;
    typedef typename DoubleLanes<W>::Type Real;
    typedef Vector<Real> Vec;
    typedef SweptVector<Real> Swept;
    auto withLength = [] (const Vec& vector) -> Swept {
        return {vector, root(vector.dot(vector))};
    };
    bool isFilledUp = false;
    for (int i = 0; i < W; i++)
        isFilledUp |= pack.chain[i] >= 0 && pack.segmentsOfLane[i] < pack.segments;
    for (int part = 0; part < REGISTERS; part++) {
        auto loadedPart = [&] (const std::vector<double>& values, int row) {
            return loaded<Real>(values, row*REGISTERS+part);
        };
        Real own;
        for (int i = 0; i < LANE_COUNT<Real>; i++)
            lane(own, i) = pack.segmentsOfLane[part*LANE_COUNT<Real>+i];
        Swept ends[2] = {};
        for (int end = 0; end < 2; end++)
            ends[end] = {{loadedPart(directions, 3*end), loadedPart(directions, 3*end+1),
                    loadedPart(directions, 3*end+2)}, splat<Real>(1)};
        auto withEnd = [&] (int s, const Swept& swept) -> Swept {
            if (!isFilledUp)
                return swept;
            // Behind the last segment of a chain is its frame.
            const Real number = splat<Real>(s);
            const Vec &vector = swept.vector, &end = ends[1].vector;
            return {{number < own ? vector.x : end.x, number < own ? vector.y : end.y,
                    number < own ? vector.z : end.z}, number < own ? swept.length : ends[1].length};
        };
        Swept a = ends[0], newA = ends[0];
        Vec moved = {}, newMoved = {};
        for (int s = -1; s <= pack.segments; s++) {
            Swept b = ends[1], newB = ends[1];
            if (s < pack.segments || CLOSED) {
                const Vec before = moved, newBefore = newMoved;
                // What is added to positions, to the bit.
                Vector<typename Lanes<W>::Type> sum = y[s+1];
                if (start.moved != NULL) {
                    sum = start.moved[s+1]+sum;
                    moved = inDouble<W>(start.moved[s+1], part);
                }
                newMoved = inDouble<W>(sum, part);
                if (s < 0)
                    continue;
                const Vec vector = start.exact[s*REGISTERS+part];
                b = withEnd(s, withLength(vector+(moved-before)));
                newB = withEnd(s, withLength(vector+(newMoved-newBefore)));
            }
            const bool isJoint = !CLOSED || s > 0 || pack.twist.isBentAtRest();
            areas[s*REGISTERS+part] = isJoint ? sweptArea<Real>(a, b, newA, newB) : Real{};
            a = b;
            newA = newB;
        }
    }
}
