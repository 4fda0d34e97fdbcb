// Included into the namespace of an instruction set. It does not compile alone.

/**
 * The implicit schemes over the segments of a pack.
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
 * linear forces and any h, the nodes have exactly the covariance k_B T/k then. The friction g of a length, gamma_def/l^2,
 * and its noise are parts of T_a rather than of Z and f_random, so that noise along a segment stays along it when the
 * segment turns. What lengths lack of the drift k_B T div(Z^-1) then is a metric force,
 *
 *     f_drift = -k_B T sum_a (k (2 theta-1) + g/h) H_a (Z/h+K)^-1 J_a
 *
 * with the second derivatives H_a of the lengths. It takes the blocks of the inverse next to its diagonal, which follow
 * from those of the elimination. In a flow u, friction is relative to u(m).
 *
 * In the scheme of second order, bends and tethers take two such stages. IMPLICIT_SCHEME.md explains all this.
 */

/** The largest change of a segment in the last iteration, over its rest length; a fifth of it remains as an error. */
const Scalar NEWTON_TOLERANCE = 1e-2;
/** The largest change of a node in the last iteration, over that length. */
const Scalar NODE_TOLERANCE = 0.1;
/** The largest error of a length that an iteration leaves, over its thermal fluctuation against what resists in a step. */
const Scalar LENGTH_TOLERANCE = 0.07;
const int NEWTON_ITERATIONS = 14;
/** A step that does not converge is cut into at most two to this power. */
const int LARGEST_DIVISION = 10;
/** The part of the friction against turning that compression may take away in the iteration's matrix. */
const Scalar COMPRESSION = 0.9;
/** A bend is drawn as a Gaussian with rejection if the joint is stiffer than this many k_B T, or else from the sphere. */
const Scalar STIFF_JOINT = 2;
/** The tension of a segment turns it back by this much of what resists, in a step. */
const Scalar NEARLY_TAUT = 0.5;

/** Two vectors that are orthogonal to a unit vector and to each other (Duff et al., J. Comput. Graph. Tech. 2017, 6, 1). */
template <class Real> CYLCHAIN_INLINE void orthogonal(const Vector<Real>& n, Vector<Real>& first, Vector<Real>& second) {
    Real sign;
    Vector<Real> copy = n;
    for (int i = 0; i < (int) (sizeof(Real)/sizeof(Scalar)); i++)
        lane(sign, i) = std::copysign(1.0, lane(copy.z, i));
    const Real a = -1/(sign+n.z), b = n.x*n.y*a;
    first = {1+sign*n.x*n.x*a, sign*b, -sign*n.x};
    second = {b, sign+n.y*n.y*a, -n.y};
}

/** What a step keeps of a segment, and of the joint with the segment before. */
template <class Real> struct ImplicitSegment {
    // At the start: the vector, its direction and length, the coordinate of the length, and the bend.
    Vector<Real> difference, tangent, bend, bisector;
    Real length, inverse, coordinate;
    // The noise, and theta of the segment and of the joint.
    Vector<Real> randomBend, randomForce, randomPair, metricForce;
    Real randomCoordinate, randomTension, theta, jointTheta;
    // What a stage makes of these: T = k (implicit q(y)+constant), with a part of the bend that turns with the joint.
    Vector<Real> constantBend, turningBend;
    Real implicit, constantCoordinate, constantTension, jointImplicit;
    // Of the last iteration: the direction of the new segment, its tension and how the tension changes.
    Vector<Real> newTangent;
    Real tension, response, multiplier, extra, tensionOfFlow;
    // The part of the response that stays with the nodes; what the direction of the tension lacks of the mean one; and the
    // tension that it was given.
    Real shift, multiplierBefore;
    Vector<Real> turned;
};

/** The vector from the point of a tether to its node. */
struct TetherVector {
    double d[3];
};

/** What a step keeps of a tether: the vector from its point to its node at the start, its noise, and the same of a stage. */
struct ImplicitTether {
    double start[3], random[3], theta;
    double constant[3], implicit;
};

/**
 * What a step begins with: the vectors of the segments and those of tethers. In single precision, they say more than the
 * nodes, which may be far from the origin: only a flow looks at these.
 */
template <int W> struct StepStart {
    Vector<typename Lanes<W>::Type> *nodes, *segments;
    TetherVector* tethers;
};

/** The stages that steps are made of: the one of scheme "implicit", and the two of second order. */
enum class Stage {Only, First, Second};
/** The stages of second order are those of the L-stable singly diagonally implicit method, with this on the diagonal. */
const Scalar DIAGONAL = 1-M_SQRT1_2;
/** The first stage has this part of the noise, and its end is where that of the second begins. */
const Scalar NOISE_OF_FIRST = DIAGONAL/(1-DIAGONAL);
/** The tolerances of its stages over those of scheme "implicit". */
const Scalar TOLERANCE_OF_STAGES = 0.3;

