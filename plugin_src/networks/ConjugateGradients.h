#ifndef CYLCHAIN_CONJUGATE_GRADIENTS_H_
#define CYLCHAIN_CONJUGATE_GRADIENTS_H_

#include "dynamics/PackStep.h"
#include "mechanics/Loop.h"
#include "networks/GradientLoops.h"
#include <vector>

namespace cylchain {

/** Both sides of all couplings of an iteration: pack by pack, each beginning with a block of its own. */
struct CoupledTerms {
    /** In the order of their nodes; those that fill up blocks are not used. */
    std::vector<CouplingTerm> terms;
    /** For each term, that of the other place of its coupling, or -1. */
    std::vector<int> partners;
    /** Where the terms of each pack begin, and how many there are; behind the last pack, all of them. */
    std::vector<int> first, count;
    /** Packs that no coupling joins to another place take no part in iterations. */
    std::vector<char> coupled;
    int getNumTerms() const {
        return first.empty() ? 0 : first.back();
    }
};

/**
 * Conjugate gradients for the equations of an iteration of an implicit step: see CoupledEquations.
 *
 * With the preconditioner P and the rest X of the matrix A = P-X, residuals are forces r on places, and their responses
 * u = P^-1 r. X joins places of different terms: its product is that of K with the partner's vector. Directions p =
 * u+beta p are not needed, but their forces P p = r+beta P p are, whose sum is the solution, and their images A p =
 * A u+beta A p, with A u = r-X u. So an iteration is a substitution along chains, and two passes over the terms, and
 * partners look at responses alone. The step along p follows from r.u and u.A u: Chronopoulos and Gear, J. Comput.
 * Appl. Math. 1989, 25, 153.
 */
template <class Real> class ConjugateGradients {
public:
    /**
     * Solve the equations until what is left of the energy r P^-1 r is less than a part of it, or than some energy.
     *
     * @param packs   they have eliminated their nodes
     * @param change  how places move without X, in blocks
     * @param found   receives the forces on places that make up for X, in blocks, if hasFound()
     * @return false where numbers in single precision do not get there: then nothing is found
     */
    bool solve(const std::vector<PackStep*>& packs, const CoupledTerms& terms, double tolerance, double least,
            const std::vector<double>& change, std::vector<double>& found, const Loop& loop);
    /** The number of substitutions that the last call of solve() took. */
    int getNumIterations() const {
        return iterations;
    }
    /** Whether it has found forces: there are none where the first substitution shows that little is left. */
    bool hasFound() const {
        return iterations > 1;
    }
private:
    double begin(const CoupledTerms& terms, int pack, const std::vector<double>& change);
    std::vector<Real> residual, response, image, force, imageOfDirection, ownFound, stiffness;
    std::vector<int> partners;
    std::vector<double> sums;
    int iterations = 0;
};

extern template class ConjugateGradients<float>;
extern template class ConjugateGradients<double>;

} // namespace cylchain

#endif /*CYLCHAIN_CONJUGATE_GRADIENTS_H_*/
