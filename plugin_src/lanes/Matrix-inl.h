// Included into the namespace of an instruction set. It does not compile alone.

/**
 * Matrices of three rows.
 */

template <class Real> struct Matrix;

/** A symmetric 3x3 matrix. */
template <class Real> struct Symmetric {
    Real xx, yx, yy, zx, zy, zz;
    CYLCHAIN_INLINE Vector<Real> operator*(const Vector<Real>& v) const {
        return {xx*v.x+yx*v.y+zx*v.z, yx*v.x+yy*v.y+zy*v.z, zx*v.x+zy*v.y+zz*v.z};
    }
    CYLCHAIN_INLINE Matrix<Real> operator*(const Matrix<Real>& m) const {
        return {m.x*xx+m.y*yx+m.z*zx, m.x*yx+m.y*yy+m.z*zy, m.x*zx+m.y*zy+m.z*zz};
    }
    CYLCHAIN_INLINE Symmetric operator-(const Symmetric& m) const {
        return {xx-m.xx, yx-m.yx, yy-m.yy, zx-m.zx, zy-m.zy, zz-m.zz};
    }
    CYLCHAIN_INLINE void add(const Symmetric& m) {
        xx += m.xx;
        yx += m.yx;
        yy += m.yy;
        zx += m.zx;
        zy += m.zy;
        zz += m.zz;
    }
    /** Add s 1. */
    CYLCHAIN_INLINE void addDiagonal(Real s) {
        xx += s;
        yy += s;
        zz += s;
    }
    /** Add s 1 + r tt. */
    CYLCHAIN_INLINE void addAxial(Real s, Real r, const Vector<Real>& t) {
        addOuter(t*r, t);
        xx += s;
        yy += s;
        zz += s;
    }
    /** Add a bT, which the caller knows to be symmetric. */
    CYLCHAIN_INLINE void addOuter(const Vector<Real>& a, const Vector<Real>& b) {
        xx += a.x*b.x;
        yx += a.y*b.x;
        yy += a.y*b.y;
        zx += a.z*b.x;
        zy += a.z*b.y;
        zz += a.z*b.z;
    }
    /** Add m+mT. */
    CYLCHAIN_INLINE void addTwice(const Matrix<Real>& m) {
        xx += 2*m.x.x;
        yx += m.y.x+m.x.y;
        yy += 2*m.y.y;
        zx += m.z.x+m.x.z;
        zy += m.z.y+m.y.z;
        zz += 2*m.z.z;
    }
    /** Subtract aT b, which the caller knows to be symmetric. */
    CYLCHAIN_INLINE void subtractTransposedProduct(const Matrix<Real>& a, const Matrix<Real>& b) {
        xx -= a.x.x*b.x.x+a.y.x*b.y.x+a.z.x*b.z.x;
        yx -= a.x.y*b.x.x+a.y.y*b.y.x+a.z.y*b.z.x;
        yy -= a.x.y*b.x.y+a.y.y*b.y.y+a.z.y*b.z.y;
        zx -= a.x.z*b.x.x+a.y.z*b.y.x+a.z.z*b.z.x;
        zy -= a.x.z*b.x.y+a.y.z*b.y.y+a.z.z*b.z.y;
        zz -= a.x.z*b.x.z+a.y.z*b.y.z+a.z.z*b.z.z;
    }
    /** Subtract a bT, which the caller knows to be symmetric. */
    CYLCHAIN_INLINE void subtractProductTransposed(const Matrix<Real>& a, const Matrix<Real>& b) {
        xx -= a.x.dot(b.x);
        yx -= a.y.dot(b.x);
        yy -= a.y.dot(b.y);
        zx -= a.z.dot(b.x);
        zy -= a.z.dot(b.y);
        zz -= a.z.dot(b.z);
    }
    CYLCHAIN_INLINE Symmetric inverse(Real scale) const {
        Symmetric c = {yy*zz-zy*zy, zx*zy-yx*zz, xx*zz-zx*zx, yx*zy-yy*zx, yx*zx-xx*zy, xx*yy-yx*yx};
        const Real factor = scale/(xx*c.xx+yx*c.yx+zx*c.zx);
        return {c.xx*factor, c.yx*factor, c.yy*factor, c.zx*factor, c.zy*factor, c.zz*factor};
    }
};

