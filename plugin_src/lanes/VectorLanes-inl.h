// Included into the namespace of an instruction set. It does not compile alone.

/**
 * Numbers, vectors and matrices in the lanes of vector registers.
 */

/** The numbers in lanes, and integers of the same size. */
#ifdef CYLCHAIN_SINGLE_PRECISION
typedef float Scalar;
typedef std::uint32_t Word;
#else
typedef double Scalar;
typedef std::uint64_t Word;
#endif

/** Added to divisors, or the least of them, so that none is zero. */
#ifdef CYLCHAIN_SINGLE_PRECISION
const Scalar LEAST = 1e-6f, TINY = 1e-30f;
#else
const Scalar LEAST = 1e-12, TINY = 1e-300;
#endif

template <int W> struct Lanes {
    typedef Scalar Type __attribute__((vector_size(sizeof(Scalar)*W)));
    typedef Word Bits __attribute__((vector_size(sizeof(Scalar)*W)));
};
template <> struct Lanes<1> {
    typedef Scalar Type;
    typedef Word Bits;
};

/** The number in each lane, and how many lanes there are. */
template <class Real> struct OfLane {
    typedef std::remove_reference_t<decltype(Real{}[0])> Type;
    static constexpr int COUNT = sizeof(Real)/sizeof(Type);
};
template <> struct OfLane<float> {
    typedef float Type;
    static constexpr int COUNT = 1;
};
template <> struct OfLane<double> {
    typedef double Type;
    static constexpr int COUNT = 1;
};
template <class Real> using NumberOf = typename OfLane<Real>::Type;

template <class Real> constexpr int LANE_COUNT = OfLane<Real>::COUNT;

template <class Real> CYLCHAIN_INLINE NumberOf<Real>& lane(Real& value, int i) {
    return reinterpret_cast<NumberOf<Real>*>(&value)[i];
}

template <class Real> CYLCHAIN_INLINE Real root(Real value) {
    Real result;
    for (int i = 0; i < LANE_COUNT<Real>; i++)
        lane(result, i) = std::sqrt(lane(value, i));
    return result;
}

/** A number in all lanes. */
template <class Real> CYLCHAIN_INLINE Real splat(NumberOf<Real> value) {
    return value-Real{};
}

template <class Real> CYLCHAIN_INLINE Real larger(Real a, Real b) {
    return a > b ? a : b;
}

template <class Real> CYLCHAIN_INLINE Real lesser(Real a, Real b) {
    return a < b ? a : b;
}

template <class Real> struct Vector {
    Real x, y, z;
    CYLCHAIN_INLINE Vector operator-() const {return {-x, -y, -z};}
    CYLCHAIN_INLINE Vector operator+(const Vector& v) const {return {x+v.x, y+v.y, z+v.z};}
    CYLCHAIN_INLINE Vector operator-(const Vector& v) const {return {x-v.x, y-v.y, z-v.z};}
    CYLCHAIN_INLINE Vector operator*(Real s) const {return {x*s, y*s, z*s};}
    CYLCHAIN_INLINE Real dot(const Vector& v) const {return x*v.x+y*v.y+z*v.z;}
};

template <class Real> CYLCHAIN_INLINE Vector<Real> crossProduct(const Vector<Real>& a, const Vector<Real>& b) {
    return {a.y*b.z-a.z*b.y, a.z*b.x-a.x*b.z, a.x*b.y-a.y*b.x};
}

/**
 * Two vectors that are orthogonal to a unit vector and to each other (Duff et al., J. Comput. Graph. Tech. 2017, 6, 1).
 */
template <class Real> CYLCHAIN_INLINE void orthogonal(const Vector<Real>& n, Vector<Real>& first,
        Vector<Real>& second) {
    Real sign;
    Vector<Real> copy = n;
    for (int i = 0; i < LANE_COUNT<Real>; i++)
        lane(sign, i) = std::copysign(1.0, lane(copy.z, i));
    const Real a = -1/(sign+n.z), b = n.x*n.y*a;
    first = {1+sign*n.x*n.x*a, sign*b, -sign*n.x};
    second = {b, sign+n.y*n.y*a, -n.y};
}

/** A vector of one lane in all lanes. */
template <class Many, class Real> CYLCHAIN_INLINE Vector<Many> inLanes(const Vector<Real>& v) {
    return {splat<Many>(v.x), splat<Many>(v.y), splat<Many>(v.z)};
}

#include "lanes/Matrix-inl.h"

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

template <class Real, class Number> CYLCHAIN_INLINE Real loaded(const std::vector<Number>& values,
            std::size_t index) {
    Real result;
    for (int i = 0; i < LANE_COUNT<Real>; i++)
        lane(result, i) = values[index*LANE_COUNT<Real>+i];
    return result;
}
