// Included into the namespace of an instruction set. It does not compile alone.

/**
 * The linear equations of an iteration of an implicit step, and their solution by elimination along chains.
 */

/** The part of the friction against turning that compression may take away in the iteration's matrix. */
const Scalar COMPRESSION = 0.9;
/**
 * Bends that are linear in the nodes leave the matrix regular under nearly all compression, so that Newton's method may
 * have all of it. Where that has not converged after so many iterations, compression counts no more.
 */
const int ITERATIONS_WITH_COMPRESSION = 5;
/** More than any tension over a length. */
const Scalar UNBOUNDED = 1e30;

template <int W, bool CLOSED> class ImplicitEquations {
    typedef typename Lanes<W>::Type Real;
    typedef Vector<Real> Vec;
    typedef Matrix<Real> Mat;
    typedef TensionBand<W, CLOSED> Band;
public:
    typedef typename Band::Row Row;
    typedef typename Band::Memory Memory;
    /** The new segment, and the one between the old nodes and the new. */
    struct Geometry {
        Vec difference, tangent, middleTangent;
        Real length, inverse, middleInverse;
    };
    /** What takes roots and divisions of a joint: its bends, and how the random one turns with it. */
    struct JointGeometry {
        BendFactor<Real> newFactor, factor;
        Vec sum;
        Real sumLength, projection, perSum, perOne;
    };
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
        allowsCompression = isLinear(pack.bending) && iteration < ITERATIONS_WITH_COMPRESSION;
        if (settings.flow.present)
            addDragOfFlow(y);
        Row rows[3];
        Row *before = rows, *here = rows+1, *after = rows+2;
        // Roots and divisions take long: those of the segment ahead come before the node is eliminated.
        Geometry previous = {}, current, ahead;
        JointGeometry joint = {}, jointAhead = {};
        std::size_t tether = 0;
        int term = 0;
        const bool linear = isLinear(pack.bending);
        band.begin();
        *here = Row {};
        here->right = loads[0];
        describeNew(y, 0, ahead);
        for (int s = 0; s < n-1; s++) {
            if constexpr (CLOSED)
                *after = Row {};
            current = ahead;
            joint = jointAhead;
            if (!CLOSED || s < pack.segments)
                addSegment(y, s, current, *here, *after);
            else {
                // The last segment of a ring that is unrolled is there for its joint alone.
                here->upper = Mat {};
                after->diagonal = Symmetric<Real> {};
                after->right = loads[s+1];
            }
            addTethers(y, s, tether, *here);
            if (numTerms > 0)
                addTerms(s, term, *here, *after);
            if (pack.hasNodeFriction && s < pack.ownNodes())
                addNodeFriction(y, s, *here);
            if (s > 0 && linear)
                addLinearBend(s, previous, current, *before, *here, *after);
            else if (s > 0)
                addJoint(s, joint, previous, current, *before, *here, *after);
            if (s < n-2) {
                describeNew(y, s+1, ahead);
                if (!linear)
                    describeNewJoint(s+1, current, ahead, jointAhead);
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
            addTethers(y, n-1, tether, *here);
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
        ImplicitSegment<Real>& segment = segments[s];
        const Real length = geometry.length;
        const Vec t = geometry.tangent, direction = geometry.middleTangent;

        // Friction.
        const Real acrossTrans = 0.25*property<Real>(pack, s, Pack::Perpendicular);
        const Real alongTrans = 0.25*property<Real>(pack, s, Pack::Parallel);
        const Real acrossTurn = (property<Real>(pack, s, Pack::Rotational)+segment.extra)*turningFactor(s, geometry);
        const Scalar perStep = 1/h;
        const Real sameAcross = (acrossTrans+acrossTurn)*perStep, otherAcross = (acrossTrans-acrossTurn)*perStep;
        const Real along = alongTrans*perStep;
        const Vec first = y[s], second = y[s+1];
        const Vec axial1 =
                direction*((along-sameAcross)*direction.dot(first)+(along-otherAcross)*direction.dot(second));
        const Vec axial2 =
                direction*((along-sameAcross)*direction.dot(second)+(along-otherAcross)*direction.dot(first));

        // Tension.
        const Real drag = property<Real>(pack, s, Pack::Extensional)*segment.inverse*perStep;
        if (hasRange(pack.stretching))
            findLimitedTension(s, length, drag);
        else {
            const Real stiffness = property<Real>(pack, s, Pack::Stiffness);
            const Real extension = length-property<Real>(pack, s, Pack::RestLength);
            segment.tension = stiffness*(segment.implicit*extension+segment.constantCoordinate)+
                    drag*(length-segment.length)*geometry.inverse+segment.constantTension;
            segment.response = stiffness*segment.implicit+drag*segment.length*geometry.inverse*geometry.inverse;
        }
        if (settings.flow.present)
            segment.tension = segment.tension-segment.tensionOfFlow;
        segment.newTangent = t;

        // The tension acts along the mean direction. The matrix has the new one, with which it is symmetric, and what
        // they differ by goes with the last iteration's tension.
        segment.turned = direction-t;
        segment.multiplierBefore = segment.multiplier;
        const Vec lacking = segment.turned*segment.multiplier;
        // Without part of the response, nothing in the nodes' own matrix would keep those of a straight chain from
        // moving apart and together in turn.
        segment.shift = lesser<Real>(0.5*segment.response, along);
        band.setTension(s, t, 1/(segment.response-segment.shift+TINY), segment.tension);

        const Real least = allowsCompression ? splat<Real>(-UNBOUNDED) : acrossTurn*(-COMPRESSION*perStep);
        const Real turning = 0.5*larger<Real>(segment.multiplier*geometry.inverse, least);
        after.diagonal = Symmetric<Real> {};
        after.diagonal.addAxial(sameAcross, along-sameAcross, direction);
        after.diagonal.addAxial(turning, segment.shift-turning, t);
        here.diagonal.add(after.diagonal);
        here.upper = Mat::axial(otherAcross, along-otherAcross, direction)-
                Mat::axial(turning, segment.shift-turning, t);
        here.right = here.right-first*sameAcross-second*otherAcross-axial1+lacking;
        after.right = loads[s+1]-second*sameAcross-first*otherAcross-axial2-lacking;
    }
    CYLCHAIN_INLINE void describeNewJoint(int s, const Geometry& geometry1, const Geometry& geometry2,
                JointGeometry& joint) {
        const ImplicitSegment<Real>& segment = segments[s];
        const Vec newBent = geometry2.tangent-geometry1.tangent, bent = geometry2.middleTangent-geometry1.middleTangent;
        // The random bend turns with the joint.
        joint.sum = segments[s-1].tangent+segment.tangent+geometry1.tangent+geometry2.tangent;
        joint.sumLength = root(joint.sum.dot(joint.sum)+LEAST*LEAST);
        joint.projection = segment.bisector.dot(joint.sum);
        // The inverse of the length, and of one plus the cosine.
        bendFactors<Real>(pack.bending, newBent, bent, joint.newFactor, joint.factor, joint.sumLength,
                joint.sumLength+joint.projection+LEAST, joint.perSum, joint.perOne);
    }
    /** Add the joint between two segments to the equations of their nodes. */
    CYLCHAIN_INLINE void addJoint(int s, const JointGeometry& joint, const Geometry& geometry1,
                const Geometry& geometry2, Row& before, Row& here, Row& after) {
        const ImplicitSegment<Real>& segment = segments[s];
        const Vec t1 = geometry1.middleTangent, t2 = geometry2.middleTangent;
        const Real perLength1 = geometry1.middleInverse, perLength2 = geometry2.middleInverse;
        const Vec newBent = geometry2.tangent-geometry1.tangent, bent = t2-t1;
        const BendFactor<Real> newFactor = joint.newFactor, factor = joint.factor;
        const Real sumLength = joint.sumLength, perOne = joint.perOne;
        const Vec bisector = joint.sum*joint.perSum;
        const Real cosine = joint.projection*joint.perSum;
        const Vec axis = crossProduct(segment.bisector, bisector);
        const Vec turned = segment.turningBend*cosine+crossProduct(axis, segment.turningBend)+
                axis*(axis.dot(segment.turningBend)*sumLength*perOne);
        const Vec newBend = newBent*newFactor.f;

        const Real stiffness = loaded<Real>(pack.joints, s);
        const Vec u = newBend*segment.jointImplicit+segment.constantBend-turned;
        const Real twist = factor.slope*u.dot(bent);
        Vec force1 = t2*twist-u*factor.f, force2 = u*factor.f+t1*twist;
        force1 = (force1-t1*t1.dot(force1))*(stiffness*perLength1);
        force2 = (force2-t2*t2.dot(force2))*(stiffness*perLength2);
        before.right = before.right+force1;
        here.right = here.right-force1+force2;
        after.right = after.right-force2;

        const Real scale = stiffness*segment.jointImplicit*factor.f*factor.f;
        const Real scale1 = scale*perLength1*perLength1, scale2 = scale*perLength2*perLength2;
        Symmetric<Real> first = {}, last = {};
        first.addAxial(scale1, -scale1, t1);
        last.addAxial(scale2, -scale2, t2);
        const Real c = t1.dot(t2);
        const Vec projected = t2-t1*c;
        // -(1-t1 t1)(1-t2 t2)
        const Mat mixed = (Mat::axial(splat<Real>(1), splat<Real>(-1), t1)-Mat::outer(projected, t2))*
                (-scale*perLength1*perLength2);
        before.second = -mixed;
        before.diagonal.add(first);
        here.diagonal.add(first);
        here.diagonal.add(last);
        here.diagonal.addTwice(before.second);
        after.diagonal.add(last);
        before.upper = before.upper+mixed-Mat::of(first);
        here.upper = here.upper+mixed-Mat::of(last);
    }
    /** Add a bend that is linear in the nodes to their equations. */
    void addLinearBend(int s, const Geometry& geometry1, const Geometry& geometry2, Row& before,
                Row& here, Row& after) {
        const ImplicitSegment<Real>& segment = segments[s];
        const Real stiffness = loaded<Real>(pack.joints, s);
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
private:
    const ImplicitState<W>& step;
    const Pack& pack;
    const StepSettings& settings;
    const int n;
    const Scalar h;
    ImplicitSegment<Real>* const segments;
    const Vec* const x;
    Vec *const loads, *const change;
    bool allowsCompression = false;
    const CouplingTerm* terms = NULL;
    int numTerms = 0;
    const Vec* forcesOfOthers = NULL;
    Band band;

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
     * The tension of a segment whose length has a range, and its response. Where the last iteration has given a
     * tension, they are those at the length that belongs to it, which is never beyond the range, extended to the length
     * that the segment has.
     */
    void findLimitedTension(int s, Real length, Real drag) {
        ImplicitSegment<Real>& segment = segments[s];
        Real stiffness = property<Real>(pack, s, Pack::Stiffness), rest = property<Real>(pack, s, Pack::RestLength);
        Real inverse = property<Real>(pack, s, Pack::InverseExtension);
        Real flow = settings.flow.present ? segment.tensionOfFlow : Real{};
        for (int i = 0; i < W; i++) {
            const FeneTension law = {lane(stiffness, i), lane(inverse, i), lane(rest, i), lane(segment.length, i),
                    lane(segment.implicit, i), lane(segment.constantCoordinate, i), lane(drag, i),
                    lane(segment.constantTension, i)};
            const double given = lane(segment.multiplier, i)+lane(flow, i);
            double response, own = lane(length, i), tension;
            if (s < pack.segmentsOfLane[i] && lane(segment.multiplier, i) != 0)
                own = law.lengthFor(given, own, response);
            law.evaluate(own, tension, response);
            lane(segment.tension, i) = tension+response*(lane(length, i)-own);
            lane(segment.response, i) = response;
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
    /** Add the tethers of a node, the next ones, to its equations. */
    void addTethers(const Vec* y, int node, std::size_t& next, Row& row) {
        for (; next < pack.tethers.size() && pack.tethers[next].node == node; next++) {
            const int i = pack.tethers[next].lane;
            const ImplicitTether& tether = step.tethers[next];
            Vec moved = y[node];
            const Scalar stiffness = pack.tethers[next].stiffness, implicit = stiffness*tether.implicit;
            lane(row.right.x, i) -= implicit*lane(moved.x, i)+stiffness*tether.constant[0];
            lane(row.right.y, i) -= implicit*lane(moved.y, i)+stiffness*tether.constant[1];
            lane(row.right.z, i) -= implicit*lane(moved.z, i)+stiffness*tether.constant[2];
            lane(row.diagonal.xx, i) += implicit;
            lane(row.diagonal.yy, i) += implicit;
            lane(row.diagonal.zz, i) += implicit;
        }
    }
};
