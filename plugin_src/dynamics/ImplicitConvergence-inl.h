// Included into the namespace of an instruction set. It does not compile alone.

/**
 * When the iteration of an implicit step ends, and which chains have moved too far in it.
 */

/** The largest change of a node in the last iteration, over the rest length of a segment. */
const Scalar NODE_TOLERANCE = 0.1;
/** The tolerances of its stages over those of scheme "implicit". */
const Scalar TOLERANCE_OF_STAGES = 0.3;

template <int W> class ImplicitConvergence {
    typedef typename Lanes<W>::Type Real;
    typedef Vector<Real> Vec;
public:
    explicit ImplicitConvergence(const ImplicitState<W>& step) : step(step), pack(step.pack), kT(step.kT),
            change(step.change) {
    }
    /** Find the square of the largest change of the last iteration over its tolerance, for each lane. */
    Real findLastChange() const {
        Real excess = Real{};
        const Real perEnergy = (pack.closed ? splat<Real>(1) : 1-loaded<Real>(pack.free, 0))*(1/(kT+TINY));
        const Scalar tighter = step.twoStages ? 1/(TOLERANCE_OF_STAGES*TOLERANCE_OF_STAGES) : 1;
        const Scalar tolerance = Coordinates<W>::limitsOf(pack).tolerance;
        const Scalar ofSegments = tolerance*tolerance;
        for (int s = 0; s < pack.segments; s++) {
            const Vec difference = change[s+1]-change[s];
            const Real inverse = property<Real>(pack, s, Pack::InverseRestLength), square = difference.dot(difference);
            const Real moved = change[s].dot(change[s])*(ofSegments/(NODE_TOLERANCE*NODE_TOLERANCE));
            const Real ratio = larger<Real>(square, moved)*(inverse*inverse*(tighter/ofSegments));
            excess = ratio < excess ? excess : ratio;
            Coordinates<W>::measure(step, s, square, perEnergy*tighter, excess);
        }
        return excess;
    }
    /** Whether any lane has not converged; those that have are taken out. NaN counts as not converged. */
    bool anyUnfinished(Real& active) const {
        Real excess = findLastChange();
        bool any = false;
        for (int i = 0; i < W; i++) {
            if (lane(excess, i) < 1)
                lane(active, i) = 0;
            any |= lane(active, i) != 0;
        }
        return any;
    }
    /** Mark lanes that have changed too much in a step for it to be right. */
    void findExcessiveChanges(const Vec* y, bool* failed) const {
        for (int s = 0; s < pack.segments; s++)
            Coordinates<W>::findExcessiveChange(step, y, s, failed);
    }
private:
    const ImplicitState<W>& step;
    const Pack& pack;
    const Scalar kT;
    const Vec* const change;
};
