// Included into the namespace of an instruction set. It does not compile alone.

/**
 * What single segments and nodes add to the linear equations of an iteration of an implicit step: friction, lengths and
 * the drag of the flow. It is the same in open chains and in rings.
 */

template <int W> class SegmentEquations {
    typedef typename Lanes<W>::Type Real;
    typedef Vector<Real> Vec;
public:
    typedef NewSegmentGeometry<Real> Geometry;
    explicit SegmentEquations(const ImplicitState<W>& step) : step(step), pack(step.pack), settings(step.settings),
            n(step.n), h(step.h), segments(step.segments), x(step.start.nodes), loads(step.loads) {
    }
    /** From now on, an iteration is linearised. */
    void begin(int iteration) {
        compressed = iteration < Coordinates<W>::limitsOf(pack).iterationsWithCompression;
    }
    CYLCHAIN_INLINE void describeNew(const Vec* y, int s, Geometry& geometry) const {
        geometry.difference = segments[s].difference+(y[s+1]-y[s]);
        const Vec middle = (segments[s].difference+geometry.difference)*splat<Real>(0.5);
        const Real length = root(geometry.difference.dot(geometry.difference)), middleLength = root(middle.dot(middle));
        // Divisions take longer than all the rest.
        const Real both = 1/(length*middleLength);
        geometry.length = length;
        geometry.inverse = both*middleLength;
        geometry.middleInverse = both*length;
        geometry.tangent = geometry.difference*geometry.inverse;
        geometry.middleTangent = middle*geometry.middleInverse;
    }
    /**
     * Add a segment to the equations of its nodes. It is the first to do so for all but the first one's diagonal.
     *
     * @param band  takes the equation of the tension
     */
    template <class Band, class Row> CYLCHAIN_INLINE void addSegment(const Vec* y, int s, const Geometry& geometry,
                Band& band, Row& here, Row& after) const {
        const FrictionOfEnd<Real> friction = addFriction(y, s, geometry, here, after);
        Coordinates<W>::template add<OnSegments>(step, s, geometry, friction, compressed, band, here, after);
        // Both ends have the same block.
        here.diagonal.add(after.diagonal);
    }
    template <class Row> void addNodeFriction(const Vec* y, int node, Row& row) const {
        const Real friction = loaded<Real>(pack.nodeFriction, 0)*(1/h);
        row.diagonal.addDiagonal(friction);
        row.right = row.right-y[node]*friction;
    }
    /**
     * Add the drag of the flow, at the middle of the step, on segments at rest. Its part along a segment is a tension.
     */
    void addDragOfFlow(const Vec* y) const {
        const LaneFlow<W> flow(settings.flow, pack.planar, x[0]);
        const Real share = splat<Real>(step.shareOfForces());
        const Real ofNode = loaded<Real>(pack.nodeFriction, 0)*share;
        for (int node = 0; node < n; node++) {
            loads[node] = step.f[node];
            if (node < pack.ownNodes())
                loads[node] = loads[node]+flow.at(x[node]+y[node]*splat<Real>(0.5))*ofNode;
        }
        for (int s = 0; s < pack.segments; s++) {
            Vec carried, pair;
            findDragOfFlow(flow, y, s, carried, pair);
            loads[s] = loads[s]+(carried-pair)*share;
            loads[s+1] = loads[s+1]+(carried+pair)*share;
        }
    }
    /**
     * The drag of the flow on a segment: what each end gets, and what the second one has more and the first one less.
     */
    CYLCHAIN_INLINE void findDragOfFlow(const LaneFlow<W>& flow, const Vec* y, int s, Vec& carried, Vec& pair) const {
        Geometry geometry;
        describeNew(y, s, geometry);
        const Vec direction = geometry.middleTangent;
        const Vec u1 = flow.at(x[s]+y[s]*splat<Real>(0.5)), u2 = flow.at(x[s+1]+y[s+1]*splat<Real>(0.5));
        const Vec sum = u1+u2, difference = u2-u1;
        const Real across = 0.25*property<Real>(pack, s, Pack::Perpendicular);
        const Real along = 0.25*property<Real>(pack, s, Pack::Parallel);
        const Real turn = property<Real>(pack, s, Pack::Rotational)*turningFactor(s, geometry);
        const Real stretch = property<Real>(pack, s, Pack::Extensional)*segments[s].inverse*geometry.inverse;
        carried = sum*across+direction*((along-across)*direction.dot(sum));
        pair = (difference-direction*direction.dot(difference))*turn;
        segments[s].tensionOfFlow = stretch*direction.dot(difference)*step.shareOfForces();
    }
private:
    const ImplicitState<W>& step;
    const Pack& pack;
    const StepSettings& settings;
    const int n;
    const Scalar h;
    ImplicitSegment<Real>* const segments;
    const Vec* const x;
    Vec* const loads;
    /** Whether all compression of segments is in the matrix. */
    bool compressed = false;

    /** Add the friction of a segment, and return that of an end. Its first node shall get the second one's block. */
    template <class Row> CYLCHAIN_INLINE FrictionOfEnd<Real> addFriction(const Vec* y, int s,
                const Geometry& geometry, Row& here, Row& after) const {
        const Vec direction = geometry.middleTangent;
        const Real acrossTrans = 0.25*property<Real>(pack, s, Pack::Perpendicular);
        const Real alongTrans = 0.25*property<Real>(pack, s, Pack::Parallel);
        const Real acrossTurn =
                (property<Real>(pack, s, Pack::Rotational)+segments[s].extra)*turningFactor(s, geometry);
        const Scalar perStep = 1/h;
        const Real sameAcross = (acrossTrans+acrossTurn)*perStep, otherAcross = (acrossTrans-acrossTurn)*perStep;
        const Real along = alongTrans*perStep;
        const Vec first = y[s], second = y[s+1];
        const Vec axial1 =
                direction*((along-sameAcross)*direction.dot(first)+(along-otherAcross)*direction.dot(second));
        const Vec axial2 =
                direction*((along-sameAcross)*direction.dot(second)+(along-otherAcross)*direction.dot(first));
        after.diagonal = Symmetric<Real> {};
        after.diagonal.addAxial(sameAcross, along-sameAcross, direction);
        here.upper = Matrix<Real>::axial(otherAcross, along-otherAcross, direction);
        here.right = here.right-first*sameAcross-second*otherAcross-axial1;
        after.right = loads[s+1]-second*sameAcross-first*otherAcross-axial2;
        return {alongTrans, acrossTurn};
    }
    /**
     * The friction of a segment's ends against turning, over its rotational friction. A turn by phi obeys
     * 2 sin(phi/2) = A cos^(1/2)(phi/2) with Gaussian A then, which diffuses as it should to second order in the step.
     * Of cos^(1/2), what is left out is of the sixth order in phi. Like all of the friction, it is that of the middle
     * of the step in what it depends on, here the length; otherwise soft lengths would lack a part of the drift.
     */
    CYLCHAIN_INLINE Real turningFactor(int s, const Geometry& geometry) const {
        const ImplicitSegment<Real>& segment = segments[s];
        const Real squareOfSine = 0.5-0.5*segment.tangent.dot(geometry.tangent);
        return (1-squareOfSine*(0.25+0.09375*squareOfSine))*(segment.inverse*geometry.inverse);
    }
};
