// Included into the namespace of an instruction set. It does not compile alone.

/**
 * The linear equations of an iteration of an implicit step, and their solution by elimination along chains.
 */

template <int W, bool CLOSED> class ImplicitEquations {
    typedef typename Lanes<W>::Type Real;
    typedef Vector<Real> Vec;
    typedef Matrix<Real> Mat;
    typedef TensionBand<W, CLOSED> Band;
public:
    typedef typename Band::Row Row;
    typedef typename Band::Memory Memory;
    typedef NewSegmentGeometry<Real> Geometry;
    typedef typename Elements<W>::Factors Factors;
    ImplicitEquations(const ImplicitState<W>& step, Memory& memory) : step(step), pack(step.pack),
            settings(step.settings), n(step.n), h(step.h), segments(step.segments), x(step.start.nodes),
            loads(step.loads), change(step.change), band(pack, memory) {
    }
    /**
     * Linearise the equations around y, and eliminate the nodes from first to last.
     *
     * @param iteration  how many there were before
     */
    void eliminate(const Vec* y, int iteration) {
        compressed = iteration < Elements<W>::limitsOf(pack).iterationsWithCompression;
        if (settings.flow.present)
            addDragOfFlow(y);
        Row rows[3];
        Row *before = rows, *here = rows+1, *after = rows+2;
        // Roots and divisions take long: those of the segment ahead come before the node is eliminated.
        Geometry previous = {}, current, ahead;
        Factors factors = {}, factorsAhead = {};
        int term = 0;
        band.begin();
        *here = Row {};
        here->right = loads[0];
        describeNew(y, 0, ahead);
        for (int s = 0; s < n-1; s++) {
            if constexpr (CLOSED)
                *after = Row {};
            current = ahead;
            factors = factorsAhead;
            if (s+3 < n)
                prefetch(&segments[s+2]);
            if (!CLOSED || s < pack.segments)
                addSegment(y, s, current, *here, *after);
            else {
                // The last segment of a ring that is unrolled is there for its joint alone.
                here->upper = Mat {};
                after->diagonal = Symmetric<Real> {};
                after->right = loads[s+1];
            }
            Elements<W>::template add<OnNodes>(step, s, y, *here);
            if (numTerms > 0)
                addTerms(s, term, *here, *after);
            if (pack.hasNodeFriction && s < pack.ownNodes())
                addNodeFriction(y, s, *here);
            if (s > 0)
                Elements<W>::template add<OnJoints>(step, s, factors, previous, current, *before, *here, *after);
            if (s < n-2) {
                describeNew(y, s+1, ahead);
                Elements<W>::describeNew(step, s+1, current, ahead, factorsAhead);
            }
            if (s > 0)
                band.template eliminate<2>(s-1, *before, *here, *after);
            previous = current;
            Row* const free = before;
            before = here;
            here = after;
            after = free;
        }
        if constexpr (CLOSED)
            band.close(*before, *here);
        else {
            Elements<W>::template add<OnNodes>(step, n-1, y, *here);
            if (pack.hasNodeFriction)
                addNodeFriction(y, n-1, *here);
            band.template eliminate<1>(n-2, *before, *here, *after);
            band.template eliminate<0>(n-1, *here, *after, *before);
        }
    }
    /** Find the changes of y and the tensions, or add to them. */
    template <Goal GOAL> void substitute() {
        band.template substitute<GOAL>(change, [&] (int s, Real tension) {
            ImplicitSegment<Real>& segment = segments[s];
            segment.multiplier = tension+segment.shift*segment.newTangent.dot(change[s+1]-change[s]);
        });
    }
    /** Let the change of tensions act along the mean direction as well, with the same elimination. */
    void refine() {
        band.setForces([&] (int s) {
            return segments[s].turned*(segments[s].multiplier-segments[s].multiplierBefore);
        });
        substitute<Goal::Add>();
    }
    /** From now on, the equations have the terms of couplings, in the order of their nodes. */
    void setTerms(const CouplingTerm* others, int count) {
        terms = others;
        numTerms = count;
    }
    /** Find how forces on nodes move nodes, with the same elimination. See TensionBand for those of rings. */
    void respond(const Vec* forces, Vec* moves) {
        band.setForcesOnNodes(forces);
        band.template substitute<Goal::Nodes>(moves, [] (int, Real) {});
    }
    /**
     * Set forces on nodes that come from couplings with other chains, or NULL for none. They are no part of the right
     * side that eliminate() gathers.
     */
    void setForcesOfOthers(const Vec* forces) {
        forcesOfOthers = forces;
    }
    /** Add what these forces do to the changes of y and of the tensions. */
    void addForcesOfOthers() {
        if (forcesOfOthers == NULL)
            return;
        band.setForcesOnNodes(forcesOfOthers);
        substitute<Goal::Add>();
    }
    /** See TensionBand. */
    template <class Function, class Blocks = NoBlocks> void findResponses(Function use,
            Blocks useBlocks = Blocks()) const {
        band.findResponses(use, useBlocks);
    }
    /**
     * The drag of the flow on a segment: what each end gets, and what the second one has more and the first one less.
     */
    CYLCHAIN_INLINE void findDragOfFlow(const LaneFlow<W>& flow, const Vec* y, int s, Vec& carried, Vec& pair) {
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
    CYLCHAIN_INLINE void describeNew(const Vec* y, int s, Geometry& geometry) {
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
    /** Add a segment to the equations of its nodes. It is the first to do so for all but the first one's diagonal. */
    CYLCHAIN_INLINE void addSegment(const Vec* y, int s, const Geometry& geometry, Row& here, Row& after) {
        const FrictionOfEnd<Real> friction = addFriction(y, s, geometry, here, after);
        Elements<W>::template add<OnSegments>(step, s, geometry, friction, compressed, band, here, after);
        // Both ends have the same block.
        here.diagonal.add(after.diagonal);
    }
private:
    const ImplicitState<W>& step;
    const Pack& pack;
    const StepSettings& settings;
    const int n;
    const Scalar h;
    ImplicitSegment<Real>* const segments;
    const Vec* const x;
    Vec *const loads, *const change;
    /** Whether all compression of segments is in the matrix. */
    bool compressed = false;
    const CouplingTerm* terms = NULL;
    int numTerms = 0;
    const Vec* forcesOfOthers = NULL;
    Band band;

    /** Add the friction of a segment, and return that of an end. Its first node shall get the second one's block. */
    CYLCHAIN_INLINE FrictionOfEnd<Real> addFriction(const Vec* y, int s, const Geometry& geometry, Row& here,
            Row& after) {
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
        here.upper = Mat::axial(otherAcross, along-otherAcross, direction);
        here.right = here.right-first*sameAcross-second*otherAcross-axial1;
        after.right = loads[s+1]-second*sameAcross-first*otherAcross-axial2;
        return {alongTrans, acrossTurn};
    }
    /**
     * Add the drag of the flow, at the middle of the step, on segments at rest. Its part along a segment is a tension.
     */
    void addDragOfFlow(const Vec* y) {
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
    /** Add the terms of couplings of a segment, the next ones, to the equations of its nodes. */
    void addTerms(int s, int& next, Row& here, Row& after) {
        for (; next < numTerms && terms[next].node == s; next++) {
            CouplingTerm term = terms[next];
            if (pack.planar)
                // What is along z moves nothing.
                term.force[2] = term.stiffness[2] = term.stiffness[4] = term.stiffness[5] = 0;
            const Scalar first = 1-term.fraction, second = term.fraction;
            addTo(here.right, term.lane, term.force, first);
            addTo(after.right, term.lane, term.force, second);
            addTo(here.diagonal, term.lane, term.stiffness, first*first);
            addTo(after.diagonal, term.lane, term.stiffness, second*second);
            addTo(here.upper, term.lane, term.stiffness, first*second);
        }
    }
    static void addTo(Vec& vector, int i, const double* values, Scalar factor) {
        lane(vector.x, i) += factor*values[0];
        lane(vector.y, i) += factor*values[1];
        lane(vector.z, i) += factor*values[2];
    }
    static void addTo(Symmetric<Real>& matrix, int i, const double* values, Scalar factor) {
        lane(matrix.xx, i) += factor*values[0];
        lane(matrix.yx, i) += factor*values[1];
        lane(matrix.zx, i) += factor*values[2];
        lane(matrix.yy, i) += factor*values[3];
        lane(matrix.zy, i) += factor*values[4];
        lane(matrix.zz, i) += factor*values[5];
    }
    static void addTo(Mat& matrix, int i, const double* values, Scalar factor) {
        Vec* const rows[] = {&matrix.x, &matrix.y, &matrix.z};
        const int of[3][3] = {{0, 1, 2}, {1, 3, 4}, {2, 4, 5}};
        for (int row = 0; row < 3; row++) {
            const double own[] = {values[of[row][0]], values[of[row][1]], values[of[row][2]]};
            addTo(*rows[row], i, own, factor);
        }
    }
    void addNodeFriction(const Vec* y, int node, Row& row) {
        const Real friction = loaded<Real>(pack.nodeFriction, 0)*(1/h);
        row.diagonal.addDiagonal(friction);
        row.right = row.right-y[node]*friction;
    }
};
