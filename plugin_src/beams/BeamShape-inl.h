// Included into the namespace of an instruction set. It does not compile alone.

/**
 * The shape of an element: its coordinates and their gradients. See BeamChain.h.
 */

/** An angle over its sine, and the derivative of that by the cosine. */
template <class Real> struct AngleFactor {
    Real value, slope;
    /**
     * With the cosine of half the angle, h, it is G(1-h)/h, where G is that of half the angle. The polynomial for G has
     * errors below 10^-9 up to angles of 157 degrees.
     */
    CYLCHAIN_INLINE explicit AngleFactor(Real cosine) {
        const Scalar coefficients[] = {0.999999999471667, 0.33333346516182516, 0.13332794845934814,
                0.05722743587914935, 0.024729305102637843, 0.014527600560043392, -0.0026241301954305074,
                0.015164298552972078, -0.01026360611517535, 0.005366278059935892};
        const Real half = root(larger<Real>(0.5*(1+cosine), splat<Real>(1e-6)));
        const Real x = 1-half, inverse = 1/half;
        Real g = splat<Real>(coefficients[9]), derivative = Real{};
        for (int i = 8; i >= 0; i--) {
            derivative = derivative*x+g;
            g = g*x+coefficients[i];
        }
        value = g*inverse;
        slope = -0.25*(derivative+value)*inverse*inverse;
    }
};

/** What makes up for the bends that an element does not have, see BeamChain.h. */
const Scalar SCALE_OF_TURN = 1.0/40, SCALE_OF_SQUARE = 1.0/560, SCALE_OF_DIFFERENCE = 1.0/84;

/** The vectors of an element: r' at its ends and in its middle. */
template <class Real> struct BeamVectors {
    Vector<Real> first, middle, last;
    /**
     * @param control1, control2  from the positions of its nodes to their control points
     * @param chord               from its first node to its second one
     */
    static CYLCHAIN_INLINE BeamVectors of(const Vector<Real>& control1, const Vector<Real>& chord,
            const Vector<Real>& control2, Real perLength) {
        return {control1*(3*perLength), (chord*splat<Real>(1.5)-(control1+control2)*splat<Real>(0.75))*perLength,
                control2*(3*perLength)};
    }
};

/** What multiplies changes of the vectors of an element in the change of a coordinate; also forces on these vectors. */
template <class Real> struct BeamGradient {
    Vector<Real> first, middle, last;
    CYLCHAIN_INLINE BeamGradient operator*(Real s) const {return {first*s, middle*s, last*s};}
    CYLCHAIN_INLINE BeamGradient operator+(const BeamGradient& g) const {
        return {first+g.first, middle+g.middle, last+g.last};
    }
    CYLCHAIN_INLINE BeamGradient operator-(const BeamGradient& g) const {
        return {first-g.first, middle-g.middle, last-g.last};
    }
    CYLCHAIN_INLINE Real dot(const BeamVectors<Real>& v) const {
        return first.dot(v.first)+middle.dot(v.middle)+last.dot(v.last);
    }
};

