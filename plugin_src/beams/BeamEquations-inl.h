// Included into the namespace of an instruction set. It does not compile alone.

/**
 * Linear equations with one block of six rows for each node of a chain, and their solution from the first node to the
 * last one. The six are the position and the control vector of a node.
 *
 * Those of a ring are solved as of a chain whose first and last nodes are the same: with the matrix A of the open
 * chain, and C that takes the last node from the first one, A x+C^T m = r and C x = 0 have the solution
 *
 *     x = x'-A^-1 C^T S^-1 C x',    A x' = r,    S = C A^-1 C^T,
 *
 * and the inverse A^-1-A^-1 C^T S^-1 C A^-1.
 */

template <class Real> struct SixVector {
    Vector<Real> position, control;
};

/** A 6x6 matrix; of a symmetric one, what is below the diagonal and on it. */
template <class Real> struct SixMatrix {
    Real a[6][6];
};

/**
 * What four vectors of an element have in the equations: symmetric blocks of them, and products for so many
 * coordinates.
 */
template <class Real> struct BeamMatrix {
    /** The pairs 00, 01, 02, 03, 11, 12, 13, 22, 23 and 33. */
    Symmetric<Real> block[10];
    /** Plus each of these times itself, for the four vectors. */
    Vector<Real> outer[5][4];
    /** Whether there are three of these alone. */
    bool planar;
};

