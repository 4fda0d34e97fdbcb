// Included into the namespace of an instruction set. It does not compile alone.

/**
 * A step of chains of beam elements. It solves, for the new nodes y, with the middle m = (x+y)/2,
 *
 *     Z(m) ((y-x)/h - u(m)) = f + f_random(x) + f_drift(x) + f_propulsion(m) - sum_a T_a J_a(m),
 *     T_a = k (theta q_a(y) + (1-theta) q_a(x) - (2 theta-1)^(1/2) q_random),    theta = max(1/2, 1-1/z),
 *
 * where the coordinates q_a with the energies k q^2/2 are the strains of nodes and of the middles of elements, and the
 * sums and differences of bends; see BeamChain.h and, for why, ImplicitStep-inl.h, whose scheme this is. z is the step
 * over the least relaxation time that the coordinate has in a free element. All friction is in Z, which is that of the
 * curve, with the noise of the curve as it was: so its drift comes by itself. Strains have metric forces. u is the flow
 * of the solvent.
 */

/** The largest number of iterations, and the least: see ImplicitStep-inl.h. */
const int MOST_BEAM_ITERATIONS = 20, LEAST_BEAM_ITERATIONS = 3;
/** The largest changes of directions and of nodes, over the length of an element, in the last iteration. */
const Scalar DIRECTION_TOLERANCE = 0.01, PLACE_TOLERANCE = 0.1;
/** The largest error of a strain that an iteration leaves, over its thermal fluctuation. */
const Scalar STRAIN_TOLERANCE = 0.07;
/** Compression may take away this part of the friction of an element against turning in the iteration's matrix. */
const Scalar BEAM_COMPRESSION = 0.3;
/** Rates of relaxation of a free element: of strains in K/(zeta h^2), and of the bends in EI/(zeta h^4). */
const Scalar STRAIN_RATE = 378, SUM_RATE = 720, DIFFERENCE_RATE = 8400;
/** How far a force on the vector in the middle moves it, by h^3 zeta; that at an end: see MOBILITY_OF_BEAM_TANGENT. */
const Scalar MIDDLE_MOBILITY = 75;
/** A step that does not converge is cut into at most two to this power. */
const int LARGEST_BEAM_DIVISION = 10;

