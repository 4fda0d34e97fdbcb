// Included into the namespace of an instruction set. It does not compile alone.

/**
 * The forces that segments exert on their ends in an implicit step.
 *
 * They are those of the linear equations that the last iteration has solved, so that all forces on a mobile node add up
 * to zero but for rounding. Each segment and each joint is added to empty equations once more, as in the elimination.
 */

template <int W> class ImplicitTensions {
    typedef typename Lanes<W>::Type Real;
    typedef Vector<Real> Vec;
    typedef BandRow<Real, false> Row;
    typedef typename SegmentEquations<W>::Geometry Geometry;
    /** The equations of tensions are left as they are. */
    struct NoBand {
        CYLCHAIN_INLINE void setTension(int, const Vec&, Real, Real) {
        }
    };
public:
    ImplicitTensions(const ImplicitState<W>& step, const SegmentEquations<W>& equations) : step(step),
            equations(equations), pack(step.pack), segments(step.segments), change(step.change) {
    }
    /** Remember what ImplicitEquations::refine() is about to change. */
    void beginRefinement() {
        minus = scratch().template reserve<Vec>(3*step.n);
        plus = minus+step.n;
        refined = plus+step.n;
        for (int s = 0; s < pack.segments; s++)
            refined[s] = segments[s].turned*(segments[s].multiplier-segments[s].multiplierBefore);
    }
    /** Record the forces of the segments of active lanes, after this. */
    void record(const Vec* y, Real active) const;
private:
    const ImplicitState<W>& step;
    const SegmentEquations<W>& equations;
    const Pack& pack;
    ImplicitSegment<Real>* const segments;
    const Vec* const change;
    Vec *minus, *plus, *refined;
    static Scratch& scratch() {
        static thread_local Scratch memory;
        return memory;
    }
};

template <int W> void ImplicitTensions<W>::record(const Vec* y, Real active) const {
    NoBand band;
    const LaneFlow<W> flow(step.settings.flow, pack.planar, step.start.nodes[0]);
    Geometry previous = {}, current;
    for (int s = 0; s < pack.segments; s++) {
        ImplicitSegment<Real>& segment = segments[s];
        const Vec first = change[s], second = change[s+1];

        // Friction, and the tension with what it does when the segment turns.
        equations.describeNew(y, s, current);
        Row here = {}, after = {};
        const Real multiplier = segment.multiplier;
        segment.multiplier = segment.multiplierBefore;
        equations.addSegment(y, s, current, band, here, after);
        segment.multiplier = multiplier;
        const Vec t = segment.newTangent;
        const Vec pull = t*(multiplier-segment.shift*t.dot(second-first))+refined[s];
        minus[s] = here.right-here.diagonal*first-here.upper*second+pull;
        plus[s] = after.right-step.loads[s+1]-here.upper.transposedTimes(first)-after.diagonal*second-pull;

        // Noise, with that of taut segments, metric forces and propulsion.
        const Real rotational = property<Real>(pack, s, Pack::Rotational);
        const Vec pair = segment.randomPair*root(1+segment.extra/(rotational+TINY))-segment.metricForce;
        Vec both = segment.randomForce;
        if (!pack.propulsions.empty())
            both = both+segment.tangent*loaded<Real>(pack.propulsions, s);
        minus[s] = minus[s]+both-pair;
        plus[s] = plus[s]+both+pair;
        if (step.settings.flow.present) {
            Vec carried, turned;
            equations.findDragOfFlow(flow, y, s, carried, turned);
            minus[s] = minus[s]+carried-turned;
            plus[s] = plus[s]+carried+turned;
        }
    }
    for (int s = 0; s < step.n-1; s++) {
        equations.describeNew(y, s, current);
        if (s > 0) {
            Row before = {}, here = {}, after = {};
            typename Coordinates<W>::Factors factors;
            Coordinates<W>::describeNew(step, s, previous, current, factors);
            Coordinates<W>::template add<OnJoints>(step, s, factors, previous, current, before, here, after);
            const Vec change1 = change[s]-change[s-1], change2 = change[s+1]-change[s];
            const Vec force1 = before.right+before.diagonal*change1-before.second*change2;
            const Vec force2 = after.diagonal*change2-before.second.transposedTimes(change1)-after.right;
            const int behind = s < pack.segments ? s : 0;
            minus[s-1] = minus[s-1]+force1;
            plus[s-1] = plus[s-1]-force1;
            minus[behind] = minus[behind]+force2;
            plus[behind] = plus[behind]-force2;
        }
        previous = current;
    }
    for (int s = 0; s < pack.segments; s++) {
        Vec direction = segments[s].difference*splat<Real>(2)+y[s+1]-y[s]+change[s+1]-change[s];
        direction = direction*(1/root(direction.dot(direction)));
        for (int i = 0; i < W; i++)
            if (lane(active, i) != 0 && s < pack.segmentsOfLane[i]) {
                SegmentForces& forces = (*step.settings.segmentForces)[pack.chain[i]][s];
                forces.tension = lane(segments[s].multiplier, i);
                const Vec* const vectors[] = {minus+s, plus+s, &direction};
                double* const results[] = {forces.minus, forces.plus, forces.direction};
                for (int k = 0; k < 3; k++) {
                    Vec vector = *vectors[k];
                    results[k][0] = lane(vector.x, i);
                    results[k][1] = lane(vector.y, i);
                    results[k][2] = lane(vector.z, i);
                }
            }
    }
}
