/**
 * The random forces, lengths and bends of a step of the implicit scheme. ImplicitLoops.h includes this file.
 */

template <int W, bool CLOSED>
void ImplicitStep<W, CLOSED>::addNoise() {
    GaussianLanes<W> gaussian(pack, settings);
    const double amplitude = std::sqrt(2*settings.kT/h);
    for (int s = 0; s < n-1; s++) {
        if (!CLOSED || s < pack.segments) {
            drawForces(gaussian, s, amplitude);
            drawLength(gaussian, s);
        }
        if (s > 0) {
            if (pack.planar)
                drawPlanarBend(gaussian, s);
            else
                drawBend(gaussian, s);
        }
    }
    for (std::size_t i = 0; i < pack.tethers.size(); i++) {
        const double deviation = std::sqrt(settings.kT/(pack.tethers[i].stiffness+TINY)*(2*tethers[i].theta-1));
        for (double& random : tethers[i].random)
            random = deviation*gaussian.nextOfLane(pack.tethers[i].lane);
        if (pack.planar)
            tethers[i].random[2] = 0;
    }
}

template <int W, bool CLOSED>
CYLCHAIN_INLINE void ImplicitStep<W, CLOSED>::drawForces(GaussianLanes<W>& gaussian, int s, double amplitude) {
    ImplicitSegment<Real>& segment = segments[s];
    const Vec t = segment.tangent;
    const Vec a = gaussianVector<W>(gaussian, pack.planar), b = gaussianVector<W>(gaussian, pack.planar);
    const Real across = property<Real>(pack, s, ChainPack::RootPerpendicular);
    const Real along = property<Real>(pack, s, ChainPack::RootParallel);
    const Vec force = (a*across+t*((along-across)*t.dot(a)))*(0.5*amplitude+Real{});
    const Real perLength = amplitude/segment.length;
    const Vec pair = (b-t*t.dot(b))*(property<Real>(pack, s, ChainPack::RootRotational)*perLength);
    f[s] = f[s]+force-pair;
    f[s+1] = f[s+1]+force+pair;
    segment.randomPair = pair;
    segment.randomTension = t.dot(b)*(property<Real>(pack, s, ChainPack::RootExtensional)*perLength);
}

template <int W, bool CLOSED>
void ImplicitStep<W, CLOSED>::drawLength(GaussianLanes<W>& gaussian, int s) {
    ImplicitSegment<Real>& segment = segments[s];
    const Real stiffness = property<Real>(pack, s, ChainPack::Stiffness);
    const Real deviation = root(settings.kT/(stiffness+TINY));
    Real random = gaussian.next();
    if (pack.stretching == StretchingModel::FENE) {
        // The density of lengths, seen as one of coordinates.
        Real inverse = property<Real>(pack, s, ChainPack::InverseExtension), scale = deviation;
        for (int i = 0; i < W; i++) {
            double square = lane(random, i)*lane(scale, i)*lane(inverse, i);
            square *= square;
            while (square > 1e-8 && s < pack.segmentsOfLane[i]) {
                const double relative = std::sqrt(-std::expm1(-square));
                if (gaussian.uniform(i) < std::exp(-square)*std::sqrt(square)/relative)
                    break;
                lane(random, i) = gaussian.nextOfLane(i);
                square = lane(random, i)*lane(scale, i)*lane(inverse, i);
                square *= square;
            }
        }
    }
    segment.randomCoordinate = random*deviation*root(2*segment.theta-1);
}

template <int W, bool CLOSED>
void ImplicitStep<W, CLOSED>::drawBend(GaussianLanes<W>& gaussian, int s) {
    ImplicitSegment<Real>& segment = segments[s];
    Real stiffness = loaded<Real>(pack.joints, s)/settings.kT, share = root(2*segment.jointTheta-1);
    Real first = gaussian.next(), second = gaussian.next();
    for (int i = 0; i < W; i++) {
        const double k = lane(stiffness, i);
        double a = lane(first, i), b = lane(second, i);
        if (k == 0 || lane(share, i) == 0)
            a = b = 0;
        else if (k > STIFF_JOINT) {
            while (gaussian.uniform(i) > bendMeasure(pack.bending, (a*a+b*b)/k)) {
                a = gaussian.nextOfLane(i);
                b = gaussian.nextOfLane(i);
            }
            a /= std::sqrt(k);
            b /= std::sqrt(k);
        }
        else {
            double square;
            do
                square = bendSquare(pack.bending, 2*gaussian.uniform(i)-1);
            while (gaussian.uniform(i) > std::exp(-0.5*k*square));
            const double scale = std::sqrt(square/(a*a+b*b));
            a *= scale;
            b *= scale;
        }
        lane(first, i) = a*lane(share, i);
        lane(second, i) = b*lane(share, i);
    }
    Vec e1, e2;
    orthogonal(segment.bisector, e1, e2);
    segment.randomBend = e1*first+e2*second;
}

template <int W, bool CLOSED>
void ImplicitStep<W, CLOSED>::drawPlanarBend(GaussianLanes<W>& gaussian, int s) {
    ImplicitSegment<Real>& segment = segments[s];
    Real stiffness = loaded<Real>(pack.joints, s)/settings.kT, share = root(2*segment.jointTheta-1), bend = Real{};
    // The energy is that of a Gaussian or more, in the angle.
    const double floor = pack.bending == BendingModel::KratkyPorod ? 4/(M_PI*M_PI) : 1;
    for (int i = 0; i < W; i++) {
        const double k = lane(stiffness, i);
        if (k == 0 || lane(share, i) == 0)
            continue;
        const bool stiff = k*floor > STIFF_JOINT;
        double angle, drawn, excess;
        do {
            angle = stiff ? gaussian.nextOfLane(i)/std::sqrt(k*floor) : M_PI*(2*gaussian.uniform(i)-1);
            drawn = bendOfAngle(pack.bending, angle);
            excess = drawn*drawn-(stiff ? floor*angle*angle : 0);
        } while (!(std::fabs(angle) < M_PI) || gaussian.uniform(i) > std::exp(-0.5*k*excess));
        lane(bend, i) = drawn*lane(share, i);
    }
    segment.randomBend = Vec {-segment.bisector.y, segment.bisector.x, Real{}}*bend;
}
