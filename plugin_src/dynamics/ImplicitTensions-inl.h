// Included into the namespace of an instruction set. It does not compile alone.

/**
 * The forces that segments exert on their ends in a step of the implicit scheme.
 *
 * They are those of the linear equations that the last iteration has solved, so that all forces on a mobile node add up to
 * zero but for rounding. Each segment and each joint is added to empty equations once more, as in the elimination.
 */

template <int W, bool CLOSED>
void ImplicitStep<W, CLOSED>::refineAndRecord(const Vec* y, Real active) {
    static thread_local Scratch scratch;
    Vec* const minus = scratch.reserve<Vec>(3*n);
    Vec* const plus = minus+n;
    Vec* const refined = plus+n;
    for (int s = 0; s < pack.segments; s++)
        refined[s] = segments[s].turned*(segments[s].multiplier-segments[s].multiplierBefore);
    refine();
    const LaneFlow<W> flow(settings.flow, pack, x);
    Geometry previous = {}, current;
    for (int s = 0; s < pack.segments; s++) {
        ImplicitSegment<Real>& segment = segments[s];
        const Vec first = change[s], second = change[s+1];

        // Friction, and the tension with what it does when the segment turns.
        describeNew(y, s, current);
        Row here = {}, after = {};
        const Real multiplier = segment.multiplier;
        segment.multiplier = segment.multiplierBefore;
        addSegment(y, s, current, here, after);
        segment.multiplier = multiplier;
        const Vec t = segment.newTangent;
        const Vec pull = t*(multiplier-segment.shift*t.dot(second-first))+refined[s];
        minus[s] = here.right-here.diagonal*first-here.upper*second+pull;
        plus[s] = after.right-loads[s+1]-here.upper.transposedTimes(first)-after.diagonal*second-pull;

        // Noise, with that of taut segments, metric forces and propulsion.
        const Real rotational = property<Real>(pack, s, Pack::Rotational);
        const Vec pair = segment.randomPair*root(1+segment.extra/(rotational+TINY))-segment.metricForce;
        Vec both = segment.randomForce;
        if (!pack.propulsions.empty())
            both = both+segment.tangent*loaded<Real>(pack.propulsions, s);
        minus[s] = minus[s]+both-pair;
        plus[s] = plus[s]+both+pair;
        if (settings.flow.present) {
            Vec carried, turned;
            findDragOfFlow(flow, y, s, carried, turned);
            minus[s] = minus[s]+carried-turned;
            plus[s] = plus[s]+carried+turned;
        }
    }
    for (int s = 0; s < n-1; s++) {
        describeNew(y, s, current);
        if (s > 0) {
            Row before = {}, here = {}, after = {};
            JointGeometry joint;
            describeNewJoint(s, previous, current, joint);
            addJoint(s, joint, previous, current, before, here, after);
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
        Vec direction = segments[s].difference*(2+Real{})+y[s+1]-y[s]+change[s+1]-change[s];
        direction = direction*(1/root(direction.dot(direction)));
        for (int i = 0; i < W; i++)
            if (lane(active, i) != 0 && s < pack.segmentsOfLane[i]) {
                SegmentForces& forces = (*settings.segmentForces)[pack.chain[i]][s];
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

/** Means over the parts of a divided step, for the lanes whose step is divided. */
template <int W> class MeanOfParts {
public:
    /** From now on, the settings record the forces of a part. */
    MeanOfParts(const Pack& pack, StepSettings& settings) : pack(pack), whole(settings.segmentForces) {
        if (whole == NULL)
            return;
        part.resize(whole->size());
        for (int chain : pack.chain)
            if (chain >= 0)
                part[chain].resize((*whole)[chain].size());
        settings.segmentForces = &part;
    }
    /** Add one of so many parts, the first of which begins anew. */
    void add(int number, int parts, const bool* divided) const {
        for (int i = 0; i < W && whole != NULL; i++)
            for (int s = 0; divided[i] && s < pack.segmentsOfLane[i]; s++) {
                SegmentForces& mean = (*whole)[pack.chain[i]][s];
                if (number == 0)
                    mean = SegmentForces();
                mean.add(part[pack.chain[i]][s], 1.0/parts);
            }
    }
private:
    const Pack& pack;
    std::vector<std::vector<SegmentForces> >* const whole;
    std::vector<std::vector<SegmentForces> > part;
};
