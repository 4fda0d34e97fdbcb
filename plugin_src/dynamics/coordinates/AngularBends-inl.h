// Included into the namespace of an instruction set. It does not compile alone.

/** Bends b = f (t2-t1) of the tangents of segments, with the angular bending models. */
template <int W> struct AngularBends : OnJoints {
    typedef typename Lanes<W>::Type Real;
    typedef Vector<Real> Vec;
    typedef Matrix<Real> Mat;
    typedef ImplicitState<W> State;
    typedef NewSegmentGeometry<Real> NewGeometry;
    static constexpr bool bends(BendingModel model) {
        return isAngular(model);
    }
    static CYLCHAIN_INLINE bool isIn(const Pack& pack) {
        return bends(pack.bending);
    }
    static CYLCHAIN_INLINE void describe(const State& step, int s) {
        const Pack& pack = step.pack;
        const Vec before = step.segments[s-1].tangent;
        ImplicitSegment<Real>& segment = step.segments[s];
        const Vec sum = before+segment.tangent, bent = segment.tangent-before;
        segment.bisector = sum*(1/root(sum.dot(sum)+TINY));
        segment.bend = bent*bendFactor(pack.bending, bent).f;
        segment.randomBend = Vec {};
        const Real l0 = property<Real>(pack, s, Pack::RestLength);
        const Real friction = lesser<Real>(property<Real>(pack, s-1, Pack::Rotational),
                property<Real>(pack, s, Pack::Rotational))+loaded<Real>(pack.nodeFriction, 0)*(0.25*l0*l0);
        const Real bendRate = 4*step.h*property<Real>(pack, s, Pack::Joint)+TINY;
        segment.jointTheta = larger<Real>(splat<Real>(0.5), 1-friction/bendRate);
    }
    static void draw(const State& step, const NoisePlaces<W>& places, const PlaceNormals<Real>&, int s) {
        if (HAS_BENDS_AT_REST && step.pack.twist.isBentAtRest())
            RestBends<W>::draw(step, places, s);
        else if (step.pack.planar)
            drawPlanar(step, places, s);
        else
            drawInSpace(step, places, s);
    }
    static CYLCHAIN_INLINE void prepare(const State& step, const Vec*, int s) {
        prepareBend(step, s, [&] {
            const Vec bent = step.segments[s].newTangent-step.segments[s-1].newTangent;
            return bent*(bendFactor(step.pack.bending, bent).f*(1-DIAGONAL));
        });
    }
    /** What takes roots and divisions: new bends, and how the random one turns with the joint. */
    struct Factors {
        BendFactor<Real> newFactor, factor;
        Vec sum;
        Real sumLength, projection, perSum, perOne;
    };
    static CYLCHAIN_INLINE void describeNew(const State& step, int s, const NewGeometry& geometry1,
            const NewGeometry& geometry2, Factors& factors) {
        const ImplicitSegment<Real>& segment = step.segments[s];
        const Vec newBent = geometry2.tangent-geometry1.tangent, bent = geometry2.middleTangent-geometry1.middleTangent;
        // The random bend turns with the joint.
        factors.sum = step.segments[s-1].tangent+segment.tangent+geometry1.tangent+geometry2.tangent;
        factors.sumLength = root(factors.sum.dot(factors.sum)+LEAST*LEAST);
        factors.projection = segment.bisector.dot(factors.sum);
        // The inverse of the length, and of one plus the cosine.
        bendFactors<Real>(step.pack.bending, newBent, bent, factors.newFactor, factors.factor, factors.sumLength,
                factors.sumLength+factors.projection+LEAST, factors.perSum, factors.perOne);
    }
    template <class AllFactors, class Row> static CYLCHAIN_INLINE void add(const State& step, int s,
                const AllFactors& factorsOfAll, const NewGeometry& geometry1, const NewGeometry& geometry2, Row& before,
                Row& here, Row& after) {
        const Factors& joint = static_cast<const FactorsOf<AngularBends>&>(factorsOfAll).own;
        const ImplicitSegment<Real>& segment = step.segments[s];
        const Vec t1 = geometry1.middleTangent, t2 = geometry2.middleTangent;
        const Real perLength1 = geometry1.middleInverse, perLength2 = geometry2.middleInverse;
        const Vec newBent = geometry2.tangent-geometry1.tangent, bent = t2-t1;
        const BendFactor<Real> newFactor = joint.newFactor, factor = joint.factor;
        const Real sumLength = joint.sumLength, perOne = joint.perOne;
        const Vec bisector = joint.sum*joint.perSum;
        const Real cosine = joint.projection*joint.perSum;
        const Vec axis = crossProduct(segment.bisector, bisector);
        const auto turnedWithJoint = [&] (const Vec& vector) {
            return vector*cosine+crossProduct(axis, vector)+axis*(axis.dot(vector)*sumLength*perOne);
        };
        Vec turned = turnedWithJoint(segment.turningBend);
        if (HAS_BENDS_AT_REST && step.pack.twist.isBentAtRest())
            turned = turned+RestBends<W>::inForce(step, s, geometry1, geometry2, bisector,
                    turnedWithJoint(step.restBends[s].bend));
        const Vec newBend = newBent*newFactor.f;

        const Real stiffness = property<Real>(step.pack, s, Pack::Joint);
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
        const Mat mixed = (Mat::axial(splat<Real>(1), splat<Real>(-1), t1)-Mat::outer(projected, t2))*
                (-scale*perLength1*perLength2);
        before.second = -mixed;
        before.diagonal.add(first);
        here.diagonal.add(first);
        here.diagonal.add(last);
        here.diagonal.addTwice(before.second);
        after.diagonal.add(last);
        before.upper = before.upper+mixed-Mat::of(first);
        here.upper = here.upper+mixed-Mat::of(last);
    }
    /** A segment has changed by more than a quarter of a turn would do. */
    static CYLCHAIN_INLINE void findExcessiveChange(const State& step, const Vec* y, int s, bool* failed) {
        const Pack& pack = step.pack;
        const Vec difference = y[s+1]-y[s];
        Real square = 0.5*difference.dot(difference), limit = property<Real>(pack, s, Pack::RestLength);
        for (int i = 0; i < W; i++)
            failed[i] |= s < pack.segmentsOfLane[i] && !(lane(square, i) < lane(limit, i)*lane(limit, i));
    }
    static CYLCHAIN_INLINE void addForces(const Pack& pack, int s, const SegmentGeometry<Real>& geometry1,
            const SegmentGeometry<Real>& geometry2, Vec* f, ChainEnergy* energy) {
        const Vec before = geometry1.tangent, t = geometry2.tangent;
        const Real joint = property<Real>(pack, s, Pack::Joint);
        const Real c = before.dot(t);
        const Vec normal = crossProduct(before, t);
        const Real sineSquared = normal.dot(normal);
        const Real slope = bendingSlope(pack.bending, joint, c, sineSquared);
        const Vec first = (t-before*c)*(-slope*geometry1.inverse), second = (before-t*c)*(-slope*geometry2.inverse);
        f[s-1] = f[s-1]-first;
        f[s] = f[s]+first-second;
        f[s+1] = f[s+1]+second;
        for (int i = 0; i < W && energy != NULL; i++) {
            Real k = joint, cosine = c, square = sineSquared;
            if (s < pack.nodesOfLane[i]-1)
                energy->bending += bendingEnergy(pack.bending, lane(k, i), lane(cosine, i), lane(square, i));
        }
    }
private:
    static void drawInSpace(const State& step, const NoisePlaces<W>& places, int s);
    /** In a plane, a bend has one component, and its angle a uniform measure. */
    static void drawPlanar(const State& step, const NoisePlaces<W>& places, int s);
};