/** A step of open chains or, if CLOSED, of rings. */
template <int W, bool CLOSED> class ImplicitStep {
    typedef typename Lanes<W>::Type Real;
    typedef Vector<Real> Vec;
    typedef Matrix<Real> Mat;
    typedef TensionBand<W, CLOSED> Band;
    typedef typename Band::Row Row;
public:
    struct Memory {
        Scratch segments, vectors, tethers;
        typename Band::Memory band;
    };
    ImplicitStep(const Pack& pack, const StepSettings& settings, Memory& memory) : pack(pack), settings(settings),
            n(pack.nodes), h(settings.stepSize), kT(settings.kT), band(pack, memory.band) {
        tethers = memory.tethers.template reserve<ImplicitTether>(pack.tethers.size());
        segments = memory.segments.template reserve<ImplicitSegment<Real> >(n);
        f = memory.vectors.template reserve<Vec>(7*n);
        change = f+n;
        rest = f+2*n;
        loads = settings.flow.present ? f+3*n : f;
        twoStages = settings.scheme == Scheme::ImplicitSecondOrder;
        external = twoStages ? f+4*n : f;
        random = twoStages ? f+5*n : f;
        drift = twoStages ? f+6*n : f;
    }
    /**
     * Take one step.
     *
     * @param start   the chains before the step
     * @param forces  the forces on nodes, but for those of the chains
     * @param y       receives how far the nodes move
     * @param failed  receives true for each lane that has not converged or a segment of which changes by more than a
     *                quarter of a turn would do
     * @return the number of iterations
     */
    int take(const StepStart<W>& start, const Vec* forces, Vec* y, bool* failed) {
        x = start.nodes;
        for (int node = 0; node < n; node++) {
            y[node] = Vec {};
            external[node] = forces[node];
            if (twoStages)
                random[node] = drift[node] = Vec {};
        }
        addPropulsion<W>(pack, start.segments, external);
        describe(start);
        if (settings.kT > 0)
            addNoise();
        for (int i = 0; i < W; i++)
            failed[i] = false;
        int iterations = 0;
        if (twoStages) {
            prepare(Stage::First, y);
            iterations = solve(y, failed);
            prepare(Stage::Second, y);
            extrapolate(y);
        }
        else
            prepare(Stage::Only, y);
        iterations += solve(y, failed);
        findExcessiveChanges(y, failed);
        return iterations;
    }
private:
    const Pack& pack;
    const StepSettings& settings;
    const int n;
    const Scalar h, kT;
    Band band;
    ImplicitSegment<Real>* segments;
    ImplicitTether* tethers;
    const Vec* x;
    bool twoStages;
    Stage stage;
    // All forces of a stage, the same with the drag of the flow, the changes of an iteration, and memory of its own.
    Vec *f, *loads, *change, *rest;
    // Forces from outside, of noise and the metric ones; all of them are f if there is one stage alone.
    Vec *external, *random, *drift;

    /** Solve the equations of a stage by Newton's method; returns the number of iterations, and marks lanes that fail. */
    int solve(Vec* y, bool* failed) {
        if (settings.flow.present && stage != Stage::Second)
            carryAlong(y);
        // The first iteration has neither metric forces nor tensions along the mean segment, and the second one the tensions
        // of the first. With two, filaments that relax from straight shorten 2 to 5 % too fast in steps of 1 to 3 us.
        const int least = stage == Stage::Only || settings.flow.varies() ? 3 : stage == Stage::First ? 2 : 1;
        Real active = 1+Real{};
        int iterations = 0;
        while (iterations < NEWTON_ITERATIONS) {
            eliminate(y);
            substitute<false>();
            if (iterations > 0 || stage == Stage::Second) {
                if (settings.segmentForces == NULL || stage == Stage::First)
                    refine();
                else
                    refineAndRecord(y, active);
            }
            else if (settings.kT > 0) {
                if (stiffenTautSegments()) {
                    eliminate(y);
                    substitute<false>();
                }
                addMetricForces();
            }
            for (int node = 0; node < n; node++)
                y[node] = y[node]+change[node]*active;
            if (!CLOSED)
                resetLengths(y);
            iterations++;
            if (iterations >= least && !anyUnfinished(active))
                break;
        }
        for (int i = 0; i < W; i++)
            failed[i] |= lane(active, i) != 0;
        return iterations;
    }
    /** How much of the forces that last for the whole step a stage has. */
    Scalar shareOfForces() const {
        return stage == Stage::First ? DIAGONAL : 1;
    }
    /** Describe a stage. The second one begins with the end of the first, y. */
    void prepare(Stage next, const Vec* y) {
        stage = next;
        Vec before = {};
        for (int s = 0; s < n-1; s++) {
            ImplicitSegment<Real>& segment = segments[s];
            if (stage == Stage::First) {
                segment.implicit = segment.jointImplicit = DIAGONAL+Real{};
                segment.constantCoordinate = segment.randomCoordinate*(-DIAGONAL*NOISE_OF_FIRST);
                segment.constantTension = segment.randomTension*-NOISE_OF_FIRST;
                segment.constantBend = Vec {};
                segment.turningBend = segment.randomBend*(DIAGONAL*NOISE_OF_FIRST+Real{});
                continue;
            }
            segment.implicit = segment.theta;
            segment.constantCoordinate = (1-segment.theta)*segment.coordinate-segment.randomCoordinate*root(2*segment.theta-1);
            segment.constantTension = Real{}-segment.randomTension;
            if (stage == Stage::Only) {
                segment.jointImplicit = segment.jointTheta;
                segment.constantBend = segment.bend*(1-segment.jointTheta);
                segment.turningBend = segment.randomBend*root(2*segment.jointTheta-1);
            }
            else {
                const Vec difference = segment.difference+(y[s+1]-y[s]);
                const Vec tangent = difference*(1/root(difference.dot(difference)));
                const Vec bent = tangent-before;
                if (s > 0)
                    segment.constantBend = bent*(bendFactor<Real>(pack.bending, bent).f*(1-DIAGONAL));
                before = tangent;
                segment.jointImplicit = DIAGONAL+Real{};
                segment.turningBend = segment.randomBend*(2*DIAGONAL+Real{});
                segment.multiplier = segment.multiplier*(1/NOISE_OF_FIRST);
            }
        }
        for (std::size_t i = 0; i < pack.tethers.size(); i++)
            prepareTether(pack.tethers[i], tethers[i], y);
        combineForces();
    }
    void prepareTether(const LaneTether& place, ImplicitTether& tether, const Vec* y) const {
        tether.implicit = stage == Stage::Only ? tether.theta : DIAGONAL;
        const Vec moved = y[place.node];
        Real components[] = {moved.x, moved.y, moved.z};
        for (int k = 0; k < 3; k++) {
            if (stage == Stage::Only)
                tether.constant[k] = tether.start[k]-std::sqrt(2*tether.theta-1)*tether.random[k];
            else if (stage == Stage::First)
                tether.constant[k] = DIAGONAL*(tether.start[k]-NOISE_OF_FIRST*tether.random[k]);
            else
                tether.constant[k] = tether.start[k]+(1-DIAGONAL)*lane(components[k], place.lane)-2*DIAGONAL*tether.random[k];
        }
    }
    /** Add the forces of a stage. */
    void combineForces() {
        if (!twoStages)
            return;
        const Real ofForces = shareOfForces()+Real{}, ofNoise = (stage == Stage::First ? NOISE_OF_FIRST : 1)+Real{};
        for (int node = 0; node < n; node++)
            f[node] = external[node]*ofForces+random[node]*ofNoise+drift[node]*(ofNoise*ofNoise);
    }
    /** Begin the second stage where the noise of the first would have taken chains, had it been that of the whole step. */
    void extrapolate(Vec* y) const {
        const Real scale = 1/NOISE_OF_FIRST+Real{}, free = CLOSED ? Real{} : loaded<Real>(pack.free, 0);
        Vec end = y[0];
        for (int node = 0; node < n; node++) {
            const Vec found = y[node];
            y[node] = found+found*((scale-1)*free);
            rest[node] = found-end;
            if (node > 0)
                rest[node] = rest[node]+segments[node-1].difference;
            end = found;
        }
        if (!CLOSED)
            rebuild(y, [&] (int s, const Vec&) {return root(rest[s+1].dot(rest[s+1]));});
    }

    /**
     * Begin the iteration where the flow carries chains as a whole, if no node of them is fixed. Segments stay what they
     * are, and the matrix symmetric.
     */
    void carryAlong(Vec* y) const {
        const LaneFlow<W> flow(settings.flow, pack, x);
        const Vec halfway = x[0]+flow.at(x[0])*(Scalar(0.5)*h*shareOfForces()+Real{});
        const Real free = loaded<Real>(pack.free, 0);
        const Vec carried = flow.at(halfway)*(free*(h*shareOfForces()));
        for (int node = 0; node < n; node++)
            y[node] = y[node]+carried;
    }
    /**
     * Segments that turn far become longer when their ends move along straight lines. Give them the directions that they
     * have now, and the lengths that the linear equations mean.
     */
    void resetLengths(Vec* y) const {
        rebuild(y, [&] (int s, const Vec& difference) {
            const ImplicitSegment<Real>& segment = segments[s];
            const Real length = larger<Real>(segment.newTangent.dot(difference), 0.5*segment.length);
            return pack.stretching == StretchingModel::FENE ? withinRange(s, length) : length;
        });
    }
    /** Give segments other lengths, around the same mean of all nodes. Chains with fixed nodes stay as they are. */
    template <class Function> CYLCHAIN_INLINE void rebuild(Vec* y, Function lengthOf) const {
        Vec sum = {}, shifted = {}, end = y[0], moved = y[0];
        Real count = Real{};
        for (int node = 0; node < n; node++) {
            const Real mobile = loaded<Real>(pack.mobile, node);
            if (node > 0) {
                const Vec change = y[node]-end, difference = segments[node-1].difference+change;
                moved = moved+change+difference*(lengthOf(node-1, difference)/root(difference.dot(difference))-1);
                end = y[node];
            }
            sum = sum+end*mobile;
            shifted = shifted+moved*mobile;
            count = count+mobile;
            rest[node] = moved;
        }
        const Vec back = (sum-shifted)*(1/larger<Real>(count, 1+Real{}));
        const Real free = loaded<Real>(pack.free, 0);
        for (int node = 0; node < n; node++)
            y[node] = y[node]+(rest[node]+back-y[node])*free;
    }
    /** A length that a FENE segment can have. */
    CYLCHAIN_INLINE Real withinRange(int s, Real length) const {
        const Real rest = property<Real>(pack, s, Pack::RestLength);
        const Real range = Scalar(1-1e-9)/(property<Real>(pack, s, Pack::InverseExtension)+TINY);
        return larger<Real>(lesser<Real>(length, rest+range), rest-range);
    }
    /** Describe the start of a step, without noise. */
    void describe(const StepStart<W>& start) {
        for (int s = 0; s < n-1; s++) {
            ImplicitSegment<Real>& segment = segments[s];
            segment.difference = start.segments[s];
            segment.length = root(segment.difference.dot(segment.difference));
            segment.inverse = 1/segment.length;
            segment.tangent = segment.difference*segment.inverse;
            const Real l0 = property<Real>(pack, s, Pack::RestLength);
            Real slope;
            stretchCoordinate(pack.stretching, property<Real>(pack, s, Pack::InverseExtension), segment.length-l0,
                    segment.coordinate, slope);
            const Real stretchRate = h*property<Real>(pack, s, Pack::Stiffness)*l0*l0+TINY;
            segment.theta = larger<Real>(0.5+Real{}, 1-property<Real>(pack, s, Pack::Extensional)/stretchRate);
            segment.randomCoordinate = segment.randomTension = segment.multiplier = segment.extra = Real{};
            segment.randomBend = segment.randomForce = segment.randomPair = segment.metricForce = Vec {};
            if (s > 0)
                describeJoint(s);
        }
        for (std::size_t i = 0; i < pack.tethers.size(); i++)
            describeTether(pack.tethers[i], start.tethers[i], tethers[i]);
    }
    void describeJoint(int s) {
        ImplicitSegment<Real>& segment = segments[s];
        const Vec sum = segments[s-1].tangent+segment.tangent, bent = segment.tangent-segments[s-1].tangent;
        segment.bisector = sum*(1/root(sum.dot(sum)+TINY));
        segment.bend = bent*bendFactor<Real>(pack.bending, bent).f;
        const Real friction = lesser<Real>(property<Real>(pack, s-1, Pack::Rotational),
                property<Real>(pack, s, Pack::Rotational));
        const Real bendRate = 4*h*loaded<Real>(pack.joints, s)+TINY;
        segment.jointTheta = larger<Real>(0.5+Real{}, 1-friction/bendRate);
    }
    void describeTether(const LaneTether& tether, const TetherVector& start, ImplicitTether& result) {
        std::copy(start.d, start.d+3, result.start);
        double friction = 0;
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
    /** Draw the random forces, lengths and bends, and those of tethers. */
    void addNoise();
    void drawForces(const Real* normals, int s, Scalar amplitude);
    void drawLength(const NoisePlaces<W>& places, int s, Real normal);
    void drawBend(const NoisePlaces<W>& places, int s);
    /** In a plane, a bend has one component, and its angle a uniform measure. */
    void drawPlanarBend(const NoisePlaces<W>& places, int s);
    /** The new segment, and the one between the old nodes and the new. */
    struct Geometry {
        Vec difference, tangent, middleTangent;
        Real length, inverse, middleInverse;
    };
    /** Linearise the equations around y, and eliminate the nodes from first to last. */
    void eliminate(const Vec* y) {
        if (settings.flow.present)
            addDragOfFlow(y);
        Row rows[3];
        Row *before = rows, *here = rows+1, *after = rows+2;
        // Roots and divisions take long: those of the segment ahead come before the node is eliminated.
        Geometry previous = {}, current, ahead;
        JointGeometry joint = {}, jointAhead = {};
        std::size_t tether = 0;
        band.begin();
        *here = Row {};
        here->right = loads[0];
        describeNew(y, 0, ahead);
        for (int s = 0; s < n-1; s++) {
            if constexpr (CLOSED)
                *after = Row {};
            current = ahead;
            joint = jointAhead;
            if (!CLOSED || s < pack.segments)
                addSegment(y, s, current, *here, *after);
            else {
                // The last segment of a ring that is unrolled is there for its joint alone.
                here->upper = Mat {};
                after->diagonal = Symmetric<Real> {};
                after->right = loads[s+1];
            }
            addTethers(y, s, tether, *here);
            if (s > 0)
                addJoint(s, joint, previous, current, *before, *here, *after);
            if (s < n-2) {
                describeNew(y, s+1, ahead);
                describeNewJoint(s+1, current, ahead, jointAhead);
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
            addTethers(y, n-1, tether, *here);
            band.template eliminate<1>(n-2, *before, *here, *after);
            band.template eliminate<0>(n-1, *here, *after, *before);
        }
    }
    /** Add the drag of the flow, at the middle of the step, on segments at rest. Its part along a segment is a tension. */
    void addDragOfFlow(const Vec* y) {
        const LaneFlow<W> flow(settings.flow, pack, x);
        const Real share = shareOfForces()+Real{};
        for (int node = 0; node < n; node++)
            loads[node] = f[node];
        for (int s = 0; s < pack.segments; s++) {
            Vec carried, pair;
            findDragOfFlow(flow, y, s, carried, pair);
            loads[s] = loads[s]+(carried-pair)*share;
            loads[s+1] = loads[s+1]+(carried+pair)*share;
        }
    }
    /** The drag of the flow on a segment: what each end gets, and what the second one has more and the first one less. */
    CYLCHAIN_INLINE void findDragOfFlow(const LaneFlow<W>& flow, const Vec* y, int s, Vec& carried, Vec& pair) {
        Geometry geometry;
        describeNew(y, s, geometry);
        const Vec direction = geometry.middleTangent;
        const Vec u1 = flow.at(x[s]+y[s]*(0.5+Real{})), u2 = flow.at(x[s+1]+y[s+1]*(0.5+Real{}));
        const Vec sum = u1+u2, difference = u2-u1;
        const Real across = 0.25*property<Real>(pack, s, Pack::Perpendicular);
        const Real along = 0.25*property<Real>(pack, s, Pack::Parallel);
        const Real turn = property<Real>(pack, s, Pack::Rotational)*turningFactor(s, geometry);
        const Real stretch = property<Real>(pack, s, Pack::Extensional)*segments[s].inverse*geometry.inverse;
        carried = sum*across+direction*((along-across)*direction.dot(sum));
        pair = (difference-direction*direction.dot(difference))*turn;
        segments[s].tensionOfFlow = stretch*direction.dot(difference)*shareOfForces();
    }
    CYLCHAIN_INLINE void describeNew(const Vec* y, int s, Geometry& geometry) {
        geometry.difference = segments[s].difference+(y[s+1]-y[s]);
        const Vec middle = (segments[s].difference+geometry.difference)*(0.5+Real{});
        const Real length = root(geometry.difference.dot(geometry.difference)), middleLength = root(middle.dot(middle));
        // Divisions take longer than all the rest.
        const Real both = 1/(length*middleLength);
        geometry.length = length;
        geometry.inverse = both*middleLength;
        geometry.middleInverse = both*length;
        geometry.tangent = geometry.difference*geometry.inverse;
        geometry.middleTangent = middle*geometry.middleInverse;
    }
    /** The friction of a segment's ends against turning, and the stiffness with which its tension turns it back, in a step. */
    void turningRates(int s, Real& friction, Real& tension) const {
        const Real l0 = property<Real>(pack, s, Pack::RestLength);
        friction = 0.25*property<Real>(pack, s, Pack::Perpendicular)+
                property<Real>(pack, s, Pack::Rotational)/(l0*l0)+TINY;
        tension = (h/shareOfForces())*segments[s].multiplier/segments[s].length;
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
        combineForces();
        return true;
    }
    /** Add a segment to the equations of its nodes. It is the first to do so for all but the first one's diagonal. */
    CYLCHAIN_INLINE void addSegment(const Vec* y, int s, const Geometry& geometry, Row& here, Row& after) {
        ImplicitSegment<Real>& segment = segments[s];
        const Real length = geometry.length;
        const Vec t = geometry.tangent, direction = geometry.middleTangent;

        // Friction.
        const Real acrossTrans = 0.25*property<Real>(pack, s, Pack::Perpendicular);
        const Real alongTrans = 0.25*property<Real>(pack, s, Pack::Parallel);
        const Real acrossTurn = (property<Real>(pack, s, Pack::Rotational)+segment.extra)*turningFactor(s, geometry);
        const Scalar perStep = 1/h;
        const Real sameAcross = (acrossTrans+acrossTurn)*perStep, otherAcross = (acrossTrans-acrossTurn)*perStep;
        const Real along = alongTrans*perStep;
        const Vec first = y[s], second = y[s+1];
        const Vec axial1 = direction*((along-sameAcross)*direction.dot(first)+(along-otherAcross)*direction.dot(second));
        const Vec axial2 = direction*((along-sameAcross)*direction.dot(second)+(along-otherAcross)*direction.dot(first));

        // Tension.
        const Real drag = property<Real>(pack, s, Pack::Extensional)*segment.inverse*perStep;
        if (pack.stretching == StretchingModel::FENE)
            findFeneTension(s, length, drag);
        else {
            const Real stiffness = property<Real>(pack, s, Pack::Stiffness);
            const Real extension = length-property<Real>(pack, s, Pack::RestLength);
            segment.tension = stiffness*(segment.implicit*extension+segment.constantCoordinate)+
                    drag*(length-segment.length)*geometry.inverse+segment.constantTension;
            segment.response = stiffness*segment.implicit+drag*segment.length*geometry.inverse*geometry.inverse;
        }
        if (settings.flow.present)
            segment.tension = segment.tension-segment.tensionOfFlow;
        segment.newTangent = t;

        // The tension acts along the mean direction. The matrix has the new one, with which it is symmetric, and what they
        // differ by goes with the last iteration's tension.
        segment.turned = direction-t;
        segment.multiplierBefore = segment.multiplier;
        const Vec lacking = segment.turned*segment.multiplier;
        // Without part of the response, nothing in the nodes' own matrix would keep those of a straight chain from moving
        // apart and together in turn.
        segment.shift = lesser<Real>(0.5*segment.response, along);
        band.setTension(s, t, 1/(segment.response-segment.shift+TINY), segment.tension);

        const Real turning = 0.5*larger<Real>(segment.multiplier*geometry.inverse, acrossTurn*(-COMPRESSION*perStep));
        after.diagonal = Symmetric<Real> {};
        after.diagonal.addAxial(sameAcross, along-sameAcross, direction);
        after.diagonal.addAxial(turning, segment.shift-turning, t);
        here.diagonal.add(after.diagonal);
        here.upper = Mat::axial(otherAcross, along-otherAcross, direction)-Mat::axial(turning, segment.shift-turning, t);
        here.right = here.right-first*sameAcross-second*otherAcross-axial1+lacking;
        after.right = loads[s+1]-second*sameAcross-first*otherAcross-axial2-lacking;
    }
    /**
     * The tension of a FENE segment and its response. Where the last iteration has given a tension, they are those at the
     * length that belongs to it, which is never beyond the range, extended to the length that the segment has.
     */
    void findFeneTension(int s, Real length, Real drag) {
        ImplicitSegment<Real>& segment = segments[s];
        Real stiffness = property<Real>(pack, s, Pack::Stiffness), rest = property<Real>(pack, s, Pack::RestLength);
        Real inverse = property<Real>(pack, s, Pack::InverseExtension);
        Real flow = settings.flow.present ? segment.tensionOfFlow : Real{};
        for (int i = 0; i < W; i++) {
            const FeneTension law = {lane(stiffness, i), lane(inverse, i), lane(rest, i), lane(segment.length, i),
                    lane(segment.implicit, i), lane(segment.constantCoordinate, i), lane(drag, i), lane(segment.constantTension, i)};
            const double given = lane(segment.multiplier, i)+lane(flow, i);
            double response, own = lane(length, i), tension;
            if (s < pack.segmentsOfLane[i] && lane(segment.multiplier, i) != 0)
                own = law.lengthFor(given, own, response);
            law.evaluate(own, tension, response);
            lane(segment.tension, i) = tension+response*(lane(length, i)-own);
            lane(segment.response, i) = response;
        }
    }
    /**
     * The friction of a segment's ends against turning, over its rotational friction. A turn by phi obeys
     * 2 sin(phi/2) = A cos^(1/2)(phi/2) with Gaussian A then, which diffuses as it should to second order in the step. Of
     * cos^(1/2), what is left out is of the sixth order in phi. Like all of the friction, it is that of the middle of the
     * step in what it depends on, here the length; otherwise soft lengths would lack a part of the drift.
     */
    CYLCHAIN_INLINE Real turningFactor(int s, const Geometry& geometry) const {
        const ImplicitSegment<Real>& segment = segments[s];
        const Real squareOfSine = 0.5-0.5*segment.tangent.dot(geometry.tangent);
        return (1-squareOfSine*(0.25+0.09375*squareOfSine))*(segment.inverse*geometry.inverse);
    }
    /** Add the tethers of a node, the next ones, to its equations. */
    void addTethers(const Vec* y, int node, std::size_t& next, Row& row) {
        for (; next < pack.tethers.size() && pack.tethers[next].node == node; next++) {
            const int i = pack.tethers[next].lane;
            const ImplicitTether& tether = tethers[next];
            Vec moved = y[node];
            const Scalar stiffness = pack.tethers[next].stiffness, implicit = stiffness*tether.implicit;
            lane(row.right.x, i) -= implicit*lane(moved.x, i)+stiffness*tether.constant[0];
            lane(row.right.y, i) -= implicit*lane(moved.y, i)+stiffness*tether.constant[1];
            lane(row.right.z, i) -= implicit*lane(moved.z, i)+stiffness*tether.constant[2];
            lane(row.diagonal.xx, i) += implicit;
            lane(row.diagonal.yy, i) += implicit;
            lane(row.diagonal.zz, i) += implicit;
        }
    }
    /** What takes roots and divisions of a joint: its bends, and how the random one turns with it. */
    struct JointGeometry {
        BendFactor<Real> newFactor, factor;
        Vec sum;
        Real sumLength, projection, perSum, perOne;
    };
    CYLCHAIN_INLINE void describeNewJoint(int s, const Geometry& geometry1, const Geometry& geometry2,
                JointGeometry& joint) {
        const ImplicitSegment<Real>& segment = segments[s];
        const Vec newBent = geometry2.tangent-geometry1.tangent, bent = geometry2.middleTangent-geometry1.middleTangent;
        // The random bend turns with the joint.
        joint.sum = segments[s-1].tangent+segment.tangent+geometry1.tangent+geometry2.tangent;
        joint.sumLength = root(joint.sum.dot(joint.sum)+LEAST*LEAST);
        joint.projection = segment.bisector.dot(joint.sum);
        // The inverse of the length, and of one plus the cosine.
        bendFactors<Real>(pack.bending, newBent, bent, joint.newFactor, joint.factor, joint.sumLength,
                joint.sumLength+joint.projection+LEAST, joint.perSum, joint.perOne);
    }
    /** Add the joint between two segments to the equations of their nodes. */
    CYLCHAIN_INLINE void addJoint(int s, const JointGeometry& joint, const Geometry& geometry1, const Geometry& geometry2,
                Row& before, Row& here, Row& after) {
        const ImplicitSegment<Real>& segment = segments[s];
        const Vec t1 = geometry1.middleTangent, t2 = geometry2.middleTangent;
        const Real perLength1 = geometry1.middleInverse, perLength2 = geometry2.middleInverse;
        const Vec newBent = geometry2.tangent-geometry1.tangent, bent = t2-t1;
        const BendFactor<Real> newFactor = joint.newFactor, factor = joint.factor;
        const Real sumLength = joint.sumLength, perOne = joint.perOne;
        const Vec bisector = joint.sum*joint.perSum;
        const Real cosine = joint.projection*joint.perSum;
        const Vec axis = crossProduct(segment.bisector, bisector);
        const Vec turned = segment.turningBend*cosine+crossProduct(axis, segment.turningBend)+
                axis*(axis.dot(segment.turningBend)*sumLength*perOne);
        const Vec newBend = newBent*newFactor.f;

        const Real stiffness = loaded<Real>(pack.joints, s);
        const Vec u = newBend*segment.jointImplicit+segment.constantBend-turned;
        const Real twist = factor.slope*u.dot(bent);
        Vec force1 = t2*twist-u*factor.f, force2 = u*factor.f+t1*twist;
        force1 = (force1-t1*t1.dot(force1))*(stiffness*perLength1);
        force2 = (force2-t2*t2.dot(force2))*(stiffness*perLength2);
        before.right = before.right+force1;
        here.right = here.right-force1+force2;
        after.right = after.right-force2;

        const Real scale = stiffness*segment.jointImplicit*factor.f*factor.f;
        const Real scale1 = scale*perLength1*perLength1, scale2 = scale*perLength2*perLength2;
        Symmetric<Real> first = {}, last = {};
        first.addAxial(scale1, -scale1, t1);
        last.addAxial(scale2, -scale2, t2);
        const Real c = t1.dot(t2);
        const Vec projected = t2-t1*c;
        // -(1-t1 t1)(1-t2 t2)
        const Mat mixed = (Mat::axial(1+Real{}, -1+Real{}, t1)-Mat::outer(projected, t2))*(-scale*perLength1*perLength2);
        before.second = mixed*(-1+Real{});
        before.diagonal.add(first);
        here.diagonal.add(first);
        here.diagonal.add(last);
        here.diagonal.addTwice(before.second);
        after.diagonal.add(last);
        before.upper = before.upper+mixed-Mat::of(first);
        here.upper = here.upper+mixed-Mat::of(last);
    }
    /** Find the changes of y and the tensions, or add to them. */
    template <bool ADD> void substitute() {
        band.template substitute<ADD>(change, [&] (int s, Real tension) {
            ImplicitSegment<Real>& segment = segments[s];
            segment.multiplier = tension+segment.shift*segment.newTangent.dot(change[s+1]-change[s]);
        });
    }
    /** Let the change of tensions act along the mean direction as well, with the same elimination. */
    void refine() {
        band.setForces([&] (int s) {
            return segments[s].turned*(segments[s].multiplier-segments[s].multiplierBefore);
        });
        substitute<true>();
    }
    /** The same, and record the forces of the segments, for the lanes that are active; see ImplicitTensions-inl.h. */
    void refineAndRecord(const Vec* y, Real active);
    /** Add the metric forces of the lengths, in the first iteration, where the directions are those of the start. */
    void addMetricForces() {
        band.findResponses([&] (int s, Vec response) {
            ImplicitSegment<Real>& segment = segments[s];
            const Vec t = segment.tangent;
            const Real stiffness = property<Real>(pack, s, Pack::Stiffness);
            const Real drag = property<Real>(pack, s, Pack::Extensional)/(segment.length*segment.length*h);
            Real noise = stiffness*(2*segment.theta-1)+drag;
            // The length resists more in the second stage than in this one.
            if (twoStages)
                noise = noise/(1+stiffness*(segment.theta-DIAGONAL)*t.dot(response));
            response = response-t*t.dot(response);
            const Vec force = response*(kT*noise/segment.length);
            segment.metricForce = force;
            drift[s] = drift[s]+force;
            drift[s+1] = drift[s+1]-force;
        });
        combineForces();
    }
    /** Whether any lane has not converged; those that have are taken out. NaN counts as not converged. */
    bool anyUnfinished(Real& active) {
        Real excess = Real{};
        const Real perEnergy = (CLOSED ? 1+Real{} : 1-loaded<Real>(pack.free, 0))*(1/(kT+TINY));
        const Scalar tighter = twoStages ? 1/(TOLERANCE_OF_STAGES*TOLERANCE_OF_STAGES) : 1;
        for (int s = 0; s < pack.segments; s++) {
            const Vec difference = change[s+1]-change[s];
            const Real inverse = property<Real>(pack, s, Pack::InverseRestLength), square = difference.dot(difference);
            const Real moved = change[s].dot(change[s])*(NEWTON_TOLERANCE*NEWTON_TOLERANCE/(NODE_TOLERANCE*NODE_TOLERANCE));
            const Real ratio = larger<Real>(square, moved)*(inverse*inverse*(tighter/(NEWTON_TOLERANCE*NEWTON_TOLERANCE)));
            // An iteration takes a length to first order in the change, so that an error of square/(2 l0) is left where
            // lengths are not reset.
            const Real error = square*inverse*(Scalar(0.5)/LENGTH_TOLERANCE);
            excess = ratio < excess ? excess : ratio;
            if (settings.kT > 0)
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
    void findExcessiveChanges(const Vec* y, bool* failed) {
        for (int s = 0; s < pack.segments; s++) {
            const Vec difference = y[s+1]-y[s];
            // A quarter of a turn.
            Real square = 0.5*difference.dot(difference), limit = property<Real>(pack, s, Pack::RestLength);
            for (int i = 0; i < W; i++)
                failed[i] |= s < pack.segmentsOfLane[i] && !(lane(square, i) < lane(limit, i)*lane(limit, i));
            if (pack.stretching == StretchingModel::FENE) {
                const Vec after = segments[s].difference+(y[s+1]-y[s]);
                Real relative = (root(after.dot(after))-limit)*property<Real>(pack, s, Pack::InverseExtension);
                for (int i = 0; i < W; i++)
                    failed[i] |= s < pack.segmentsOfLane[i] && !(std::fabs(lane(relative, i)) < 1);
            }
        }
    }
};

#include "dynamics/ImplicitNoise-inl.h"
#include "dynamics/ImplicitTensions-inl.h"

/** Where a step would begin if its nodes had moved already. */
template <int W> void moveStart(const Pack& pack, const StepStart<W>& start, const Vector<typename Lanes<W>::Type>* moved,
            bool needsNodes, const StepStart<W>& result) {
    for (int node = 0; needsNodes && node < pack.nodes; node++)
        result.nodes[node] = start.nodes[node]+moved[node];
    for (int s = 0; s < pack.nodes-1; s++)
        result.segments[s] = start.segments[s]+(moved[s+1]-moved[s]);
    for (std::size_t i = 0; i < pack.tethers.size(); i++) {
        const LaneTether& tether = pack.tethers[i];
        Vector<typename Lanes<W>::Type> change = moved[tether.node];
        result.tethers[i].d[0] = start.tethers[i].d[0]+lane(change.x, tether.lane);
        result.tethers[i].d[1] = start.tethers[i].d[1]+lane(change.y, tether.lane);
        result.tethers[i].d[2] = start.tethers[i].d[2]+lane(change.z, tether.lane);
    }
}

/**
 * Advance the lanes that failed, from the start, by the same time in more and more parts. They follow the Brownian path of
 * the step, so that what failed is not left out of the noise.
 */
template <int W, bool CLOSED> void divideStep(const Pack& pack, const StepStart<W>& start,
            const Vector<typename Lanes<W>::Type>* f, StepSettings settings, Vector<typename Lanes<W>::Type>* y, bool* failed,
            typename ImplicitStep<W, CLOSED>::Memory& memory) {
    typedef typename Lanes<W>::Type Real;
    static thread_local Scratch vectors, tethers;
    const double h = settings.stepSize;
    const std::uint64_t step = settings.step;
    const int level = settings.level, n = pack.nodes;
    const MeanOfParts<W> mean(pack, settings);
    Vector<Real>* moved = vectors.reserve<Vector<Real> >(4*n);
    Vector<Real>* change = moved+n;
    const StepStart<W> from = {moved+2*n, moved+3*n, tethers.reserve<TetherVector>(pack.tethers.size())};
    for (int division = 1; division <= LARGEST_DIVISION; division++) {
        const int parts = 1<<division;
        settings.stepSize = h/parts;
        settings.level = level+division;
        bool failedNow[W] = {}, failedPart[W];
        for (int node = 0; node < n; node++)
            moved[node] = Vector<Real> {};
        bool hope = true;
        for (int part = 0; part < parts && hope; part++) {
            settings.step = (step<<division)+part;
            moveStart<W>(pack, start, moved, settings.flow.present, from);
            ImplicitStep<W, CLOSED>(pack, settings, memory).take(from, f, change, failedPart);
            for (int node = 0; node < n; node++)
                moved[node] = moved[node]+change[node];
            mean.add(part, parts, failed);
            hope = false;
            for (int i = 0; i < W; i++) {
                failedNow[i] |= failedPart[i];
                hope |= failed[i] && !failedNow[i];
            }
        }
        bool any = false;
        for (int i = 0; i < W; i++) {
            if (failed[i] && !failedNow[i]) {
                failed[i] = false;
                for (int node = 0; node < n; node++) {
                    lane(y[node].x, i) = lane(moved[node].x, i);
                    lane(y[node].y, i) = lane(moved[node].y, i);
                    lane(y[node].z, i) = lane(moved[node].z, i);
                }
            }
            any |= failed[i];
        }
        if (!any)
            return;
    }
}

template <int W, bool CLOSED> Instability stepPackImplicitly(const Pack& pack, const double* positions, const double* forces,
            const double* box, const StepSettings& settings, double* displacements) {
    typedef typename Lanes<W>::Type Real;
    static thread_local typename ImplicitStep<W, CLOSED>::Memory memory;
    static thread_local Scratch vectors, tethers;
    const int n = pack.nodes;
    Vector<Real>* f = vectors.reserve<Vector<Real> >(4*n);
    Vector<Real>* y = f+n;
    const StepStart<W> start = {y+n, y+2*n, tethers.reserve<TetherVector>(pack.tethers.size())};
    if (settings.flow.present)
        gatherStart<W>(pack, positions, box, start.nodes);
    gatherSegments<W>(pack, positions, box, start.segments);
    for (std::size_t i = 0; i < pack.tethers.size(); i++) {
        tetherVector(pack, pack.tethers[i], positions, box, start.tethers[i].d);
        if (pack.planar)
            start.tethers[i].d[2] = 0;
    }
    gatherForces<W>(pack, forces, f);
    bool failed[W];
    Instability result;
    result.iterations = ImplicitStep<W, CLOSED>(pack, settings, memory).take(start, f, y, failed);
    for (int i = 0; i < W; i++)
        result.divided += failed[i];
    if (result.divided > 0)
        divideStep<W, CLOSED>(pack, start, f, settings, y, failed, memory);
    scatter<W>(pack, y, 1, displacements);
    for (int i = 0; i < W; i++)
        if (failed[i] && result.chain < 0)
            result.chain = pack.chain[i];
    return result;
}
