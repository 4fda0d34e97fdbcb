#ifndef CYLCHAIN_COUPLED_EQUATIONS_H_
#define CYLCHAIN_COUPLED_EQUATIONS_H_

#include "dynamics/PackStep.h"
#include "mechanics/Loop.h"
#include "networks/ChainPlaces.h"
#include "networks/ConjugateGradients.h"
#include <array>
#include <memory>
#include <vector>

namespace cylchain {

/** A flag for each lane of each pack. */
typedef std::vector<std::unique_ptr<bool[]> > LaneFlags;
/** A flag for each pack. */
typedef std::vector<char> PackFlags;

/**
 * A coupling in the equations of an iteration: a force on its first place, and the opposite one on the second, and how
 * much less force there is for each displacement of the first against the second, a symmetric matrix (xx, xy, xz, yy,
 * yz, zz) without negative eigenvalues. A place that is not on a chain does not move.
 */
struct CouplingEquation {
    PlaceOnChain places[2];
    double force[3], stiffness[6];
};

/**
 * The linear equations of an iteration for all chains of an implicit step, and their solution.
 *
 * With A of all chains, block by block, and couplings with S = S_1-S_2 between places 1 and 2, they are
 *
 *     (A + sum S^T K S) change = right + sum S^T F.
 *
 * Of S^T K S, what concerns one place alone, S_1^T K S_1 and S_2^T K S_2, lies inside the band of its chain and is
 * eliminated with it: that is P. The rest, X, is left to conjugate gradients with the preconditioner P, beginning with
 * P^-1 right: all residuals are forces on places of couplings then, and so are all vectors of the method; a product
 * with P^-1 is one substitution along chains. All sums are in an order that does not depend on threads.
 */
class CoupledEquations {
public:
    /** How well the equations of an iteration are solved. */
    struct Demands {
        /** Whether tensions of segments must be right, not moves alone. */
        bool forTensions = false;
        /** See ImplicitCouplings::getStiffness(), getDemandingStiffness() and getRelativeTolerance(). */
        double stiffness = 0, demandingStiffness = 0, tolerance = 1;
        /** Whether the vectors of the method may be in single precision, as those of packs are. */
        bool single = false;
    };
    /**
     * Linearise packs and solve the equations, to within a tolerance of energy.
     *
     * @param active  the packs that take part; others stay where they are
     * @return false if single precision was asked for, and did not do
     */
    bool solve(const std::vector<PackStep*>& packs, const PackFlags& active,
            const std::vector<CouplingEquation>& equations, double kT, const Demands& demands, const Loop& loop);
    /** Find how the places of equations from a number on will move against each other, before advance(). */
    void predictMoves(const std::vector<PackStep*>& packs, std::size_t first, const Loop& loop);
    /**
     * Add forces on the places of some equations, which join no places, to those of the equations that have been
     * solved.
     *
     * @param first  the first of these equations; they are the last ones
     * @param loads  the force on the first place of each, opposite to that on the second: three numbers
     */
    void push(const std::vector<PackStep*>& packs, std::size_t first, const std::vector<double>& loads,
            const Demands& demands, const Loop& loop);
    /** How much more a place of one of these equations moves with them. */
    std::array<double, 3> getPushedMove(std::size_t equation, int side) const;
    /** The terms of a pack: the first of them, and how many there are. */
    int firstTerm(int pack) const {
        return gathered.first[pack];
    }
    int countTerms(int pack) const {
        return gathered.count[pack];
    }
    /** The term of an equation's side. */
    int getTerm(std::size_t equation, int side) const {
        return termOf[2*equation+side];
    }
    /** Whether any equation joins two places. */
    bool joinsPlaces() const {
        return joins;
    }
    /** End the iteration of the packs that take part, with a share of the changes. */
    void advance(const std::vector<PackStep*>& packs, const PackFlags& active, const ShareOfChange& share,
            LaneFlags& unfinished, const Loop& loop);
    /** For each equation, how much its first place moves against the second with all of the changes: three numbers. */
    const std::vector<double>& getMoves() const {
        return moves;
    }
    /**
     * Find how a force on each place of each equation moves that place: two symmetric matrices for each equation. What
     * couplings pass on from chain to chain is left out, but each couplings' own stiffness at its places is there.
     */
    void findCompliances(const std::vector<PackStep*>& packs, std::vector<double>& compliances, const Loop& loop);
    /**
     * Tell the packs that need it how stiff what holds each place is, with the other place of its coupling as mobile as
     * it is by itself: with the compliance C of that place, K-K C K.
     */
    void findJointStiffness(const std::vector<PackStep*>& packs, const Loop& loop);
    /** The number of substitutions that the last call of solve() took. */
    int getNumIterations() const {
        return iterations;
    }
private:
    bool hasSamePlaces(const std::vector<CouplingEquation>& equations, const PackFlags& active, const Loop& loop);
    void sortPlaces(const std::vector<CouplingEquation>& equations, const PackFlags& active);
    /** @return whether the terms are those of the last iteration */
    bool gatherTerms(const std::vector<CouplingEquation>& equations, const PackFlags& active,
            const Loop& loop);
    bool findForces(const std::vector<PackStep*>& packs, const Demands& demands, const std::vector<double>& ofPlaces,
            std::vector<double>& forces, const Loop& loop);
    void addResponses(const std::vector<PackStep*>& packs, const std::vector<double>& forces,
            std::vector<double>& ofPlaces, const Loop& loop) const;
    void findMoves(std::size_t first, const std::vector<double>& ofPlaces, std::vector<double>& result,
            const Loop& loop) const;
    void noteForces();
    void tellForces(const std::vector<PackStep*>& packs, bool areSame);
    void findCompliancesOfTerms(const std::vector<PackStep*>& packs, const Loop& loop);
    /** One for each place on a chain. */
    CoupledTerms gathered;
    /** For each equation and side, the number of its term, or -1. */
    std::vector<int> termOf;
    /** For each equation and side, the place by which it has been sorted, and the packs that took part then. */
    struct SortedPlace {
        int pack, node, lane;
    };
    std::vector<SortedPlace> sortedPlaces;
    PackFlags activeOfTerms;
    /** In blocks of terms: how places move without what joins them, and then with it, and the forces found. */
    std::vector<double> change, found, pushed, foundByPush;
    /** Whether there are such forces, and whether any equation joins two places. */
    bool hasFound = false, joins = false;
    double least = 0, tighter = 1;
    ConjugateGradients<float> single;
    ConjugateGradients<double> twice;
    std::vector<double> moves, compliancesOfTerms, jointStiffness;
    /** For packs that may move together, three numbers for each term: see PackStep::setExpectedForces(). */
    std::vector<double> expected;
    std::vector<int> firstOfPack, firstOfNode;
    int iterations = 0;
};

} // namespace cylchain

#endif /*CYLCHAIN_COUPLED_EQUATIONS_H_*/
