// Included into the namespace of an instruction set. It does not compile alone.

/**
 * Bends at rest: joints with the energy (stiffness/2) (b-R k)^2, where R k is a vector of the material, with the
 * angular bending models. See docs/design/twist.md.
 *
 * As nodes move, frames are carried along, and R k turns with the bisector, up to half the difference of what both
 * halves of the joint sweep. So the force of -stiffness b.R k is that of b alone, with the part of R k across the plane
 * of the joint times the cosine of half its angle. Segments turn about themselves when nodes have moved.
 */
template <int W> struct RestBends {
    typedef typename Lanes<W>::Type Real;
    typedef Vector<Real> Vec;
    typedef ImplicitState<W> State;
    /** Find where the material is at the start of a step. */
    static void describe(State& step) {
        for (int s = 0; s < step.n; s++)
            step.restBends[s] = RestBend<Real> {};
        carryFrames<W>(step.pack, [&] (int s) {
            return step.segments[s].tangent;
        }, step.start.twists, [&] (int s, const Vec&, const Vec&, const Vec& bisector, const Vec& axis) {
            step.restBends[s] = {axis, inSpace(step.pack, s, bisector, axis)};
        });
    }
    /**
     * Draw the random bend from the equilibrium of the joint for the frame as it is, less its mean. Without noise from
     * nodes the mean of bends is not quite that at rest, because of their measure: as that noise has its share of it
     * where theta is less than one, what remains is a force.
     */
    static void draw(const State& step, const NoisePlaces<W>& places, int s);
    /** What the force of a joint has of its bend at rest, which has been turned with the joint, in place of a bend. */
    template <class Geometry> static CYLCHAIN_INLINE Vec inForce(const State& step, int s, const Geometry& geometry1,
            const Geometry& geometry2, const Vec& bisector, const Vec& bend) {
        const Vec sum = geometry1.middleTangent+geometry2.middleTangent;
        const Vec bent = geometry2.middleTangent-geometry1.middleTangent;
        const Real cosine = Scalar(0.5)*root(sum.dot(sum)), square = bent.dot(bent)+TINY;
        const Vec across = crossProduct(bisector, bent);
        const Vec moved = (geometry2.tangent-step.segments[s].tangent)-(geometry1.tangent-step.segments[s-1].tangent);
        // Half the tangent of a quarter of the angle, over the sine of half of it.
        const Real turn = step.segments[s].jointImplicit*across.dot(moved)/(4+4*cosine);
        return bend+crossProduct(bisector, bend)*turn-across*(across.dot(bend)*(1-cosine)/square);
    }
    /**
     * Turn segments about themselves, when nodes have moved by y.
     *
     * @param changes  of twists: what nodes have changed, to which turns add
     */
    static void turnFrames(const State& step, const Vec* y, Real* changes);
    /** By how much the energy of bends is that of bends at rest, for nodes and twists. */
    static double findEnergy(const Pack& pack, const Vec* nodes, const Real* twists);
private:
    /**
     * Draw a bend of a lane from its equilibrium.
     *
     * @param k     the stiffness over k_B T
     * @param bend  two normal numbers, which become the bend
     */
    static void drawBend(const State& step, int s, int i, double k, const double* rest, double acceptance,
            double* bend);
    /** The energy of a joint between tangents over that of b-R k for R k = 0, as a function of how it is turned. */
    static CYLCHAIN_INLINE void findTurnedEnergy(const Pack& pack, int s, const Vec& before, const Vec& tangent,
            const Vec& bisector, const Vec& rest, Real& cosine, Real& sine) {
        const Vec bent = tangent-before;
        const Vec bend = bent*(bendFactor(pack.bending, bent).f*property<Real>(pack, s, Pack::Joint));
        cosine = bend.dot(rest);
        sine = bend.dot(crossProduct(bisector, rest));
    }
    /** The bend at rest of a joint, half-way over which the material has an axis. */
    static CYLCHAIN_INLINE Vec inSpace(const Pack& pack, int s, const Vec& bisector, const Vec& axis) {
        return axis*loaded<Real>(pack.twist.bends, 2*s)+
                crossProduct(bisector, axis)*loaded<Real>(pack.twist.bends, 2*s+1);
    }
};

template <int W> void RestBends<W>::draw(const State& step, const NoisePlaces<W>& places, int s) {
    const Pack& pack = step.pack;
    ImplicitSegment<Real>& segment = step.segments[s];
    Real stiffness = property<Real>(pack, s, Pack::Joint)/step.kT, theta = segment.jointTheta;
    Real rest[2] = {loaded<Real>(pack.twist.bends, 2*s), loaded<Real>(pack.twist.bends, 2*s+1)};
    Real normals[2], acceptance;
    drawCandidates<W>(noiseKey(step.settings), NoiseKind::Bend, places, normals, acceptance);
    for (int i = 0; i < W; i++) {
        const double k = lane(stiffness, i), noise = 2*lane(theta, i)-1;
        double own[2] = {lane(rest[0], i), lane(rest[1], i)}, bend[2] = {lane(normals[0], i), lane(normals[1], i)};
        double lacking = 0;
        if (k > 0 && noise > 0) {
            drawBend(step, s, i, k, own, lane(acceptance, i), bend);
            // The mean, with the logarithm of the measure as a parabola.
            const double slope = slopeOfBendMeasure(pack.bending, own[0]*own[0]+own[1]*own[1]);
            lacking = slope/(k+slope)*(1-std::sqrt(noise));
        }
        for (int c = 0; c < 2; c++)
            lane(normals[c], i) = k > 0 && noise > 0 ? bend[c]-own[c]*(1-lacking) : 0;
    }
    const Vec axis = step.restBends[s].axis;
    segment.randomBend = axis*normals[0]+crossProduct(segment.bisector, axis)*normals[1];
}