template <int W> class BeamEquations {
public:
    typedef typename Lanes<W>::Type Real;
    typedef Vector<Real> Vec;
    struct Row {
        SixMatrix<Real> diagonal, upper;
    };
    struct Eliminated {
        SixMatrix<Real> inverse, factor;
        Real right[6];
    };
    /**
     * @param mobile   one or zero for each particle and lane
     * @param columns  memory for 6 vectors of all nodes if the chains are rings, or NULL
     */
    BeamEquations(const std::vector<double>& mobile, int nodes, Eliminated* memory, SixVector<Real>* columns) :
            mobile(mobile), n(nodes), rows(memory), columns(columns) {
    }
    /** Add an element to the equations of its nodes; it is the first to do so for the second one. */
    static CYLCHAIN_INLINE void addElement(const BeamMatrix<Real>& m, Row& here, Row& after) {
        addLower(m, 0, here.diagonal);
#pragma GCC unroll 6
        for (int i = 0; i < 6; i++)
#pragma GCC unroll 6
            for (int j = 0; j <= i; j++)
                after.diagonal.a[i][j] = Real{};
        addLower(m, 2, after.diagonal);
#pragma GCC unroll 6
        for (int k = 0; k < 2; k++)
#pragma GCC unroll 6
            for (int l = 0; l < 2; l++)
                setBlock(m, k, 2+l, here.upper, k, l);
    }
    /** Add a symmetric matrix to the control vector of a node. */
    static CYLCHAIN_INLINE void addToControl(const Symmetric<Real>& m, Row& row) {
        addSymmetric(m, row.diagonal, 1);
    }
    /**
     * Eliminate a node, which the next one follows unless it is the last. Compiled once, it is as fast as within each
     * caller.
     */
    __attribute__((noinline)) void eliminate(int node, Row& here, Row& after, bool last) {
        Eliminated& own = rows[node];
        invert(node, here.diagonal);
        own.inverse = here.diagonal;
        if (last)
            return;
#pragma GCC unroll 6
        for (int i = 0; i < 6; i++)
#pragma GCC unroll 6
            for (int j = 0; j < 6; j++) {
                Real value = own.inverse.a[i][0]*here.upper.a[0][j];
#pragma GCC unroll 6
                for (int k = 1; k < 6; k++)
                    value = value+element(own.inverse, i, k)*here.upper.a[k][j];
                own.factor.a[i][j] = value;
            }
#pragma GCC unroll 6
        for (int i = 0; i < 6; i++)
#pragma GCC unroll 6
            for (int j = 0; j <= i; j++) {
                Real value = after.diagonal.a[i][j];
#pragma GCC unroll 6
                for (int k = 0; k < 6; k++)
                    value = value-here.upper.a[k][i]*own.factor.a[k][j];
                after.diagonal.a[i][j] = value;
            }
    }
    /** Set the right side of all nodes. */
    void setRight(const SixVector<Real>* right) {
        for (int node = 0; node < n; node++)
            store(right[node], rows[node].right);
    }
    /** After the last node was eliminated: make the last node the first one if chains are rings. */
    void close() {
        if (columns != NULL)
            findColumns();
    }
    /** Solve the equations with the right side that they have. */
    void substitute(SixVector<Real>* result) {
        substituteOpen(result);
        if (columns != NULL)
            closeResult(result);
    }
    /** Solve those of open chains. */
    __attribute__((noinline)) void substituteOpen(SixVector<Real>* result) {
        for (int node = 0; node < n-1; node++) {
            const Eliminated& own = rows[node];
#pragma GCC unroll 6
            for (int j = 0; j < 6; j++) {
                Real value = rows[node+1].right[j];
#pragma GCC unroll 6
                for (int i = 0; i < 6; i++)
                    value = value-own.factor.a[i][j]*own.right[i];
                rows[node+1].right[j] = value;
            }
        }
        Real next[6] = {};
        for (int node = n-1; node >= 0; node--) {
            const Eliminated& own = rows[node];
            Real x[6];
#pragma GCC unroll 6
            for (int i = 0; i < 6; i++) {
                Real value = element(own.inverse, i, 0)*own.right[0];
#pragma GCC unroll 6
                for (int j = 1; j < 6; j++)
                    value = value+element(own.inverse, i, j)*own.right[j];
                if (node < n-1)
#pragma GCC unroll 6
                    for (int j = 0; j < 6; j++)
                        value = value-own.factor.a[i][j]*next[j];
                x[i] = value;
            }
#pragma GCC unroll 6
            for (int i = 0; i < 6; i++)
                next[i] = x[i];
            result[node] = {{x[0], x[1], x[2]}, {x[3], x[4], x[5]}};
        }
    }
    /**
     * Find the blocks of the inverse of the matrix, from the last node to the first, and use them: those of a node
     * and, unless it is the last one, that of the node and the next and that of the next.
     */
    template <class Function> void findInverse(Function use) const {
        SixMatrix<Real> next = rows[n-1].inverse, both = {};
        // What is used of rings: their own blocks of the last two nodes, and those between them.
        SixMatrix<Real> ofRing[3];
        if (columns != NULL) {
            ofRing[0] = next;
            closeBlock(n-1, n-1, ofRing[0]);
            use(n-1, ofRing[0], both, ofRing[0]);
        }
        else
            use(n-1, next, both, next);
        for (int node = n-2; node >= 0; node--) {
            const Eliminated& own = rows[node];
            SixMatrix<Real> here;
#pragma GCC unroll 6
            for (int i = 0; i < 6; i++)
#pragma GCC unroll 6
                for (int j = 0; j < 6; j++) {
                    Real value = Real{};
#pragma GCC unroll 6
                    for (int k = 0; k < 6; k++)
                        value = value-own.factor.a[i][k]*element(next, k, j);
                    both.a[i][j] = value;
                }
#pragma GCC unroll 6
            for (int i = 0; i < 6; i++)
#pragma GCC unroll 6
                for (int j = 0; j <= i; j++) {
                    Real value = own.inverse.a[i][j];
#pragma GCC unroll 6
                    for (int k = 0; k < 6; k++)
                        value = value-both.a[i][k]*own.factor.a[j][k];
                    here.a[i][j] = value;
                }
            if (columns != NULL) {
                ofRing[2] = ofRing[0];
                ofRing[0] = here;
                ofRing[1] = both;
                closeBlock(node, node, ofRing[0]);
                closeBlock(node, node+1, ofRing[1]);
            }
            const bool open = columns == NULL;
            use(node, open ? here : ofRing[0], open ? both : ofRing[1], open ? next : ofRing[2]);
            next = here;
        }
    }
    static CYLCHAIN_INLINE Real element(const SixMatrix<Real>& symmetric, int i, int j) {
        return i >= j ? symmetric.a[i][j] : symmetric.a[j][i];
    }
    static CYLCHAIN_INLINE void store(const SixVector<Real>& v, Real* values) {
        values[0] = v.position.x;
        values[1] = v.position.y;
        values[2] = v.position.z;
        values[3] = v.control.x;
        values[4] = v.control.y;
        values[5] = v.control.z;
    }
private:
    /** The number of a pair of vectors, of which the second one is not before the first. */
    static constexpr int indexOf(int k, int l) {
        return k*(7-k)/2+l;
    }
    const std::vector<double>& mobile;
    const int n;
    Eliminated* const rows;
    /** A^-1 C^T of rings, column by column; or NULL. */
    SixVector<Real>* const columns;
    /** S^-1 of rings. */
    SixMatrix<Real> stiffness;

    __attribute__((noinline)) void findColumns() {
        for (int k = 0; k < 6; k++) {
            for (int node = 0; node < n; node++)
                std::fill(rows[node].right, rows[node].right+6, Real{});
            rows[0].right[k] = splat<Real>(1);
            rows[n-1].right[k] = splat<Real>(-1);
            substituteOpen(columns+k*n);
        }
        for (int j = 0; j < 6; j++) {
            Real first[6], last[6];
            store(columns[j*n], first);
            store(columns[j*n+n-1], last);
            for (int i = j; i < 6; i++)
                stiffness.a[i][j] = first[i]-last[i];
        }
        invert(0, stiffness);
    }
    __attribute__((noinline)) void closeResult(SixVector<Real>* result) const {
        Real first[6], last[6];
        store(result[0], first);
        store(result[n-1], last);
        for (int k = 0; k < 6; k++) {
            Real force = Real{};
            for (int j = 0; j < 6; j++)
                force = force+element(stiffness, k, j)*(first[j]-last[j]);
            for (int node = 0; node < n; node++) {
                const SixVector<Real>& column = columns[k*n+node];
                result[node].position = result[node].position-column.position*force;
                result[node].control = result[node].control-column.control*force;
            }
        }
        // The same to the last digit.
        result[n-1] = result[0];
    }
    /** Take from a block of the inverse what it has less of because the chain is a ring; of nodes, its lower half. */
    __attribute__((noinline)) void closeBlock(int node, int other, SixMatrix<Real>& block) const {
        Real one[6][6], second[6][6];
        for (int k = 0; k < 6; k++) {
            store(columns[k*n+node], one[k]);
            store(columns[k*n+other], second[k]);
        }
        for (int k = 0; k < 6; k++)
            for (int j = 0; j < 6; j++) {
                Real force = Real{};
                for (int l = 0; l < 6; l++)
                    force = force+element(stiffness, k, l)*second[l][j];
                for (int i = node == other ? j : 0; i < 6; i++)
                    block.a[i][j] = block.a[i][j]-one[k][i]*force;
            }
    }
    /** The inverse. Fixed particles have none of it: they neither move nor pass anything on. */
    CYLCHAIN_INLINE void invert(int node, SixMatrix<Real>& m) const {
        const Real moves[] = {loaded<Real>(mobile, 2*node), loaded<Real>(mobile, 2*node+1)};
#pragma GCC unroll 6
        for (int pivot = 0; pivot < 6; pivot++) {
            const Real mobileOne = moves[pivot/3];
            const Real inverse = mobileOne/(m.a[pivot][pivot]*mobileOne+(1-mobileOne));
            Real column[6];
#pragma GCC unroll 6
            for (int i = 0; i < 6; i++)
                column[i] = element(m, i, pivot);
#pragma GCC unroll 6
            for (int i = 0; i < 6; i++)
#pragma GCC unroll 6
                for (int j = 0; j <= i; j++)
                    if (i != pivot && j != pivot)
                        m.a[i][j] = m.a[i][j]-column[i]*column[j]*inverse;
#pragma GCC unroll 6
            for (int i = 0; i < 6; i++) {
                Real& one = i >= pivot ? m.a[i][pivot] : m.a[pivot][i];
                one = i == pivot ? -inverse : column[i]*inverse;
            }
        }
#pragma GCC unroll 6
        for (int i = 0; i < 6; i++)
#pragma GCC unroll 6
            for (int j = 0; j <= i; j++)
                m.a[i][j] = -m.a[i][j];
    }
    static CYLCHAIN_INLINE void addSymmetric(const Symmetric<Real>& s, SixMatrix<Real>& m, int k) {
        const int o = 3*k;
        m.a[o][o] = m.a[o][o]+s.xx;
        m.a[o+1][o] = m.a[o+1][o]+s.yx;
        m.a[o+1][o+1] = m.a[o+1][o+1]+s.yy;
        m.a[o+2][o] = m.a[o+2][o]+s.zx;
        m.a[o+2][o+1] = m.a[o+2][o+1]+s.zy;
        m.a[o+2][o+2] = m.a[o+2][o+2]+s.zz;
    }
    /** Add the blocks of the vectors k and k+1 to the lower half of a matrix. */
    static CYLCHAIN_INLINE void addLower(const BeamMatrix<Real>& m, int k, SixMatrix<Real>& result) {
#pragma GCC unroll 6
        for (int l = 0; l < 2; l++) {
            Symmetric<Real> own = m.block[indexOf(k+l, k+l)];
#pragma GCC unroll 6
            for (int i = 0; i < 3; i++)
                own.addOuter(m.outer[i][k+l], m.outer[i][k+l]);
            if (!m.planar)
#pragma GCC unroll 6
                for (int i = 3; i < 5; i++)
                    own.addOuter(m.outer[i][k+l], m.outer[i][k+l]);
            addSymmetric(own, result, l);
        }
        SixMatrix<Real> below;
        setBlock(m, k+1, k, below, 1, 0);
#pragma GCC unroll 6
        for (int i = 3; i < 6; i++)
#pragma GCC unroll 6
            for (int j = 0; j < 3; j++)
                result.a[i][j] = result.a[i][j]+below.a[i][j];
    }
    /** Set a block of a matrix to that of two vectors of an element. */
    static CYLCHAIN_INLINE void setBlock(const BeamMatrix<Real>& matrix, int first, int second, SixMatrix<Real>& m,
            int k, int l) {
        Real (*const a)[6] = m.a;
        const int o = 3*k, p = 3*l;
        const Symmetric<Real> s = matrix.block[indexOf(std::min(first, second),
                std::max(first, second))];
        Matrix<Real> sum = Matrix<Real>::of(s);
#pragma GCC unroll 6
        for (int i = 0; i < 3; i++)
            sum = sum+Matrix<Real>::outer(matrix.outer[i][first], matrix.outer[i][second]);
        if (!matrix.planar)
#pragma GCC unroll 6
            for (int i = 3; i < 5; i++)
                sum = sum+Matrix<Real>::outer(matrix.outer[i][first], matrix.outer[i][second]);
        a[o][p] = sum.x.x;
        a[o][p+1] = sum.x.y;
        a[o][p+2] = sum.x.z;
        a[o+1][p] = sum.y.x;
        a[o+1][p+1] = sum.y.y;
        a[o+1][p+2] = sum.y.z;
        a[o+2][p] = sum.z.x;
        a[o+2][p+1] = sum.z.y;
        a[o+2][p+2] = sum.z.z;
    }
};
