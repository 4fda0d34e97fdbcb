/**
 * Matrices of three rows. ChainLoops.h includes this file into the namespace of an instruction set.
 */

/** A 3x3 matrix; x, y and z are its rows. */
template <class Real> struct Matrix {
    Vector<Real> x, y, z;
    static CYLCHAIN_INLINE Matrix axial(Real s, Real r, const Vector<Real>& t) {
        const Vector<Real> v = t*r;
        return {{s+v.x*t.x, v.x*t.y, v.x*t.z}, {v.y*t.x, s+v.y*t.y, v.y*t.z}, {v.z*t.x, v.z*t.y, s+v.z*t.z}};
    }
    static CYLCHAIN_INLINE Matrix of(const Symmetric<Real>& s) {
        return {{s.xx, s.yx, s.zx}, {s.yx, s.yy, s.zy}, {s.zx, s.zy, s.zz}};
    }
    static CYLCHAIN_INLINE Matrix outer(const Vector<Real>& a, const Vector<Real>& b) {
        return {b*a.x, b*a.y, b*a.z};
    }
    CYLCHAIN_INLINE Matrix operator+(const Matrix& m) const {return {x+m.x, y+m.y, z+m.z};}
    CYLCHAIN_INLINE Matrix operator-(const Matrix& m) const {return {x-m.x, y-m.y, z-m.z};}
    CYLCHAIN_INLINE Matrix operator*(Real s) const {return {x*s, y*s, z*s};}
    CYLCHAIN_INLINE Vector<Real> operator*(const Vector<Real>& v) const {return {x.dot(v), y.dot(v), z.dot(v)};}
    CYLCHAIN_INLINE Matrix operator*(const Matrix& m) const {
        return {m.x*x.x+m.y*x.y+m.z*x.z, m.x*y.x+m.y*y.y+m.z*y.z, m.x*z.x+m.y*z.y+m.z*z.z};
    }
    /** Its part below the diagonal and on it, which is all of a symmetric matrix. */
    CYLCHAIN_INLINE Symmetric<Real> lower() const {
        return {x.x, y.x, y.y, z.x, z.y, z.z};
    }
    CYLCHAIN_INLINE Matrix transposed() const {
        return {{x.x, y.x, z.x}, {x.y, y.y, z.y}, {x.z, y.z, z.z}};
    }
    CYLCHAIN_INLINE Matrix inverse() const {
        const Vector<Real> a = crossProduct(y, z), b = crossProduct(z, x), c = crossProduct(x, y);
        return Matrix {a, b, c}.transposed()*(1/x.dot(a));
    }
};
