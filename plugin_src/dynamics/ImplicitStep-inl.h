// Included into the namespace of an instruction set. It does not compile alone.

/**
 * A step of the implicit schemes.
 *
 * A step solves, for the new nodes y, with the middle m = (x+y)/2 of the old and the new nodes,
 *
 *     Z(m) (y-x)/h = f + f_random(x) + f_drift(x) - sum_a T_a J_a(m)
 *
 * where the a are the lengths of segments, the bends of joints and the components of tethers, each with an energy
 * k q^2/2, J_a(m) is the gradient of q_a, and
 *
 *     T_a = k (theta q_a(y) + (1-theta) q_a(x) - (2 theta-1)^(1/2) q_random),    theta = max(1/2, 1-1/z).
 *
 * z is the step over the relaxation time of the fastest mode; q_random is drawn afresh from the equilibrium of q_a. For
 * linear forces and any h, the nodes have exactly the covariance k_B T/k then. The friction g of a length,
 * gamma_def/l^2, and its noise are parts of T_a rather than of Z and f_random, so that noise along a segment stays
 * along it when the segment turns. What lengths lack of the drift k_B T div(Z^-1) then is a metric force,
 *
 *     f_drift = -k_B T sum_a (k (2 theta-1) + g/h) H_a (Z/h+K)^-1 J_a
 *
 * with the second derivatives H_a of the lengths. It takes the blocks of the inverse next to its diagonal, which follow
 * from those of the elimination. In a flow u, friction is relative to u(m).
 *
 * In the scheme of second order, bends and tethers take two such stages. All this is explained in
 * docs/design/implicit_scheme.md.
 */