template <int W> void AngularBends<W>::drawInSpace(const State& step, const NoisePlaces<W>& places, int s) {
    const Pack& pack = step.pack;
    ImplicitSegment<Real>& segment = step.segments[s];
    const NoiseKey key = noiseKey(step.settings);
    Real stiffness = property<Real>(pack, s, Pack::Joint)/step.kT, theta = segment.jointTheta;
    Real normals[2], acceptance;
    drawCandidates<W>(key, NoiseKind::Bend, places, normals, acceptance);
    // Nearly all bends of stiff joints are accepted at once.
    Real accepted = Real{};
    if (acceptsBendsInLanes(pack.bending)) {
        const Real deviation = 1/root(stiffness+TINY);
        accepted = stiffness > STIFF_JOINT ? acceptedBends(pack.bending, normals, deviation, acceptance) : Real{};
        const Real used = step.twoStages ? deviation : (theta > 0.5 ? deviation : Real{});
        for (int k = 0; k < 2; k++)
            normals[k] = normals[k]*(accepted > 0 ? used : splat<Real>(1));
    }
    for (int i = 0; i < W; i++) {
        if (lane(accepted, i) != 0)
            continue;
        const double k = lane(stiffness, i);
        double drawn[2] = {lane(normals[0], i), lane(normals[1], i)};
        double& a = drawn[0], &b = drawn[1];
        if (k == 0 || (lane(theta, i) == 0.5 && !step.twoStages))
            a = b = 0;
        else if (k > STIFF_JOINT) {
            double uniform = lane(acceptance, i);
            for (std::uint32_t draw = 1; uniform > bendMeasure(pack.bending, (a*a+b*b)/k); draw++)
                drawCandidate(key, NoiseKind::Bend, pack.chain[i], pack.firstNode[i]+s, draw, drawn, uniform);
            a /= std::sqrt(k);
            b /= std::sqrt(k);
        }
        else {
            double square, uniforms[2];
            std::uint32_t draw = 1;
            do {
                drawUniforms(key, NoiseKind::Bend, pack.chain[i], pack.firstNode[i]+s, draw++, uniforms);
                square = bendSquare(pack.bending, 2*uniforms[0]-1);
            } while (uniforms[1] > std::exp(-0.5*k*square));
            const double scale = std::sqrt(square/(a*a+b*b));
            a *= scale;
            b *= scale;
        }
        lane(normals[0], i) = a;
        lane(normals[1], i) = b;
    }
    Vec e1, e2;
    orthogonal(segment.bisector, e1, e2);
    segment.randomBend = e1*normals[0]+e2*normals[1];
}

