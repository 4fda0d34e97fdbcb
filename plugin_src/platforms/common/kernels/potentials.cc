/**
 * Bends of joints as coordinates b = f (t2-t1) with the energy (stiffness/2) b^2, and lengths as coordinates q with the
 * energy (stiffness/2) q^2: the formulas of mechanics/BendingModels-inl.h and StretchingModels-inl.h for the models of
 * the chains that the program is compiled for.
 */

#if !defined(BENDING_KratkyPorod) && !defined(BENDING_Quadratic) && !defined(BENDING_InscribedCircle) && \
    !defined(BENDING_BondDifference)
#error "The kernels do not know this bending model: its formulas are missing in potentials.cc"
#endif
#if !defined(STRETCHING_Harmonic) && !defined(STRETCHING_FENE)
#error "The kernels do not know this stretching model: its formulas are missing in potentials.cc"
#endif

/** f of a bend b = f (t2-t1), and df/dc, for the cosine c. */
typedef struct {double f, slope;} BendFactor;

/** For the square of t2-t1. */
inline DEVICE BendFactor bendFactor(double square) {
#if defined(BENDING_KratkyPorod)
    BendFactor result = {1, 0};
#elif defined(BENDING_Quadratic)
    double chord = fmin(sqrt(square), 2.0), halfAngle = asin(0.5*chord);
    BendFactor result = {1+chord*chord/24, -1.0/12};
    if (chord >= 1e-3) {
        result.f = 2*halfAngle/chord;
        result.slope = -(1/chord-halfAngle*cos(halfAngle)*2/(chord*chord))/sin(2*halfAngle);
    }
#else
    double f = 2/sqrt(fmax(4-square, 1e-12));
    BendFactor result = {f, f*f*f*-0.25};
#endif
    return result;
}

/** The square of a bend for the cosine c. */
inline DEVICE double bendSquare(double c) {
#if defined(BENDING_KratkyPorod)
    return 2*(1-c);
#elif defined(BENDING_Quadratic)
    return acos(c)*acos(c);
#else
    return 4*(1-c)/(1+c);
#endif
}

/** The bend of a joint in a plane, for the angle between its segments. */
inline DEVICE double bendOfAngle(double angle) {
#if defined(BENDING_KratkyPorod)
    return 2*sin(0.5*angle);
#elif defined(BENDING_Quadratic)
    return angle;
#else
    return 2*tan(0.5*angle);
#endif
}

/** The density of a bend with a square in the plane of b over that of a Gaussian. */
inline DEVICE double bendMeasure(double square) {
#if defined(BENDING_KratkyPorod)
    return square < 4 ? 1 : 0;
#elif defined(BENDING_Quadratic)
    double angle = sqrt(square);
    return angle < PI ? (angle > 1e-8 ? sin(angle)/angle : 1) : 0;
#else
    return 1/((1+0.25*square)*(1+0.25*square));
#endif
}

/** The square of a bend over that of the angle is this or more. */
#if defined(BENDING_KratkyPorod)
#define LEAST_BEND_SQUARE (4/(PI*PI))
#else
#define LEAST_BEND_SQUARE 1.0
#endif

/** The slope dV/dc of the energy of a joint with the cosine c, and the energy. */
inline DEVICE double2 bendingSlopeAndEnergy(double stiffness, double c, double sineSquared) {
#if defined(BENDING_KratkyPorod)
    return make_double2(-stiffness, c > 0 ? stiffness*sineSquared/(1+c) : stiffness*(1-c));
#elif defined(BENDING_Quadratic)
    double sine = sqrt(sineSquared), angle = atan2(sine, c);
    return make_double2(-stiffness*(sine > 1e-8 ? angle/sine : 1.0), 0.5*stiffness*angle*angle);
#else
    double perSquare = 1/((1+c)*(1+c));
    return make_double2(-4*stiffness*perSquare, 2*stiffness*sineSquared*perSquare);
#endif
}

/** The tension of a segment for an extension, and its energy; inverse is one over the largest extension. */
inline DEVICE double2 tensionAndEnergy(double stiffness, double extension, double inverse) {
#ifdef STRETCHING_FENE
    double relative = extension*inverse;
    return make_double2(stiffness*extension/(1-relative*relative),
            -0.5*stiffness/(inverse*inverse)*log1p(-(inverse*inverse*(extension*extension))));
#else
    return make_double2(stiffness*extension, 0.5*stiffness*(extension*extension));
#endif
}

#ifdef STRETCHING_FENE
/** The coordinate of a length for an extension, and its slope. */
inline DEVICE double2 stretchCoordinate(double inverse, double e) {
    double limit = 1-1e-9, relative = fmax(-limit, fmin(limit, e*inverse)), square = relative*relative;
    double root = square > 1e-8 ? sqrt(-log1p(-square)) : fabs(relative)*(1+0.25*square);
    double slope = square > 1e-8 ? fabs(relative)/((1-square)*root) : 1+0.75*square;
    return make_double2((relative < 0 ? -root : root)/inverse+slope*(e-relative/inverse), slope);
}

/** The tension of a segment in a step, as a function of its new length: see FeneTension in StretchingModels-inl.h. */
typedef struct {double stiffness, inverse, rest, before, theta, offset, drag, noise;} FeneTension;

/** The tension for a length, and its derivative but for that of the slope. */
inline DEVICE double2 feneTension(FeneTension law, double length) {
    double2 own = stretchCoordinate(law.inverse, length-law.rest);
    double mean = stretchCoordinate(law.inverse, 0.5*(law.before+length)-law.rest).y;
    return make_double2(
            law.stiffness*mean*(law.theta*own.x+law.offset)+law.drag*(1-law.before/length)-law.noise,
            law.stiffness*mean*law.theta*own.y+law.drag*law.before/(length*length));
}

/** The length for a tension, beginning at a length. */
DEVICE double feneLength(FeneTension law, double tension, double length) {
    double range = (1-1e-9)/law.inverse, low = fmax(law.rest-range, 1e-9*law.rest), high = law.rest+range;
    double last = 1e300;
    length = fmax(low, fmin(high, length));
    for (int i = 0; i < 100; i++) {
        double2 found = feneTension(law, length);
        double excess = found.x-tension;
        if (excess > 0)
            high = length;
        else
            low = length;
        double next = length-excess/found.y;
        bool halve = !(next > low && next < high) || fabs(excess) > 0.5*last;
        last = fabs(excess);
        double change = (halve ? 0.5*(low+high) : next)-length;
        length += change;
        if (fabs(change) < 1e-12*law.rest)
            break;
    }
    return length;
}
#endif
