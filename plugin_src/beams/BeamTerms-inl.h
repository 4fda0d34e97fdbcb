// Included into the namespace of an instruction set. It does not compile alone.

/**
 * Couplings at places on elements: what they add to the equations of a pack, and how forces on places and the motions
 * of places belong to those of nodes.
 */

/** The terms of couplings of a pack, in the order of their elements. */
template <int W> class BeamTerms {
    typedef typename Lanes<W>::Type Real;
    typedef SixVector<Real> Six;
    typedef typename BeamEquations<W>::Row Row;
public:
    explicit BeamTerms(const BeamPack& pack) : pack(pack), planar(pack.planar) {
    }
    void set(const CouplingTerm* newTerms, int count) {
        terms = newTerms;
        numTerms = count;
        weights.clear();
        for (int i = 0; i < count; i++) {
            const double length = pack.properties[BeamPack::Length*W+terms[i].lane];
            const BezierWeights own = weightsOf(terms[i].hold, terms[i].fraction, length);
            weights.push_back({{own.position1, own.control1, own.position2, own.control2}});
        }
    }
    int size() const {
        return numTerms;
    }
    /** Add the terms of an element, the next ones, to the equations of its nodes. */
    void add(int element, int& next, Row& here, Row& after, Six* right) const {
        for (; next < numTerms && terms[next].node == element; next++) {
            const CouplingTerm& term = terms[next];
            const int i = term.lane;
            const double* const w = weights[next].of;
            double k[3][3];
            findStiffness(term, k);
            for (int a = 0; a < 2; a++)
                for (int b = 0; b < 2; b++)
                    for (int row = 0; row < 3; row++)
                        for (int column = 0; column < 3; column++) {
                            lane(here.upper.a[3*a+row][3*b+column], i) += w[a]*w[2+b]*k[row][column];
                            // Of symmetric matrices, what is below the diagonal and on it.
                            if (3*a+row < 3*b+column)
                                continue;
                            lane(here.diagonal.a[3*a+row][3*b+column], i) += w[a]*w[b]*k[row][column];
                            lane(after.diagonal.a[3*a+row][3*b+column], i) += w[2+a]*w[2+b]*k[row][column];
                        }
            addForce(next, term.force, right);
        }
    }
    /** Find what forces on the places of the terms are on positions and control vectors. */
    template <class Number> void spread(const Number* forces, int nodes, Six* ofNodes) const {
        std::fill(ofNodes, ofNodes+nodes, Six {});
        for (int i = 0; i < numTerms; i++) {
            double force[3];
            for (int k = 0; k < 3; k++)
                force[k] = forces[TermBlocks::place(i, k)];
            addForce(i, force, ofNodes);
        }
    }
    /** Find how places move with the nodes. */
    template <class Number> void gather(const Six* ofNodes, Number* moves) const {
        for (int i = 0; i < numTerms; i++) {
            const Scalar* const first = numbersOf(ofNodes[terms[i].node], terms[i].lane);
            const Scalar* const second = numbersOf(ofNodes[terms[i].node+1], terms[i].lane);
            const double* const w = weights[i].of;
            for (int k = 0; k < 3; k++)
                moves[TermBlocks::place(i, k)] =
                        w[0]*first[k*W]+w[1]*first[(3+k)*W]+w[2]*second[k*W]+w[3]*second[(3+k)*W];
        }
    }
    /** Find how a force on the place of each term moves it: see PackStep::findCompliances(). */
    void findCompliances(const BeamEquations<W>& equations, double* compliances) const {
        int left = numTerms;
        equations.findInverse([&] (int node, const SixMatrix<Real>& here, const SixMatrix<Real>& both,
                    const SixMatrix<Real>& next) {
            for (; left > 0 && terms[left-1].node == node; left--)
                findCompliance(left-1, here, both, next, compliances+6*(left-1));
        });
    }
private:
    struct Weights {
        double of[4];
    };
    const BeamPack& pack;
    const bool planar;
    const CouplingTerm* terms = NULL;
    int numTerms = 0;
    std::vector<Weights> weights;

    /** In a plane, what is along z moves nothing. */
    void findStiffness(const CouplingTerm& term, double (*k)[3]) const {
        const int of[3][3] = {{0, 1, 2}, {1, 3, 4}, {2, 4, 5}};
        for (int row = 0; row < 3; row++)
            for (int column = 0; column < 3; column++)
                k[row][column] = planar && (row == 2 || column == 2) ? 0 : term.stiffness[of[row][column]];
    }
    /** The numbers of a lane, which are W apart: three of the position and three of the control vector. */
    static Scalar* numbersOf(Six& vector, int i) {
        return reinterpret_cast<Scalar*>(&vector)+i;
    }
    static Scalar laneOf(const Real& value, int i) {
        return reinterpret_cast<const Scalar*>(&value)[i];
    }
    static const Scalar* numbersOf(const Six& vector, int i) {
        return reinterpret_cast<const Scalar*>(&vector)+i;
    }
    void addForce(int number, const double* force, Six* ofNodes) const {
        Scalar* const first = numbersOf(ofNodes[terms[number].node], terms[number].lane);
        Scalar* const second = numbersOf(ofNodes[terms[number].node+1], terms[number].lane);
        const double* const w = weights[number].of;
        for (int k = 0; k < (planar ? 2 : 3); k++) {
            first[k*W] += w[0]*force[k];
            first[(3+k)*W] += w[1]*force[k];
            second[k*W] += w[2]*force[k];
            second[(3+k)*W] += w[3]*force[k];
        }
    }
    void findCompliance(int number, const SixMatrix<Real>& here, const SixMatrix<Real>& both,
            const SixMatrix<Real>& next, double* result) const {
        const int i = terms[number].lane;
        const double* const w = weights[number].of;
        auto symmetric = [&] (const SixMatrix<Real>& m, int row, int column) {
            return laneOf(row >= column ? m.a[row][column] : m.a[column][row], i);
        };
        int entry = 0;
        for (int row = 0; row < 3; row++)
            for (int column = row; column < 3; column++) {
                double sum = 0;
                for (int a = 0; a < 2; a++)
                    for (int b = 0; b < 2; b++) {
                        sum += w[a]*w[b]*symmetric(here, 3*a+row, 3*b+column);
                        sum += w[2+a]*w[2+b]*symmetric(next, 3*a+row, 3*b+column);
                        sum += w[a]*w[2+b]*(laneOf(both.a[3*a+row][3*b+column], i)+
                                laneOf(both.a[3*a+column][3*b+row], i));
                    }
                result[entry++] = sum;
            }
    }
};