/** A 3x3 matrix; x, y and z are its rows. */
template <class Real> struct Matrix {
    Vector<Real> x, y, z;
    static CYLCHAIN_INLINE Matrix axial(Real s, Real r, const Vector<Real>& t) {
        const Vector<Real> v = t*r;
        return {{s+v.x*t.x, v.x*t.y, v.x*t.z}, {v.y*t.x, s+v.y*t.y, v.y*t.z}, {v.z*t.x, v.z*t.y, s+v.z*t.z}};
    }
    static CYLCHAIN_INLINE Matrix diagonal(Real s) {
        return {{s, Real{}, Real{}}, {Real{}, s, Real{}}, {Real{}, Real{}, s}};
    }
    static CYLCHAIN_INLINE Matrix of(const Symmetric<Real>& s) {
        return {{s.xx, s.yx, s.zx}, {s.yx, s.yy, s.zy}, {s.zx, s.zy, s.zz}};
    }
    static CYLCHAIN_INLINE Matrix outer(const Vector<Real>& a, const Vector<Real>& b) {
        return {b*a.x, b*a.y, b*a.z};
    }
    CYLCHAIN_INLINE Matrix operator-() const {return {-x, -y, -z};}
    CYLCHAIN_INLINE Matrix operator+(const Matrix& m) const {return {x+m.x, y+m.y, z+m.z};}
    CYLCHAIN_INLINE Matrix operator-(const Matrix& m) const {return {x-m.x, y-m.y, z-m.z};}
    CYLCHAIN_INLINE Matrix operator*(Real s) const {return {x*s, y*s, z*s};}
    CYLCHAIN_INLINE Vector<Real> operator*(const Vector<Real>& v) const {return {x.dot(v), y.dot(v), z.dot(v)};}
    CYLCHAIN_INLINE Matrix operator*(const Matrix& m) const {
        return {m.x*x.x+m.y*x.y+m.z*x.z, m.x*y.x+m.y*y.y+m.z*y.z, m.x*z.x+m.y*z.y+m.z*z.z};
    }
    /** The product of the transposed matrix with a vector. */
    CYLCHAIN_INLINE Vector<Real> transposedTimes(const Vector<Real>& v) const {
        return x*v.x+y*v.y+z*v.z;
    }
    /** The product of the transposed matrix with another one. */
    CYLCHAIN_INLINE Matrix transposedTimes(const Matrix& m) const {
        return {m.x*x.x+m.y*y.x+m.z*z.x, m.x*x.y+m.y*y.y+m.z*z.y, m.x*x.z+m.y*y.z+m.z*z.z};
    }
    /** Its part below the diagonal and on it, which is all of a symmetric matrix. */
    CYLCHAIN_INLINE Symmetric<Real> lower() const {
        return {x.x, y.x, y.y, z.x, z.y, z.z};
    }
    CYLCHAIN_INLINE Matrix transposed() const {
        return {{x.x, y.x, z.x}, {x.y, y.y, z.y}, {x.z, y.z, z.z}};
    }
};

/** The inverse for a mobile node, and zero for a fixed one, which neither moves nor passes anything on. */
template <class Real> inline Symmetric<Real> inverseOfMobile(Symmetric<Real> diagonal, Real mobile) {
    const Real held = 1-mobile;
    diagonal.xx += held;
    diagonal.yy += held;
    diagonal.zz += held;
    return diagonal.inverse(mobile);
}

/** A matrix of one lane in all lanes. */
template <class Many, class Real> CYLCHAIN_INLINE Matrix<Many> inLanes(const Matrix<Real>& m) {
    return {inLanes<Many>(m.x), inLanes<Many>(m.y), inLanes<Many>(m.z)};
}
template <class Many, class Real> CYLCHAIN_INLINE Symmetric<Many> inLanes(const Symmetric<Real>& m) {
    return {splat<Many>(m.xx), splat<Many>(m.yx), splat<Many>(m.yy), splat<Many>(m.zx), splat<Many>(m.zy),
            splat<Many>(m.zz)};
}
