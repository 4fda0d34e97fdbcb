/**
 * This tests conjugate gradients for places that couplings join: with packs that respond as dense matrices say, they
 * find what elimination finds, in both precisions and with every instruction set. Packs have from 1 to 12 places, so
 * that the last blocks of terms are filled up; some couplings hold a place alone, and a pack is coupled to no other.
 */

#include "TestChains.h"
#include "networks/ConjugateGradients.h"
#include <algorithm>
#include <memory>
#include <random>

namespace {

/** A pack whose places are moved by forces as a matrix says. */
class MatrixStep : public PackStep {
public:
    explicit MatrixStep(const vector<Array>& compliance) : compliance(compliance) {
    }
    void respond(const double* forces, double* moves) override {
        respondAs(forces, moves);
    }
    void respond(const float* forces, float* moves) override {
        respondAs(forces, moves);
    }
    void begin(const double*, const double*, const double*, const StepSettings&, const bool*) override {
    }
    int getNumStages() const override {
        return 1;
    }
    void beginStage(int) override {
    }
    void eliminate(const CouplingTerm*, int, double*) override {
    }
    void findCompliances(double*) override {
    }
    void advance(const double*, const ShareOfChange&, bool*, double*) override {
    }
    void findExcessiveChanges(bool*) const override {
    }
    void getPositions(const double*, double*) const override {
    }
    void getDisplacements(double*) const override {
    }
private:
    const vector<Array> compliance;
    template <class Number> void respondAs(const Number* forces, Number* moves) const {
        for (size_t row = 0; row < compliance.size(); row++) {
            double sum = 0;
            for (size_t column = 0; column < compliance.size(); column++)
                sum += compliance[row][column]*forces[TermBlocks::place(column/3, column%3)];
            moves[TermBlocks::place(row/3, row%3)] = sum;
        }
    }
};

/** A symmetric matrix with eigenvalues of the size of one, as products of random numbers. */
vector<Array> drawMatrix(int n, mt19937_64& generator) {
    normal_distribution<double> normal;
    vector<Array> factor(n, Array(n)), result = factor;
    for (Array& row : factor)
        for (double& value : row)
            value = normal(generator);
    for (int i = 0; i < n; i++)
        for (int j = 0; j < n; j++) {
            for (int k = 0; k < n; k++)
                result[i][j] += factor[i][k]*factor[j][k]/n;
            result[i][j] += i == j ? 0.5 : 0;
        }
    return result;
}

const int ENTRIES[3][3] = {{0, 1, 2}, {1, 3, 4}, {2, 4, 5}};

/** Packs, the terms of couplings between them, and what elimination finds. */
struct Problem {
    CoupledTerms terms;
    vector<unique_ptr<PackStep> > packs;
    /** In blocks: how places move without what joins them, the forces that make up for that, and how they move then. */
    Array change, found, solution;
    Problem(const vector<int>& sizes, double stiffness, mt19937_64& generator) {
        const int numPacks = sizes.size();
        terms.first.push_back(0);
        for (int size : sizes) {
            terms.count.push_back(size);
            terms.first.push_back(terms.first.back()+TermBlocks::fill(size));
        }
        terms.terms.resize(terms.getNumTerms());
        terms.partners.assign(terms.getNumTerms(), -1);
        terms.coupled.assign(numPacks, 0);
        vector<int> packOf(terms.getNumTerms(), -1), places;
        for (int pack = 0; pack < numPacks; pack++)
            for (int i = 0; i < sizes[pack]; i++)
                packOf[terms.first[pack]+i] = pack;
        // All but those of the last pack are joined; one is left over if their number is odd.
        for (int i = 0; i < terms.first[numPacks-1]; i++)
            if (packOf[i] >= 0)
                places.push_back(i);
        shuffle(places.begin(), places.end(), generator);
        for (CouplingTerm& term : terms.terms)
            setStiffness(drawMatrix(3, generator), stiffness, term);
        for (size_t i = 0; i+1 < places.size(); i += 2) {
            const int a = places[i], b = places[i+1];
            terms.partners[a] = b;
            terms.partners[b] = a;
            terms.terms[b] = terms.terms[a];
            terms.coupled[packOf[a]] = terms.coupled[packOf[b]] = 1;
        }
        solve(generator);
    }
    vector<PackStep*> getPacks() const {
        vector<PackStep*> result;
        for (const unique_ptr<PackStep>& pack : packs)
            result.push_back(pack.get());
        return result;
    }
private:
    static void setStiffness(const vector<Array>& matrix, double stiffness, CouplingTerm& term) {
        for (int row = 0; row < 3; row++)
            for (int column = 0; column < 3; column++)
                term.stiffness[ENTRIES[row][column]] = stiffness*matrix[row][column];
    }
    /** With the inverse matrices C of packs, each with K of its places: y = y0+C X y. */
    void solve(mt19937_64& generator) {
        normal_distribution<double> normal;
        const int n = 3*terms.getNumTerms();
        change.assign(n, 0.0);
        vector<Array> whole(n, Array(n));
        Array right(n);
        for (int i = 0; i < n; i++)
            whole[i][i] = 1;
        for (size_t pack = 0; pack < terms.count.size(); pack++) {
            const int size = 3*terms.count[pack], first = terms.first[pack];
            vector<Array> matrix = drawMatrix(size, generator), inverse;
            for (int i = 0; i < size; i++)
                for (int k = 0; k < 3; k++)
                    matrix[i][i-i%3+k] += terms.terms[first+i/3].stiffness[ENTRIES[i%3][k]];
            for (int i = 0; i < size; i++) {
                Array unit(size);
                unit[i] = 1;
                inverse.push_back(denseSolution(matrix, unit));
            }
            packs.emplace_back(new MatrixStep(inverse));
            for (int i = 0; i < size; i++) {
                right[3*first+i] = change[TermBlocks::place(first+i/3, i%3)] = normal(generator);
                for (int j = 0; j < size; j++) {
                    const int term = first+j/3, partner = terms.partners[term];
                    for (int k = 0; k < 3 && partner >= 0; k++)
                        whole[3*first+i][3*partner+k] -= inverse[i][j]*terms.terms[term].stiffness[ENTRIES[j%3][k]];
                }
            }
        }
        right = denseSolution(whole, right);
        solution.assign(n, 0.0);
        found.assign(n, 0.0);
        for (int term = 0; term < n/3; term++)
            for (int k = 0; k < 3; k++) {
                solution[TermBlocks::place(term, k)] = right[3*term+k];
                const int partner = terms.partners[term];
                for (int other = 0; other < 3 && partner >= 0; other++)
                    found[TermBlocks::place(term, k)] +=
                            terms.terms[term].stiffness[ENTRIES[k][other]]*right[3*partner+other];
            }
    }
};

/** Solve a problem, with the packs in any order; returns the number of iterations. */
template <class Real> int testProblem(const Problem& problem, double tolerance, double error) {
    const vector<PackStep*> packs = problem.getPacks();
    double largest = 0;
    for (double force : problem.found)
        largest = max(largest, fabs(force));
    Array before;
    ConjugateGradients<Real> gradients;
    for (const Loop& order : {SERIAL, BACKWARDS}) {
        Array found(problem.change.size(), 0.0), moves(found.size(), 0.0);
        check(gradients.solve(packs, problem.terms, tolerance, 0, problem.change, found, order), "it is solved");
        for (size_t pack = 0; pack < packs.size(); pack++) {
            const int first = 3*problem.terms.first[pack];
            packs[pack]->respond(&found[first], &moves[first]);
            for (int i = 0; i < problem.terms.count[pack]; i++)
                for (int k = 0; k < 3; k++) {
                    const int place = TermBlocks::place(problem.terms.first[pack]+i, k);
                    checkClose(problem.solution[place], problem.change[place]+moves[place], 1, error, "moves there");
                    checkClose(problem.found[place], found[place], max(1.0, largest), error, "forces on places");
                }
        }
        check(before.empty() || before == found, "the order of packs changes no bit");
        before = found;
    }
    return gradients.getNumIterations();
}

void testSolutions() {
    mt19937_64 generator(1);
    for (const vector<int>& sizes : {vector<int> {4, 4, 1}, {1, 2, 3}, {9, 5, 6, 7, 8, 3}, {12, 1, 1, 1, 5}})
        for (double stiffness : {0.1, 1.0, 10.0}) {
            const Problem problem(sizes, stiffness, generator);
            testProblem<double>(problem, 1e-24, 1e-9);
            const int most = testProblem<float>(problem, 1e-10, 2e-3);
            const int fewer = testProblem<float>(problem, 0.9, 1e3);
            check(fewer < most, "a rough solution takes fewer iterations");
        }
}

/** Where nothing joins two places, nothing is left to do. */
void testWithoutPartners() {
    mt19937_64 generator(2);
    Problem problem({3, 5}, 1, generator);
    problem.terms.partners.assign(problem.terms.partners.size(), -1);
    problem.terms.coupled.assign(2, 0);
    problem.solution = problem.change;
    problem.found.assign(problem.found.size(), 0.0);
    check(testProblem<double>(problem, 1e-20, 1e-12) == 0, "no iteration");
    check(testProblem<float>(problem, 1e-20, 1e-12) == 0, "no iteration");
}

/** The energy with which iterations begin, and what it is known not to exceed before packs respond. */
void findEnergy(const Problem& problem, double& energy, double& bound) {
    const CoupledTerms& terms = problem.terms;
    Array residual(problem.change.size(), 0.0), response(residual.size(), 0.0);
    energy = bound = 0;
    for (int term = 0; term < terms.getNumTerms(); term++) {
        const int partner = terms.partners[term];
        if (partner < 0)
            continue;
        for (int k = 0; k < 3; k++) {
            const double* const stiffness = terms.terms[term].stiffness;
            double force = 0;
            for (int other = 0; other < 3; other++)
                force += stiffness[ENTRIES[k][other]]*problem.change[TermBlocks::place(partner, other)];
            residual[TermBlocks::place(term, k)] = force;
            bound += force*problem.change[TermBlocks::place(partner, k)];
        }
    }
    for (size_t pack = 0; pack < problem.packs.size(); pack++)
        problem.packs[pack]->respond(&residual[3*terms.first[pack]], &response[3*terms.first[pack]]);
    for (size_t i = 0; i < residual.size(); i++)
        energy += residual[i]*response[i];
}

/** Packs do not respond where what is left is too little whatever they do, and only there. */
void testLittleLeft() {
    mt19937_64 generator(4);
    for (double stiffness : {0.1, 1.0, 10.0, 1000.0}) {
        const Problem problem({4, 7, 2, 3}, stiffness, generator);
        const vector<PackStep*> packs = problem.getPacks();
        double energy, bound;
        findEnergy(problem, energy, bound);
        check(energy > 0 && energy < bound, "the energy is not more than is known");
        auto iterationsTo = [&] (double least) {
            Array found(problem.change.size(), 0.0);
            ConjugateGradients<double> gradients;
            check(gradients.solve(packs, problem.terms, 1e-20, least, problem.change, found, SERIAL), "it is solved");
            const bool none = found == Array(found.size(), 0.0);
            check(none == (gradients.getNumIterations() < 2), "forces are found where there are iterations");
            return gradients.getNumIterations();
        };
        check(iterationsTo(1.001*bound) == 0, "no pack responds");
        check(iterationsTo(0.999*bound) > 0, "packs respond");
        check(iterationsTo(1.001*energy) == 1, "they respond once");
        check(iterationsTo(0.999*energy) > 1, "more than that is left");
    }
}

/** What is not a number ends iterations. */
void testNotANumber() {
    mt19937_64 generator(3);
    const Problem problem({4, 4, 2}, 1, generator);
    const vector<PackStep*> packs = problem.getPacks();
    Array change = problem.change, found(change.size(), 0.0);
    change[0] = NAN;
    ConjugateGradients<float> gradients;
    gradients.solve(packs, problem.terms, 0.1, 0, change, found, SERIAL);
    check(gradients.getNumIterations() < 3, "it ends");
}

} // namespace

int main() {
    return runTests({testSolutions, testWithoutPartners, testLittleLeft, testNotANumber});
}
