// Included into the namespace of an instruction set. It does not compile alone.

/**
 * Lengths of segments as coordinates q with the energy (stiffness/2) q^2, and their tensions.
 *
 * Each entry of CYLCHAIN_STRETCHING_MODELS has a struct of its name with its formulas.
 */

/** Extend a coordinate q with the energy (stiffness/2) q^2 to FENE: its value and slope for an extension e. */
inline void feneCoordinate(double inverse, double e, double& q, double& slope) {
    const double limit = 1-1e-9, relative = std::fmax(-limit, std::fmin(limit, e*inverse));
    const double square = relative*relative;
    const double root = square > 1e-8 ? std::sqrt(-std::log1p(-square)) : std::fabs(relative)*(1+0.25*square);
    slope = square > 1e-8 ? std::fabs(relative)/((1-square)*root) : 1+0.75*square;
    q = std::copysign(root, relative)/inverse+slope*(e-relative/inverse);
}

// Implicit steps draw lengths and find tensions by what these are: another model needs its own.
static_assert(countOf<StretchingModel>() == 2 && !hasRange(StretchingModel::Harmonic) &&
        hasRange(StretchingModel::FENE), "Tensions within a range are those of FENE, and others are harmonic");

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

/** The energy (k/2) (l-l0)^2. */
struct Harmonic {
    /** The tension for an extension e = l-l0, and the inverse of its maximum. */
    template <class Real> static CYLCHAIN_INLINE Real tension(Real stiffness, Real e, Real) {
        return stiffness*e;
    }
    static double energy(double stiffness, double e, double) {
        return 0.5*stiffness*(e*e);
    }
    /** The coordinate q for an extension, and dq/de. */
    template <class Real> static CYLCHAIN_INLINE void coordinate(Real, Real e, Real& q, Real& slope) {
        q = e;
        slope = splat<Real>(1);
    }
};

/** The energy -(k/2) D^2 ln(1-((l-l0)/D)^2). */
struct FENE {
    template <class Real> static CYLCHAIN_INLINE Real tension(Real stiffness, Real e, Real inverse) {
        const Real relative = e*inverse;
        return stiffness*e/(1-relative*relative);
    }
    static double energy(double stiffness, double e, double inverse) {
        const double relative = inverse*inverse*(e*e);
        return -0.5*stiffness/(inverse*inverse)*std::log1p(-relative);
    }
    template <class Real> static CYLCHAIN_INLINE void coordinate(Real inverse, Real e, Real& q, Real& slope) {
        for (int i = 0; i < LANE_COUNT<Real>; i++) {
            double own, derivative;
            feneCoordinate(lane(inverse, i), lane(e, i), own, derivative);
            lane(q, i) = own;
            lane(slope, i) = derivative;
        }
    }
};

// A formula of a model.
#define CYLCHAIN_CASE(entry, ...) case StretchingModel::entry: return entry::CYLCHAIN_FORMULA;
#define CYLCHAIN_DISPATCH \
    switch (model) { \
        CYLCHAIN_STRETCHING_MODELS(CYLCHAIN_CASE) \
    } \
    noOtherEntry();

template <class Real> CYLCHAIN_INLINE Real stretchingTension(StretchingModel model, Real stiffness, Real e,
            Real inverse) {
#define CYLCHAIN_FORMULA tension(stiffness, e, inverse)
    CYLCHAIN_DISPATCH
#undef CYLCHAIN_FORMULA
}

CYLCHAIN_INLINE double stretchingEnergy(StretchingModel model, double stiffness, double e, double inverse) {
#define CYLCHAIN_FORMULA energy(stiffness, e, inverse)
    CYLCHAIN_DISPATCH
#undef CYLCHAIN_FORMULA
}

template <class Real> CYLCHAIN_INLINE void stretchCoordinate(StretchingModel model, Real inverse, Real e, Real& q,
            Real& slope) {
#define CYLCHAIN_FORMULA coordinate(inverse, e, q, slope)
    CYLCHAIN_DISPATCH
#undef CYLCHAIN_FORMULA
}

#undef CYLCHAIN_DISPATCH
#undef CYLCHAIN_CASE
