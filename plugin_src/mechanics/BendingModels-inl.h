// Included into the namespace of an instruction set. It does not compile alone.

/**
 * Bends of joints as coordinates b = f (t2-t1) with the energy (stiffness/2) b^2, and their distribution in
 * equilibrium.
 *
 * Each angular entry of CYLCHAIN_BENDING_MODELS has a struct of its name with its formulas. LinearBends-inl.h has those
 * of bends that are linear in the nodes.
 */

/** f of a bend b = f (t2-t1), and df/dc, for the cosine c. */
template <class Real> struct BendFactor {
    Real f, slope;
};

/** What a model has unless it has something better. */
struct BendingFormulas {
    /** Whether factors() finds what bendFactors() does, with fewer divisions. */
    static constexpr bool SHARES_DIVISIONS = false;
    template <class Real> static CYLCHAIN_INLINE void factors(const Vector<Real>&, const Vector<Real>&,
                BendFactor<Real>&, BendFactor<Real>&, Real, Real, Real, Real&, Real&) {
    }
    /**
     * One in each lane where a candidate for a bend, two normal numbers times the deviation, is accepted with the
     * probability measure(), and zero in others, which are looked at one by one.
     */
    template <class Real> static CYLCHAIN_INLINE Real accepted(const Real*, Real, Real) {
        return Real{};
    }
    static constexpr bool ACCEPTS_IN_LANES = false;
    /** The square of a bend over that of the angle is this or more. */
    static constexpr double LEAST_SQUARE = 1;
};

/** The energy b (1-c). */
struct KratkyPorod : BendingFormulas {
    /** The slope dV/dc of the energy of a joint with the cosine c and the sine s. */
    template <class Real> static CYLCHAIN_INLINE Real slope(Real stiffness, Real, Real) {
        return -stiffness;
    }
    static double energy(double stiffness, double c, double sineSquared) {
        return c > 0 ? stiffness*sineSquared/(1+c) : stiffness*(1-c);
    }
    /** The factor of the bend between tangents that differ by a vector with the given square. */
    template <class Real> static CYLCHAIN_INLINE BendFactor<Real> factor(Real) {
        return {splat<Real>(1), Real{}};
    }
    /** The square of a bend for the cosine c. */
    static double square(double c) {
        return 2*(1-c);
    }
    /** The bend of a joint in a plane, for the angle between its segments. */
    static double ofAngle(double angle) {
        return 2*std::sin(0.5*angle);
    }
    /** The density of a bend with the given square in the plane of b over that of a Gaussian. */
    static double measure(double square) {
        return square < 4 ? 1 : 0;
    }
    static constexpr double LEAST_SQUARE = 4/(M_PI*M_PI);
};

/** The energy (b/2) theta^2. */
struct Quadratic : BendingFormulas {
    template <class Real> static CYLCHAIN_INLINE Real slope(Real stiffness, Real c, Real sineSquared) {
        Real result;
        for (int i = 0; i < LANE_COUNT<Real>; i++) {
            const double sine = std::sqrt(lane(sineSquared, i)), angle = std::atan2(sine, lane(c, i));
            lane(result, i) = -lane(stiffness, i)*(sine > 1e-8 ? angle/sine : 1.0);
        }
        return result;
    }
    static double energy(double stiffness, double c, double sineSquared) {
        const double angle = std::atan2(std::sqrt(sineSquared), c);
        return 0.5*stiffness*angle*angle;
    }
    template <class Real> static CYLCHAIN_INLINE BendFactor<Real> factor(Real square) {
        BendFactor<Real> result;
        for (int i = 0; i < LANE_COUNT<Real>; i++) {
            const double chord = std::fmin(std::sqrt(lane(square, i)), 2.0), half = std::asin(0.5*chord);
            const bool small = chord < 1e-3;
            lane(result.f, i) = small ? 1+chord*chord/24 : 2*half/chord;
            lane(result.slope, i) = small ? -1.0/12 : -(1/chord-half*std::cos(half)*2/(chord*chord))/std::sin(2*half);
        }
        return result;
    }
    static double square(double c) {
        return std::acos(c)*std::acos(c);
    }
    static double ofAngle(double angle) {
        return angle;
    }
    static double measure(double square) {
        const double angle = std::sqrt(square);
        return angle < M_PI ? (angle > 1e-8 ? std::sin(angle)/angle : 1) : 0;
    }
};

/** The energy 2b (1-c)/(1+c). */
struct InscribedCircle : BendingFormulas {
    template <class Real> static CYLCHAIN_INLINE Real slope(Real stiffness, Real c, Real) {
        return -4*stiffness/((1+c)*(1+c));
    }
    static double energy(double stiffness, double c, double sineSquared) {
        return 2*stiffness*sineSquared/((1+c)*(1+c));
    }
    template <class Real> static CYLCHAIN_INLINE BendFactor<Real> factor(Real square) {
        const Real sum = larger<Real>(4-square, splat<Real>(LEAST));
        const Real f = 2/root(sum);
        return {f, f*f*f*Scalar(-0.25)};
    }
    template <class Real> static CYLCHAIN_INLINE void factors(const Vector<Real>& difference1,
                const Vector<Real>& difference2, BendFactor<Real>& factor1, BendFactor<Real>& factor2, Real numbers,
                Real number1, Real number2, Real& inverse1, Real& inverse2) {
        const Real root1 = root(larger<Real>(4-difference1.dot(difference1), splat<Real>(LEAST)));
        const Real root2 = root(larger<Real>(4-difference2.dot(difference2), splat<Real>(LEAST)));
        const Real roots = root1*root2, all = 1/(roots*numbers);
        const Real perRoots = all*numbers, perNumbers = all*roots;
        const Real f1 = 2*perRoots*root2, f2 = 2*perRoots*root1;
        factor1 = {f1, f1*f1*f1*Scalar(-0.25)};
        factor2 = {f2, f2*f2*f2*Scalar(-0.25)};
        inverse1 = perNumbers*number2;
        inverse2 = perNumbers*number1;
    }
    static constexpr bool SHARES_DIVISIONS = true;
    static double square(double c) {
        return 4*(1-c)/(1+c);
    }
    static double ofAngle(double angle) {
        return 2*std::tan(0.5*angle);
    }
    static double measure(double square) {
        return 1/((1+0.25*square)*(1+0.25*square));
    }
    template <class Real> static CYLCHAIN_INLINE Real accepted(const Real* normals, Real deviation, Real acceptance) {
        const Real density = 1+0.25*(normals[0]*normals[0]+normals[1]*normals[1])*deviation*deviation;
        return acceptance*density*density <= 1 ? splat<Real>(1) : Real{};
    }
    static constexpr bool ACCEPTS_IN_LANES = true;
};

