// Included into the namespace of an instruction set. It does not compile alone.

/**
 * What an implicit step begins with, and what each of its stages makes of that: the coefficients of the tensions.
 */

template <int W> class ImplicitStages {
    typedef typename Lanes<W>::Type Real;
    typedef Vector<Real> Vec;
public:
    explicit ImplicitStages(ImplicitState<W>& step) : step(step) {
    }
    /** Describe the start of a step, without noise. */
    void describe() {
        for (int s = 0; s < step.n; s++) {
            if (s < step.n-1)
                describeSegment(s);
            Coordinates<W>::describe(step, s);
        }
    }
    /** Describe a stage. The second one begins with the end of the first, y. */
    void prepare(Stage next, const Vec* y) {
        step.stage = next;
        for (int s = 0; s < step.n; s++) {
            if (next == Stage::Second && s < step.n-1)
                describeEndOfFirst(y, s);
            Coordinates<W>::prepare(step, y, s);
        }
        step.combineForces();
    }
private:
    ImplicitState<W>& step;

    CYLCHAIN_INLINE void describeSegment(int s) {
        ImplicitSegment<Real>& segment = step.segments[s];
        segment.difference = step.start.segments[s];
        segment.length = root(segment.difference.dot(segment.difference));
        segment.inverse = 1/segment.length;
        segment.tangent = segment.difference*segment.inverse;
        segment.extra = Real{};
        segment.randomForce = segment.randomPair = segment.metricForce = Vec {};
    }
    CYLCHAIN_INLINE void describeEndOfFirst(const Vec* y, int s) {
        ImplicitSegment<Real>& segment = step.segments[s];
        const Vec difference = segment.difference+(y[s+1]-y[s]);
        segment.newTangent = difference*(1/root(difference.dot(difference)));
    }
};
