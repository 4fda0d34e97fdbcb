// Included into the namespace of an instruction set. It does not compile alone.

/**
 * The metric forces of a step: without them, strains that do not fluctuate within a step would have the wrong measure.
 */

/** How far vectors are moved to find second derivatives. */
const Scalar NEARBY = 1e-5;

template <int W> class BeamMetricForces {
    typedef typename Lanes<W>::Type Real;
    typedef Vector<Real> Vec;
    typedef SixVector<Real> Six;
    typedef BeamEquations<W> Equations;
public:
    /** @param noise  k_B T (2 theta-1) of the strains */
    BeamMetricForces(const BeamPack& pack, const BeamStart<W>& start, const BeamElementState<Real>* elements,
            const Equations& equations, Real noise) : start(start), n(pack.nodes), elements(elements),
            equations(equations), perLength(1/loaded<Real>(pack.properties, BeamPack::Length)), noise(noise) {
    }
    /**
     * Add the metric forces of strains, -k_B T sum_a k (2 theta-1) H_a (Z/h+K)^-1 J_a, with the matrix of the first
     * iteration. Bends have none: they are drawn from their own distribution.
     */
    void add(Six* forces) const {
        equations.findInverse([&] (int e, const SixMatrix<Real>& here, const SixMatrix<Real>& both,
                    const SixMatrix<Real>& next) {
            const BeamElementState<Real>& own = elements[e];
            const Vec t = own.direction;
            const Vec response = controlBlock(here, t)*(9*perLength*perLength);
            const Vec force = (response-t*t.dot(response))*(-noise*own.ofNode.stiffness/(1+own.ofNode.start));
            forces[e].control = forces[e].control+force*(3*perLength);
            if (e == n-1)
                return;
            const BeamVectors<Real> v = BeamVectors<Real>::of(start.control[e], start.chord[e], start.control[e+1],
                    perLength);
            const BeamGradient<Real> gradient = BeamShape<Real>(v).middleGradient();
            const BeamVectors<Real> moves = respond(gradient, here, both, next);
            const Real square = moves.first.dot(moves.first)+moves.middle.dot(moves.middle)+moves.last.dot(moves.last);
            const Real less = NEARBY/root(square+TINY);
            const BeamShape<Real> nearby(BeamVectors<Real> {v.first+moves.first*less, v.middle+moves.middle*less,
                    v.last+moves.last*less});
            addForcesOf((nearby.middleGradient()-gradient)*(-noise*own.ofMiddle.stiffness/less), perLength, forces[e],
                    forces[e+1]);
        });
    }
private:
    const BeamStart<W>& start;
    const int n;
    const BeamElementState<Real>* const elements;
    const Equations& equations;
    const Real perLength, noise;

    /** How forces with a gradient move the vectors of an element, by the blocks of the inverse. */
    BeamVectors<Real> respond(const BeamGradient<Real>& gradient, const SixMatrix<Real>& here,
            const SixMatrix<Real>& both, const SixMatrix<Real>& next) const {
        Six first = {}, second = {};
        addForcesOf(gradient, perLength, first, second);
        Real pull[2][6], moves[2][6];
        Equations::store(first, pull[0]);
        Equations::store(second, pull[1]);
        for (int i = 0; i < 6; i++) {
            Real ofFirst = Real{}, ofSecond = Real{};
            for (int j = 0; j < 6; j++) {
                ofFirst = ofFirst+Equations::element(here, i, j)*pull[0][j]+both.a[i][j]*pull[1][j];
                ofSecond = ofSecond+both.a[j][i]*pull[0][j]+Equations::element(next, i, j)*pull[1][j];
            }
            moves[0][i] = ofFirst;
            moves[1][i] = ofSecond;
        }
        const Vec chord = {moves[1][0]-moves[0][0], moves[1][1]-moves[0][1], moves[1][2]-moves[0][2]};
        return BeamVectors<Real>::of(Vec {moves[0][3], moves[0][4], moves[0][5]}, chord,
                Vec {moves[1][3], moves[1][4], moves[1][5]}, perLength);
    }
    /** The product of a vector with the block of the control vector. */
    static CYLCHAIN_INLINE Vec controlBlock(const SixMatrix<Real>& m, const Vec& v) {
        return {m.a[3][3]*v.x+m.a[4][3]*v.y+m.a[5][3]*v.z, m.a[4][3]*v.x+m.a[4][4]*v.y+m.a[5][4]*v.z,
                m.a[5][3]*v.x+m.a[5][4]*v.y+m.a[5][5]*v.z};
    }
};
