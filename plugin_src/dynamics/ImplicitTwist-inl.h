// Included into the namespace of an instruction set. It does not compile alone.

/**
 * Twist in an implicit step: see docs/design/twist.md.
 *
 * The angles by which segments turn about themselves are unknowns beside the nodes. Given the nodes, they solve
 *
 *     Z_s turn_s/h = T_(s+1) - T_s + random_s,      T_s = k (q_s + theta c_s - (2 theta-1)^(1/2) q_random),
 *     c_s = turn_s - turn_(s-1) + swept_s,
 *
 * with the twist q_s of a joint at the start, and the area swept_s that the great circle between its tangents sweeps on
 * the unit sphere, by which the angle between frames that are carried along changes. That is done in each iteration,
 * and the torques T_s that come out are forces -T_s J_s(m) on nodes. What a change of the nodes does to T is in the
 * equations as far as all torques of a chain change together. Hands that follow the helix add to Z and to random. An
 * end frame that turns against a friction Z does so by h/Z (torque + random - T), which makes its joint softer.
 */

/** By this much, nodes may give way to the torque that all of a chain shares without its being in their equations. */
const Scalar NEARLY_RIGID = 0.1;

/** The friction over the step of segments that keep their frames. */
const Scalar OF_WHAT_DOES_NOT_TURN = 1e30;

