// Included into the namespace of an instruction set. It does not compile alone.

/**
 * What kinds of coordinates have in common, and what steps tell them: see Coordinates-inl.h.
 */

/** When the iteration of an implicit step ends. */
struct NewtonLimits {
    /** The largest change of a segment in the last iteration, over its rest length; a fifth of it is left as error. */
    Scalar tolerance = 1e-2;
    /** The most iterations, and how many of them may have all compression of segments in their matrix. */
    int iterations = 14, iterationsWithCompression = 0;
};

/** A segment, as coordinates see it. */
template <class Real> struct SegmentGeometry {
    Vector<Real> difference, tangent;
    Real length, inverse;
};

/** A new segment, and the one between the old nodes and the new. */
template <class Real> struct NewSegmentGeometry : SegmentGeometry<Real> {
    Vector<Real> middleTangent;
    Real middleInverse;
};

/** The friction of an end of a segment: along the segment, and against turning it. */
template <class Real> struct FrictionOfEnd {
    Real along, turning;
};

/** The normal numbers of a place: those of its node and of its segment, where these were drawn. */
template <class Real> struct PlaceNormals {
    Real ofNode[8], ofSegment[8];
};

/** What a kind of coordinates has unless it has something else. */
struct CoordinateDefaults {
    static constexpr bool DRAWS_WITH_NODES = false;
    /** Whether the bends of a model are coordinates of this kind. */
    static constexpr bool bends(BendingModel) {
        return false;
    }
    static void setLimits(NewtonLimits&) {
    }
    struct Factors {};
    template <class State, class Geometry> static CYLCHAIN_INLINE void describeNew(const State&, int, const Geometry&,
                const Geometry&, Factors&) {
    }
    template <class Real> static CYLCHAIN_INLINE Real stiffnessAgainstTurning(const Pack&, int) {
        return Real{};
    }
    template <class State, class Real> static CYLCHAIN_INLINE void measure(const State&, int, Real, Real, Real&) {
    }
    template <class State, class Vec> static CYLCHAIN_INLINE void findExcessiveChange(const State&, const Vec*, int,
                bool*) {
    }
};

/** Coordinates of a node, by its number. */
struct OnNodes : CoordinateDefaults {
    static CYLCHAIN_INLINE bool isAt(const Pack&, int) {
        return true;
    }
};

/** Coordinates of a segment s, between the nodes s and s+1. */
struct OnSegments : CoordinateDefaults {
    static CYLCHAIN_INLINE bool isAt(const Pack& pack, int s) {
        return s < pack.segments;
    }
};

/** Coordinates of the joint between segments s-1 and s. The last two segments of a ring that is unrolled have one. */
struct OnJoints : CoordinateDefaults {
    static CYLCHAIN_INLINE bool isAt(const Pack& pack, int s) {
        return s > 0 && s < pack.nodes-1;
    }
};

/** Factors of one kind among those of all. */
template <class Kind> struct FactorsOf {
    typename Kind::Factors own;
};
