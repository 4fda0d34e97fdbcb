// Compiled once for each instruction set, which CYLCHAIN_LOOPS names. It does not compile alone.

#include "dynamics/GradientLoops.h"
#include "dynamics/TermBlocks.h"
#include <cstring>

namespace cylchain {
namespace CYLCHAIN_LOOPS {

// Called functions cannot keep vectors in registers.
#define CYLCHAIN_INLINE inline __attribute__((always_inline))

const int SIZE = TermBlocks::SIZE;

/** One number of each term of a block, or four of one. */
template <class Real> struct Four;
template <> struct Four<float> {
    typedef float Type __attribute__((vector_size(16)));
    typedef int Mask __attribute__((vector_size(16)));
};
template <> struct Four<double> {
    typedef double Type __attribute__((vector_size(32)));
    typedef long long Mask __attribute__((vector_size(32)));
};
template <class Real> using FourOf = typename Four<Real>::Type;
typedef FourOf<double> Sums;

template <class Real> CYLCHAIN_INLINE FourOf<Real> load(const Real* values) {
    FourOf<Real> result;
    std::memcpy(&result, values, sizeof(result));
    return result;
}

template <class Real> CYLCHAIN_INLINE void store(const FourOf<Real>& values, Real* result) {
    std::memcpy(result, &values, sizeof(values));
}

/** Some four of the eight numbers of a and b. */
#ifdef __clang__
#define CYLCHAIN_CHOOSE(a, b, ...) __builtin_shufflevector(a, b, __VA_ARGS__)
#else
#define CYLCHAIN_CHOOSE(a, b, ...) __builtin_shuffle(a, b, (typename Four<Real>::Mask) {__VA_ARGS__})
#endif

/** Turn rows into columns. */
template <class Real> CYLCHAIN_INLINE void transpose(FourOf<Real>* rows) {
    const FourOf<Real> a = CYLCHAIN_CHOOSE(rows[0], rows[1], 0, 4, 1, 5);
    const FourOf<Real> b = CYLCHAIN_CHOOSE(rows[2], rows[3], 0, 4, 1, 5);
    const FourOf<Real> c = CYLCHAIN_CHOOSE(rows[0], rows[1], 2, 6, 3, 7);
    const FourOf<Real> d = CYLCHAIN_CHOOSE(rows[2], rows[3], 2, 6, 3, 7);
    rows[0] = CYLCHAIN_CHOOSE(a, b, 0, 1, 4, 5);
    rows[1] = CYLCHAIN_CHOOSE(a, b, 2, 3, 6, 7);
    rows[2] = CYLCHAIN_CHOOSE(c, d, 0, 1, 4, 5);
    rows[3] = CYLCHAIN_CHOOSE(c, d, 2, 3, 6, 7);
}

/** Sums are in double precision. */
template <class Real> CYLCHAIN_INLINE void addProduct(const FourOf<Real>& a, const FourOf<Real>& b, Sums& sums) {
    sums += __builtin_convertvector(a, Sums)*__builtin_convertvector(b, Sums);
}

CYLCHAIN_INLINE double total(const Sums* sums) {
    const Sums all = sums[0]+sums[1]+sums[2];
    return all[0]+all[1]+all[2]+all[3];
}

template <class Real> double turn(const GradientVectors<Real>& vectors, int first, int last, Real ratio) {
    // What is far from the processor's caches is asked for this many terms ahead.
    const int ahead = 16;
    const GradientVectors<Real> v = vectors;
    Sums sums[3] = {};
    for (int term = first; term < last; term += SIZE) {
        FourOf<Real> partners[SIZE];
        for (int i = 0; i < SIZE; i++) {
            const ShownTerm<Real>& partner = v.shown[v.partners[term+i]];
            partners[i] = load(partner.response)+load(partner.direction)*ratio;
            if (term+ahead < last)
                __builtin_prefetch(&v.shown[v.partners[term+ahead+i]]);
        }
        transpose<Real>(partners);
        const Real* const k = v.stiffness+6*term;
        const FourOf<Real> xx = load(k), xy = load(k+SIZE), xz = load(k+2*SIZE), yy = load(k+3*SIZE);
        const FourOf<Real> yz = load(k+4*SIZE), zz = load(k+5*SIZE);
        const FourOf<Real>&x = partners[0], &y = partners[1], &z = partners[2];
        const FourOf<Real> pulls[] = {xx*x+xy*y+xz*z, xy*x+yy*y+yz*z, xz*x+yz*y+zz*z};
        for (int coordinate = 0; coordinate < 3; coordinate++) {
            const int place = 3*term+SIZE*coordinate;
            const FourOf<Real> force = load(v.residual+place)+load(v.force+place)*ratio;
            const FourOf<Real> direction = load(v.response+place)+load(v.direction+place)*ratio;
            const FourOf<Real> image = force-pulls[coordinate];
            store(force, v.force+place);
            store(direction, v.direction+place);
            store(image, v.image+place);
            addProduct<Real>(direction, image, sums[coordinate]);
        }
    }
    return total(sums);
}

template <class Real> void move(const GradientVectors<Real>& vectors, int first, int last, Real step) {
    const GradientVectors<Real> v = vectors;
    for (int place = 3*first; place < 3*last; place += SIZE) {
        store(load(v.found+place)+load(v.force+place)*step, v.found+place);
        store(load(v.change+place)+load(v.direction+place)*step, v.change+place);
        store(load(v.residual+place)-load(v.image+place)*step, v.residual+place);
    }
}

template <class Real> double show(const GradientVectors<Real>& vectors, int first, int last) {
    const GradientVectors<Real> v = vectors;
    Sums sums[3] = {};
    for (int term = first; term < last; term += SIZE) {
        FourOf<Real> responses[SIZE] = {}, directions[SIZE] = {};
        for (int coordinate = 0; coordinate < 3; coordinate++) {
            const int place = 3*term+SIZE*coordinate;
            responses[coordinate] = load(v.response+place);
            directions[coordinate] = load(v.direction+place);
            addProduct<Real>(load(v.residual+place), responses[coordinate], sums[coordinate]);
        }
        transpose<Real>(responses);
        transpose<Real>(directions);
        for (int i = 0; i < SIZE; i++) {
            store(responses[i], v.shown[term+i].response);
            store(directions[i], v.shown[term+i].direction);
        }
    }
    return total(sums);
}

static const GradientLoops LOOPS = {
    {turn<float>, move<float>, show<float>},
    {turn<double>, move<double>, show<double>}
};

} // namespace CYLCHAIN_LOOPS
} // namespace cylchain
