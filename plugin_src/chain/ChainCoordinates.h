/**
 * Lengths and bends as coordinates q with the energy (stiffness/2) q^2, and the distributions of bends in equilibrium.
 * ChainLoops.h includes this file into the namespace of an instruction set.
 */

/** A bend b = f (t2-t1), with the energy (stiffness/2) b^2, and df/dc, for the cosine c. */
template <class Real> struct BendFactor {
    Real f, slope;
};

template <class Real> CYLCHAIN_INLINE BendFactor<Real> bendFactor(BendingModel model, const Vector<Real>& difference) {
    const Real square = difference.dot(difference);
    if (model == BendingModel::KratkyPorod)
        return {1+Real{}, Real{}};
    if (model == BendingModel::InscribedCircle) {
        const Real sum = 4-square+1e-12;
        const Real f = 2/root(sum);
        return {f, -f/sum};
    }
    BendFactor<Real> result;
    for (int i = 0; i < (int) (sizeof(Real)/sizeof(double)); i++) {
        Real copy = square;
        const double chord = std::fmin(std::sqrt(lane(copy, i)), 2.0), half = std::asin(0.5*chord);
        const bool small = chord < 1e-3;
        lane(result.f, i) = small ? 1+chord*chord/24 : 2*half/chord;
        lane(result.slope, i) = small ? -1.0/12 : -(1/chord-half*std::cos(half)*2/(chord*chord))/std::sin(2*half);
    }
    return result;
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

/** The length of a segment as a coordinate with the energy (stiffness/2) q^2. */
template <class Real> CYLCHAIN_INLINE void stretchCoordinate(StretchingModel model, Real inverse, Real e, Real& q, Real& slope) {
    q = e;
    slope = 1+Real{};
    if (model == StretchingModel::FENE)
        for (int i = 0; i < (int) (sizeof(Real)/sizeof(double)); i++)
            feneCoordinate(lane(inverse, i), lane(e, i), lane(q, i), lane(slope, i));
}
