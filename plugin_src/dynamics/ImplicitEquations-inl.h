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
    typedef typename SegmentEquations<W>::Geometry Geometry;
    typedef typename Coordinates<W>::Factors Factors;
    ImplicitEquations(const ImplicitState<W>& step, ImplicitTwist<W, CLOSED>& twist, Memory& memory) : step(step),
            pack(step.pack), n(step.n), segments(step.segments), change(step.change), twist(twist),
            isTwisted(pack.twist.isPresent()), ofSegments(step), band(pack, memory) {
    }
    /**
     * Linearise the equations around y, and eliminate the nodes from first to last.
     *
     * @param iteration  how many there were before
     */
    void eliminate(const Vec* y, int iteration) {
        ofSegments.begin(iteration);
        if (step.settings.flow.present)
            ofSegments.addDragOfFlow(y);
        if (isTwisted)
            twist.addForces(y, iteration > 0 || step.settings.flow.present);
        Row rows[3];
        Row *before = rows, *here = rows+1, *after = rows+2;
        // Roots and divisions take long: those of the segment ahead come before the node is eliminated.
        Geometry previous = {}, current, ahead;
        Factors factors = {}, factorsAhead = {};
        int term = 0;
        band.begin();
        *here = Row {};
        here->right = step.loads[0];
        describeNew(y, 0, ahead);
        for (int s = 0; s < n-1; s++) {
            if constexpr (CLOSED)
                *after = Row {};
            current = ahead;
            factors = factorsAhead;
            if (s+3 < n)
                prefetch<IteratedSegment<Real> >(&segments[s+2]);
            if (!CLOSED || s < pack.segments)
                ofSegments.addSegment(y, s, current, band, *here, *after);
            else {
                // The last segment of a ring that is unrolled is there for its joint alone.
                here->upper = Mat {};
                after->diagonal = Symmetric<Real> {};
                after->right = step.loads[s+1];
            }
            Coordinates<W>::template add<OnNodes>(step, s, y, *here);
            if (numTerms > 0)
                addTerms(s, term, *here, *after);
            if (pack.hasNodeFriction && s < pack.ownNodes())
                ofSegments.addNodeFriction(y, s, *here);
            if (s > 0)
                Coordinates<W>::template add<OnJoints>(step, s, factors, previous, current, *before, *here, *after);
            if (isTwisted && s > 0)
                twist.addStiffness(s, previous, current, *before, *here, *after);
            if (s < n-2) {
                describeNew(y, s+1, ahead);
                Coordinates<W>::describeNew(step, s+1, current, ahead, factorsAhead);
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
            Coordinates<W>::template add<OnNodes>(step, n-1, y, *here);
            if (pack.hasNodeFriction)
                ofSegments.addNodeFriction(y, n-1, *here);
            band.template eliminate<1>(n-2, *before, *here, *after);
            band.template eliminate<0>(n-1, *here, *after, *before);
        }
    }
    /** Find the changes of y and the tensions, or add to them. */
    template <Goal GOAL> void substitute() {
        band.template substitute<GOAL>(change, [&] (int s, Real tension) {
            setMultiplier(s, tension);
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
    /** The same, with how they change tensions. */
    void respond(const Vec* forces, Vec* moves, Real* ofTensions) {
        band.setForcesOnNodes(forces);
        band.respond(moves, ofTensions);
    }
    /** See TensionBand. */
    template <class Many> void respondToEach(const Vector<Many>* forces, Vector<Many>* moves) {
        band.respondToEach(forces, moves);
    }
    /** Add a multiple of that to the changes of y and of the tensions. */
    void addResponse(const Vec* moves, const Real* ofTensions, Real factor) {
        band.addResponse(moves, ofTensions, factor, change, [&] (int s, Real tension) {
            setMultiplier(s, tension);
        });
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
        addForces(forcesOfOthers);
    }
    /** Add what forces on nodes do to the changes of y and of the tensions. */
    void addForces(const Vec* forces) {
        band.setForcesOnNodes(forces);
        substitute<Goal::Add>();
    }
    /** See TensionBand. */
    void prefetchElimination() const {
        band.prefetchElimination();
    }
    /** See TensionBand. */
    template <class Use> void findResponses(const Use& use) const {
        band.findResponses(use);
    }
    const SegmentEquations<W>& getEquationsOfSegments() const {
        return ofSegments;
    }
private:
    const ImplicitState<W>& step;
    const Pack& pack;
    const int n;
    ImplicitSegment<Real>* const segments;
    Vec* const change;
    ImplicitTwist<W, CLOSED>& twist;
    const bool isTwisted;
    SegmentEquations<W> ofSegments;
    const CouplingTerm* terms = NULL;
    int numTerms = 0;
    const Vec* forcesOfOthers = NULL;
    Band band;

    CYLCHAIN_INLINE void setMultiplier(int s, Real tension) {
        ImplicitSegment<Real>& segment = segments[s];
        segment.multiplier = tension+segment.shift*segment.newTangent.dot(change[s+1]-change[s]);
    }
    CYLCHAIN_INLINE void describeNew(const Vec* y, int s, Geometry& geometry) const {
        if (isTwisted)
            geometry = twist.getSegment(s);
        else
            ofSegments.describeNew(y, s, geometry);
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
};
