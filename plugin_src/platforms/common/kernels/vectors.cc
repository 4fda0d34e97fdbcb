/**
 * Vectors and matrices of three rows. Chains are computed in double precision, whatever the precision of the platform.
 */

typedef double3 Vector;

/** A symmetric matrix. */
typedef struct {double xx, yx, yy, zx, zy, zz;} Symmetric;

/** A matrix by its rows. */
typedef struct {Vector x, y, z;} Matrix;

inline DEVICE Vector zeroVector() {
    return make_double3(0, 0, 0);
}

inline DEVICE double product(Vector a, Vector b) {
    return a.x*b.x+a.y*b.y+a.z*b.z;
}

inline DEVICE Vector crossProduct(Vector a, Vector b) {
    return make_double3(a.y*b.z-a.z*b.y, a.z*b.x-a.x*b.z, a.x*b.y-a.y*b.x);
}

inline DEVICE Symmetric zeroSymmetric() {
    Symmetric m = {0, 0, 0, 0, 0, 0};
    return m;
}

inline DEVICE Matrix zeroMatrix() {
    Matrix m;
    m.x = m.y = m.z = zeroVector();
    return m;
}

inline DEVICE Symmetric sumOfSymmetric(Symmetric a, Symmetric b) {
    Symmetric m = {a.xx+b.xx, a.yx+b.yx, a.yy+b.yy, a.zx+b.zx, a.zy+b.zy, a.zz+b.zz};
    return m;
}

inline DEVICE Symmetric scaledSymmetric(Symmetric m, double s) {
    Symmetric r = {m.xx*s, m.yx*s, m.yy*s, m.zx*s, m.zy*s, m.zz*s};
    return r;
}

inline DEVICE Symmetric withDiagonal(Symmetric m, double s) {
    m.xx += s;
    m.yy += s;
    m.zz += s;
    return m;
}

/** m+a bT, which the caller knows to be symmetric. */
inline DEVICE Symmetric withOuter(Symmetric m, Vector a, Vector b) {
    m.xx += a.x*b.x;
    m.yx += a.y*b.x;
    m.yy += a.y*b.y;
    m.zx += a.z*b.x;
    m.zy += a.z*b.y;
    m.zz += a.z*b.z;
    return m;
}

/** m+s 1+r t tT. */
inline DEVICE Symmetric withAxial(Symmetric m, double s, double r, Vector t) {
    return withDiagonal(withOuter(m, t*r, t), s);
}

/** m-aT b, which the caller knows to be symmetric. */
inline DEVICE Symmetric lessTransposedProduct(Symmetric m, Matrix a, Matrix b) {
    m.xx -= a.x.x*b.x.x+a.y.x*b.y.x+a.z.x*b.z.x;
    m.yx -= a.x.y*b.x.x+a.y.y*b.y.x+a.z.y*b.z.x;
    m.yy -= a.x.y*b.x.y+a.y.y*b.y.y+a.z.y*b.z.y;
    m.zx -= a.x.z*b.x.x+a.y.z*b.y.x+a.z.z*b.z.x;
    m.zy -= a.x.z*b.x.y+a.y.z*b.y.y+a.z.z*b.z.y;
    m.zz -= a.x.z*b.x.z+a.y.z*b.y.z+a.z.z*b.z.z;
    return m;
}

/** m-a bT, which the caller knows to be symmetric. */
inline DEVICE Symmetric lessProductTransposed(Symmetric m, Matrix a, Matrix b) {
    m.xx -= product(a.x, b.x);
    m.yx -= product(a.y, b.x);
    m.yy -= product(a.y, b.y);
    m.zx -= product(a.z, b.x);
    m.zy -= product(a.z, b.y);
    m.zz -= product(a.z, b.z);
    return m;
}

inline DEVICE Vector symmetricTimes(Symmetric m, Vector v) {
    return make_double3(m.xx*v.x+m.yx*v.y+m.zx*v.z, m.yx*v.x+m.yy*v.y+m.zy*v.z, m.zx*v.x+m.zy*v.y+m.zz*v.z);
}

