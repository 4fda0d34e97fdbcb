// Included into the namespace of an instruction set. It does not compile alone.

/**
 * What an implicit step begins with, and what each of its stages makes of that: the coefficients of the tensions.
 */

/**
 * With all of theta, modes that a step just resolves decay too slowly. With less, the fastest ones change their sign
 * from step to step, by (1-theta)/theta of themselves, which is forgotten after a few.
 */
const Scalar LARGEST_THETA_OF_LINEAR_BENDS = 0.8;

template <int W, bool CLOSED> class ImplicitStages {
    typedef typename Lanes<W>::Type Real;
    typedef Vector<Real> Vec;
public:
    explicit ImplicitStages(ImplicitState<W>& step) : step(step), pack(step.pack), n(step.n), h(step.h),
            segments(step.segments), tethers(step.tethers) {
    }
    /** Describe the start of a step, without noise. */
    void describe() {
        const Real ofNode = loaded<Real>(pack.nodeFriction, 0);
        for (int s = 0; s < n-1; s++) {
            ImplicitSegment<Real>& segment = segments[s];
            segment.difference = step.start.segments[s];
            segment.length = root(segment.difference.dot(segment.difference));
            segment.inverse = 1/segment.length;
            segment.tangent = segment.difference*segment.inverse;
            const Real l0 = property<Real>(pack, s, Pack::RestLength);
            Real slope;
            stretchCoordinate<Real>(pack.stretching, property<Real>(pack, s, Pack::InverseExtension), segment.length-l0,
                    segment.coordinate, slope);
            const Real stretchRate = h*property<Real>(pack, s, Pack::Stiffness)*l0*l0+TINY;
            const Real friction = property<Real>(pack, s, Pack::Extensional)+ofNode*(0.25*l0*l0);
            segment.theta = larger<Real>(splat<Real>(0.5), 1-friction/stretchRate);
            segment.randomCoordinate = segment.randomTension = segment.multiplier = segment.extra = Real{};
            segment.randomBend = segment.randomForce = segment.randomPair = segment.metricForce = Vec {};
            if (s > 0 && isLinear(pack.bending))
                describeLinearBend(s);
            else if (s > 0)
                describeJoint(s);
        }
        for (std::size_t i = 0; i < pack.tethers.size(); i++)
            describeTether(pack.tethers[i], step.start.tethers[i], tethers[i]);
    }
    /** Describe a stage. The second one begins with the end of the first, y. */
    void prepare(Stage next, const Vec* y) {
        step.stage = next;
        Vec before = {};
        for (int s = 0; s < n-1; s++) {
            ImplicitSegment<Real>& segment = segments[s];
            if (step.stage == Stage::First) {
                segment.implicit = segment.jointImplicit = splat<Real>(DIAGONAL);
                segment.constantCoordinate = segment.randomCoordinate*(-DIAGONAL*NOISE_OF_FIRST);
                segment.constantTension = segment.randomTension*-NOISE_OF_FIRST;
                segment.constantBend = Vec {};
                segment.turningBend = segment.randomBend*splat<Real>(DIAGONAL*NOISE_OF_FIRST);
                continue;
            }
            segment.implicit = segment.theta;
            segment.constantCoordinate =
                    (1-segment.theta)*segment.coordinate-segment.randomCoordinate*root(2*segment.theta-1);
            segment.constantTension = -segment.randomTension;
            if (step.stage == Stage::Only) {
                segment.jointImplicit = segment.jointTheta;
                segment.constantBend = segment.bend*(1-segment.jointTheta);
                segment.turningBend = segment.randomBend*root(2*segment.jointTheta-1);
            }
            else {
                const Vec difference = segment.difference+(y[s+1]-y[s]);
                const bool linear = isLinear(pack.bending);
                const Vec tangent = linear ? difference : difference*(1/root(difference.dot(difference)));
                const Vec bent = tangent-before;
                if (s > 0)
                    segment.constantBend = bent*((linear ? splat<Real>(1) : bendFactor(pack.bending, bent).f)*
                            (1-DIAGONAL));
                before = tangent;
                segment.jointImplicit = splat<Real>(DIAGONAL);
                segment.turningBend = segment.randomBend*splat<Real>(2*DIAGONAL);
                segment.multiplier = segment.multiplier*(1/NOISE_OF_FIRST);
            }
        }
        for (std::size_t i = 0; i < pack.tethers.size(); i++)
            prepareTether(pack.tethers[i], tethers[i], y);
        step.combineForces();
    }
private:
    ImplicitState<W>& step;
    const Pack& pack;
    const int n;
    const Scalar h;
    ImplicitSegment<Real>* const segments;
    ImplicitTether* const tethers;

    void describeJoint(int s) {
        ImplicitSegment<Real>& segment = segments[s];
        const Vec sum = segments[s-1].tangent+segment.tangent, bent = segment.tangent-segments[s-1].tangent;
        segment.bisector = sum*(1/root(sum.dot(sum)+TINY));
        segment.bend = bent*bendFactor(pack.bending, bent).f;
        const Real l0 = property<Real>(pack, s, Pack::RestLength);
        const Real friction = lesser<Real>(property<Real>(pack, s-1, Pack::Rotational),
                property<Real>(pack, s, Pack::Rotational))+loaded<Real>(pack.nodeFriction, 0)*(0.25*l0*l0);
        const Real bendRate = 4*h*loaded<Real>(pack.joints, s)+TINY;
        segment.jointTheta = larger<Real>(splat<Real>(0.5), 1-friction/bendRate);
    }
    /** The bend that alternates from node to node has four times the bend of a node, and relaxes as sixteen of them. */
    void describeLinearBend(int s) {
        ImplicitSegment<Real>& segment = segments[s];
        segment.bend = segment.difference-segments[s-1].difference;
        const Real inverse = property<Real>(pack, s, Pack::InverseRestLength);
        const Real friction = loaded<Real>(pack.nodeFriction, 0)+
                4*inverse*inverse*property<Real>(pack, s, Pack::Rotational);
        const Real bendRate = 16*h*loaded<Real>(pack.joints, s)+TINY;
        segment.jointTheta = lesser<Real>(splat<Real>(LARGEST_THETA_OF_LINEAR_BENDS),
                larger<Real>(splat<Real>(0.5), 1-friction/bendRate));
    }
    void describeTether(const LaneTether& tether, const TetherVector& start, ImplicitTether& result) {
        std::copy(start.d, start.d+3, result.start);
        double friction = pack.nodeFriction[tether.lane];
        for (int side = tether.node-1; side <= tether.node; side++) {
            const int s = CLOSED && side < 0 ? pack.segments-1 : side;
            if (s >= 0 && s < pack.segmentsOfLane[tether.lane]) {
                Real parallel = property<Real>(pack, s, Pack::Parallel), l0 = property<Real>(pack, s, Pack::RestLength);
                Real extensional = property<Real>(pack, s, Pack::Extensional);
                const double length = lane(l0, tether.lane);
                friction += 0.25*lane(parallel, tether.lane)+lane(extensional, tether.lane)/(length*length);
            }
        }
        result.theta = std::fmax(0.5, 1-friction/(h*tether.stiffness+TINY));
        for (double& random : result.random)
            random = 0;
    }
    void prepareTether(const LaneTether& place, ImplicitTether& tether, const Vec* y) const {
        tether.implicit = step.stage == Stage::Only ? tether.theta : DIAGONAL;
        const Vec moved = y[place.node];
        Real components[] = {moved.x, moved.y, moved.z};
        for (int k = 0; k < 3; k++) {
            if (step.stage == Stage::Only)
                tether.constant[k] = tether.start[k]-std::sqrt(2*tether.theta-1)*tether.random[k];
            else if (step.stage == Stage::First)
                tether.constant[k] = DIAGONAL*(tether.start[k]-NOISE_OF_FIRST*tether.random[k]);
            else
                tether.constant[k] = tether.start[k]+(1-DIAGONAL)*lane(components[k], place.lane)-
                        2*DIAGONAL*tether.random[k];
        }
    }
};
