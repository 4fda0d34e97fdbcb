/**
 * Scheme "implicit" over the segments of a pack. ChainLoops.h includes this file into the namespace of an instruction
 * set.
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
 * from those of the elimination. In a flow u, friction is relative to u(m). IMPLICIT_SCHEME.md explains all this.
 */

/** The largest change of a segment in the last iteration, over its rest length; a fifth of it remains as an error. */
const double NEWTON_TOLERANCE = 1e-2;
/** The largest error of a length that an iteration leaves, over its thermal fluctuation against what resists in a step. */
const double LENGTH_TOLERANCE = 0.07;
const int NEWTON_ITERATIONS = 14;
/** A step that does not converge is cut into at most two to this power. */
const int LARGEST_DIVISION = 10;
/** The part of the friction against turning that compression may take away in the iteration's matrix. */
const double COMPRESSION = 0.9;
/** In the first iteration, a length resists at most this many times as much as turning. */
const double STIFFEST_LENGTH = 1e4;
/** A bend is drawn as a Gaussian with rejection if the joint is stiffer than this many k_B T, or else from the sphere. */
const double STIFF_JOINT = 2;
/** The tension of a segment turns it back by this much of what resists, in a step. */
const double NEARLY_TAUT = 0.5;
const double TINY = 1e-300;

template <class Real> CYLCHAIN_INLINE Real larger(Real a, Real b) {
    return a > b ? a : b;
}

/** Two vectors that are orthogonal to a unit vector and to each other (Duff et al., J. Comput. Graph. Tech. 2017, 6, 1). */
template <class Real> CYLCHAIN_INLINE void orthogonal(const Vector<Real>& n, Vector<Real>& first, Vector<Real>& second) {
    Real sign;
    Vector<Real> copy = n;
    for (int i = 0; i < (int) (sizeof(Real)/sizeof(double)); i++)
        lane(sign, i) = std::copysign(1.0, lane(copy.z, i));
    const Real a = -1/(sign+n.z), b = n.x*n.y*a;
    first = {1+sign*n.x*n.x*a, sign*b, -sign*n.x};
    second = {b, sign+n.y*n.y*a, -n.y};
}

/** What a step keeps of a segment, and of the joint with the segment before. */
template <class Real> struct ImplicitSegment {
    // At the start: the vector, its direction and length, the coordinate of the length, and the bend.
    Vector<Real> difference, tangent, bend, bisector;
    Real length, coordinate;
    // The noise, and how implicit the segment and the joint are.
    Vector<Real> randomBend, randomPair;
    Real randomCoordinate, randomTension, theta, jointTheta;
    // Of the last iteration: the direction of the new segment, its tension and how the tension changes.
    Vector<Real> newTangent;
    Real tension, response;
    Real multiplier, extra, tensionOfFlow;
    // What the first iteration takes of tension and response.
    Real softening;
};

/** What a step keeps of a tether: the vector from its point to its node at the start, its noise and how implicit it is. */
struct ImplicitTether {
    double start[3], random[3], theta;
};

/** What elimination leaves of a node: y = solution - next y(+1) - second y(+2). */
template <class Real> struct ImplicitNode {
    Matrix<Real> inverse, next, second;
    Vector<Real> solution;
};