inline DEVICE Matrix symmetricTimesMatrix(Symmetric s, Matrix m) {
    Matrix r;
    r.x = m.x*s.xx+m.y*s.yx+m.z*s.zx;
    r.y = m.x*s.yx+m.y*s.yy+m.z*s.zy;
    r.z = m.x*s.zx+m.y*s.zy+m.z*s.zz;
    return r;
}

inline DEVICE Vector matrixTimes(Matrix m, Vector v) {
    return make_double3(product(m.x, v), product(m.y, v), product(m.z, v));
}

inline DEVICE Vector transposedTimes(Matrix m, Vector v) {
    return m.x*v.x+m.y*v.y+m.z*v.z;
}

inline DEVICE Matrix matrixProduct(Matrix a, Matrix b) {
    Matrix r;
    r.x = transposedTimes(b, a.x);
    r.y = transposedTimes(b, a.y);
    r.z = transposedTimes(b, a.z);
    return r;
}

inline DEVICE Matrix transposed(Matrix m) {
    Matrix r;
    r.x = make_double3(m.x.x, m.y.x, m.z.x);
    r.y = make_double3(m.x.y, m.y.y, m.z.y);
    r.z = make_double3(m.x.z, m.y.z, m.z.z);
    return r;
}

inline DEVICE Matrix transposedProduct(Matrix a, Matrix b) {
    return matrixProduct(transposed(a), b);
}

inline DEVICE Matrix sumOf(Matrix a, Matrix b) {
    a.x = a.x+b.x;
    a.y = a.y+b.y;
    a.z = a.z+b.z;
    return a;
}

inline DEVICE Matrix scaled(Matrix m, double s) {
    m.x = m.x*s;
    m.y = m.y*s;
    m.z = m.z*s;
    return m;
}

inline DEVICE Matrix differenceOf(Matrix a, Matrix b) {
    a.x = a.x-b.x;
    a.y = a.y-b.y;
    a.z = a.z-b.z;
    return a;
}

inline DEVICE Matrix outer(Vector a, Vector b) {
    Matrix r;
    r.x = b*a.x;
    r.y = b*a.y;
    r.z = b*a.z;
    return r;
}

/** s 1+r t tT. */
inline DEVICE Matrix axial(double s, double r, Vector t) {
    Matrix m = outer(t*r, t);
    m.x.x += s;
    m.y.y += s;
    m.z.z += s;
    return m;
}

inline DEVICE Matrix fullMatrix(Symmetric s) {
    Matrix r;
    r.x = make_double3(s.xx, s.yx, s.zx);
    r.y = make_double3(s.yx, s.yy, s.zy);
    r.z = make_double3(s.zx, s.zy, s.zz);
    return r;
}

/** The part below the diagonal and on it, which is all of a symmetric matrix. */
inline DEVICE Symmetric lowerPart(Matrix m) {
    Symmetric s = {m.x.x, m.y.x, m.y.y, m.z.x, m.z.y, m.z.z};
    return s;
}

/** The inverse for a mobile node, and zero for a fixed one, which neither moves nor passes anything on. */
inline DEVICE Symmetric inverseOfMobile(Symmetric m, double mobile) {
    m = withDiagonal(m, 1-mobile);
    Symmetric c = {m.yy*m.zz-m.zy*m.zy, m.zx*m.zy-m.yx*m.zz, m.xx*m.zz-m.zx*m.zx, m.yx*m.zy-m.yy*m.zx,
            m.yx*m.zx-m.xx*m.zy, m.xx*m.yy-m.yx*m.yx};
    double factor = mobile/(m.xx*c.xx+m.yx*c.yx+m.zx*c.zx);
    Symmetric r = {c.xx*factor, c.yx*factor, c.yy*factor, c.zx*factor, c.zy*factor, c.zz*factor};
    return r;
}

/** The image of a vector that is shortest in a periodic box of three vectors (nine numbers). */
inline DEVICE Vector nearestImage(Vector d, GLOBAL const double* RESTRICT box) {
    double images = floor(d.z/box[8]+0.5);
    d = d-make_double3(box[6], box[7], box[8])*images;
    images = floor(d.y/box[4]+0.5);
    d = d-make_double3(box[3], box[4], box[5])*images;
    images = floor(d.x/box[0]+0.5);
    return d-make_double3(box[0], box[1], box[2])*images;
}