// A formula of an angular model. Callers have no other ones.
#define CYLCHAIN_CASE_Angular(entry) case BendingModel::entry: return entry::CYLCHAIN_FORMULA;
#define CYLCHAIN_CASE_Linear(entry) case BendingModel::entry: break;
#define CYLCHAIN_CASE(entry, name, kind) CYLCHAIN_CASE_##kind(entry)
#define CYLCHAIN_DISPATCH \
    switch (model) { \
        CYLCHAIN_BENDING_MODELS(CYLCHAIN_CASE) \
    } \
    noOtherEntry();

template <class Real> inline Real bendingSlope(BendingModel model, Real stiffness, Real c, Real sineSquared) {
#define CYLCHAIN_FORMULA slope(stiffness, c, sineSquared)
    CYLCHAIN_DISPATCH
#undef CYLCHAIN_FORMULA
}

inline double bendingEnergy(BendingModel model, double stiffness, double c, double sineSquared) {
#define CYLCHAIN_FORMULA energy(stiffness, c, sineSquared)
    CYLCHAIN_DISPATCH
#undef CYLCHAIN_FORMULA
}

template <class Real> CYLCHAIN_INLINE BendFactor<Real> bendFactor(BendingModel model, const Vector<Real>& difference) {
    const Real square = difference.dot(difference);
#define CYLCHAIN_FORMULA factor(square)
    CYLCHAIN_DISPATCH
#undef CYLCHAIN_FORMULA
}

/**
 * The factors of two bends, together with the inverses of two other numbers: with one division for as many as can be,
 * which take longer than the rest.
 */
template <class Real> CYLCHAIN_INLINE void bendFactors(BendingModel model, const Vector<Real>& difference1,
            const Vector<Real>& difference2, BendFactor<Real>& factor1, BendFactor<Real>& factor2, Real number1,
            Real number2, Real& inverse1, Real& inverse2) {
    const Real numbers = number1*number2;
#define CYLCHAIN_SHARING_CASE_Angular(entry) \
    if (entry::SHARES_DIVISIONS && model == BendingModel::entry) \
        return entry::factors(difference1, difference2, factor1, factor2, numbers, number1, number2, inverse1, \
                inverse2);
#define CYLCHAIN_SHARING_CASE_Linear(entry)
#define CYLCHAIN_SHARING_CASE(entry, name, kind) CYLCHAIN_SHARING_CASE_##kind(entry)
    CYLCHAIN_BENDING_MODELS(CYLCHAIN_SHARING_CASE)
#undef CYLCHAIN_SHARING_CASE
#undef CYLCHAIN_SHARING_CASE_Linear
#undef CYLCHAIN_SHARING_CASE_Angular
    factor1 = bendFactor(model, difference1);
    factor2 = bendFactor(model, difference2);
    const Real both = 1/numbers;
    inverse1 = both*number2;
    inverse2 = both*number1;
}

inline double bendSquare(BendingModel model, double c) {
#define CYLCHAIN_FORMULA square(c)
    CYLCHAIN_DISPATCH
#undef CYLCHAIN_FORMULA
}

inline double bendOfAngle(BendingModel model, double angle) {
#define CYLCHAIN_FORMULA ofAngle(angle)
    CYLCHAIN_DISPATCH
#undef CYLCHAIN_FORMULA
}

inline double bendMeasure(BendingModel model, double square) {
#define CYLCHAIN_FORMULA measure(square)
    CYLCHAIN_DISPATCH
#undef CYLCHAIN_FORMULA
}

/** Minus twice the slope of the logarithm of bendMeasure() over the square of the bend. */
inline double slopeOfBendMeasure(BendingModel model, double square) {
    const double small = 1e-4, least = square > small ? square-small : 0;
    return -2*std::log(bendMeasure(model, square+small)/bendMeasure(model, least))/(square+small-least);
}

inline double leastBendSquare(BendingModel model) {
#define CYLCHAIN_FORMULA LEAST_SQUARE
    CYLCHAIN_DISPATCH
#undef CYLCHAIN_FORMULA
}

inline bool acceptsBendsInLanes(BendingModel model) {
#define CYLCHAIN_FORMULA ACCEPTS_IN_LANES
    CYLCHAIN_DISPATCH
#undef CYLCHAIN_FORMULA
}

template <class Real> CYLCHAIN_INLINE Real acceptedBends(BendingModel model, const Real* normals, Real deviation,
            Real acceptance) {
#define CYLCHAIN_FORMULA accepted(normals, deviation, acceptance)
    CYLCHAIN_DISPATCH
#undef CYLCHAIN_FORMULA
}

#undef CYLCHAIN_DISPATCH
#undef CYLCHAIN_CASE
#undef CYLCHAIN_CASE_Linear
#undef CYLCHAIN_CASE_Angular
