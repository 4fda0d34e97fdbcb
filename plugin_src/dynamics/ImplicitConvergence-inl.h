// Included into the namespace of an instruction set. It does not compile alone.

/**
 * When the iteration of an implicit step ends, and which chains have moved too far in it.
 */

/** The largest change of a segment in the last iteration, over its rest length; a fifth of it remains as an error. */
const Scalar NEWTON_TOLERANCE = 1e-2;
/** The same for chains whose bends are linear in the nodes; Newton's method leaves less of it as an error. */
const Scalar TOLERANCE_OF_LINEAR_BENDS = 3e-2;
/** The least cosine of the angle by which a segment of such a chain may turn in a step. */
const Scalar LEAST_COSINE = -0.9;
/** The largest change of a node in the last iteration, over that length. */
const Scalar NODE_TOLERANCE = 0.1;
/**
 * The largest error of a length that an iteration leaves, over its thermal fluctuation against what resists in a step.
 */
const Scalar LENGTH_TOLERANCE = 0.07;
/** The tolerances of its stages over those of scheme "implicit". */
const Scalar TOLERANCE_OF_STAGES = 0.3;

template <int W, bool CLOSED> class ImplicitConvergence {
    typedef typename Lanes<W>::Type Real;
    typedef Vector<Real> Vec;
public:
    explicit ImplicitConvergence(const ImplicitState<W>& step) : step(step), pack(step.pack), kT(step.kT),
            segments(step.segments), change(step.change) {
    }
    /** Whether any lane has not converged; those that have are taken out. NaN counts as not converged. */
    bool anyUnfinished(Real& active) const {
        Real excess = Real{};
        const Real perEnergy = (CLOSED ? splat<Real>(1) : 1-loaded<Real>(pack.free, 0))*(1/(kT+TINY));
        const Scalar tighter = step.twoStages ? 1/(TOLERANCE_OF_STAGES*TOLERANCE_OF_STAGES) : 1;
        const Scalar tolerance = isLinear(pack.bending) ? TOLERANCE_OF_LINEAR_BENDS : NEWTON_TOLERANCE;
        const Scalar ofSegments = tolerance*tolerance;
        for (int s = 0; s < pack.segments; s++) {
            const Vec difference = change[s+1]-change[s];
            const Real inverse = property<Real>(pack, s, Pack::InverseRestLength), square = difference.dot(difference);
            const Real moved = change[s].dot(change[s])*(ofSegments/(NODE_TOLERANCE*NODE_TOLERANCE));
            const Real ratio = larger<Real>(square, moved)*(inverse*inverse*(tighter/ofSegments));
            // An iteration takes a length to first order in the change, so that an error of square/(2 l0) is left where
            // lengths are not reset.
            const Real error = square*inverse*(Scalar(0.5)/LENGTH_TOLERANCE);
            excess = ratio < excess ? excess : ratio;
            if (step.settings.kT > 0)
                excess = larger(excess, error*error*segments[s].response*(perEnergy*tighter));
        }
        bool any = false;
        for (int i = 0; i < W; i++) {
            if (lane(excess, i) < 1)
                lane(active, i) = 0;
            any |= lane(active, i) != 0;
        }
        return any;
    }
    /**
     * Mark lanes a segment of which changes by more than a quarter of a turn would do, or leaves its range. Where bends
     * are linear in the nodes, all that is needed is a direction half-way, which a turn by 150 degrees leaves.
     */
    void findExcessiveChanges(const Vec* y, bool* failed) const {
        for (int s = 0; s < pack.segments; s++) {
            const Vec difference = y[s+1]-y[s];
            if (isLinear(pack.bending)) {
                const Vec before = segments[s].difference, after = before+difference;
                Real excess = root(before.dot(before)*after.dot(after))*LEAST_COSINE-before.dot(after);
                for (int i = 0; i < W; i++)
                    failed[i] |= s < pack.segmentsOfLane[i] && !(lane(excess, i) < 0);
            }
            else {
                // A quarter of a turn.
                Real square = 0.5*difference.dot(difference), limit = property<Real>(pack, s, Pack::RestLength);
                for (int i = 0; i < W; i++)
                    failed[i] |= s < pack.segmentsOfLane[i] && !(lane(square, i) < lane(limit, i)*lane(limit, i));
            }
            if (hasRange(pack.stretching)) {
                const Vec after = segments[s].difference+(y[s+1]-y[s]);
                Real relative = (root(after.dot(after))-property<Real>(pack, s, Pack::RestLength))*
                        property<Real>(pack, s, Pack::InverseExtension);
                for (int i = 0; i < W; i++)
                    failed[i] |= s < pack.segmentsOfLane[i] && !(std::fabs(lane(relative, i)) < 1);
            }
        }
    }
private:
    const ImplicitState<W>& step;
    const Pack& pack;
    const Scalar kT;
    const ImplicitSegment<Real>* const segments;
    const Vec* const change;
};
