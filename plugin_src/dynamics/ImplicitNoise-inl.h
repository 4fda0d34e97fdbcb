// Included into the namespace of an instruction set. It does not compile alone.

/**
 * The random forces, lengths and bends of an implicit step.
 */

/**
 * A bend is drawn as a Gaussian with rejection if the joint is stiffer than this many k_B T, or else from the sphere.
 */
const Scalar STIFF_JOINT = 2;

/**
 * Two vectors that are orthogonal to a unit vector and to each other (Duff et al., J. Comput. Graph. Tech. 2017, 6, 1).
 */
template <class Real> CYLCHAIN_INLINE void orthogonal(const Vector<Real>& n, Vector<Real>& first,
        Vector<Real>& second) {
    Real sign;
    Vector<Real> copy = n;
    for (int i = 0; i < LANE_COUNT<Real>; i++)
        lane(sign, i) = std::copysign(1.0, lane(copy.z, i));
    const Real a = -1/(sign+n.z), b = n.x*n.y*a;
    first = {1+sign*n.x*n.x*a, sign*b, -sign*n.x};
    second = {b, sign+n.y*n.y*a, -n.y};
}

template <int W, bool CLOSED> class ImplicitNoise {
    typedef typename Lanes<W>::Type Real;
    typedef Vector<Real> Vec;
public:
    explicit ImplicitNoise(ImplicitState<W>& step) : step(step), pack(step.pack), settings(step.settings), kT(step.kT),
            segments(step.segments), random(step.random) {
    }
    /** Draw the random forces, lengths and bends, and those of tethers. */
    void draw();
private:
    ImplicitState<W>& step;
    const Pack& pack;
    const StepSettings& settings;
    const Scalar kT;
    ImplicitSegment<Real>* const segments;
    Vec* const random;

    void drawForceOnNode(const Real* normals, int node, Scalar amplitude) {
        const Real size = loaded<Real>(pack.rootNodeFriction, 0)*amplitude;
        random[node] = random[node]+nodeNoise<Real>(normals, pack.planar)*size;
    }
    void drawForces(const Real* normals, int s, Scalar amplitude);
    void drawLength(const NoisePlaces<W>& places, int s, Real normal);
    void drawBend(const NoisePlaces<W>& places, int s);
    /** A bend that is linear in the nodes is Gaussian. */
    void drawLinearBend(const Real* normals, int s) {
        const Real stiffness = loaded<Real>(pack.joints, s);
        const Real deviation = stiffness > 0 ? root(kT/(stiffness+TINY)) : Real{};
        segments[s].randomBend = nodeNoise<Real>(normals, pack.planar)*deviation;
    }
    /** In a plane, a bend has one component, and its angle a uniform measure. */
    void drawPlanarBend(const NoisePlaces<W>& places, int s);
};

template <int W, bool CLOSED>
void ImplicitNoise<W, CLOSED>::draw() {
    const NoiseKey key = noiseKey(settings);
    NoisePlaces<W> places = noisePlaces<W>(pack);
    const Scalar amplitude = std::sqrt(2*settings.kT/step.h);
    for (int s = 0; s < step.n-1; s++, places.part += 1) {
        Real ofNode[8];
        if (pack.hasNodeFriction || isLinear(pack.bending))
            drawNormals<W, 4>(key, NoiseKind::Node, places, ofNode);
        if (pack.hasNodeFriction && s < pack.ownNodes())
            drawForceOnNode(ofNode, s, amplitude);
        if (pack.hasSegmentFriction && s < pack.segments) {
            Real normals[8];
            drawNormals<W, 4>(key, NoiseKind::Segment, places, normals);
            drawForces(normals, s, amplitude);
            drawLength(places, s, normals[6]);
        }
        else if (s < pack.segments)
            drawLength(places, s, ofNode[3]);
        if (s > 0 && isLinear(pack.bending))
            drawLinearBend(ofNode+4, s);
        else if (s > 0) {
            if (pack.planar)
                drawPlanarBend(places, s);
            else
                drawBend(places, s);
        }
    }
    if (pack.hasNodeFriction && step.n-1 < pack.ownNodes()) {
        Real normals[8];
        drawNormals<W, 4>(key, NoiseKind::Node, places, normals);
        drawForceOnNode(normals, step.n-1, amplitude);
    }
    for (std::size_t i = 0; i < pack.tethers.size(); i++) {
        const LaneTether& tether = pack.tethers[i];
        const double deviation = std::sqrt(settings.kT/(tether.stiffness+TINY));
        const NoisePlaces<1> place = {(Word) pack.chain[tether.lane], (Word) tether.number};
        Scalar normals[4];
        drawNormals<1, 2>(key, NoiseKind::Tether, place, normals);
        for (int k = 0; k < 3; k++)
            step.tethers[i].random[k] = pack.planar && k == 2 ? 0 : deviation*normals[k];
    }
}