template <int W> void AngularBends<W>::drawPlanar(const State& step, const NoisePlaces<W>& places, int s) {
    const Pack& pack = step.pack;
    ImplicitSegment<Real>& segment = step.segments[s];
    const NoiseKey key = noiseKey(step.settings);
    Real stiffness = property<Real>(pack, s, Pack::Joint)/step.kT, theta = segment.jointTheta, bend = Real{};
    Real normals[2], acceptance;
    drawCandidates<W>(key, NoiseKind::Bend, places, normals, acceptance);
    // The energy is that of a Gaussian or more, in the angle.
    const double floor = leastBendSquare(pack.bending);
    for (int i = 0; i < W; i++) {
        const double k = lane(stiffness, i);
        if (k == 0 || (lane(theta, i) == 0.5 && !step.twoStages))
            continue;
        const bool stiff = k*floor > STIFF_JOINT;
        double candidates[2] = {lane(normals[0], i), 0}, uniforms[2] = {0, lane(acceptance, i)};
        for (std::uint32_t draw = 1;; draw++) {
            if (!stiff)
                drawUniforms(key, NoiseKind::Bend, pack.chain[i], pack.firstNode[i]+s, draw, uniforms);
            const double angle = stiff ? candidates[0]/std::sqrt(k*floor) : M_PI*(2*uniforms[0]-1);
            const double drawn = bendOfAngle(pack.bending, angle);
            const double excess = drawn*drawn-(stiff ? floor*angle*angle : 0);
            if (std::fabs(angle) < M_PI && uniforms[1] <= std::exp(-0.5*k*excess)) {
                lane(bend, i) = drawn;
                break;
            }
            if (stiff)
                drawCandidate(key, NoiseKind::Bend, pack.chain[i], pack.firstNode[i]+s, draw, candidates, uniforms[1]);
        }
    }
    segment.randomBend = Vec {-segment.bisector.y, segment.bisector.x, Real{}}*bend;
}