template <int W> void RestBends<W>::drawBend(const State& step, int s, int i, double k, const double* rest,
            double acceptance, double* bend) {
    const Pack& pack = step.pack;
    const NoiseKey key = noiseKey(step.settings);
    const std::uint32_t chain = pack.chain[i], place = pack.firstNode[i]+s;
    if (k > STIFF_JOINT) {
        // A Gaussian with rejection.
        for (std::uint32_t draw = 1;; draw++) {
            for (int c = 0; c < 2; c++)
                bend[c] = rest[c]+bend[c]/std::sqrt(k);
            if (acceptance <= bendMeasure(pack.bending, bend[0]*bend[0]+bend[1]*bend[1]))
                return;
            drawCandidate(key, NoiseKind::Bend, chain, place, draw, bend, acceptance);
        }
    }
    // Directions from the sphere.
    double uniforms[4], excess;
    std::uint32_t draw = 1;
    do {
        drawUniforms(key, NoiseKind::Bend, chain, place, draw++, uniforms);
        drawUniforms(key, NoiseKind::Bend, chain, place, draw++, uniforms+2);
        const double size = std::sqrt(bendSquare(pack.bending, 2*uniforms[0]-1)), angle = 2*M_PI*uniforms[1];
        bend[0] = size*std::cos(angle);
        bend[1] = size*std::sin(angle);
        excess = (bend[0]-rest[0])*(bend[0]-rest[0])+(bend[1]-rest[1])*(bend[1]-rest[1]);
    } while (uniforms[2] > std::exp(-0.5*k*excess));
}

template <int W> void RestBends<W>::turnFrames(const State& step, const Vec* y, Real* changes) {
    const Pack& pack = step.pack;
    const PackTwist<Scalar>& twist = pack.twist;
    static thread_local Scratch memory;
    static thread_local std::vector<FrameTurns> lanes;
    Real* const twists = memory.reserve<Real>(pack.segments+1);
    lanes.resize(std::max<std::size_t>(lanes.size(), W));
    for (int s = 0; s <= pack.segments; s++)
        twists[s] = step.start.twists[s]+changes[s];
    for (int i = 0; i < W; i++) {
        if (pack.chain[i] < 0)
            continue;
        lanes[i].begin(pack.segmentsOfLane[i], pack.closed, step.kT);
        for (int s = 0; s <= pack.segmentsOfLane[i]; s++) {
            const std::size_t at = (std::size_t) s*W+i;
            FrameTurns::Joint& joint = lanes[i].joint(s);
            joint.stiffness = twist.stiffness[at];
            joint.torque = twist.stiffness[at]*lane(twists[s], i);
            if (s < pack.segmentsOfLane[i])
                lanes[i].setFriction(s, twist.friction[at]/step.h);
        }
        if (!pack.closed) {
            lanes[i].joint(0).torque += twist.torque[i];
            lanes[i].joint(pack.segmentsOfLane[i]).torque += twist.torque[W+i];
        }
    }
    carryFrames<W>(pack, [&] (int s) {
        const Vec difference = step.segments[s].difference+(y[s+1]-y[s]);
        return difference*(1/root(difference.dot(difference)));
    }, twists, [&] (int s, const Vec& before, const Vec& tangent, const Vec& bisector, const Vec& axis) {
        Real along, across;
        findTurnedEnergy(pack, s, before, tangent, bisector, inSpace(pack, s, bisector, axis), along, across);
        for (int i = 0; i < W; i++)
            if (pack.chain[i] >= 0 && s < pack.segmentsOfLane[i]+(pack.closed ? 1 : 0)) {
                lanes[i].joint(s).cosine = lane(along, i);
                lanes[i].joint(s).sine = lane(across, i);
            }
    });
    for (int i = 0; i < W; i++) {
        if (pack.chain[i] < 0)
            continue;
        lanes[i].take(noiseKey(step.settings), pack.chain[i]);
        for (int s = 0; s <= pack.segmentsOfLane[i]; s++)
            lane(changes[s], i) += lanes[i].changeOf(s);
    }
}

template <int W> double RestBends<W>::findEnergy(const Pack& pack, const Vec* nodes, const Real* twists) {
    double result = 0;
    carryFrames<W>(pack, [&] (int s) {
        const Vec difference = nodes[s+1]-nodes[s];
        return difference*(1/root(difference.dot(difference)));
    }, twists, [&] (int s, const Vec& before, const Vec& tangent, const Vec& bisector, const Vec& axis) {
        Real along, across;
        const Vec rest = inSpace(pack, s, bisector, axis);
        findTurnedEnergy(pack, s, before, tangent, bisector, rest, along, across);
        Real energy = Scalar(0.5)*property<Real>(pack, s, Pack::Joint)*rest.dot(rest)-along;
        for (int i = 0; i < W; i++)
            if (pack.chain[i] >= 0 && s < pack.segmentsOfLane[i]+(pack.closed ? 1 : 0))
                result += lane(energy, i);
    });
    return result;
}