/** A step of open chains or, if CLOSED, of rings. */
template <int W, bool CLOSED> class ImplicitStep {
    typedef typename Lanes<W>::Type Real;
    typedef Vector<Real> Vec;
    typedef Matrix<Real> Mat;
public:
    struct Memory {
        Scratch segments, nodes, vectors, tethers, border;
    };
    ImplicitStep(const ChainPack& pack, const StepSettings& settings, const double* box, Memory& memory) : pack(pack),
            settings(settings), box(box), n(pack.nodes), h(settings.stepSize) {
        tethers = memory.tethers.template reserve<ImplicitTether>(pack.tethers.size());
        segments = memory.segments.template reserve<ImplicitSegment<Real> >(n);
        nodes = memory.nodes.template reserve<ImplicitNode<Real> >(n);
        f = memory.vectors.template reserve<Vec>(3*n);
        change = f+n;
        loads = settings.flow.present ? f+2*n : f;
        if (CLOSED)
            toBorder = memory.border.template reserve<BorderCoupling>(n);
    }
    /**
     * Take one step.
     *
     * @param before  the nodes before
     * @param forces  the forces on them, but for those of the chains
     * @param y       receives the nodes after
     * @param failed  receives true for each lane that has not converged or whose segments change by more than their
     *                length
     */
    void take(const Vec* before, const Vec* forces, Vec* y, bool* failed) {
        x = before;
        for (int node = 0; node < n; node++) {
            y[node] = x[node];
            f[node] = forces[node];
        }
        if (settings.flow.present)
            carryAlong(y);
        addPropulsion<W>(pack, x, f);
        describe();
        if (settings.kT > 0)
            addNoise();
        // The first iteration has neither metric forces nor tensions along the mean segment, however short the step is. How
        // a gradient turns a chain takes one more.
        const int least = settings.flow.varies() ? 3 : 2;
        Real active = 1+Real{};
        for (int iteration = 0; iteration < NEWTON_ITERATIONS; iteration++) {
            stiffest = iteration == 0 ? STIFFEST_LENGTH : HUGE_VAL;
            eliminate(y);
            substitute();
            if (iteration == 0 && settings.kT > 0) {
                if (stiffenTautSegments()) {
                    eliminate(y);
                    substitute();
                }
                addMetricForces();
            }
            for (int node = 0; node < n; node++)
                y[node] = y[node]+change[node]*active;
            if (iteration+1 >= least && !anyUnfinished(active))
                break;
        }
        for (int i = 0; i < W; i++)
            failed[i] = lane(active, i) != 0;
        findExcessiveChanges(y, failed);
    }
private:
    const ChainPack& pack;
    const StepSettings& settings;
    const double* const box;
    const int n;
    const double h;
    ImplicitSegment<Real>* segments;
    ImplicitNode<Real>* nodes;
    ImplicitTether* tethers;
    double stiffest;
    const Vec* x;
    // The forces, the same with the drag of the flow, and the changes of an iteration.
    Vec *f, *loads, *change;
    /** The coupling of a node of a ring to its first two nodes. */
    struct BorderCoupling {
        Mat node[2];
    };
    BorderCoupling* toBorder;

    /**
     * Begin the iteration where the flow carries chains as a whole, if no node of them is fixed. Segments stay what they
     * are, and the matrix symmetric.
     */
    void carryAlong(Vec* y) const {
        const LaneFlow<W> flow(settings.flow, pack, x[0]);
        const Vec halfway = x[0]+flow.at(x[0])*(0.5*h+Real{});
        Real free;
        for (int i = 0; i < W; i++) {
            lane(free, i) = 1;
            for (int node = 0; node < pack.nodesOfLane[i]; node++)
                if (pack.mobile[node*W+i] == 0)
                    lane(free, i) = 0;
        }
        const Vec carried = flow.at(halfway)*(free*h);
        for (int node = 0; node < n; node++)
            y[node] = y[node]+carried;
    }
    /** Describe the start of a step, without noise. */
    void describe() {
        for (int s = 0; s < n-1; s++) {
            ImplicitSegment<Real>& segment = segments[s];
            segment.difference = x[s+1]-x[s];
            segment.length = root(segment.difference.dot(segment.difference));
            segment.tangent = segment.difference*(1/segment.length);
            const Real l0 = property<Real>(pack, s, ChainPack::RestLength);
            Real slope;
            stretchCoordinate(pack.stretching, property<Real>(pack, s, ChainPack::InverseExtension), segment.length-l0,
                    segment.coordinate, slope);
            const Real stretchRate = h*property<Real>(pack, s, ChainPack::Stiffness)*l0*l0+TINY;
            segment.theta = larger<Real>(0.5+Real{}, 1-property<Real>(pack, s, ChainPack::Extensional)/stretchRate);
            segment.randomCoordinate = segment.randomTension = segment.multiplier = segment.extra = Real{};
            segment.randomBend = Vec {};
            if (s > 0)
                describeJoint(s);
        }
        for (std::size_t i = 0; i < pack.tethers.size(); i++)
            describeTether(pack.tethers[i], tethers[i]);
    }
    void describeJoint(int s) {
        ImplicitSegment<Real>& segment = segments[s];
        const Vec sum = segments[s-1].tangent+segment.tangent, bent = segment.tangent-segments[s-1].tangent;
        segment.bisector = sum*(1/root(sum.dot(sum)+TINY));
        segment.bend = bent*bendFactor<Real>(pack.bending, bent).f;
        const Real friction = -larger<Real>(-property<Real>(pack, s-1, ChainPack::Rotational),
                -property<Real>(pack, s, ChainPack::Rotational));
        const Real bendRate = 4*h*loaded<Real>(pack.joints, s)+TINY;
        segment.jointTheta = larger<Real>(0.5+Real{}, 1-friction/bendRate);
    }
    void describeTether(const LaneTether& tether, ImplicitTether& result) {
        tetherVector<W>(tether, x, box, result.start);
        if (pack.planar)
            result.start[2] = 0;
        double friction = 0;
        for (int side = tether.node-1; side <= tether.node; side++) {
            const int s = CLOSED && side < 0 ? pack.segments-1 : side;
            if (s >= 0 && s < pack.segmentsOfLane[tether.lane]) {
                Real parallel = property<Real>(pack, s, ChainPack::Parallel), l0 = property<Real>(pack, s, ChainPack::RestLength);
                Real extensional = property<Real>(pack, s, ChainPack::Extensional);
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
    void drawForces(const Real* normals, int s, double amplitude);
    void drawLength(const NoisePlaces<W>& places, int s, Real normal);
    void drawBend(const NoisePlaces<W>& places, int s);
    /** In a plane, a bend has one component, and its angle a uniform measure. */
    void drawPlanarBend(const NoisePlaces<W>& places, int s);
    /** The equations of a node and its coupling to the next two, while they are gathered. */
    struct Row {
        Mat diagonal, lower, upper, second;
        Vec right;
    };
    /** In a ring, also the coupling of the node to the first two, and theirs to it. */
    struct ClosedRow : Row {
        Mat toBorder[2], fromBorder[2];
    };
    /** The equations of the first two nodes of a ring. */
    struct Border {
        Mat matrix[2][2];
        Vec right[2];
    };
    /** The new segment, and the one between the old nodes and the new. */
    struct Geometry {
        Vec difference, tangent, middleTangent;
        Real length, middleInverse;
    };
    /** Linearise the equations around y, and eliminate the nodes from first to last. */
    void eliminate(const Vec* y) {
        if (settings.flow.present)
            addDragOfFlow(y);
        if (CLOSED)
            eliminateRing(y);
        else
            eliminateChain(y);
        if (settings.flow.present)
            for (int s = 0; s < pack.segments; s++)
                segments[s].tension = segments[s].tension-segments[s].tensionOfFlow;
    }
    /** Add the drag of the flow, at the middle of the step, on segments at rest. Its part along a segment is a tension. */
    void addDragOfFlow(const Vec* y) {
        const LaneFlow<W> flow(settings.flow, pack, x[0]);
        for (int node = 0; node < n; node++)
            loads[node] = f[node];
        for (int s = 0; s < pack.segments; s++) {
            Geometry geometry;
            describeNew(y, s, geometry);
            const Vec direction = geometry.middleTangent;
            const Vec u1 = flow.at((x[s]+y[s])*(0.5+Real{})), u2 = flow.at((x[s+1]+y[s+1])*(0.5+Real{}));
            const Vec sum = u1+u2, difference = u2-u1;
            const Real across = 0.25*property<Real>(pack, s, ChainPack::Perpendicular);
            const Real along = 0.25*property<Real>(pack, s, ChainPack::Parallel);
            const Vec carried = sum*across+direction*((along-across)*direction.dot(sum));
            const Real turn = property<Real>(pack, s, ChainPack::Rotational)*geometry.middleInverse*geometry.middleInverse;
            const Real stretch = property<Real>(pack, s, ChainPack::Extensional)/(segments[s].length*geometry.length);
            const Vec pair = difference*turn+direction*((stretch-turn)*direction.dot(difference));
            segments[s].tensionOfFlow = stretch*direction.dot(difference);
            loads[s] = loads[s]+carried-pair;
            loads[s+1] = loads[s+1]+carried+pair;
        }
    }
    void eliminateChain(const Vec* y) {
        Row rows[3];
        Row *before = rows, *here = rows+1, *after = rows+2;
        Geometry previous, current;
        std::size_t tether = 0;
        here->diagonal = Mat {};
        here->right = loads[0];
        for (int s = 0; s < n-1; s++) {
            describeNew(y, s, current);
            addSegment(y, s, current, *here, *after);
            addTethers(y, s, tether, *here);
            if (s > 0) {
                addJoint(s, previous, current, *before, *here, *after);
                eliminate<2>(s-1, *before, *here, *after);
            }
            previous = current;
            Row* const free = before;
            before = here;
            here = after;
            after = free;
        }
        addTethers(y, n-1, tether, *here);
        eliminate<1>(n-2, *before, *here, *after);
        eliminate<0>(n-1, *here, *after, *before);
    }
    /** The first two nodes of a ring come last: all others are coupled to them as well. */
    void eliminateRing(const Vec* y);
    void eliminateNodeOfRing(int node, ClosedRow& row, ClosedRow& next, ClosedRow& second, Border& border);
    static void coupleToBorder(ClosedRow& row, int k, const Mat& from, const Mat& to);
    void eliminateBorder(const Border& border);
    /** The inverse for a node that moves, and zero for a fixed one. */
    CYLCHAIN_INLINE Mat inverseOf(Mat diagonal, int node) const {
        const Real mobile = loaded<Real>(pack.mobile, node);
        diagonal.x.x += 1-mobile;
        diagonal.y.y += 1-mobile;
        diagonal.z.z += 1-mobile;
        return diagonal.inverse()*mobile;
    }
    CYLCHAIN_INLINE void describeNew(const Vec* y, int s, Geometry& geometry) {
        geometry.difference = y[s+1]-y[s];
        geometry.length = root(geometry.difference.dot(geometry.difference));
        geometry.tangent = geometry.difference*(1/geometry.length);
        const Vec middle = (segments[s].difference+geometry.difference)*(0.5+Real{});
        geometry.middleInverse = 1/root(middle.dot(middle));
        geometry.middleTangent = middle*geometry.middleInverse;
    }
    /** The friction of a segment's ends against turning, and the stiffness with which its tension turns it back, in a step. */
    void turningRates(int s, Real& friction, Real& tension) const {
        const Real l0 = property<Real>(pack, s, ChainPack::RestLength);
        friction = 0.25*property<Real>(pack, s, ChainPack::Perpendicular)+
                property<Real>(pack, s, ChainPack::Rotational)/(l0*l0)+TINY;
        tension = h*segments[s].multiplier/segments[s].length;
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
            const Real rotational = property<Real>(pack, s, ChainPack::Rotational);
            segment.extra = taut*larger<Real>(0.5*tension-friction, Real{})*segment.length*segment.length;
            // Chains that are not taut solve the same equations once more.
            segment.multiplier = segment.multiplier*taut;
            const Vec pair = segment.randomPair*(root(1+segment.extra/(rotational+TINY))-1);
            f[s] = f[s]-pair;
            f[s+1] = f[s+1]+pair;
        }
        return true;
    }
    /** Add a segment to the equations of its nodes. It is the first to do so for all but the first one's diagonal. */
    CYLCHAIN_INLINE void addSegment(const Vec* y, int s, const Geometry& geometry, Row& here, Row& after) {
        ImplicitSegment<Real>& segment = segments[s];
        const Real length = geometry.length, inverseSquare = geometry.middleInverse*geometry.middleInverse;
        const Vec t = geometry.tangent, direction = geometry.middleTangent;

        // Friction.
        const Real acrossTrans = 0.25*property<Real>(pack, s, ChainPack::Perpendicular);
        const Real alongTrans = 0.25*property<Real>(pack, s, ChainPack::Parallel);
        const Real acrossTurn = (property<Real>(pack, s, ChainPack::Rotational)+segment.extra)*inverseSquare;
        const Mat same = Mat::axial((acrossTrans+acrossTurn)/h, (alongTrans-acrossTrans-acrossTurn)/h, direction);
        const Mat other = Mat::axial((acrossTrans-acrossTurn)/h, (alongTrans-acrossTrans+acrossTurn)/h, direction);
        const Vec first = y[s]-x[s], second = y[s+1]-x[s+1];

        // Tension.
        const Real stiffness = property<Real>(pack, s, ChainPack::Stiffness);
        const Real l0 = property<Real>(pack, s, ChainPack::RestLength);
        const Real reciprocal = property<Real>(pack, s, ChainPack::InverseExtension);
        Real coordinate, slope, unused, middleSlope;
        stretchCoordinate(pack.stretching, reciprocal, length-l0, coordinate, slope);
        stretchCoordinate(pack.stretching, reciprocal, 0.5*(segment.length+length)-l0, unused, middleSlope);
        const Real drag = property<Real>(pack, s, ChainPack::Extensional)/(segment.length*length*h);
        Real tension = stiffness*middleSlope*(segment.theta*coordinate+(1-segment.theta)*segment.coordinate-
                segment.randomCoordinate)+drag*(length-segment.length)-segment.randomTension;
        Real response = stiffness*middleSlope*segment.theta*slope+drag*segment.length/length;
        // Metric forces are those of constraints then, and rounding the blocks of the inverse does not reach them.
        const Real softening = stiffest*(acrossTrans+acrossTurn)/(h*response);
        segment.softening = softening < 1 ? softening : 1+Real{};
        tension = tension*segment.softening;
        response = response*segment.softening;
        const Vec pull = direction*tension;
        const Real turning = 0.5*larger<Real>(segment.multiplier/length, -COMPRESSION*acrossTurn/h);
        const Mat elastic = Mat::axial(turning, -turning, t)+Mat::outer(direction*response, t);
        segment.newTangent = t;
        segment.tension = tension;
        segment.response = response;

        after.diagonal = same+elastic;
        here.diagonal = here.diagonal+after.diagonal;
        here.lower = here.upper = other-elastic;
        here.right = here.right-same*first-other*second+pull;
        after.right = loads[s+1]-same*second-other*first-pull;
    }
    /** Add the tethers of a node, the next ones, to its equations. */
    void addTethers(const Vec* y, int node, std::size_t& next, Row& row) {
        for (; next < pack.tethers.size() && pack.tethers[next].node == node; next++) {
            const int i = pack.tethers[next].lane;
            const ImplicitTether& tether = tethers[next];
            Vec moved = y[node]-x[node];
            const double stiffness = pack.tethers[next].stiffness, implicit = stiffness*tether.theta;
            lane(row.right.x, i) -= implicit*lane(moved.x, i)+stiffness*(tether.start[0]-tether.random[0]);
            lane(row.right.y, i) -= implicit*lane(moved.y, i)+stiffness*(tether.start[1]-tether.random[1]);
            lane(row.right.z, i) -= implicit*lane(moved.z, i)+stiffness*(tether.start[2]-tether.random[2]);
            lane(row.diagonal.x.x, i) += implicit;
            lane(row.diagonal.y.y, i) += implicit;
            lane(row.diagonal.z.z, i) += implicit;
        }
    }
    /** Add the joint between two segments to the equations of their nodes. */
    CYLCHAIN_INLINE void addJoint(int s, const Geometry& geometry1, const Geometry& geometry2, Row& before, Row& here,
                Row& after) {
        const ImplicitSegment<Real>& segment = segments[s];
        const Vec t1 = geometry1.middleTangent, t2 = geometry2.middleTangent;
        const Real perLength1 = geometry1.middleInverse, perLength2 = geometry2.middleInverse;
        const Vec newBent = geometry2.tangent-geometry1.tangent;
        const Vec newBend = newBent*bendFactor<Real>(pack.bending, newBent).f;

        // The random bend turns with the joint.
        const Vec sum = segments[s-1].tangent+segment.tangent+geometry1.tangent+geometry2.tangent;
        const Vec bisector = sum*(1/root(sum.dot(sum)+TINY));
        const Vec axis = crossProduct(segment.bisector, bisector);
        const Real cosine = segment.bisector.dot(bisector);
        const Vec random = segment.randomBend*cosine+crossProduct(axis, segment.randomBend)+
                axis*(axis.dot(segment.randomBend)/(1+cosine+1e-12));

        const Real stiffness = loaded<Real>(pack.joints, s);
        const Vec u = newBend*segment.jointTheta+segment.bend*(1-segment.jointTheta)-random;
        const Vec bent = t2-t1;
        const BendFactor<Real> factor = bendFactor<Real>(pack.bending, bent);
        const Real twist = factor.slope*u.dot(bent);
        Vec force1 = t2*twist-u*factor.f, force2 = u*factor.f+t1*twist;
        force1 = (force1-t1*t1.dot(force1))*(stiffness*perLength1);
        force2 = (force2-t2*t2.dot(force2))*(stiffness*perLength2);
        before.right = before.right+force1;
        here.right = here.right-force1+force2;
        after.right = after.right-force2;

        const Real scale = stiffness*segment.jointTheta*factor.f*factor.f;
        const Real scale1 = scale*perLength1*perLength1, scale2 = scale*perLength2*perLength2;
        const Mat first = Mat::axial(scale1, -scale1, t1), last = Mat::axial(scale2, -scale2, t2);
        const Real c = t1.dot(t2);
        const Vec projected = t2-t1*c;
        // -(1-t1 t1)(1-t2 t2)
        const Mat mixed = (Mat::axial(1+Real{}, -1+Real{}, t1)-Mat::outer(projected, t2))*(-scale*perLength1*perLength2);
        const Mat mixedT = mixed.transposed();
        before.diagonal = before.diagonal+first;
        here.diagonal = here.diagonal+first+last-mixed-mixedT;
        after.diagonal = after.diagonal+last;
        before.upper = before.upper+mixed-first;
        before.lower = before.lower+mixedT-first;
        here.upper = here.upper+mixed-last;
        here.lower = here.lower+mixedT-last;
        before.second = mixed*(-1+Real{});
    }
    /** Eliminate a node from the equations of those of the next two that exist. Nothing passes through a fixed one. */
    template <int FOLLOWING> CYLCHAIN_INLINE void eliminate(int node, const Row& row, Row& next, Row& second) {
        ImplicitNode<Real>& result = nodes[node];
        result.inverse = inverseOf(row.diagonal, node);
        result.solution = result.inverse*row.right;
        if (FOLLOWING > 0) {
            result.next = result.inverse*row.upper;
            next.diagonal = next.diagonal-row.lower*result.next;
            next.right = next.right-row.lower*result.solution;
        }
        if (FOLLOWING > 1) {
            const Mat secondT = row.second.transposed();
            result.second = result.inverse*row.second;
            next.upper = next.upper-row.lower*result.second;
            next.lower = next.lower-secondT*result.next;
            second.diagonal = second.diagonal-secondT*result.second;
            second.right = second.right-secondT*result.solution;
        }
        else
            result.second = Mat {};
    }
    /** Find the changes of y, and the tensions that come with them. */
    void substitute() {
        if (CLOSED)
            substituteRing();
        else
            substituteChain();
        for (int s = 0; s < pack.segments; s++) {
            ImplicitSegment<Real>& segment = segments[s];
            segment.multiplier = segment.tension+segment.response*segment.newTangent.dot(change[s+1]-change[s]);
        }
    }
    void substituteChain() {
        for (int node = n-1; node >= 0; node--) {
            change[node] = nodes[node].solution;
            if (node < n-1)
                change[node] = change[node]-nodes[node].next*change[node+1];
            if (node < n-2)
                change[node] = change[node]-nodes[node].second*change[node+2];
        }
    }
    void substituteRing();
    /**
     * Add the metric forces of the lengths. The matrix is symmetric in the first iteration, so the blocks of its
     * inverse follow from those of its elimination, from last to first.
     */
    void addMetricForces() {
        if (CLOSED)
            addMetricForcesOfRing();
        else
            addMetricForcesOfChain();
    }
    void addMetricForcesOfChain() {
        Mat same = nodes[n-1].inverse, other = {}, sameAfter = {};
        for (int s = n-2; s >= 0; s--) {
            // Blocks of the inverse: (s,s), (s,s+1) and (s,s+2).
            const ImplicitNode<Real>& node = nodes[s];
            Mat newOther = node.next*same, newSecond = node.next*other;
            newOther = (newOther+node.second*other.transposed())*(-1+Real{});
            newSecond = (newSecond+node.second*sameAfter)*(-1+Real{});
            // Errors that are not symmetric would grow from node to node.
            Mat newSame = node.inverse-node.next*newOther.transposed()-node.second*newSecond.transposed();
            newSame = (newSame+newSame.transposed())*(0.5+Real{});

            addMetricForce(s, newSame, newOther, same);
            sameAfter = same;
            same = newSame;
            other = newOther;
        }
    }
    /** Add the metric force of a segment, for the blocks of the inverse that belong to its nodes. */
    CYLCHAIN_INLINE void addMetricForce(int s, const Mat& first, const Mat& other, const Mat& second) {
        const ImplicitSegment<Real>& segment = segments[s];
        const Vec t = segment.tangent;
        Vec response = (second+first-other-other.transposed())*t;
        response = response-t*t.dot(response);
        const Real drag = property<Real>(pack, s, ChainPack::Extensional)/(segment.length*segment.length*h);
        const Real noise = segment.softening*(property<Real>(pack, s, ChainPack::Stiffness)*(2*segment.theta-1)+drag);
        const Vec force = response*(settings.kT*noise/segment.length);
        f[s] = f[s]+force;
        f[s+1] = f[s+1]-force;
    }
    void addMetricForcesOfRing();
    /** Whether any lane has not converged; those that have are taken out. NaN counts as not converged. */
    bool anyUnfinished(Real& active) {
        Real excess = Real{};
        for (int s = 0; s < pack.segments; s++) {
            const Vec difference = change[s+1]-change[s];
            const Real l0 = property<Real>(pack, s, ChainPack::RestLength), square = difference.dot(difference);
            const Real ratio = square/(NEWTON_TOLERANCE*NEWTON_TOLERANCE*l0*l0);
            // An iteration takes a length to first order in the change, so that an error of square/(2 l0) is left.
            const Real error = square/(2*LENGTH_TOLERANCE*l0);
            excess = ratio < excess ? excess : ratio;
            if (settings.kT > 0)
                excess = larger(excess, error*error*segments[s].response/settings.kT);
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
            const Vec difference = y[s+1]-y[s]-segments[s].difference;
            Real square = difference.dot(difference), limit = property<Real>(pack, s, ChainPack::RestLength);
            for (int i = 0; i < W; i++)
                failed[i] |= s < pack.segmentsOfLane[i] && !(lane(square, i) < lane(limit, i)*lane(limit, i));
        }
    }
};

#include "ImplicitNoise.h"
#include "ImplicitRing.h"

/**
 * Advance the lanes that failed, from the start, by the same time in more and more parts. They follow the Brownian path of
 * the step, so that what failed is not left out of the noise.
 */
template <int W, bool CLOSED> void divideStep(const ChainPack& pack, const Vector<typename Lanes<W>::Type>* x,
            const Vector<typename Lanes<W>::Type>* f, StepSettings settings, Vector<typename Lanes<W>::Type>* y,
            const double* box, bool* failed, typename ImplicitStep<W, CLOSED>::Memory& memory, Scratch& scratch) {
    typedef typename Lanes<W>::Type Real;
    const double h = settings.stepSize;
    const std::uint64_t step = settings.step;
    const int level = settings.level;
    Vector<Real>* from = scratch.reserve<Vector<Real> >(2*pack.nodes);
    Vector<Real>* to = from+pack.nodes;
    for (int division = 1; division <= LARGEST_DIVISION; division++) {
        const int parts = 1<<division;
        settings.stepSize = h/parts;
        settings.level = level+division;
        bool failedNow[W] = {}, failedPart[W];
        for (int node = 0; node < pack.nodes; node++)
            to[node] = x[node];
        bool hope = true;
        for (int part = 0; part < parts && hope; part++) {
            settings.step = (step<<division)+part;
            for (int node = 0; node < pack.nodes; node++)
                from[node] = to[node];
            ImplicitStep<W, CLOSED>(pack, settings, box, memory).take(from, f, to, failedPart);
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
                for (int node = 0; node < pack.nodes; node++) {
                    lane(y[node].x, i) = lane(to[node].x, i);
                    lane(y[node].y, i) = lane(to[node].y, i);
                    lane(y[node].z, i) = lane(to[node].z, i);
                }
            }
            any |= failed[i];
        }
        if (!any)
            return;
    }
}

template <int W, bool CLOSED> Instability stepPackImplicitly(const ChainPack& pack, const double* positions, const double* forces,
            const double* box, const StepSettings& settings, double* displacements) {
    typedef typename Lanes<W>::Type Real;
    static thread_local typename ImplicitStep<W, CLOSED>::Memory memory;
    static thread_local Scratch vectors, scratch;
    const int n = pack.nodes;
    Vector<Real>* x = vectors.reserve<Vector<Real> >(3*n);
    Vector<Real>* f = x+n;
    Vector<Real>* y = f+n;
    gatherStart<W>(pack, positions, box, x);
    gatherForces<W>(pack, forces, f);
    bool failed[W];
    ImplicitStep<W, CLOSED>(pack, settings, box, memory).take(x, f, y, failed);
    Instability result;
    for (int i = 0; i < W; i++)
        result.divided += failed[i];
    if (result.divided > 0)
        divideStep<W, CLOSED>(pack, x, f, settings, y, box, failed, memory, scratch);
    for (int node = 0; node < n; node++)
        y[node] = y[node]-x[node];
    scatter<W>(pack, y, 1, displacements);
    for (int i = 0; i < W; i++)
        if (failed[i] && result.chain < 0)
            result.chain = pack.chain[i];
    return result;
}