template <int W, bool CLOSED>
CYLCHAIN_INLINE void ImplicitNoise<W, CLOSED>::drawForces(const Real* normals, int s, Scalar amplitude) {
    ImplicitSegment<Real>& segment = segments[s];
    const Vec t = segment.tangent;
    Vec a, b;
    forceNoise<Real>(normals, pack.planar, a, b);
    const Real across = property<Real>(pack, s, Pack::RootPerpendicular);
    const Real along = property<Real>(pack, s, Pack::RootParallel);
    const Vec force = (a*across+t*((along-across)*t.dot(a)))*splat<Real>(Scalar(0.5)*amplitude);
    const Real perLength = amplitude/segment.length;
    const Vec pair = (b-t*t.dot(b))*(property<Real>(pack, s, Pack::RootRotational)*perLength);
    random[s] = random[s]+force-pair;
    random[s+1] = random[s+1]+force+pair;
    segment.randomForce = force;
    segment.randomPair = pair;
    segment.randomTension = t.dot(b)*(property<Real>(pack, s, Pack::RootExtensional)*perLength);
}

template <int W, bool CLOSED>
void ImplicitNoise<W, CLOSED>::drawLength(const NoisePlaces<W>& places, int s, Real normal) {
    ImplicitSegment<Real>& segment = segments[s];
    const Real stiffness = property<Real>(pack, s, Pack::Stiffness);
    switch (pack.stretching) {
        case StretchingModel::Harmonic:
            segment.randomCoordinate = normal*root(kT/(stiffness+TINY));
            break;
        case StretchingModel::FENE: {
            // Segments that fill up a lane have neither stiffness nor a maximum extension.
            const Real inverse = property<Real>(pack, s, Pack::InverseExtension);
            drawFeneCoordinates<W>(noiseKey(settings), places, stiffness/(inverse*inverse*kT+TINY), normal);
            segment.randomCoordinate = normal/(inverse+TINY);
            break;
        }
    }
}

template <int W, bool CLOSED>
void ImplicitNoise<W, CLOSED>::drawBend(const NoisePlaces<W>& places, int s) {
    ImplicitSegment<Real>& segment = segments[s];
    const NoiseKey key = noiseKey(settings);
    Real stiffness = loaded<Real>(pack.joints, s)/kT, theta = segment.jointTheta;
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
                drawCandidate(key, NoiseKind::Bend, pack.chain[i], s, draw, drawn, uniform);
            a /= std::sqrt(k);
            b /= std::sqrt(k);
        }
        else {
            double square, uniforms[2];
            std::uint32_t draw = 1;
            do {
                drawUniforms(key, NoiseKind::Bend, pack.chain[i], s, draw++, uniforms);
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

template <int W, bool CLOSED>
void ImplicitNoise<W, CLOSED>::drawPlanarBend(const NoisePlaces<W>& places, int s) {
    ImplicitSegment<Real>& segment = segments[s];
    const NoiseKey key = noiseKey(settings);
    Real stiffness = loaded<Real>(pack.joints, s)/kT, theta = segment.jointTheta, bend = Real{};
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
                drawUniforms(key, NoiseKind::Bend, pack.chain[i], s, draw, uniforms);
            const double angle = stiff ? candidates[0]/std::sqrt(k*floor) : M_PI*(2*uniforms[0]-1);
            const double drawn = bendOfAngle(pack.bending, angle);
            const double excess = drawn*drawn-(stiff ? floor*angle*angle : 0);
            if (std::fabs(angle) < M_PI && uniforms[1] <= std::exp(-0.5*k*excess)) {
                lane(bend, i) = drawn;
                break;
            }
            if (stiff)
                drawCandidate(key, NoiseKind::Bend, pack.chain[i], s, draw, candidates, uniforms[1]);
        }
    }
    segment.randomBend = Vec {-segment.bisector.y, segment.bisector.x, Real{}}*bend;
}
