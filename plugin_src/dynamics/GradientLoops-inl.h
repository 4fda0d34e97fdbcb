// Compiled once for each instruction set, which CYLCHAIN_LOOPS names. It does not compile alone.

#include "dynamics/GradientLoops.h"
#include "dynamics/TermBlocks.h"
#include "mechanics/Inline.h"
#include <cstdint>
#include <cstring>

namespace cylchain {
namespace CYLCHAIN_LOOPS {

const int SIZE = TermBlocks::SIZE;

#include "lanes/Transposition-inl.h"

typedef FourOf<double> Sums;

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
            partners[i] = loadFour(partner.response)+loadFour(partner.direction)*ratio;
            if (term+ahead < last)
                __builtin_prefetch(&v.shown[v.partners[term+ahead+i]]);
        }
        transpose<Real>(partners);
        const Real* const k = v.stiffness+6*term;
        const FourOf<Real> xx = loadFour(k), xy = loadFour(k+SIZE), xz = loadFour(k+2*SIZE), yy = loadFour(k+3*SIZE);
        const FourOf<Real> yz = loadFour(k+4*SIZE), zz = loadFour(k+5*SIZE);
        const FourOf<Real>&x = partners[0], &y = partners[1], &z = partners[2];
        const FourOf<Real> pulls[] = {xx*x+xy*y+xz*z, xy*x+yy*y+yz*z, xz*x+yz*y+zz*z};
        for (int coordinate = 0; coordinate < 3; coordinate++) {
            const int place = 3*term+SIZE*coordinate;
            const FourOf<Real> force = loadFour(v.residual+place)+loadFour(v.force+place)*ratio;
            const FourOf<Real> direction = loadFour(v.response+place)+loadFour(v.direction+place)*ratio;
            const FourOf<Real> image = force-pulls[coordinate];
            storeFour(force, v.force+place);
            storeFour(direction, v.direction+place);
            storeFour(image, v.image+place);
            addProduct<Real>(direction, image, sums[coordinate]);
        }
    }
    return total(sums);
}

template <class Real> void move(const GradientVectors<Real>& vectors, int first, int last, Real step) {
    const GradientVectors<Real> v = vectors;
    for (int place = 3*first; place < 3*last; place += SIZE) {
        storeFour(loadFour(v.found+place)+loadFour(v.force+place)*step, v.found+place);
        storeFour(loadFour(v.change+place)+loadFour(v.direction+place)*step, v.change+place);
        storeFour(loadFour(v.residual+place)-loadFour(v.image+place)*step, v.residual+place);
    }
}

template <class Real> double show(const GradientVectors<Real>& vectors, int first, int last) {
    const GradientVectors<Real> v = vectors;
    Sums sums[3] = {};
    for (int term = first; term < last; term += SIZE) {
        FourOf<Real> responses[SIZE] = {}, directions[SIZE] = {};
        for (int coordinate = 0; coordinate < 3; coordinate++) {
            const int place = 3*term+SIZE*coordinate;
            responses[coordinate] = loadFour(v.response+place);
            directions[coordinate] = loadFour(v.direction+place);
            addProduct<Real>(loadFour(v.residual+place), responses[coordinate], sums[coordinate]);
        }
        transpose<Real>(responses);
        transpose<Real>(directions);
        for (int i = 0; i < SIZE; i++) {
            storeFour(responses[i], v.shown[term+i].response);
            storeFour(directions[i], v.shown[term+i].direction);
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
