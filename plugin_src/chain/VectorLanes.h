/**
 * Numbers, vectors and matrices in the lanes of vector registers. ChainLoops.h includes this file into the namespace of an
 * instruction set.
 */

// Called functions cannot keep vectors in registers.
#define CYLCHAIN_INLINE inline __attribute__((always_inline))

template <int W> struct Lanes {
    typedef double Type __attribute__((vector_size(8*W)));
    typedef std::uint64_t Bits __attribute__((vector_size(8*W)));
};
template <> struct Lanes<1> {
    typedef double Type;
    typedef std::uint64_t Bits;
};

template <class Real> CYLCHAIN_INLINE double& lane(Real& value, int i) {
    return reinterpret_cast<double*>(&value)[i];
}

template <class Real> CYLCHAIN_INLINE Real root(Real value) {
    Real result;
    for (int i = 0; i < (int) (sizeof(Real)/sizeof(double)); i++)
        lane(result, i) = std::sqrt(lane(value, i));
    return result;
}

template <class Real> struct Vector {
    Real x, y, z;
    CYLCHAIN_INLINE Vector operator+(const Vector& v) const {return {x+v.x, y+v.y, z+v.z};}
    CYLCHAIN_INLINE Vector operator-(const Vector& v) const {return {x-v.x, y-v.y, z-v.z};}
    CYLCHAIN_INLINE Vector operator*(Real s) const {return {x*s, y*s, z*s};}
    CYLCHAIN_INLINE Real dot(const Vector& v) const {return x*v.x+y*v.y+z*v.z;}
};

template <class Real> CYLCHAIN_INLINE Vector<Real> crossProduct(const Vector<Real>& a, const Vector<Real>& b) {
    return {a.y*b.z-a.z*b.y, a.z*b.x-a.x*b.z, a.x*b.y-a.y*b.x};
}

/** A symmetric 3x3 matrix. */
template <class Real> struct Symmetric {
    Real xx, yx, yy, zx, zy, zz;
    Vector<Real> operator*(const Vector<Real>& v) const {
        return {xx*v.x+yx*v.y+zx*v.z, yx*v.x+yy*v.y+zy*v.z, zx*v.x+zy*v.y+zz*v.z};
    }
    /** Add s 1 + r tt. */
    void addAxial(Real s, Real r, const Vector<Real>& t) {
        const Vector<Real> rt = t*r;
        xx += s+rt.x*t.x;
        yx += rt.y*t.x;
        yy += s+rt.y*t.y;
        zx += rt.z*t.x;
        zy += rt.z*t.y;
        zz += s+rt.z*t.z;
    }
    Symmetric operator-(const Symmetric& m) const {
        return {xx-m.xx, yx-m.yx, yy-m.yy, zx-m.zx, zy-m.zy, zz-m.zz};
    }
    Symmetric inverse(Real scale) const {
        Symmetric c = {yy*zz-zy*zy, zx*zy-yx*zz, xx*zz-zx*zx, yx*zy-yy*zx, yx*zx-xx*zy, xx*yy-yx*yx};
        const Real factor = scale/(xx*c.xx+yx*c.yx+zx*c.zx);
        return {c.xx*factor, c.yx*factor, c.yy*factor, c.zx*factor, c.zy*factor, c.zz*factor};
    }
};

#include "Matrix.h"

/** Memory that a thread keeps between calls, aligned for vector registers. */
class Scratch {
public:
    ~Scratch() {
        std::free(data);
    }
    template <class T> T* reserve(std::size_t count) {
        const std::size_t bytes = (count*sizeof(T)+63)/64*64;
        if (bytes > size) {
            std::free(data);
            data = std::aligned_alloc(64, bytes);
            if (data == NULL)
                throw std::bad_alloc();
            size = bytes;
        }
        return static_cast<T*>(data);
    }
private:
    void* data = NULL;
    std::size_t size = 0;
};

template <class Real> CYLCHAIN_INLINE Real loaded(const std::vector<double>& values, std::size_t index) {
    Real result;
    for (int i = 0; i < (int) (sizeof(Real)/sizeof(double)); i++)
        lane(result, i) = values[index*(sizeof(Real)/sizeof(double))+i];
    return result;
}
