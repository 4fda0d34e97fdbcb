// Compiled once for each instruction set, which CYLCHAIN_LOOPS names. It does not compile alone.

#include "dynamics/TermBlocks.h"
#include "mechanics/Inline.h"
#include "networks/GradientLoops.h"
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

template <class Real> double findEnergy(const GradientVectors<Real>& vectors, int first, int last) {
    const GradientVectors<Real> v = vectors;
    Sums sums[3] = {};
    for (int term = first; term < last; term += SIZE)
        for (int coordinate = 0; coordinate < 3; coordinate++) {
            const int place = 3*term+SIZE*coordinate;
            addProduct<Real>(loadFour(v.residual+place), loadFour(v.response+place), sums[coordinate]);
        }
    return total(sums);
}

template <class Real> double findImages(const GradientVectors<Real>& vectors, int first, int last) {
    // What is far from the processor's caches is asked for this many terms ahead.
    const int ahead = 16;
    const GradientVectors<Real> v = vectors;
    Sums sums[3] = {};
    for (int term = first; term < last; term += SIZE) {
        const int* const partners = v.partners+term;
        if (term+ahead < last)
            for (int i = 0; i < SIZE; i++)
                __builtin_prefetch(v.response+partners[ahead+i]+SIZE);
        FourOf<Real> ofPartners[3];
        for (int coordinate = 0; coordinate < 3; coordinate++) {
            const Real* const response = v.response+SIZE*coordinate;
            ofPartners[coordinate] = FourOf<Real> {response[partners[0]], response[partners[1]], response[partners[2]],
                    response[partners[3]]};
        }
        const Real* const k = v.stiffness+6*term;
        const FourOf<Real> xx = loadFour(k), xy = loadFour(k+SIZE), xz = loadFour(k+2*SIZE), yy = loadFour(k+3*SIZE);
        const FourOf<Real> yz = loadFour(k+4*SIZE), zz = loadFour(k+5*SIZE);
        const FourOf<Real>&x = ofPartners[0], &y = ofPartners[1], &z = ofPartners[2];
        const FourOf<Real> pulls[] = {xx*x+xy*y+xz*z, xy*x+yy*y+yz*z, xz*x+yz*y+zz*z};
        for (int coordinate = 0; coordinate < 3; coordinate++) {
            const int place = 3*term+SIZE*coordinate;
            const FourOf<Real> image = loadFour(v.residual+place)-pulls[coordinate];
            storeFour(image, v.image+place);
            addProduct<Real>(loadFour(v.response+place), image, sums[coordinate]);
        }
    }
    return total(sums);
}

template <class Real> void moveFirst(const GradientVectors<Real>& vectors, int first, int last, Real step) {
    const GradientVectors<Real> v = vectors;
    for (int place = 3*first; place < 3*last; place += SIZE) {
        const FourOf<Real> residual = loadFour(v.residual+place), image = loadFour(v.image+place);
        storeFour(residual, v.force+place);
        storeFour(image, v.imageOfDirection+place);
        storeFour(residual*step, v.found+place);
        storeFour(residual-image*step, v.residual+place);
    }
}

template <class Real> void move(const GradientVectors<Real>& vectors, int first, int last, Real step, Real ratio) {
    const GradientVectors<Real> v = vectors;
    for (int place = 3*first; place < 3*last; place += SIZE) {
        const FourOf<Real> residual = loadFour(v.residual+place);
        const FourOf<Real> force = residual+loadFour(v.force+place)*ratio;
        const FourOf<Real> image = loadFour(v.image+place)+loadFour(v.imageOfDirection+place)*ratio;
        storeFour(force, v.force+place);
        storeFour(image, v.imageOfDirection+place);
        storeFour(loadFour(v.found+place)+force*step, v.found+place);
        storeFour(residual-image*step, v.residual+place);
    }
}

static const GradientLoops LOOPS = {
    {findEnergy<float>, findImages<float>, moveFirst<float>, move<float>},
    {findEnergy<double>, findImages<double>, moveFirst<double>, move<double>}
};

} // namespace CYLCHAIN_LOOPS
} // namespace cylchain
