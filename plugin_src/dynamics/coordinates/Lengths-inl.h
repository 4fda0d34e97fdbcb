// Included into the namespace of an instruction set. It does not compile alone.

/**
 * The largest error of a length that an iteration leaves, over its thermal fluctuation against what resists in a step.
 */
const Scalar LENGTH_TOLERANCE = 0.07;
/** The part of the friction against turning that compression may take away in the iteration's matrix. */
const Scalar COMPRESSION = 0.9;
/** More than any tension over a length. */
const Scalar UNBOUNDED = 1e30;

/**
 * The lengths of segments, with the stretching models. Their multipliers, which are tensions, are unknowns of the
 * equations: see TensionBand-inl.h. The friction against a change of a length is a part of its tension.
 */
template <int W> struct Lengths : OnSegments {
    typedef typename Lanes<W>::Type Real;
    typedef Vector<Real> Vec;
    typedef Matrix<Real> Mat;
    typedef ImplicitState<W> State;
    static CYLCHAIN_INLINE bool isIn(const Pack&) {
        return true;
    }
    static CYLCHAIN_INLINE void describe(const State& step, int s) {
        const Pack& pack = step.pack;
        ImplicitSegment<Real>& segment = step.segments[s];
        const Real l0 = property<Real>(pack, s, Pack::RestLength);
        Real slope;
        stretchCoordinate<Real>(pack.stretching, property<Real>(pack, s, Pack::InverseExtension), segment.length-l0,
                segment.coordinate, slope);
        const Real stretchRate = step.h*property<Real>(pack, s, Pack::Stiffness)*l0*l0+TINY;
        const Real friction =
                property<Real>(pack, s, Pack::Extensional)+loaded<Real>(pack.nodeFriction, 0)*(0.25*l0*l0);
        segment.theta = larger<Real>(splat<Real>(0.5), 1-friction/stretchRate);
        segment.randomCoordinate = segment.randomTension = segment.multiplier = Real{};
    }
    static void draw(const State& step, const NoisePlaces<W>& places, const PlaceNormals<Real>& normals, int s) {
        const Pack& pack = step.pack;
        ImplicitSegment<Real>& segment = step.segments[s];
        const Real stiffness = property<Real>(pack, s, Pack::Stiffness);
        Real normal = pack.hasSegmentFriction ? normals.ofSegment[6] : normals.ofNode[3];
        switch (pack.stretching) {
            case StretchingModel::Harmonic:
                segment.randomCoordinate = normal*root(step.kT/(stiffness+TINY));
                break;
            case StretchingModel::FENE: {
                // Segments that fill up a lane have neither stiffness nor a maximum extension.
                const Real inverse = property<Real>(pack, s, Pack::InverseExtension);
                drawFeneCoordinates<W>(noiseKey(step.settings), places, stiffness/(inverse*inverse*step.kT+TINY),
                        normal);
                segment.randomCoordinate = normal/(inverse+TINY);
                break;
            }
        }
    }
    static CYLCHAIN_INLINE void prepare(const State& step, const Vec*, int s) {
        ImplicitSegment<Real>& segment = step.segments[s];
        if (step.stage == Stage::First) {
            segment.implicit = splat<Real>(DIAGONAL);
            segment.constantCoordinate = segment.randomCoordinate*(-DIAGONAL*NOISE_OF_FIRST);
            segment.constantTension = segment.randomTension*-NOISE_OF_FIRST;
            return;
        }
        // Of the two stages, the second one is that of scheme "implicit" but for bends and tethers.
        segment.implicit = segment.theta;
        segment.constantCoordinate =
                (1-segment.theta)*segment.coordinate-segment.randomCoordinate*root(2*segment.theta-1);
        segment.constantTension = -segment.randomTension;
        if (step.stage == Stage::Second)
            segment.multiplier = segment.multiplier*(1/NOISE_OF_FIRST);
    }
    /**
     * Add a length to the equations of its nodes.
     *
     * @param compressed   whether all compression is in the matrix
     * @param band         takes the equation of the tension
     * @param after        the second node; the block of the first node gets what that of the second one gets
     */
    template <class Band, class Row> static CYLCHAIN_INLINE void add(const State& step, int s,
                const NewSegmentGeometry<Real>& geometry, const FrictionOfEnd<Real>& friction, bool compressed,
                Band& band, Row& here, Row& after) {
        const Pack& pack = step.pack;
        ImplicitSegment<Real>& segment = step.segments[s];
        const Real length = geometry.length;
        const Vec t = geometry.tangent;
        const Scalar perStep = 1/step.h;
        const Real drag = property<Real>(pack, s, Pack::Extensional)*segment.inverse*perStep;
        if (hasRange(pack.stretching))
            findLimitedTension(step, s, length, drag);
        else {
            const Real stiffness = property<Real>(pack, s, Pack::Stiffness);
            const Real extension = length-property<Real>(pack, s, Pack::RestLength);
            segment.tension = stiffness*(segment.implicit*extension+segment.constantCoordinate)+
                    drag*(length-segment.length)*geometry.inverse+segment.constantTension;
            segment.response = stiffness*segment.implicit+drag*segment.length*geometry.inverse*geometry.inverse;
        }
        if (step.settings.flow.present)
            segment.tension = segment.tension-segment.tensionOfFlow;
        segment.newTangent = t;

        // The tension acts along the mean direction. The matrix has the new one, with which it is symmetric, and what
        // they differ by goes with the last iteration's tension.
        segment.turned = geometry.middleTangent-t;
        segment.multiplierBefore = segment.multiplier;
        const Vec lacking = segment.turned*segment.multiplier;
        // Without part of the response, nothing in the nodes' own matrix would keep those of a straight chain from
        // moving apart and together in turn.
        segment.shift = lesser<Real>(0.5*segment.response, friction.along*perStep);
        band.setTension(s, t, 1/(segment.response-segment.shift+TINY), segment.tension);

        const Real least = compressed ? splat<Real>(-UNBOUNDED) : friction.turning*(-COMPRESSION*perStep);
        const Real turning = 0.5*larger<Real>(segment.multiplier*geometry.inverse, least);
        after.diagonal.addAxial(turning, segment.shift-turning, t);
        here.upper = here.upper-Mat::axial(turning, segment.shift-turning, t);
        here.right = here.right+lacking;
        after.right = after.right-lacking;
    }
    static CYLCHAIN_INLINE void measure(const State& step, int s, Real square, Real perEnergy, Real& excess) {
        if (!(step.settings.kT > 0))
            return;
        // An iteration takes a length to first order in the change, so that an error of square/(2 l0) is left where
        // lengths are not reset.
        const Real error =
                square*property<Real>(step.pack, s, Pack::InverseRestLength)*(Scalar(0.5)/LENGTH_TOLERANCE);
        excess = larger(excess, error*error*step.segments[s].response*perEnergy);
    }
    /** A length has left its range. */
    static CYLCHAIN_INLINE void findExcessiveChange(const State& step, const Vec* y, int s, bool* failed) {
        const Pack& pack = step.pack;
        if (!hasRange(pack.stretching))
            return;
        const Vec after = step.segments[s].difference+(y[s+1]-y[s]);
        Real relative = (root(after.dot(after))-property<Real>(pack, s, Pack::RestLength))*
                property<Real>(pack, s, Pack::InverseExtension);
        for (int i = 0; i < W; i++)
            failed[i] |= s < pack.segmentsOfLane[i] && !(std::fabs(lane(relative, i)) < 1);
    }
    /** The length that the linear equations mean for a segment with another vector. */
    static CYLCHAIN_INLINE Real meantLength(const State& step, int s, const Vec& difference) {
        const ImplicitSegment<Real>& segment = step.segments[s];
        const Real length = larger<Real>(segment.newTangent.dot(difference), 0.5*segment.length);
        return hasRange(step.pack.stretching) ? withinRange(step.pack, s, length) : length;
    }
    static CYLCHAIN_INLINE void addForces(const Pack& pack, int s, const SegmentGeometry<Real>& geometry, Vec* f,
            ChainEnergy* energy) {
        const Real stiffness = property<Real>(pack, s, Pack::Stiffness);
        const Real inverse = property<Real>(pack, s, Pack::InverseExtension);
        const Real extension = geometry.length-property<Real>(pack, s, Pack::RestLength);
        const Vec pull = geometry.tangent*stretchingTension(pack.stretching, stiffness, extension, inverse);
        f[s] = f[s]+pull;
        f[s+1] = f[s+1]-pull;
        for (int i = 0; i < W && energy != NULL; i++) {
            Real k = stiffness, e = extension, d = inverse;
            if (s < pack.segmentsOfLane[i])
                energy->stretching += stretchingEnergy(pack.stretching, lane(k, i), lane(e, i), lane(d, i));
        }
    }
private:
    /**
     * The tension of a segment whose length has a range, and its response. Where the last iteration has given a
     * tension, they are those at the length that belongs to it, which is never beyond the range, extended to the length
     * that the segment has.
     */
    static void findLimitedTension(const State& step, int s, Real length, Real drag) {
        const Pack& pack = step.pack;
        ImplicitSegment<Real>& segment = step.segments[s];
        Real stiffness = property<Real>(pack, s, Pack::Stiffness), rest = property<Real>(pack, s, Pack::RestLength);
        Real inverse = property<Real>(pack, s, Pack::InverseExtension);
        Real flow = step.settings.flow.present ? segment.tensionOfFlow : Real{};
        for (int i = 0; i < W; i++) {
            const FeneTension law = {lane(stiffness, i), lane(inverse, i), lane(rest, i), lane(segment.length, i),
                    lane(segment.implicit, i), lane(segment.constantCoordinate, i), lane(drag, i),
                    lane(segment.constantTension, i)};
            const double given = lane(segment.multiplier, i)+lane(flow, i);
            double response, own = lane(length, i), tension;
            if (s < pack.segmentsOfLane[i] && lane(segment.multiplier, i) != 0)
                own = law.lengthFor(given, own, response);
            law.evaluate(own, tension, response);
            lane(segment.tension, i) = tension+response*(lane(length, i)-own);
            lane(segment.response, i) = response;
        }
    }
    /** A length within the range of its segment. */
    static CYLCHAIN_INLINE Real withinRange(const Pack& pack, int s, Real length) {
        const Real rest = property<Real>(pack, s, Pack::RestLength);
        const Real range = Scalar(1-1e-9)/(property<Real>(pack, s, Pack::InverseExtension)+TINY);
        return larger<Real>(lesser<Real>(length, rest+range), rest-range);
    }
};
