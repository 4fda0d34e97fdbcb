#ifndef CYLCHAIN_SYMMETRIC_MATRICES_H_
#define CYLCHAIN_SYMMETRIC_MATRICES_H_

/**
 * Vectors of three numbers, and symmetric 3x3 matrices as couplings have them: six numbers, (xx, xy, xz, yy, yz, zz).
 */
namespace cylchain {

inline double dot(const double* a, const double* b) {
    return a[0]*b[0]+a[1]*b[1]+a[2]*b[2];
}

/** Find the product a x b. */
inline void cross(const double* a, const double* b, double* result) {
    result[0] = a[1]*b[2]-a[2]*b[1];
    result[1] = a[2]*b[0]-a[0]*b[2];
    result[2] = a[0]*b[1]-a[1]*b[0];
}

/** Find the product with a vector. */
template <class Number> inline void multiply(const Number* m, const Number* v, Number* result) {
    result[0] = m[0]*v[0]+m[1]*v[1]+m[2]*v[2];
    result[1] = m[1]*v[0]+m[3]*v[1]+m[4]*v[2];
    result[2] = m[2]*v[0]+m[4]*v[1]+m[5]*v[2];
}

/** Set a matrix to size n nT. */
inline void setOuter(double size, const double* n, double* m) {
    m[0] = size*n[0]*n[0];
    m[1] = size*n[0]*n[1];
    m[2] = size*n[0]*n[2];
    m[3] = size*n[1]*n[1];
    m[4] = size*n[1]*n[2];
    m[5] = size*n[2]*n[2];
}

} // namespace cylchain

#endif /*CYLCHAIN_SYMMETRIC_MATRICES_H_*/
