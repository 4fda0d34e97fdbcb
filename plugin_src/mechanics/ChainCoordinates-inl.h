// Included into the namespace of an instruction set. It does not compile alone.

/**
 * Lengths and bends as coordinates q with the energy (stiffness/2) q^2, and the distributions of bends in equilibrium.
 */

/** A bend b = f (t2-t1), with the energy (stiffness/2) b^2, and df/dc, for the cosine c. */
template <class Real> struct BendFactor {
    Real f, slope;
};

template <class Real> CYLCHAIN_INLINE BendFactor<Real> bendFactor(BendingModel model, const Vector<Real>& difference) {
    const Real square = difference.dot(difference);
    if (model == BendingModel::KratkyPorod)
        return {splat<Real>(1), Real{}};
    if (model == BendingModel::InscribedCircle) {
        const Real sum = larger<Real>(4-square, splat<Real>(LEAST));
        const Real f = 2/root(sum);
        return {f, f*f*f*Scalar(-0.25)};
    }
    BendFactor<Real> result;
    for (int i = 0; i < LANE_COUNT<Real>; i++) {
        Real copy = square;
        const double chord = std::fmin(std::sqrt(lane(copy, i)), 2.0), half = std::asin(0.5*chord);
        const bool small = chord < 1e-3;
        lane(result.f, i) = small ? 1+chord*chord/24 : 2*half/chord;
        lane(result.slope, i) = small ? -1.0/12 : -(1/chord-half*std::cos(half)*2/(chord*chord))/std::sin(2*half);
    }
    return result;
}

/**
 * The factors of two bends, together with the inverses of two other numbers: with one division for all, which take
 * longer than the rest.
 */
template <class Real> CYLCHAIN_INLINE void bendFactors(BendingModel model, const Vector<Real>& difference1,
            const Vector<Real>& difference2, BendFactor<Real>& factor1, BendFactor<Real>& factor2, Real number1,
            Real number2, Real& inverse1, Real& inverse2) {
    const Real numbers = number1*number2;
    if (model == BendingModel::InscribedCircle) {
        const Real root1 = root(larger<Real>(4-difference1.dot(difference1), splat<Real>(LEAST)));
        const Real root2 = root(larger<Real>(4-difference2.dot(difference2), splat<Real>(LEAST)));
        const Real roots = root1*root2, all = 1/(roots*numbers);
        const Real perRoots = all*numbers, perNumbers = all*roots;
        const Real f1 = 2*perRoots*root2, f2 = 2*perRoots*root1;
        factor1 = {f1, f1*f1*f1*Scalar(-0.25)};
        factor2 = {f2, f2*f2*f2*Scalar(-0.25)};
        inverse1 = perNumbers*number2;
        inverse2 = perNumbers*number1;
        return;
    }
    factor1 = bendFactor<Real>(model, difference1);
    factor2 = bendFactor<Real>(model, difference2);
    const Real both = 1/numbers;
    inverse1 = both*number2;
    inverse2 = both*number1;
}

/** The square of a bend for the cosine c. */
inline double bendSquare(BendingModel model, double c) {
    if (model == BendingModel::InscribedCircle)
        return 4*(1-c)/(1+c);
    if (model == BendingModel::KratkyPorod)
        return 2*(1-c);
    return std::acos(c)*std::acos(c);
}

/** The bend of a joint in a plane, for the angle between its segments. */
inline double bendOfAngle(BendingModel model, double angle) {
    if (model == BendingModel::InscribedCircle)
        return 2*std::tan(0.5*angle);
    if (model == BendingModel::KratkyPorod)
        return 2*std::sin(0.5*angle);
    return angle;
}

/** The density of a bend with the given square in the plane of b over that of a Gaussian. */
inline double bendMeasure(BendingModel model, double square) {
    if (model == BendingModel::InscribedCircle)
        return 1/((1+0.25*square)*(1+0.25*square));
    if (model == BendingModel::KratkyPorod)
        return square < 4 ? 1 : 0;
    const double angle = std::sqrt(square);
    return angle < M_PI ? (angle > 1e-8 ? std::sin(angle)/angle : 1) : 0;
}

/** Extend a coordinate q with the energy (stiffness/2) q^2 to FENE: its value and slope for an extension e. */
inline void feneCoordinate(double inverse, double e, double& q, double& slope) {
    const double limit = 1-1e-9, relative = std::fmax(-limit, std::fmin(limit, e*inverse));
    const double square = relative*relative;
    const double root = square > 1e-8 ? std::sqrt(-std::log1p(-square)) : std::fabs(relative)*(1+0.25*square);
    slope = square > 1e-8 ? std::fabs(relative)/((1-square)*root) : 1+0.75*square;
    q = std::copysign(root, relative)/inverse+slope*(e-relative/inverse);
}

/**
 * The tension of a FENE segment in a step, as a function of its new length: it grows from minus to plus infinity
 * between the shortest and the longest length, so that for every tension there is a length in between.
 */
struct FeneTension {
    /** 1/D, the rest length, and the length at the start of the step. */
    double stiffness, inverse, rest, before;
    /**
     * The tension is the slope at the mean length times (stiffness (theta q+constant)), and (drag/l) (l-before), and
     * less noise.
     */
    double theta, constant, drag, noise;
    /** The tension for a length, and its derivative but for that of the slope. */
    void evaluate(double length, double& tension, double& response) const {
        double q, slope, unused, meanSlope;
        feneCoordinate(inverse, length-rest, q, slope);
        feneCoordinate(inverse, 0.5*(before+length)-rest, unused, meanSlope);
        tension = stiffness*meanSlope*(theta*q+constant)+drag*(1-before/length)-noise;
        response = stiffness*meanSlope*theta*slope+drag*before/(length*length);
    }
    /** The length for a tension, beginning at a length, and the response there. */
    double lengthFor(double tension, double length, double& response) const {
        const double range = (1-1e-9)/inverse;
        double low = std::fmax(rest-range, 1e-9*rest), high = rest+range, excess, last = HUGE_VAL;
        length = std::fmax(low, std::fmin(high, length));
        for (int i = 0; i < 100; i++) {
            evaluate(length, excess, response);
            excess -= tension;
            (excess > 0 ? high : low) = length;
            const double next = length-excess/response;
            const bool halve = !(next > low && next < high) || std::fabs(excess) > 0.5*last;
            last = std::fabs(excess);
            const double change = (halve ? 0.5*(low+high) : next)-length;
            length += change;
            if (std::fabs(change) < 1e-12*rest)
                break;
        }
        evaluate(length, excess, response);
        return length;
    }
};

/** The length of a segment as a coordinate with the energy (stiffness/2) q^2. */
template <class Real> CYLCHAIN_INLINE void stretchCoordinate(StretchingModel model, Real inverse, Real e, Real& q,
        Real& slope) {
    q = e;
    slope = splat<Real>(1);
    if (model == StretchingModel::FENE)
        for (int i = 0; i < LANE_COUNT<Real>; i++) {
            double coordinate, derivative;
            feneCoordinate(lane(inverse, i), lane(e, i), coordinate, derivative);
            lane(q, i) = coordinate;
            lane(slope, i) = derivative;
        }
}
