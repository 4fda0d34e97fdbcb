// Included into the namespace of an instruction set. It does not compile alone.

/**
 * What an implicit step adds in its first iteration: the metric forces of lengths, and friction for taut segments.
 */

/** The tension of a segment turns it back by this much of what resists, in a step. */
const Scalar NEARLY_TAUT = 0.5;

/**
 * What responses are used for: for metric forces, or for the compliances of the places of couplings. A type that is for
 * both, one of which it is made with, is that of rings: their responses take long to compile.
 */
template <int W, bool FORCES, bool COMPLIANCES> class UseOfResponses {
    typedef typename Lanes<W>::Type Real;
    typedef Vector<Real> Vec;
public:
    static constexpr bool NEEDS_BLOCKS = COMPLIANCES;
    /** Let the segments of a step receive their metric forces. */
    explicit UseOfResponses(ImplicitState<W>& step) : step(&step) {
    }
    /** Find the compliances of some terms, in the order of their nodes, six numbers each. */
    UseOfResponses(const CouplingTerm* terms, int count, double* compliances) : terms(terms), next(count),
            compliances(compliances) {
    }
    CYLCHAIN_INLINE void takeResponse(int s, Vec response) const {
        if (!FORCES || (COMPLIANCES && step == NULL))
            return;
        const Pack& pack = step->pack;
        ImplicitSegment<Real>& segment = step->segments[s];
        const Vec t = segment.tangent;
        const Real stiffness = property<Real>(pack, s, Pack::Stiffness);
        const Real drag = property<Real>(pack, s, Pack::Extensional)/(segment.length*segment.length*step->h);
        Real noise = stiffness*(2*segment.theta-1)+drag;
        // The length resists more in the second stage than in this one.
        if (step->twoStages)
            noise = noise/(1+stiffness*(segment.theta-DIAGONAL)*t.dot(response));
        response = response-t*t.dot(response);
        const Vec force = response*(step->kT*noise/segment.length);
        segment.metricForce = force;
        step->drift[s] = step->drift[s]+force;
        step->drift[s+1] = step->drift[s+1]-force;
    }
    CYLCHAIN_INLINE void takeBlocks(int s, const Symmetric<Real>& first, const Matrix<Real>& both,
            const Symmetric<Real>& second) const {
        for (; COMPLIANCES && next > 0 && terms[next-1].node == s; next--)
            findCompliance(terms[next-1], first, both, second, compliances+6*(next-1));
    }
private:
    ImplicitState<W>* const step = NULL;
    const CouplingTerm* const terms = NULL;
    mutable int next = 0;
    double* const compliances = NULL;

    // Copies of the blocks, which stay in registers where no term is.
    static __attribute__((noinline)) void findCompliance(const CouplingTerm& term, Symmetric<Real> first,
            Matrix<Real> both, Symmetric<Real> second, double* result) {
        const double f = term.fraction, g = 1-f;
        const int i = term.lane;
        auto mean = [&] (Real& a, Real& ab, Real& ba, Real& b) {
            return g*g*lane(a, i)+f*g*(lane(ab, i)+lane(ba, i))+f*f*lane(b, i);
        };
        result[0] = mean(first.xx, both.x.x, both.x.x, second.xx);
        result[1] = mean(first.yx, both.x.y, both.y.x, second.yx);
        result[2] = mean(first.zx, both.x.z, both.z.x, second.zx);
        result[3] = mean(first.yy, both.y.y, both.y.y, second.yy);
        result[4] = mean(first.zy, both.y.z, both.z.y, second.zy);
        result[5] = mean(first.zz, both.z.z, both.z.z, second.zz);
    }
};

template <int W> class MetricForces {
    typedef typename Lanes<W>::Type Real;
    typedef Vector<Real> Vec;
public:
    explicit MetricForces(ImplicitState<W>& step) : step(step), pack(step.pack), h(step.h), segments(step.segments),
            random(step.random) {
    }
    /** Add the metric forces of the lengths, in the first iteration, where the directions are those of the start. */
    template <bool CLOSED> CYLCHAIN_INLINE void add(const ImplicitEquations<W, CLOSED>& equations) {
        equations.findResponses(UseOfResponses<W, true, CLOSED>(step));
        step.combineForces();
    }
    /**
     * Give friction and its noise to segments that are taut: whose tension turns them back faster than a step resolves.
     *
     * @return whether any chain has a segment that comes near to it
     */
    bool stiffenTautSegments() {
        Real greatest = Real{};
        for (int s = 0; s < pack.segments; s++) {
            Real friction, tension;
            turningRates(s, friction, tension);
            greatest = larger<Real>(greatest, tension/friction);
        }
        bool any = false;
        Real taut = Real{};
        for (int i = 0; i < W; i++)
            if (lane(greatest, i) > NEARLY_TAUT) {
                lane(taut, i) = 1;
                any = true;
            }
        if (!any)
            return false;
        for (int s = 0; s < pack.segments; s++) {
            Real friction, tension;
            turningRates(s, friction, tension);
            ImplicitSegment<Real>& segment = segments[s];
            const Real rotational = property<Real>(pack, s, Pack::Rotational);
            segment.extra = taut*larger<Real>(0.5*tension-friction, Real{})*segment.length*segment.length;
            // Chains that are not taut solve the same equations once more.
            segment.multiplier = segment.multiplier*taut;
            const Vec pair = segment.randomPair*(root(1+segment.extra/(rotational+TINY))-1);
            random[s] = random[s]-pair;
            random[s+1] = random[s+1]+pair;
        }
        step.combineForces();
        return true;
    }
private:
    ImplicitState<W>& step;
    const Pack& pack;
    const Scalar h;
    ImplicitSegment<Real>* const segments;
    Vec* const random;

    /**
     * The friction of a segment's ends against turning, and the stiffness with which its tension turns it back, in a
     * step.
     */
    void turningRates(int s, Real& friction, Real& tension) const {
        const Real l0 = property<Real>(pack, s, Pack::RestLength);
        friction = 0.25*property<Real>(pack, s, Pack::Perpendicular)+
                property<Real>(pack, s, Pack::Rotational)/(l0*l0)+0.5*loaded<Real>(pack.nodeFriction, 0)+TINY;
        friction = friction+(h/step.shareOfForces())*Coordinates<W>::template stiffnessAgainstTurning<Real>(pack, s);
        tension = (h/step.shareOfForces())*segments[s].multiplier/segments[s].length;
    }
};