template <int W, bool CLOSED> class ImplicitTwist {
    typedef typename Lanes<W>::Type Real;
    typedef Vector<Real> Vec;
    typedef Matrix<Real> Mat;
    typedef typename DoubleLanes<W>::Type Double;
    static constexpr int REGISTERS = DoubleLanes<W>::REGISTERS;
public:
    explicit ImplicitTwist(ImplicitState<W>& step) : step(step), pack(step.pack), twist(pack.twist),
            ofSegments(step), segments(pack.segments), first(CLOSED && !twist.isBentAtRest() ? 1 : 0),
            joints(step.joints), newSegments(step.newSegments) {
        for (int i = 0; i < W && twist.isPresent(); i++)
            isFilledUp |= pack.chain[i] >= 0 && pack.segmentsOfLane[i] < segments;
    }
    /** Describe the start of a step, draw the noise, and eliminate the turns of segments. */
    __attribute__((noinline)) void begin() {
        if (step.settings.endDirections != NULL)
            followBodies();
        for (int end = 0; end < 2; end++)
            directions[end] = {loaded<Real>(*endDirections, 3*end), loaded<Real>(*endDirections, 3*end+1),
                    loaded<Real>(*endDirections, 3*end+2)};
        Real frictionBefore = loaded<Real>(twist.friction, CLOSED ? segments-1 : 0);
        for (int s = 0; s <= segments; s++) {
            TwistedJoint<Real>& joint = joints[s];
            const Real stiffness = loaded<Real>(twist.stiffness, s);
            const Real friction = s < segments ? loaded<Real>(twist.friction, s) : frictionBefore;
            joint.friction = friction*(1/step.h);
            const Real least = lesser<Real>(friction, frictionBefore);
            frictionBefore = friction;
            Real theta = larger<Real>(splat<Real>(0.5), 1-least/(4*step.h*stiffness+TINY));
            if (twist.isBentAtRest()) {
                // Segments turn when nodes have moved: see FrameTurns.h.
                joint.friction = splat<Real>(OF_WHAT_DOES_NOT_TURN);
                theta = splat<Real>(0.5);
            }
            joint.implicit = joint.coupling = stiffness*theta;
            joint.constant = stiffness*step.start.twists[s];
            joint.random = Real{};
            // The noise of equilibrium, for now.
            joint.torque = root(stiffness*(2*theta-1)*step.kT);
        }
        forEnds([&] (int s, int i, int end) {
            double& turn = turnsOfFrames[end];
            turn = twist.angularVelocity[end]*step.settings.stepSize;
            if (twist.frameMobility[end] > 0)
                turn += letFrameTurn(s, i, end);
            lane(joints[s].constant, i) += twist.torque[end]+lane(joints[s].implicit, i)*turn;
        });
        if (step.settings.kT > 0 && !twist.isBentAtRest())
            draw();
        if (step.settings.turnedPairs != NULL)
            addTurnedPairs();
        factorise();
    }
    /**
     * Describe the segments for new nodes, and set the forces of twist on these, to which they add what is there.
     *
     * @param moved  whether the nodes are elsewhere than at the start
     */
    __attribute__((noinline)) void addForces(const Vec* y, bool moved) {
        haveMoved = moved;
        if (moved)
            solve<Moment::Iteration>(y);
        else
            solve<Moment::Start>(y);
        const Vec* const others = step.settings.flow.present ? step.loads : step.f;
        Vec force = {}, share = {}, ofJoint = {}, shareOfJoint = {};
        if (!CLOSED)
            findForces(0, ofJoint, shareOfJoint);
        for (int s = 0; s < step.n; s++) {
            Vec newForce = {}, newShare = {};
            if (s < step.n-1) {
                // A segment turns by the torques of both of its joints.
                const Vec before = ofJoint, shareBefore = shareOfJoint;
                ofJoint = shareOfJoint = Vec {};
                if (s < segments)
                    findForces(s+1, ofJoint, shareOfJoint);
                const Real perLength = ofOwn(s, getSegment(s).middleInverse, Real{});
                newForce = (before+ofJoint)*perLength;
                newShare = (shareBefore+shareOfJoint)*perLength;
            }
            step.loads[s] = others[s]+newForce-force;
            force = newForce;
            if (twist.isHeld) {
                step.gradient[s] = share-newShare;
                share = newShare;
            }
        }
        if (step.settings.endTorques != NULL)
            tellTorques();
    }
    /** A segment as addForces() has found it. */
    CYLCHAIN_INLINE NewSegmentGeometry<Real> getSegment(int s) const {
        if (haveMoved)
            return newSegments[s];
        const IteratedSegment<Real>& start = step.segments[s];
        return {{start.difference, start.tangent, start.length, start.inverse}, start.tangent, start.inverse};
    }
    /**
     * Let all torques of chains that are held change with the nodes: what the equations without that have found for the
     * changes of nodes becomes what those with it do.
     *
     * @param iteration  how many there were before; the first one finds how far nodes give way, for all
     */
    template <class Equations> void shareTorque(Equations& equations, int iteration) {
        Vec* const response = step.gradient+step.n;
        Vec* const forces = response+step.n;
        Real* const ofTensions = step.responsesOfTensions;
        if (iteration == 0)
            equations.respond(step.gradient, response, ofTensions);
        else if (!givesWay)
            return;
        Real found = Real{}, own = Real{};
        for (int node = 0; node < step.n; node++) {
            found = found+step.gradient[node].dot(step.change[node]);
            own = own+step.gradient[node].dot(response[node]);
        }
        own = shared*own;
        givesWay = false;
        for (int i = 0; i < W; i++)
            givesWay |= lane(own, i) > NEARLY_RIGID;
        if (!givesWay)
            return;
        const Real share = -shared*found/(1+own);
        if (iteration == 0)
            equations.addResponse(response, ofTensions, share);
        else {
            // With the gradient for the present nodes.
            for (int node = 0; node < step.n; node++)
                forces[node] = step.gradient[node]*share;
            equations.addForces(forces);
        }
    }
    /** Add how the torque of a joint changes with the directions of its segments, to the equations of its nodes. */
    template <class Row> CYLCHAIN_INLINE void addStiffness(int s, const NewSegmentGeometry<Real>& geometry1,
            const NewSegmentGeometry<Real>& geometry2, Row& before, Row& here, Row& after) const {
        const Vec t1 = geometry1.middleTangent, t2 = geometry2.middleTangent;
        // The gradient is that of the middle, which moves half as far.
        const Vec axis = (t1+t2)*(0.25*joints[s].torque*geometry1.middleInverse*geometry2.middleInverse*
                joints[s].perCosine);
        const Matrix<Real> mixed = {{Real{}, -axis.z, axis.y}, {axis.z, Real{}, -axis.x}, {-axis.y, axis.x, Real{}}};
        before.second = before.second-mixed;
        before.upper = before.upper+mixed;
        here.upper = here.upper+mixed;
        if (twist.isBentAtRest())
            addOwnStiffness(s, geometry1, geometry2, before, here, after);
    }
    /** Find how the twists have changed when the nodes have moved by y. */
    __attribute__((noinline)) void findChanges(const Vec* y, Double* changes) {
        findSweptAreas<W, CLOSED>(pack, *endDirections, step.start, y, changes);
        solve<Moment::End>(y, changes);
        for (int place = 0; place < (segments+1)*REGISTERS; place++) {
            const int s = place/REGISTERS, part = place%REGISTERS;
            if (s < segments || CLOSED)
                changes[place] = changes[place]+inDouble<W>(joints[s < segments ? s : 0].turn, part);
            if (s > 0)
                changes[place] = changes[place]-inDouble<W>(joints[s-1].turn, part);
        }
        forEnds([&] (int s, int i, int end) {
            double turn = turnsOfFrames[end];
            if (twist.frameMobility[end] > 0) {
                Real torque = joints[s].torque+joints[s].implicit*twistOfTurns(s);
                turn -= twist.frameMobility[end]*step.settings.stepSize*lane(torque, i);
            }
            reinterpret_cast<double*>(changes+s*REGISTERS)[i] += turn;
        });
        for (int s = 0; s < segments && step.settings.turnsOfPieces != NULL; s++)
            for (int i = 0; i < W; i++)
                if (pack.particles[s*W+i] >= 0)
                    step.settings.turnsOfPieces[pack.particles[s*W+i]] = lane(joints[s].turn, i);
    }
private:
    ImplicitState<W>& step;
    const Pack& pack;
    const PackTwist<Scalar>& twist;
    const SegmentEquations<W> ofSegments;
    const int segments, first;
    TwistedJoint<Real>* const joints;
    NewSegmentGeometry<Real>* const newSegments;
    /** Of frames beyond ends in this step, [end][axis][lane], and the same in lanes. */
    const std::vector<double>* endDirections = &twist.directions;
    Vec directions[2];
    std::vector<double> ofBodies;
    /** By how much frames turn without the torques of their joints, as in the lists of these. */
    double turnsOfFrames[2*W];
    /** Whether torques have been found for nodes that have moved, whose segments are known. */
    bool haveMoved = false;
    /** Whether a chain is shorter than others. */
    bool isFilledUp = false;
    /** The sum of torques when each twist changes by one; and in rings, what the elimination needs. */
    Real shared, corner, perCorner;
    /** Whether the nodes of any chain give way to its torque by so much that their equations need it. */
    bool givesWay = true;

    /** A number of a segment, or in lanes where this one only fills up, another. */
    CYLCHAIN_INLINE Real ofOwn(int s, Real value, Real other) const {
        return isFilledUp && s < segments ?
                (property<Real>(pack, s, Pack::InverseRestLength) > Real{} ? value : other) : value;
    }
    /** The direction of a segment, or behind the last one of a chain, that of its frame. */
    CYLCHAIN_INLINE Vec directionAt(int s, const Vec& tangent) const {
        if (!isFilledUp)
            return tangent;
        const Vec& frame = directions[1];
        return {ofOwn(s, tangent.x, frame.x), ofOwn(s, tangent.y, frame.y), ofOwn(s, tangent.z, frame.z)};
    }
    /** The joint before a segment. */
    int jointBefore(int s) const {
        return s == 0 && CLOSED ? segments : s;
    }
    /** Call a function with the joint and the lane of each end of open chains, and where its frame is in lists. */
    template <class Function> CYLCHAIN_INLINE void forEnds(Function function) const {
        for (int i = 0; i < W && !CLOSED; i++) {
            function(0, i, i);
            function(pack.segmentsOfLane[i], i, W+i);
        }
    }
    /** Let frames that rigid bodies carry point where they do as the step begins. */
    void followBodies() {
        ofBodies = twist.directions;
        endDirections = &ofBodies;
        for (int i = 0; i < W; i++) {
            if (pack.chain[i] < 0)
                continue;
            const std::vector<double>& own = (*step.settings.endDirections)[pack.chain[i]];
            for (std::size_t k = 0; k < own.size(); k++)
                ofBodies[k*W+i] = own[k];
        }
    }
    /** Tell bodies the torques of the frames that they carry, as they will be when nodes and segments have moved. */
    void tellTorques() const {
        forEnds([&] (int s, int i, int end) {
            if (pack.chain[i] < 0)
                return;
            Real change = (joints[s].torque-joints[s].constant)/(joints[s].implicit+TINY);
            step.settings.endTorques[2*pack.chain[i]+end/W] = twist.stiffness[s*W+i]*
                    (lane(step.start.twists[s], i)+lane(change, i)+turnsOfFrames[end]);
        });
    }
    void draw() {
        const NoiseKey key = noiseKey(step.settings);
        NoisePlaces<W> places = noisePlaces<W>(pack);
        // Chains with twist have no friction of nodes, whose numbers these would be.
        Real normals[2];
        for (int s = 0; s <= segments; s++, places.part += 1) {
            drawNormals<W, 1>(key, NoiseKind::Node, places, normals);
            TwistedJoint<Real>& joint = joints[s];
            joint.constant = joint.constant-normals[0]*joint.torque;
            joint.random = normals[1]*root(2*step.kT*joint.friction);
        }
    }
    /**
     * Let the frame at an end give way to the torque of its joint, against a friction: it has turned where that torque
     * is known, and is eliminated here. Returns by how much its noise turns it.
     */
    double letFrameTurn(int s, int i, int end) {
        TwistedJoint<Real>& joint = joints[s];
        const double stiffness = twist.stiffness[s*W+i], givesWay = twist.frameMobility[end]*step.settings.stepSize;
        const double theta = std::fmax(lane(joint.implicit, i)/stiffness, 1-1/(4*stiffness*givesWay));
        const double softer = 1/(1+stiffness*theta*givesWay), kT = step.settings.kT;
        lane(joint.implicit, i) = lane(joint.coupling, i) = stiffness*theta*softer;
        lane(joint.constant, i) *= softer;
        lane(joint.torque, i) = std::sqrt(stiffness*(2*theta-1)*kT)*softer;
        if (kT <= 0)
            return 0;
        // Behind the numbers of tethers.
        Scalar normals[2];
        drawNormals<1, 1>(noiseKey(step.settings), NoiseKind::Tether, {(Word) pack.chain[i], (Word) UINT32_MAX},
                normals);
        return normals[end/W]*std::sqrt(2*kT*givesWay);
    }
    void addTurnedPairs() {
        const double kT = step.settings.kT, perTime = 1/step.h;
        for (int i = 0; i < W; i++) {
            if (pack.chain[i] < 0)
                continue;
            for (const TurnedPair& pair : (*step.settings.turnedPairs)[pack.chain[i]]) {
                const int s = pair.segment, next = s+1 < segments ? s+1 : 0;
                TwistedJoint<Real> &own = joints[s], &other = joints[next];
                // Of the numbers that belong to this place, twist takes the first two.
                Scalar normals[4] = {};
                if (kT > 0)
                    drawNormals<1, 2>(noiseKey(step.settings), NoiseKind::Node, {(Word) pack.chain[i], (Word) s},
                            normals);
                const double root = std::sqrt(pair.first), mixed = root > 0 ? pair.mixed/root : 0;
                const double rest = std::sqrt(std::fmax(0.0, pair.second-mixed*mixed));
                const double noise = std::sqrt(2*kT*perTime);
                lane(own.friction, i) += pair.first*perTime;
                lane(own.random, i) += pair.torque[0]+noise*root*normals[2];
                if (pair.second == 0)
                    continue;
                lane(other.friction, i) += pair.second*perTime;
                lane(other.random, i) += pair.torque[1]+noise*(mixed*normals[2]+rest*normals[3]);
                lane(joints[s+1].coupling, i) -= pair.mixed*perTime;
            }
        }
    }
    /** Add what a joint whose segments do not turn gives way by. */
    template <class Row> CYLCHAIN_INLINE void addOwnStiffness(int s, const NewSegmentGeometry<Real>& geometry1,
            const NewSegmentGeometry<Real>& geometry2, Row& before, Row& here, Row& after) const {
        const Vec first = joints[s].curvature*-geometry1.middleInverse;
        const Vec last = joints[s].curvature*geometry2.middleInverse, middle = -(first+last);
        const Real k = joints[s].implicit;
        before.diagonal.addOuter(first*k, first);
        before.upper = before.upper+Mat::outer(first*k, middle);
        before.second = before.second+Mat::outer(first*k, last);
        here.diagonal.addOuter(middle*k, middle);
        here.upper = here.upper+Mat::outer(middle*k, last);
        after.diagonal.addOuter(last*k, last);
    }
    /** Eliminate the turns of segments, and find how torques respond to a change of all twists. */
    void factorise() {
        // What a segment has beyond the joint behind it. A difference of pivots would lose the friction in rounding.
        Real own = joints[jointBefore(0)].implicit;
        for (int s = 0; s < segments; s++) {
            if (s > 0) {
                const Real stiffness = joints[s].implicit, coupling = joints[s].coupling;
                own = (stiffness*own+(stiffness-coupling)*(stiffness+coupling))*joints[s-1].inversePivot;
            }
            own = own+joints[s].friction;
            Real pivot = own+joints[s+1].implicit;
            if (CLOSED && s == 0) {
                own = own+pivot;
                pivot = pivot+pivot;
            }
            if (CLOSED && s == segments-1) {
                const Real last = joints[segments].coupling;
                pivot = pivot+last*last*(2*joints[0].inversePivot);
            }
            // What fills up does not turn.
            joints[s].inversePivot = ofOwn(s, 1/pivot, Real{});
        }
        if (CLOSED) {
            // By Sherman and Morrison, for the coupling of the last segment and the first.
            const Real last = joints[segments].coupling, diagonal = 0.5/joints[0].inversePivot;
            corner = last/diagonal;
            substitute([&] (int s) {return s == 0 ? -diagonal : s == segments-1 ? -last : Real{};});
            for (int s = 0; s < segments; s++)
                joints[s].border = joints[s].turn;
            perCorner = 1/(1+joints[0].border+corner*joints[segments-1].border);
        }
        if (!twist.isHeld)
            return;
        substitute([&] (int s) {return joints[s+1].implicit-joints[jointBefore(s)].implicit;});
        if (CLOSED)
            closeRing();
        shared = Real{};
        const Real held = loaded<Real>(twist.held, 0);
        for (int s = first; s <= segments; s++) {
            joints[s].share = held*joints[s].implicit*(1+twistOfTurns(s));
            shared = shared+joints[s].share;
        }
        for (int s = first; s <= segments; s++)
            joints[s].share = joints[s].share*(1/(shared+TINY));
    }
    /** How the turns of segments change the twist of a joint. */
    CYLCHAIN_INLINE Real twistOfTurns(int s) const {
        Real result = Real{};
        if (s < segments || CLOSED)
            result = joints[s < segments ? s : 0].turn;
        if (s > 0)
            result = result-joints[s-1].turn;
        return result;
    }
    /** Solve the equations of open chains for turns, with a function of their right sides. */
    template <class Function> CYLCHAIN_INLINE void substitute(Function right) {
        Real part = Real{};
        for (int s = 0; s < segments; s++) {
            part = right(s)+joints[s].coupling*part;
            joints[s].turn = part;
            part = part*joints[s].inversePivot;
        }
        part = Real{};
        for (int s = segments-1; s >= 0; s--) {
            part = (joints[s].turn+part)*joints[s].inversePivot;
            joints[s].turn = part;
            part = part*joints[s].coupling;
        }
    }
    void closeRing() {
        const Real part = (joints[0].turn+corner*joints[segments-1].turn)*perCorner;
        for (int s = 0; s < segments; s++)
            joints[s].turn = joints[s].turn-joints[s].border*part;
    }
    /** What torques are found for: the start of a step, or nodes in an iteration or after the last one. */
    enum class Moment {Start, Iteration, End};
    /** Find the turns for new nodes, and the torques as if there were none. */
    template <Moment MOMENT> void solve(const Vec* y, const Double* areas = NULL) {
        Vec tangent = directions[0], newTangent = directions[0], middle = directions[0];
        for (int s = 0; s <= segments; s++) {
            TwistedJoint<Real>& joint = joints[s];
            const Vec before = tangent, newBefore = newTangent, middleBefore = middle;
            if (s < segments || CLOSED) {
                const IteratedSegment<Real>& start = step.segments[s];
                tangent = directionAt(s, start.tangent);
                if constexpr (MOMENT == Moment::Start)
                    middle = tangent;
                else if constexpr (MOMENT == Moment::Iteration) {
                    ofSegments.describeNew(y, s, newSegments[s]);
                    newTangent = directionAt(s, newSegments[s].tangent);
                    middle = directionAt(s, newSegments[s].middleTangent);
                }
            }
            else
                tangent = newTangent = middle = directions[1];
            if (s < first)
                continue;
            joint.torque = joint.constant;
            if constexpr (MOMENT == Moment::Iteration)
                joint.torque = joint.torque+joint.implicit*sweptArea<Real>(before, tangent, newBefore, newTangent);
            if constexpr (MOMENT == Moment::End)
                joint.torque = joint.torque+joint.implicit*fromDouble<W>(areas+s*REGISTERS);
            if constexpr (MOMENT != Moment::End) {
                joint.perCosine = 1/(1+middleBefore.dot(middle)+TINY);
                joint.curvature = crossProduct(middleBefore, middle)*joint.perCosine;
                joint.perCosine = ofOwn(s, joint.perCosine, Real{});
            }
        }
        substitute([&] (int s) {return joints[s].random+joints[s+1].torque-joints[jointBefore(s)].torque;});
        if (CLOSED)
            closeRing();
    }
    /** Find the torque of a joint, its force and its gradient, on either segment as if that had the length one. */
    CYLCHAIN_INLINE void findForces(int s, Vec& force, Vec& gradient) {
        joints[s].torque = joints[s].torque+joints[s].implicit*twistOfTurns(s);
        force = joints[s].curvature*joints[s].torque;
        if (twist.isHeld)
            gradient = joints[s].curvature*joints[s].share;
    }
};