template <class Real> struct BeamShape {
    typedef Vector<Real> Vec;
    /** Directions, and the inverse lengths of the vectors. */
    Vec first, middle, last;
    Real perFirst, perMiddle, perLast;
    /** Strains at the first node and in the middle. */
    Real strain, middleStrain;
    /** The sum s of the two bends, and their difference d. */
    Vec sum, difference;
    Vec normal1, normal2, turn, second, unscaled;
    AngleFactor<Real> factor1, factor2;
    Real turnSquare, scale;
    CYLCHAIN_INLINE explicit BeamShape(const BeamVectors<Real>& v) : BeamShape(v, root(v.first.dot(v.first)),
            root(v.middle.dot(v.middle)), root(v.last.dot(v.last))) {
    }
    /** The change of the strain in the middle for that of the vectors. */
    CYLCHAIN_INLINE BeamGradient<Real> middleGradient() const {
        const Vec away = turn*(turnSquare*Scalar(1.0/120)), bow = second*splat<Real>(1.0/20);
        return {-bow-away, middle+bow*splat<Real>(2), away-bow};
    }
    /** The forces on the vectors that do the work of moments, those of the sum and of the difference. */
    CYLCHAIN_INLINE BeamGradient<Real> forcesOf(const Vec& ofSum, const Vec& ofDifference) const {
        const Real work = ofDifference.dot(unscaled);
        const Vec scaled = ofDifference*scale+unscaled*(work*(2*SCALE_OF_DIFFERENCE));
        const Vec moment1 = ofSum-scaled, moment2 = ofSum+scaled;
        const Vec apart = turn*(work*(2*SCALE_OF_TURN+turnSquare*(4*SCALE_OF_SQUARE)));
        const Real along1 = factor1.slope*moment1.dot(normal1), along2 = factor2.slope*moment2.dot(normal2);
        const Vec force1 = crossProduct(middle, moment1)*factor1.value+middle*along1;
        const Vec force2 = crossProduct(moment2, middle)*factor2.value+middle*along2;
        const Vec force = crossProduct(moment1, first)*factor1.value+first*along1+
                crossProduct(last, moment2)*factor2.value+last*along2;
        return {apart-across(force1, first)*perFirst, across(force, middle)*(-perMiddle),
                -apart-across(force2, last)*perLast};
    }
    /** How the two bends change, across the middle, with the vectors. */
    CYLCHAIN_INLINE void findChanges(const BeamVectors<Real>& change, Vec& ofSum, Vec& ofDifference) const {
        const Vec dFirst = across(change.first, first)*perFirst, dMiddle = across(change.middle, middle)*perMiddle;
        const Vec dLast = across(change.last, last)*perLast;
        const Real dCosine1 = dFirst.dot(middle)+first.dot(dMiddle), dCosine2 = dMiddle.dot(last)+middle.dot(dLast);
        const Vec bend1 = (crossProduct(dFirst, middle)+crossProduct(first, dMiddle))*factor1.value+
                normal1*(factor1.slope*dCosine1);
        const Vec bend2 = (crossProduct(dMiddle, last)+crossProduct(middle, dLast))*factor2.value+
                normal2*(factor2.slope*dCosine2);
        const Vec apart = bend2-bend1;
        const Real dScale = turn.dot(change.last-change.first)*(2*SCALE_OF_TURN+turnSquare*(4*SCALE_OF_SQUARE))+
                unscaled.dot(apart)*(2*SCALE_OF_DIFFERENCE);
        ofSum = across(bend1+bend2, middle);
        ofDifference = across(apart*scale+unscaled*dScale, middle);
    }
private:
    CYLCHAIN_INLINE BeamShape(const BeamVectors<Real>& v, Real length1, Real lengthOfMiddle, Real length2) :
            BeamShape(v, length1, lengthOfMiddle, length2, 1/(length1*lengthOfMiddle*length2)) {
    }
    CYLCHAIN_INLINE BeamShape(const BeamVectors<Real>& v, Real length1, Real lengthOfMiddle, Real length2, Real all) :
            first(v.first*(all*lengthOfMiddle*length2)), middle(v.middle*(all*length1*length2)),
            last(v.last*(all*length1*lengthOfMiddle)), perFirst(all*lengthOfMiddle*length2),
            perMiddle(all*length1*length2), perLast(all*length1*lengthOfMiddle), strain(length1-1),
            normal1(crossProduct(first, middle)), normal2(crossProduct(middle, last)), turn(v.last-v.first),
            second(v.first+v.last-v.middle*splat<Real>(2)), factor1(first.dot(middle)), factor2(middle.dot(last)) {
        const Vec bend1 = normal1*factor1.value, bend2 = normal2*factor2.value;
        sum = bend1+bend2;
        turnSquare = turn.dot(turn);
        unscaled = bend2-bend1;
        scale = 1+turnSquare*(SCALE_OF_TURN+turnSquare*SCALE_OF_SQUARE)+unscaled.dot(unscaled)*SCALE_OF_DIFFERENCE;
        difference = unscaled*scale;
        middleStrain = lengthOfMiddle-1-second.dot(second)*Scalar(1.0/40)+turnSquare*turnSquare*Scalar(1.0/480);
    }
    static CYLCHAIN_INLINE Vec across(const Vec& v, const Vec& direction) {
        return v-direction*direction.dot(v);
    }
};

/** Gauss points of an element, and the weights of its Bezier points' vectors there: four, which are exact. */
constexpr int GAUSS_POINTS = 4;
constexpr Scalar GAUSS_PLACES[] = {0.06943184420297371, 0.33000947820757187, 0.6699905217924281, 0.9305681557970262};
constexpr Scalar GAUSS_WEIGHTS[] = {0.17392742256872679, 0.3260725774312732, 0.3260725774312732, 0.17392742256872679};

/** The weights of the position and the control vector of the first node and of the second one at a place. */
struct BeamWeights {
    Scalar value[GAUSS_POINTS][4], slope[GAUSS_POINTS][4];
    constexpr BeamWeights() : value(), slope() {
        for (int g = 0; g < GAUSS_POINTS; g++) {
            const Scalar x = GAUSS_PLACES[g], y = 1-x;
            value[g][0] = y*y*(1+2*x);
            value[g][1] = 3*x*y*y;
            value[g][2] = x*x*(1+2*y);
            value[g][3] = -3*x*x*y;
            slope[g][0] = -6*x*y;
            slope[g][1] = 3*y*(1-3*x);
            slope[g][2] = 6*x*y;
            slope[g][3] = 3*x*(3*x-2);
        }
    }
};
constexpr BeamWeights WEIGHTS;