template <int W> class BeamStep {
    typedef typename Lanes<W>::Type Real;
    typedef Vector<Real> Vec;
    typedef SixVector<Real> Six;
    typedef BeamEquations<W> Equations;
public:
    struct Memory {
        Scratch elements, vectors, rows, columns;
        std::vector<BeamTetherState> tethers;
    };
    BeamStep(const BeamPack& pack, const StepSettings& settings, const BeamStart<W>& start, Memory& memory) :
            pack(pack), settings(settings), start(start), n(pack.nodes),
            elements(memory.elements.template reserve<BeamElementState<Real> >(n)),
            forces(memory.vectors.template reserve<Six>(3*n)), right(forces+n), change(forces+2*n),
            equations(pack.mobile, n, memory.rows.template reserve<typename Equations::Eliminated>(n),
                    pack.closed ? memory.columns.template reserve<Six>(6*n) : NULL),
            tethers(memory.tethers),
            length(of(BeamPack::Length)), perLength(1/length), parallel(of(BeamPack::Parallel)),
            perpendicular(of(BeamPack::Perpendicular)),
            shortening(1.5*of(BeamPack::Shortening)), perStep(1/settings.stepSize),
            flow(settings.flow, pack.planar, *start.first) {
        const Real h = splat<Real>(settings.stepSize), square = length*length;
        const Real rateOfBends = h*of(BeamPack::Bending)/(perpendicular*square*square);
        thetaOfStrains = thetaOf(h*of(BeamPack::Stretching)*STRAIN_RATE/(parallel*square));
        thetaOfSum = thetaOf(rateOfBends*SUM_RATE);
        thetaOfDifference = thetaOf(rateOfBends*DIFFERENCE_RATE);
    }
    /**
     * Take the step.
     *
     * @param external  the forces that do work on positions and control vectors
     * @param y         receives how far these move
     * @param failed    receives true for each lane that has not converged or turns too far
     * @return the number of iterations
     */
    int take(const Six* external, Six* y, bool* failed) {
        begin(external, y);
        Real active = splat<Real>(1);
        int iterations = 0;
        while (iterations < MOST_BEAM_ITERATIONS) {
            eliminate(y, NULL);
            advance(y, iterations, active);
            iterations++;
            if (iterations >= LEAST_BEAM_ITERATIONS && !anyUnfinished(active))
                break;
        }
        for (int i = 0; i < W; i++)
            failed[i] = lane(active, i) != 0;
        findExcessiveChanges(y, failed);
        return iterations;
    }
    /** Describe the start of a step, and draw its noise. */
    void begin(const Six* external, Six* y) {
        // A flow carries chains as a whole; those with fixed particles begin where they are.
        const Real time = loaded<Real>(pack.free, 0)*settings.stepSize;
        const Vec carried = flow.at(*start.first+flow.at(*start.first)*(0.5*time))*time;
        for (int node = 0; node < n; node++) {
            y[node] = {carried, Vec {}};
            forces[node] = external[node];
        }
        for (int e = 0; e < n; e++)
            describe(e);
        describeTethers();
        if (settings.kT > 0) {
            const Real largest = larger<Real>(thetaOfSum, thetaOfDifference);
            BeamNoise<W> noise(pack, settings, start, elements, forces, largest-0.5);
            for (int e = 0; e < n; e++)
                noise.draw(e);
        }
    }
    /** Linearise the equations around y with those of couplings, or NULL, and solve them: see getChange(). */
    void eliminate(const Six* y, const BeamTerms<W>* terms) {
        int nextTerm = 0;
        std::size_t nextTether = 0;
        typename Equations::Row rows[2];
        typename Equations::Row *here = rows, *after = rows+1;
        *here = typename Equations::Row {};
        for (int node = 0; node < n; node++)
            right[node] = forces[node];
        if (settings.flow.present)
            addDrag(y);
        for (int e = 0; e < n-1; e++) {
            BeamElementState<Real>& own = elements[e];
            const BeamShape<Real> now(vectors(e, y, 1)), middle(vectors(e, y, 0.5));
            BeamMatrix<Real> m;
            // The strain in the middle, and one or two components of two bends.
            m.planar = pack.planar;
            addFriction(y, e, m);
            if (pack.propelled)
                addPropulsion(y, e);
            addBends(now, middle, own, e, m);
            addMiddleStrain(now, middle, own, e, m);
            Equations::addElement(m, *here, *after);
            addNodeStrain(now.first, now.strain, middle.first, e, *here);
            if (e == n-2) {
                const Vec control = (start.control[e+1]+y[e+1].control)*(3*perLength);
                addNodeStrain(now.last, root(control.dot(control))-1, middle.last, e+1, *after);
            }
            if (terms != NULL)
                terms->add(e, nextTerm, *here, *after, right);
            addTethers(y, e, nextTether, *here);
            if (e == n-2)
                addTethers(y, e+1, nextTether, *after);
            equations.eliminate(e, *here, *after, false);
            std::swap(here, after);
        }
        equations.eliminate(n-1, *here, *after, true);
        equations.close();
        equations.setRight(right);
        equations.substitute(change);
    }
    /** Finish an iteration with the change that was found: find the tensions, and move the nodes of active lanes. */
    void advance(Six* y, int iteration, Real active) {
        if (iteration == 0 && settings.kT > 0)
            BeamMetricForces<W>(pack, start, elements, equations, settings.kT*(2*thetaOfStrains-1)).add(forces);
        move(y, active, iteration > 0);
    }
    /** Find how forces on positions and control vectors move these, with the last elimination. */
    void respond(const Six* onNodes, Six* moves) {
        equations.setRight(onNodes);
        equations.substitute(moves);
    }
    Six* getChange() {
        return change;
    }
    const Equations& getEquations() const {
        return equations;
    }
    /** Whether any lane has not converged; those that have are taken out. NaN counts as not converged. */
    bool anyUnfinished(Real& active) const {
        const Scalar perDirection = 1/(DIRECTION_TOLERANCE*DIRECTION_TOLERANCE);
        const Scalar perPlace = 1/(PLACE_TOLERANCE*PLACE_TOLERANCE);
        const Real held = pack.closed ? splat<Real>(1) : 1-loaded<Real>(pack.free, 0);
        const Real perEnergy = held*(1/(settings.kT+TINY))*(settings.kT > 0 ? 1 : 0);
        Real excess = Real{};
        for (int e = 0; e < n; e++) {
            const Vec turn = change[e].control*(3*perLength), place = change[e].position*perLength;
            include(turn.dot(turn), elements[e].ofNode.stiffness*perEnergy, perDirection, excess);
            const Real far = place.dot(place)*perPlace;
            excess = far < excess ? excess : far;
            if (e == n-1)
                break;
            const Vec middle = BeamVectors<Real>::of(change[e].control, change[e+1].position-change[e].position,
                    change[e+1].control, perLength).middle;
            include(middle.dot(middle), elements[e].ofMiddle.stiffness*perEnergy, perDirection, excess);
        }
        bool any = false;
        for (int i = 0; i < W; i++) {
            if (lane(excess, i) < 1)
                lane(active, i) = 0;
            any |= lane(active, i) != 0;
        }
        return any;
    }
    /** Mark lanes of which a vector has changed by more than a quarter of a turn would do. */
    void findExcessiveChanges(const Six* y, bool* failed) const {
        for (int e = 0; e < n; e++) {
            const Vec turn = y[e].control*(3*perLength);
            Real square = turn.dot(turn);
            if (e < n-1) {
                const Vec middle = BeamVectors<Real>::of(y[e].control, y[e+1].position-y[e].position, y[e+1].control,
                        perLength).middle;
                square = larger<Real>(square, middle.dot(middle));
            }
            for (int i = 0; i < W; i++)
                failed[i] |= e < pack.nodesOfLane[i] && !(lane(square, i) < 2);
        }
    }
private:
    const BeamPack& pack;
    const StepSettings& settings;
    const BeamStart<W>& start;
    const int n;
    BeamElementState<Real>* const elements;
    Six *const forces, *const right, *const change;
    Equations equations;
    std::vector<BeamTetherState>& tethers;
    const Real length, perLength, parallel, perpendicular, shortening;
    const Scalar perStep;
    const LaneFlow<W> flow;
    Real thetaOfStrains, thetaOfSum, thetaOfDifference;

    Real of(int property) const {
        return loaded<Real>(pack.properties, property);
    }
    static Real thetaOf(Real rate) {
        return larger<Real>(splat<Real>(0.5), 1-1/(rate+TINY));
    }
    CYLCHAIN_INLINE Real present(int e) const {
        return loaded<Real>(pack.present, e);
    }
    CYLCHAIN_INLINE BeamVectors<Real> startVectors(int e) const {
        return BeamVectors<Real>::of(start.control[e], start.chord[e], start.control[e+1], perLength);
    }
    CYLCHAIN_INLINE BeamVectors<Real> vectors(int e, const Six* y, Scalar share) const {
        const Real part = splat<Real>(share);
        return BeamVectors<Real>::of(start.control[e]+y[e].control*part,
                start.chord[e]+(y[e+1].position-y[e].position)*part, start.control[e+1]+y[e+1].control*part, perLength);
    }
    void describe(int e) {
        BeamElementState<Real>& own = elements[e];
        const Real modulus = of(BeamPack::Stretching)*length;
        own.ofNode = own.ofMiddle = BeamStrain<Real> {};
        const Real before = e > 0 ? present(e-1) : pack.closed ? present(n-2) : Real{};
        own.ofNode.stiffness = modulus*(before+present(e))*Scalar(1.0/6);
        if (e == n-1) {
            // The first node of a ring has its strain.
            if (pack.closed)
                own.ofNode.stiffness = Real{};
            const Vec control = start.control[e]*(3*perLength);
            own.ofNode.start = root(control.dot(control))-1;
            return;
        }
        const BeamShape<Real> shape(startVectors(e));
        own.ofMiddle.stiffness = modulus*present(e)*Scalar(2.0/3);
        own.ofNode.start = shape.strain;
        own.ofMiddle.start = shape.middleStrain+shortening;
        own.sum = shape.sum;
        own.difference = shape.difference;
        own.middle = shape.middle;
        own.randomSum = own.randomDifference = Vec {};
    }
    /** Describe tethers, and draw their noise: they are coordinates like those of elements, but linear ones. */
    void describeTethers() {
        tethers.resize(pack.tethers.size());
        const NoiseKey key = {(std::uint32_t) settings.seed, (std::uint32_t) settings.level, settings.step};
        for (std::size_t number = 0; number < tethers.size(); number++) {
            const BeamTether& tether = pack.tethers[number];
            auto property = [&] (int which) {
                return pack.properties[which*W+tether.lane];
            };
            const double least = std::fmin(property(BeamPack::Parallel), property(BeamPack::Perpendicular));
            const double friction = property(BeamPack::Length)*(least/MOBILITY_OF_BEAM_END);
            const double rate = settings.stepSize*tether.stiffness/friction;
            BeamTetherState& own = tethers[number];
            own.theta = std::fmax(0.5, 1-1/(rate+TINY));
            std::fill(own.random, own.random+3, 0.0);
            if (settings.kT == 0 || tether.stiffness == 0)
                continue;
            const NoisePlaces<1> place = {(Word) pack.noiseChain[tether.lane], (Word) tether.number};
            Scalar normals[4];
            drawNormals<1, 2>(key, NoiseKind::Tether, place, normals);
            for (int k = 0; k < (pack.planar ? 2 : 3); k++)
                own.random[k] = normals[k]*std::sqrt(settings.kT/tether.stiffness);
        }
    }
    /** Add the tethers of a node, the next ones, to its equations. */
    void addTethers(const Six* y, int node, std::size_t& next, typename Equations::Row& row) {
        for (; next < tethers.size() && pack.tethers[next].node == node; next++) {
            const BeamTether& tether = pack.tethers[next];
            const BeamTetherState& own = tethers[next];
            const double *d = start.tethers+3*next, stiffness = tether.stiffness, random = std::sqrt(2*own.theta-1);
            const int i = tether.lane;
            Vec moved = y[node].position;
            const double move[] = {lane(moved.x, i), lane(moved.y, i), lane(moved.z, i)};
            double force[3];
            for (int k = 0; k < 3; k++)
                force[k] = pack.planar && k == 2 ? 0 : stiffness*(d[k]+own.theta*move[k]-random*own.random[k]);
            Vec& onNode = right[node].position;
            lane(onNode.x, i) -= force[0];
            lane(onNode.y, i) -= force[1];
            lane(onNode.z, i) -= force[2];
            for (int k = 0; k < 3; k++)
                lane(row.diagonal.a[k][k], i) += stiffness*own.theta;
        }
    }
    /** Set the tension of a strain as it is, and return how it grows. */
    CYLCHAIN_INLINE Real findTension(BeamStrain<Real>& strain, Real now) const {
        const Real theta = thetaOfStrains;
        strain.tension = strain.stiffness*(now*theta+strain.start*(1-theta)-strain.random*root(2*theta-1));
        return strain.stiffness*theta;
    }
    CYLCHAIN_INLINE void addForces(const BeamGradient<Real>& force, Six& first, Six& second) const {
        addForcesOf(force, perLength, first, second);
    }
    CYLCHAIN_INLINE void addFriction(const Six* y, int e, BeamMatrix<Real>& m) {
        const Real half = splat<Real>(0.5);
        const Vec control1 = start.control[e]+y[e].control*half, control2 = start.control[e+1]+y[e+1].control*half;
        const Vec chord = start.chord[e]+(y[e+1].position-y[e].position)*half;
        const Real size = length*present(e)*perStep;
        const Real across = perpendicular*size, more = parallel*size-across;
        Symmetric<Real> resistance[GAUSS_POINTS] = {};
        for (int g = 0; g < GAUSS_POINTS; g++) {
            const Vec t = directionAt(g, control1, chord, control2);
            resistance[g].addAxial(across*GAUSS_WEIGHTS[g], more*GAUSS_WEIGHTS[g], t);
            addAt(g, -(resistance[g]*velocityAt(g, y[e], y[e+1])), right[e], right[e+1]);
        }
        int pair = 0;
#pragma GCC unroll 4
        for (int k = 0; k < 4; k++)
#pragma GCC unroll 4
            for (int l = k; l < 4; l++) {
                Symmetric<Real> sum = {};
#pragma GCC unroll 4
                for (int g = 0; g < GAUSS_POINTS; g++)
                    addTimes(sum, resistance[g], WEIGHTS.value[g][k]*WEIGHTS.value[g][l]);
                m.block[pair++] = sum;
            }
    }
    /** Add the propulsion of an element, along its curve in the middle of the step. */
    void addPropulsion(const Six* y, int e) {
        const Real half = splat<Real>(0.5);
        addPropulsionOf(of(BeamPack::Propulsion)*present(e), start.control[e]+y[e].control*half,
                start.chord[e]+(y[e+1].position-y[e].position)*half, start.control[e+1]+y[e+1].control*half, right[e],
                right[e+1]);
    }
    /** Add the friction of the flow, in the middle of the step. */
    void addDrag(const Six* y) {
        const Real half = splat<Real>(0.5);
        Vec first = *start.first+y[0].position*half;
        for (int e = 0; e < n-1; e++) {
            const Vec control1 = start.control[e]+y[e].control*half, control2 = start.control[e+1]+y[e+1].control*half;
            const Vec chord = start.chord[e]+(y[e+1].position-y[e].position)*half;
            const Real size = length*present(e), across = perpendicular*size, more = parallel*size-across;
            for (int g = 0; g < GAUSS_POINTS; g++) {
                const Scalar* const weights = WEIGHTS.value[g];
                const Vec velocity = flow.at(first+control1*splat<Real>(weights[1])+chord*splat<Real>(weights[2])+
                        control2*splat<Real>(weights[3]));
                const Vec t = directionAt(g, control1, chord, control2);
                const Vec drag = (velocity*across+t*(more*t.dot(velocity)))*splat<Real>(GAUSS_WEIGHTS[g]);
                addAt(g, drag, right[e], right[e+1]);
            }
            first = first+chord;
        }
    }
    static CYLCHAIN_INLINE void addTimes(Symmetric<Real>& sum, const Symmetric<Real>& one, Scalar factor) {
        sum.xx += one.xx*factor;
        sum.yx += one.yx*factor;
        sum.yy += one.yy*factor;
        sum.zx += one.zx*factor;
        sum.zy += one.zy*factor;
        sum.zz += one.zz*factor;
    }
    /** A vector across the middle of an element, after the middle has turned. */
    static CYLCHAIN_INLINE Vec turned(const Vec& v, const Vec& from, const Vec& to) {
        const Real cosine = from.dot(to);
        const Vec axis = crossProduct(from, to);
        return v*cosine+crossProduct(axis, v)+axis*(axis.dot(v)/(1+cosine+Scalar(1e-9)));
    }
    /** Add the bends, and what the tension of the middle does against turning. */
    CYLCHAIN_INLINE void addBends(const BeamShape<Real>& now, const BeamShape<Real>& middle,
            const BeamElementState<Real>& own, int e, BeamMatrix<Real>& m) {
        const Real stiffness = of(BeamPack::Bending)*perLength*present(e), other = stiffness*Scalar(4.0/3);
        const Real theta1 = thetaOfSum, theta2 = thetaOfDifference;
        // All bends turn with the middle, so that what a bend is does not depend on how far the element turns.
        const Vec before1 = own.sum*(1-theta1)-own.randomSum*root(2*theta1-1);
        const Vec before2 = own.difference*(1-theta2)-own.randomDifference*root(2*theta2-1);
        const Vec moment1 = (turned(now.sum*theta1, now.middle, middle.middle)+
                turned(before1, own.middle, middle.middle))*stiffness;
        const Vec moment2 = (turned(now.difference*theta2, now.middle, middle.middle)+
                turned(before2, own.middle, middle.middle))*other;
        addForces(middle.forcesOf(moment1, moment2), right[e], right[e+1]);

        Vec e1 = {Real{}, Real{}, splat<Real>(1)}, e2 = {};
        if (!pack.planar)
            orthogonal(now.middle, e1, e2);
        const Real root1 = root(stiffness*theta1), root2 = root(other*theta2);
        setCoordinate(now.forcesOf(e1*root1, Vec {}), m.outer[1]);
        setCoordinate(now.forcesOf(Vec {}, e1*root2), m.outer[2]);
        if (!pack.planar) {
            setCoordinate(now.forcesOf(e2*root1, Vec {}), m.outer[3]);
            setCoordinate(now.forcesOf(Vec {}, e2*root2), m.outer[4]);
        }
        else
            for (int k = 0; k < 4; k++)
                m.outer[3][k] = m.outer[4][k] = Vec {};

        const Real least = perpendicular*length*length*length*present(e)*(-BEAM_COMPRESSION/MIDDLE_MOBILITY*perStep);
        const Real taut = 0.5*larger<Real>(own.ofMiddle.multiplier*now.perMiddle, least)*perLength*perLength;
        Symmetric<Real> across = {};
        across.addAxial(taut, -taut, now.middle);
        const Scalar weights[] = {2.25, 1.125, -2.25, 1.125, 0.5625, -1.125, 0.5625, 2.25, -1.125, 0.5625};
#pragma GCC unroll 10
        for (int pair = 0; pair < 10; pair++)
            addTimes(m.block[pair], across, weights[pair]);
    }
    /** What a coordinate with this gradient, or less this, has for the four vectors. */
    CYLCHAIN_INLINE void setCoordinate(const BeamGradient<Real>& gradient, Vec* outer) const {
        SixVector<Real> first = {}, second = {};
        addForces(gradient, first, second);
        outer[0] = first.position;
        outer[1] = first.control;
        outer[2] = second.position;
        outer[3] = second.control;
    }
    CYLCHAIN_INLINE void addMiddleStrain(const BeamShape<Real>& now,
            const BeamShape<Real>& middle, BeamElementState<Real>& own, int e, BeamMatrix<Real>& m) {
        const BeamGradient<Real> gradient = now.middleGradient();
        const Real response = findTension(own.ofMiddle, now.middleStrain+shortening);
        const BeamGradient<Real> lacking = middle.middleGradient()-gradient;
        addForces(gradient*(-own.ofMiddle.tension)-lacking*own.ofMiddle.multiplier, right[e], right[e+1]);
        own.lacking = lacking;
        const Vec chord = gradient.middle*(perLength*Scalar(1.5)), control = gradient.middle*(perLength*Scalar(0.75));
        own.weights[0] = -chord;
        own.weights[1] = gradient.first*(3*perLength)-control;
        own.weights[2] = chord;
        own.weights[3] = gradient.last*(3*perLength)-control;
        const Real scale = root(response);
        for (int k = 0; k < 4; k++)
            m.outer[0][k] = own.weights[k]*scale;
        own.newMiddle = now.middle;
    }
    CYLCHAIN_INLINE void addNodeStrain(const Vec& direction, Real strain, const Vec& middle, int node,
            typename Equations::Row& row) {
        BeamElementState<Real>& own = elements[node];
        const Real response = findTension(own.ofNode, strain);
        own.nodeLacking = middle-direction;
        const Vec force = direction*own.ofNode.tension+own.nodeLacking*own.ofNode.multiplier;
        right[node].control = right[node].control-force*(3*perLength);
        const Real least = perpendicular*length*length*length*(-BEAM_COMPRESSION/MOBILITY_OF_BEAM_TANGENT*perStep);
        const Real there = own.ofNode.stiffness > 0 ? splat<Real>(1) : Real{};
        const Real taut = 0.5*there*larger<Real>(own.ofNode.multiplier/(1+strain), least);
        const Real square = 9*perLength*perLength;
        Symmetric<Real> matrix = {};
        matrix.addAxial(taut*square, (response-taut)*square, direction);
        Equations::addToControl(matrix, row);
        own.direction = direction;
    }
    /** Set the tensions that the linear equations give, or add to them. */
    template <bool ADD> void findMultipliers(const Six* changes) {
        for (int e = 0; e < n; e++) {
            BeamElementState<Real>& own = elements[e];
            const Real ofNode = own.ofNode.stiffness*thetaOfStrains*(3*perLength)*own.direction.dot(changes[e].control);
            own.ofNode.multiplier = (ADD ? own.ofNode.multiplier : own.ofNode.tension)+ofNode;
            if (e == n-1)
                break;
            const Real moved = own.weights[0].dot(changes[e].position)+own.weights[1].dot(changes[e].control)+
                    own.weights[2].dot(changes[e+1].position)+own.weights[3].dot(changes[e+1].control);
            own.ofMiddle.multiplier = (ADD ? own.ofMiddle.multiplier : own.ofMiddle.tension)+
                    own.ofMiddle.stiffness*thetaOfStrains*moved;
        }
    }
    /** Let changes of tensions and moments act as in the middle of the step as well, with the same elimination. */
    void refine(const Six* y) {
        for (int e = 0; e < n; e++) {
            const BeamElementState<Real>& own = elements[e];
            if (e == 0)
                right[e] = Six {};
            right[e].control = right[e].control+
                    own.nodeLacking*(3*perLength*(own.ofNode.before-own.ofNode.multiplier));
            if (e == n-1)
                break;
            right[e+1] = Six {};
            addForces(own.lacking*(own.ofMiddle.before-own.ofMiddle.multiplier), right[e], right[e+1]);
        }
        for (int e = 0; e < n-1; e++)
            refineMoments(y, e);
        equations.setRight(right);
        equations.substitute(right);
        findMultipliers<true>(right);
        for (int node = 0; node < n; node++) {
            change[node].position = change[node].position+right[node].position;
            change[node].control = change[node].control+right[node].control;
        }
    }
    /** The matrix has moments change as they act at the end of the step: what they lack of those in its middle. */
    CYLCHAIN_INLINE void refineMoments(const Six* y, int e) {
        const BeamShape<Real> now(vectors(e, y, 1)), middle(vectors(e, y, 0.5));
        const Real stiffness = of(BeamPack::Bending)*perLength*present(e);
        const BeamVectors<Real> changes = BeamVectors<Real>::of(change[e].control,
                change[e+1].position-change[e].position, change[e+1].control, perLength);
        Vec moment1, moment2;
        now.findChanges(changes, moment1, moment2);
        moment1 = moment1*(stiffness*thetaOfSum);
        moment2 = moment2*(stiffness*thetaOfDifference*Scalar(4.0/3));
        addForces(middle.forcesOf(turned(moment1, now.middle, middle.middle),
                turned(moment2, now.middle, middle.middle))-now.forcesOf(moment1, moment2), right[e], right[e+1]);
    }
    /** Find the tensions, and move the nodes of active lanes. */
    void move(Six* y, Real active, bool refines) {
        for (int e = 0; e < n; e++) {
            elements[e].ofNode.before = elements[e].ofNode.multiplier;
            elements[e].ofMiddle.before = elements[e].ofMiddle.multiplier;
        }
        findMultipliers<false>(change);
        if (refines)
            refine(y);
        for (int node = 0; node < n; node++) {
            y[node].position = y[node].position+change[node].position*active;
            y[node].control = y[node].control+change[node].control*active;
        }
        if (!pack.closed)
            resetLengths(y);
    }
    /**
     * Vectors that turn far become longer, because nodes move along straight lines. Give them the directions that they
     * have now, and the lengths that the linear equations mean, around the same mean of all nodes. Chains with fixed
     * particles stay as they are.
     */
    void resetLengths(Six* y) {
        const Real isFree = loaded<Real>(pack.free, 0);
        Vec sum = {}, shifted = {}, moved = y[0].position, controlBefore = {};
        Real count = Real{};
        for (int node = 0; node < n; node++) {
            const Vec control = start.control[node]+y[node].control;
            const Real ratio = larger<Real>(elements[node].direction.dot(control)/root(control.dot(control)),
                    splat<Real>(0.5));
            const Vec reset = control*ratio;
            if (node > 0) {
                const int e = node-1;
                const BeamVectors<Real> v = vectors(e, y, 1);
                const Real share = larger<Real>(elements[e].newMiddle.dot(v.middle)/root(v.middle.dot(v.middle)),
                        splat<Real>(0.5));
                const Vec chord = (v.middle*(share*length)+(controlBefore+reset)*splat<Real>(0.75))*splat<Real>(2.0/3);
                moved = moved+chord-start.chord[e];
            }
            controlBefore = reset;
            const Real mobile = loaded<Real>(pack.mobile, 2*node);
            sum = sum+y[node].position*mobile;
            shifted = shifted+moved*mobile;
            count = count+mobile;
            right[node] = {moved, reset-start.control[node]};
        }
        const Vec back = (sum-shifted)*(1/larger<Real>(count, splat<Real>(1)));
        for (int node = 0; node < n; node++) {
            const Real taken = isFree*loaded<Real>(pack.mobile, 2*node);
            y[node].position = y[node].position+(right[node].position+back-y[node].position)*taken;
            y[node].control = y[node].control+(right[node].control-y[node].control)*taken;
        }
    }
    /** An iteration takes a strain to first order in the change, so that half its square is left. */
    CYLCHAIN_INLINE void include(Real square, Real stiffness, Scalar perDirection, Real& excess) const {
        const Real ratio = square*perDirection;
        excess = ratio < excess ? excess : ratio;
        const Real error = square*(Scalar(0.5)/STRAIN_TOLERANCE);
        excess = larger<Real>(excess, error*error*stiffness*thetaOfStrains);
    }
};
