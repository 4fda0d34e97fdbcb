// Included into the namespace of an instruction set. It does not compile alone.

/**
 * What an implicit step adds in its first iteration: the metric forces of lengths, and friction for taut segments.
 */

/** The tension of a segment turns it back by this much of what resists, in a step. */
const Scalar NEARLY_TAUT = 0.5;

template <int W, bool CLOSED> class MetricForces {
    typedef typename Lanes<W>::Type Real;
    typedef Vector<Real> Vec;
public:
    explicit MetricForces(ImplicitState<W>& step) : step(step), pack(step.pack), h(step.h), segments(step.segments),
            random(step.random), drift(step.drift) {
    }
    /** Add the metric forces of the lengths, in the first iteration, where the directions are those of the start. */
    void add(const ImplicitEquations<W, CLOSED>& equations) {
        equations.findResponses([&] (int s, Vec response) {
            ImplicitSegment<Real>& segment = segments[s];
            const Vec t = segment.tangent;
            const Real stiffness = property<Real>(pack, s, Pack::Stiffness);
            const Real drag = property<Real>(pack, s, Pack::Extensional)/(segment.length*segment.length*h);
            Real noise = stiffness*(2*segment.theta-1)+drag;
            // The length resists more in the second stage than in this one.
            if (step.twoStages)
                noise = noise/(1+stiffness*(segment.theta-DIAGONAL)*t.dot(response));
            response = response-t*t.dot(response);
            const Vec force = response*(step.kT*noise/segment.length);
            segment.metricForce = force;
            drift[s] = drift[s]+force;
            drift[s+1] = drift[s+1]-force;
        });
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
    Vec *const random, *const drift;

    /**
     * The friction of a segment's ends against turning, and the stiffness with which its tension turns it back, in a
     * step.
     */
    void turningRates(int s, Real& friction, Real& tension) const {
        const Real l0 = property<Real>(pack, s, Pack::RestLength);
        friction = 0.25*property<Real>(pack, s, Pack::Perpendicular)+
                property<Real>(pack, s, Pack::Rotational)/(l0*l0)+0.5*loaded<Real>(pack.nodeFriction, 0)+TINY;
        friction = friction+(h/step.shareOfForces())*Elements<W>::template stiffnessAgainstTurning<Real>(pack, s);
        tension = (h/step.shareOfForces())*segments[s].multiplier/segments[s].length;
    }
};
