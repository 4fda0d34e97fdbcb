// Included into the namespace of an instruction set. It does not compile alone.

/**
 * With all of theta, modes that a step just resolves decay too slowly. With less, the fastest ones change their sign
 * from step to step, by (1-theta)/theta of themselves, which is forgotten after a few.
 */
const Scalar LARGEST_THETA_OF_LINEAR_BENDS = 0.8;
/** The least cosine of the angle by which a segment of such a chain may turn in a step. */
const Scalar LEAST_COSINE = -0.9;

static_assert(countWhere<BendingModel>(isLinear) == 1, "Linear bends have the formulas of one model");

/** Bends b = u2-u1 of the vectors of segments: the model BondDifference. */
template <int W> struct LinearBends : OnJoints {
    typedef typename Lanes<W>::Type Real;
    typedef Vector<Real> Vec;
    typedef Matrix<Real> Mat;
    typedef ImplicitState<W> State;
    typedef NewSegmentGeometry<Real> NewGeometry;
    static constexpr bool bends(BendingModel model) {
        return isLinear(model);
    }
    static CYLCHAIN_INLINE bool isIn(const Pack& pack) {
        return bends(pack.bending);
    }
    /** The bend that alternates from node to node has four times the bend of a node, and relaxes as sixteen of them. */
    static void describe(const State& step, int s) {
        const Pack& pack = step.pack;
        ImplicitSegment<Real>& segment = step.segments[s];
        segment.bend = segment.difference-step.segments[s-1].difference;
        segment.randomBend = Vec {};
        const Real inverse = property<Real>(pack, s, Pack::InverseRestLength);
        const Real friction = loaded<Real>(pack.nodeFriction, 0)+
                4*inverse*inverse*property<Real>(pack, s, Pack::Rotational);
        const Real bendRate = 16*step.h*property<Real>(pack, s, Pack::Joint)+TINY;
        segment.jointTheta = lesser<Real>(splat<Real>(LARGEST_THETA_OF_LINEAR_BENDS),
                larger<Real>(splat<Real>(0.5), 1-friction/bendRate));
    }
    static constexpr bool DRAWS_WITH_NODES = true;
    /** Such a bend is Gaussian. */
    static void draw(const State& step, const NoisePlaces<W>&, const PlaceNormals<Real>& normals, int s) {
        const Real stiffness = property<Real>(step.pack, s, Pack::Joint);
        const Real deviation = stiffness > 0 ? root(step.kT/(stiffness+TINY)) : Real{};
        step.segments[s].randomBend = nodeNoise<Real>(normals.ofNode+4, step.pack.planar)*deviation;
    }
    static CYLCHAIN_INLINE void prepare(const State& step, const Vec* y, int s) {
        prepareBend(step, s, [&] {
            const Vec before = step.segments[s-1].difference+(y[s]-y[s-1]);
            const Vec behind = step.segments[s].difference+(y[s+1]-y[s]);
            return (behind-before)*splat<Real>(1-DIAGONAL);
        });
    }
    /**
     * Newton's method leaves less of a change as an error where bends are linear. These leave the matrix regular under
     * nearly all compression, so that it may have all of it; where that has not converged, compression counts no more.
     */
    static void setLimits(NewtonLimits& limits) {
        limits = {3e-2, 20, 5};
    }
    template <class Factors, class Row> static void add(const State& step, int s, const Factors&,
                const NewGeometry& geometry1, const NewGeometry& geometry2, Row& before, Row& here, Row& after) {
        const ImplicitSegment<Real>& segment = step.segments[s];
        const Real stiffness = property<Real>(step.pack, s, Pack::Joint);
        const Vec bend = geometry2.difference-geometry1.difference;
        const Vec force = (bend*segment.jointImplicit+segment.constantBend-segment.turningBend)*stiffness;
        before.right = before.right-force;
        here.right = here.right+force+force;
        after.right = after.right-force;
        const Real scale = stiffness*segment.jointImplicit, twice = scale+scale;
        before.diagonal.addDiagonal(scale);
        here.diagonal.addDiagonal(twice+twice);
        after.diagonal.addDiagonal(scale);
        before.second = Mat::diagonal(scale);
        before.upper = before.upper-Mat::diagonal(twice);
        here.upper = here.upper-Mat::diagonal(twice);
    }
    /** Such bends hold segments that are much shorter than what tension straightens. */
    template <class> static CYLCHAIN_INLINE Real stiffnessAgainstTurning(const Pack& pack, int s) {
        return property<Real>(pack, s, Pack::Joint)+property<Real>(pack, s+1, Pack::Joint);
    }
    /** All that is needed is a direction half-way, which a turn by 150 degrees leaves. */
    static CYLCHAIN_INLINE void findExcessiveChange(const State& step, const Vec* y, int s, bool* failed) {
        const Pack& pack = step.pack;
        const Vec before = step.segments[s].difference, after = before+(y[s+1]-y[s]);
        Real excess = root(before.dot(before)*after.dot(after))*LEAST_COSINE-before.dot(after);
        for (int i = 0; i < W; i++)
            failed[i] |= s < pack.segmentsOfLane[i] && !(lane(excess, i) < 0);
    }
    static CYLCHAIN_INLINE void addForces(const Pack& pack, int s, const SegmentGeometry<Real>& geometry1,
            const SegmentGeometry<Real>& geometry2, Vec* f, ChainEnergy* energy) {
        const Vec bend = geometry2.difference-geometry1.difference, force = bend*property<Real>(pack, s, Pack::Joint);
        f[s-1] = f[s-1]-force;
        f[s] = f[s]+force+force;
        f[s+1] = f[s+1]-force;
        for (int i = 0; i < W && energy != NULL; i++) {
            Real own = bend.dot(force);
            if (s < pack.nodesOfLane[i]-1)
                energy->bending += 0.5*lane(own, i);
        }
    }
};
