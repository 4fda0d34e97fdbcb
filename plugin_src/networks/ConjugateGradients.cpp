#include "networks/ConjugateGradients.h"
#include "dynamics/TermBlocks.h"
#include "mechanics/Prefetch.h"
#include "mechanics/SymmetricMatrices.h"
#include <algorithm>
#include <cstddef>
#include <type_traits>

using namespace cylchain;
using namespace std;

namespace {

const int LARGEST_NUMBER_OF_ITERATIONS = 1000;
/** Where energies grow by more, single precision has rounded away what matters: in stiff links of free particles. */
const double LARGEST_GROWTH = 1e6;

/** Let values have room for as many as needed. Their number changes with each iteration of a step. */
template <class Value> void makeRoom(size_t count, vector<Value>& values) {
    if (values.size() < count)
        values.resize(count);
}

template <class Real> const GradientKernels<Real>& kernels() {
    if constexpr (is_same<Real, float>::value)
        return gradientLoops().single;
    else
        return gradientLoops().twice;
}

} // namespace

/**
 * Take the terms of a pack: the first residuals are what X makes of the moves without it. Returns no less than their
 * energy r P^-1 r: P has the stiffness K of each coupling at its places, so that the energy is at most r K^-1 r.
 */
template <class Real> double ConjugateGradients<Real>::begin(const CoupledTerms& all, int pack,
            const vector<double>& change) {
    const int first = all.first[pack], last = all.first[pack+1], end = first+all.count[pack];
    for (vector<Real>* values : {&residual, &response})
        fill(values->begin()+3*first, values->begin()+3*last, Real(0));
    double energy = 0;
    for (int i = first; i < last; i++) {
        if (i+AHEAD < end && all.partners[i+AHEAD] >= 0)
            for (int coordinate = 0; coordinate < 3; coordinate++)
                prefetch(&change[TermBlocks::place(all.partners[i+AHEAD], coordinate)]);
        Real* const k = &stiffness[6*(i-i%TermBlocks::SIZE)+i%TermBlocks::SIZE];
        const bool joined = i < end && all.partners[i] >= 0;
        const int partner = joined ? all.partners[i] : i;
        partners[i] = TermBlocks::place(partner, 0);
        for (int entry = 0; entry < 6; entry++)
            k[TermBlocks::SIZE*entry] = joined ? all.terms[i].stiffness[entry] : 0;
        if (!joined)
            continue;
        double ofPartner[3], pull[3];
        for (int coordinate = 0; coordinate < 3; coordinate++)
            ofPartner[coordinate] = change[TermBlocks::place(partner, coordinate)];
        multiply(all.terms[i].stiffness, ofPartner, pull);
        for (int coordinate = 0; coordinate < 3; coordinate++) {
            residual[TermBlocks::place(i, coordinate)] = pull[coordinate];
            energy += pull[coordinate]*ofPartner[coordinate];
        }
    }
    return energy;
}

template <class Real> bool ConjugateGradients<Real>::solve(const vector<PackStep*>& packs, const CoupledTerms& all,
            double tolerance, double leastEnergy, const vector<double>& change, vector<double>& found,
            const Loop& loop) {
    const GradientKernels<Real>& kernel = kernels<Real>();
    const size_t count = all.getNumTerms();
    for (vector<Real>* values : {&residual, &response, &image, &force, &imageOfDirection, &ownFound})
        makeRoom(3*count, *values);
    makeRoom(6*count, stiffness);
    makeRoom(count, partners);
    sums.assign(packs.size(), 0.0);
    const GradientVectors<Real> vectors = {residual.data(), response.data(), image.data(), force.data(),
            imageOfDirection.data(), ownFound.data(), stiffness.data(), partners.data()};
    auto forCoupled = [&] (auto function) {
        loop(packs.size(), [&] (int pack) {
            if (all.coupled[pack])
                function(pack, all.first[pack], all.first[pack+1]);
        });
    };
    auto total = [&] () {
        double sum = 0;
        for (double ofPack : sums)
            sum += ofPack;
        return sum;
    };
    auto respondAfter = [&] (auto function) {
        forCoupled([&] (int pack, int first, int last) {
            if (pack+1 < (int) packs.size() && all.coupled[pack+1])
                packs[pack+1]->prefetchElimination();
            function(first, last);
            // Energies do not see what moves nothing, so that it would grow.
            if (packs[pack]->mayMoveTogether())
                packs[pack]->keepWhatMoves(&residual[3*first]);
            packs[pack]->respond(&residual[3*first], &response[3*first]);
            sums[pack] = kernel.findEnergy(vectors, first, last);
        });
        iterations++;
    };
    forCoupled([&] (int pack, int, int) {
        sums[pack] = begin(all, pack, change);
    });
    iterations = 0;
    if (total() <= leastEnergy)
        return true;
    respondAfter([] (int, int) {});
    double energy = total();
    const double least = max(tolerance*energy, leastEnergy);
    const double largest = LARGEST_GROWTH*energy;
    double ratio = 0, step = 0;
    while (energy > least && iterations < LARGEST_NUMBER_OF_ITERATIONS) {
        forCoupled([&] (int pack, int first, int last) {
            sums[pack] = kernel.findImages(vectors, first, last);
        });
        // The product of the direction and its image.
        const double product = total()-(ratio == 0 ? 0 : ratio*energy/step);
        step = energy/product;
        respondAfter([&] (int first, int last) {
            if (ratio == 0)
                kernel.moveFirst(vectors, first, last, step);
            else
                kernel.move(vectors, first, last, step, ratio);
        });
        const double before = energy;
        energy = total();
        ratio = energy/before;
        // Written so that NaN is too large.
        if (is_same<Real, float>::value && !(product > 0 && energy >= -least && energy < largest))
            return false;
    }
    if (is_same<Real, float>::value && energy > least)
        return false;
    if (hasFound())
        loop(packs.size(), [&] (int pack) {
            const int first = 3*all.first[pack], last = 3*all.first[pack+1];
            if (all.coupled[pack])
                copy(ownFound.begin()+first, ownFound.begin()+last, found.begin()+first);
            else
                fill(found.begin()+first, found.begin()+last, 0.0);
        });
    return true;
}

template class cylchain::ConjugateGradients<float>;
template class cylchain::ConjugateGradients<double>;