/** A step of open chains or, if CLOSED, of rings. */
template <int W, bool CLOSED> class ImplicitStep {
    typedef typename Lanes<W>::Type Real;
    typedef Vector<Real> Vec;
public:
    struct Memory {
        typename ImplicitState<W>::Memory state;
        typename ImplicitEquations<W, CLOSED>::Memory equations;
    };
    /**
     * @param start  the chains before the step
     */
    ImplicitStep(const Pack& pack, const StepSettings& settings, const StepStart<W>& start, Memory& memory) :
            step(pack, settings, start, memory.state), stages(step), noise(step), positions(step),
            twist(step), equations(step, twist, memory.equations), metricForces(step),
            tensions(step, equations.getEquationsOfSegments()), convergence(step) {
    }
    /**
     * Take one step.
     *
     * @param forces  the forces on nodes, but for those of the chains
     * @param y       receives how far the nodes move
     * @param failed  receives true for each lane that has not converged or a segment of which changes by more than a
     *                quarter of a turn would do
     * @param turned  receives by how much twists change, if chains have any
     * @return the number of iterations
     */
    __attribute__((noinline)) int take(const Vec* forces, Vec* y, bool* failed,
            typename DoubleLanes<W>::Type* turned) {
        begin(forces, y);
        for (int i = 0; i < W; i++)
            failed[i] = false;
        int iterations = 0;
        for (int stage = 0; stage < getNumStages(); stage++) {
            beginStage(stage, y);
            iterations += solve(y, failed);
        }
        convergence.findExcessiveChanges(y, failed);
        findTwists(y, turned);
        return iterations;
    }
    /** Describe the start of a step, and draw its noise. */
    __attribute__((noinline)) void begin(const Vec* forces, Vec* y) {
        for (int node = 0; node < step.n; node++) {
            y[node] = Vec {};
            step.external[node] = forces[node];
            if (step.twoStages)
                step.random[node] = step.drift[node] = Vec {};
        }
        addPropulsion<W>(step.pack, step.start.segments, step.external);
        stages.describe();
        if constexpr (HAS_BENDS_AT_REST)
            if (step.pack.twist.isBentAtRest())
                RestBends<W>::describe(step);
        if (step.settings.kT > 0)
            noise.draw();
        if (step.pack.twist.isPresent())
            twist.begin();
    }
    /** Find by how much twists have changed when nodes have moved by y. */
    void findTwists(const Vec* y, typename DoubleLanes<W>::Type* turned) {
        if (!step.pack.twist.isPresent())
            return;
        twist.findChanges(y, turned);
        if constexpr (HAS_BENDS_AT_REST)
            if (step.pack.twist.isBentAtRest())
                RestBends<W>::turnFrames(step, y, turned);
    }
    int getNumStages() const {
        return step.twoStages ? 2 : 1;
    }
    void beginStage(int stage, Vec* y) {
        stages.prepare(!step.twoStages ? Stage::Only : stage == 0 ? Stage::First : Stage::Second, y);
        if (step.stage == Stage::Second)
            positions.extrapolate(y);
        if (step.settings.flow.present && step.stage != Stage::Second)
            positions.carryAlong(y);
    }
    /** Linearise the equations around y, and solve them. */
    void eliminate(const Vec* y, int iteration) {
        equations.eliminate(y, iteration);
        equations.template substitute<Goal::Find>();
        if (step.pack.twist.isHeld)
            twist.shareTorque(equations, iteration);
    }
    /** Ask for the memory that eliminate() begins with. */
    void prefetchStart() const {
        for (int i = 0; i < 3 && i < step.n; i++)
            prefetch<IteratedSegment<Real> >(&step.segments[i]);
        prefetchFirst(step.loads, step.n);
        prefetchFirst(step.change, step.n);
        equations.prefetchElimination();
    }
    /** Finish the iteration, with what the linear equations have changed, and move the nodes of active lanes. */
    void advance(Vec* y, int iteration, Real active) {
        if (iteration > 0 || step.stage == Stage::Second) {
            if (step.settings.segmentForces == NULL || step.stage == Stage::First)
                equations.refine();
            else {
                tensions.beginRefinement();
                equations.refine();
                tensions.record(y, active);
            }
        }
        else if (step.settings.kT > 0) {
            if (metricForces.stiffenTautSegments()) {
                eliminate(y, iteration);
                equations.addForcesOfOthers();
            }
            metricForces.add(equations);
        }
        for (int node = 0; node < step.n; node++)
            y[node] = y[node]+step.change[node]*active;
        if (!CLOSED)
            positions.resetLengths(y);
    }
    /**
     * The first iteration has neither metric forces nor tensions along the mean segment, and the second one the
     * tensions of the first. With two, filaments that relax from straight shorten 2 to 5 % too fast in steps of 1 to
     * 3 us.
     */
    int leastIterations() const {
        const bool needsThree = step.stage == Stage::Only || step.settings.flow.varies();
        return needsThree ? 3 : step.stage == Stage::First ? 2 : 1;
    }
    const ImplicitConvergence<W>& getConvergence() const {
        return convergence;
    }
    ImplicitEquations<W, CLOSED>& getEquations() {
        return equations;
    }
    const ImplicitEquations<W, CLOSED>& getEquations() const {
        return equations;
    }
    Vec* getChange() {
        return step.change;
    }
private:
    ImplicitState<W> step;
    ImplicitStages<W> stages;
    ImplicitNoise<W> noise;
    ImplicitPositions<W> positions;
    ImplicitTwist<W, CLOSED> twist;
    ImplicitEquations<W, CLOSED> equations;
    MetricForces<W> metricForces;
    ImplicitTensions<W> tensions;
    ImplicitConvergence<W> convergence;

    /**
     * Solve the equations of a stage by Newton's method; returns the number of iterations, and marks lanes that fail.
     */
    int solve(Vec* y, bool* failed) {
        Real active = splat<Real>(1);
        int iterations = 0;
        const int most = Coordinates<W>::limitsOf(step.pack).iterations;
        while (iterations < most) {
            eliminate(y, iterations);
            advance(y, iterations, active);
            iterations++;
            if (iterations >= leastIterations() && !convergence.anyUnfinished(active))
                break;
        }
        for (int i = 0; i < W; i++)
            failed[i] |= lane(active, i) != 0;
        return iterations;
    }
};
