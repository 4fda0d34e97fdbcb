// Included into the namespace of an instruction set. It does not compile alone.

/**
 * The random forces of a step, which belong to the friction of the curve, and the random strains and bends.
 */

/** How much wider differences are drawn in a plane, as a part of their stiffness over k_B T. */
const Scalar PLANAR_WIDTH = 0.13;

template <int W> class BeamNoise {
    typedef typename Lanes<W>::Type Real;
    typedef Vector<Real> Vec;
    typedef SixVector<Real> Six;
public:
    /**
     * @param elements    receives the random strains and bends
     * @param forces      the random forces are added to these
     * @param drawnBends  more than zero where bends have a random part
     */
    BeamNoise(const BeamPack& pack, const StepSettings& settings, const BeamStart<W>& start,
            BeamElementState<Real>* elements, Six* forces, Real drawnBends) : pack(pack), settings(settings),
            start(start), n(pack.nodes), elements(elements), forces(forces), drawnBends(drawnBends) {
    }
    void draw(int e) {
        const NoiseKey key = {(std::uint32_t) settings.seed, (std::uint32_t) settings.level, settings.step};
        NoisePlaces<W> places;
        for (int i = 0; i < W; i++) {
            reinterpret_cast<Word*>(&places.chain)[i] = pack.noiseChain[i];
            reinterpret_cast<Word*>(&places.part)[i] = e;
        }
        Real ofForces[8], others[6];
        drawNormals<W, 3>(key, NoiseKind::Node, places, others);
        BeamElementState<Real>& own = elements[e];
        own.ofNode.random = others[0]*deviation(own.ofNode.stiffness);
        if (e == n-1)
            return;
        drawNormals<W, 4>(key, NoiseKind::Segment, places, ofForces);
        own.ofMiddle.random = others[1]*deviation(own.ofMiddle.stiffness);
        drawBends(key, places, e);
        const Real normals[] = {ofForces[0], ofForces[1], ofForces[2], ofForces[3], ofForces[4], ofForces[5],
                ofForces[6], ofForces[7], others[2], others[3], others[4], others[5]};
        const Real amplitude = root(splat<Real>(2*settings.kT/settings.stepSize)*of(BeamPack::Length)*present(e));
        const Real across = root(of(BeamPack::Perpendicular))*amplitude, along = root(of(BeamPack::Parallel))*amplitude;
        for (int g = 0; g < GAUSS_POINTS; g++) {
            const Vec t = directionAt(g, start.control[e], start.chord[e], start.control[e+1]);
            const Vec noise = {normals[3*g], normals[3*g+1], pack.planar ? Real{} : normals[3*g+2]};
            const Vec force = noise*across+t*((along-across)*t.dot(noise));
            addAt(g, force*splat<Real>(std::sqrt(GAUSS_WEIGHTS[g])), forces[e], forces[e+1]);
        }
    }
private:
    const BeamPack& pack;
    const StepSettings& settings;
    const BeamStart<W>& start;
    const int n;
    BeamElementState<Real>* const elements;
    Six* const forces;
    Real drawnBends;

    Real of(int property) const {
        return loaded<Real>(pack.properties, property);
    }
    Real present(int e) const {
        return loaded<Real>(pack.present, e);
    }
    /** Draw the two bends of an element from equilibrium, by rejection from normal numbers. */
    void drawBends(const NoiseKey& key, const NoisePlaces<W>& places, int e) {
        BeamElementState<Real>& own = elements[e];
        Real uniform, normals[6];
        drawCandidates<W>(key, NoiseKind::Bend, places, normals, uniform);
        normals[2] = normals[3] = Real{};
        if (!pack.planar)
            drawNormals<W, 2>(key, NoiseKind::Length, places, normals+2);
        const Real bending = of(BeamPack::Bending)*present(e)/of(BeamPack::Length);
        Real sum = deviation(bending), difference = deviation(bending*Scalar(4.0/3));
        if (pack.planar)
            difference = difference/root(larger<Real>(1-difference*difference*PLANAR_WIDTH, splat<Real>(0.1)));
        for (int i = 0; i < W; i++) {
            // Bends that follow a path of midpoints have no random part.
            if (lane(drawnBends, i) == 0)
                continue;
            double drawn[4], least = lane(uniform, i);
            for (int k = 0; k < 4; k++)
                drawn[k] = lane(normals[k], i);
            for (std::uint32_t draw = 1; least > measure(drawn, lane(sum, i), lane(difference, i)); draw++) {
                double unused;
                drawCandidate(key, NoiseKind::Bend, pack.noiseChain[i], e, draw, drawn, least);
                if (!pack.planar)
                    drawCandidate(key, NoiseKind::Length, pack.noiseChain[i], e, draw, drawn+2, unused);
            }
            for (int k = 0; k < 4; k++)
                lane(normals[k], i) = drawn[k];
        }
        if (pack.planar) {
            own.randomSum = {Real{}, Real{}, normals[0]*sum};
            own.randomDifference = {Real{}, Real{}, normals[1]*difference};
        }
        else {
            Vec a, b;
            orthogonal(own.middle, a, b);
            own.randomSum = (a*normals[0]+b*normals[1])*sum;
            own.randomDifference = (a*normals[2]+b*normals[3])*difference;
        }
    }
    /**
     * The measure of positions over that of the two bends of an element without strain, and over how far the candidates
     * for the difference are drawn too wide: at most one, but 1.01 where an element in a plane bends by 1.5 radians. It
     * is that of the length in the middle, which belongs to a strain, and of directions: in space, the sines of the
     * two angles over these.
     */
    double measure(const double* normals, double ofSum, double ofDifference) const {
        const int components = pack.planar ? 1 : 2;
        double square = 0, both = 0, other = 0, wide = 0;
        for (int k = 0; k < components; k++) {
            const double s = normals[k]*ofSum, d = normals[components+k]*ofDifference;
            square += s*s;
            both += s*d;
            other += d*d;
            wide += normals[components+k]*normals[components+k];
        }
        const double half = std::sin(0.5*std::sqrt(square)), turnSquare = 4*half*half;
        const double least = 1+turnSquare*(SCALE_OF_TURN+turnSquare*SCALE_OF_SQUARE);
        const double scale = scaleOf(std::sqrt(other), least);
        both /= scale;
        other /= scale*scale;
        // How a difference grows with the one that is not scaled, along and across it.
        const double along = scale+2*SCALE_OF_DIFFERENCE*other;
        const double angles[] = {std::sqrt(std::max(0.0, 0.25*(square+other)-0.5*both)),
                std::sqrt(0.25*(square+other)+0.5*both)};
        if (std::max(angles[0], angles[1]) > M_PI)
            return 0;
        // The length x of the middle vector solves x-1-|t1+t2-2u|^2/40+|t2-t1|^4/480 = 0.
        const double slope = 1+0.1*(std::cos(angles[0])+std::cos(angles[1]));
        const double derivative = std::sqrt(slope*slope-0.4*(1+(4-turnSquare)/40-turnSquare*turnSquare/480));
        const double length = 5*(slope-derivative);
        if (pack.planar)
            return length/(derivative*along)*std::exp(-0.5*PLANAR_WIDTH*ofDifference*ofDifference*wide);
        double result = length*length/(derivative*along*scale);
        for (double angle : angles)
            result *= angle < 1e-4 ? 1 : std::sin(angle)/angle;
        return result;
    }
    /** The scale of a difference of bends d: x in x = least+c (d/x)^2, by Newton's method. */
    static double scaleOf(double difference, double least) {
        double scale = least;
        for (int i = 0; i < 8; i++) {
            const double one = difference/scale, wrong = (least+SCALE_OF_DIFFERENCE*one*one-scale)*scale;
            scale += wrong/(scale+2*SCALE_OF_DIFFERENCE*one*one);
        }
        return scale;
    }
    /** Of a coordinate in equilibrium; none if it has no stiffness. */
    Real deviation(Real stiffness) const {
        const Real some = stiffness > 0 ? splat<Real>(1) : Real{};
        return some*root(splat<Real>(settings.kT)/(stiffness+(1-some)));
    }
};
