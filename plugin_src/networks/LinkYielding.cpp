#include "networks/LinkYielding.h"
#include "mechanics/SymmetricMatrices.h"
#include <algorithm>

using namespace cylchain;
using namespace std;

namespace {

/** What one minus the product of stiffness and compliances is at least: steps in either precision know no less. */
const double LEAST_YIELDING = 1e-13, LEAST_YIELDING_IN_SINGLE_PRECISION = 1e-5;

/** Find the product of two matrices, row by row. */
void multiplyMatrices(const double* a, const double* b, double* result) {
    for (int row = 0; row < 3; row++)
        for (int column = 0; column < 3; column++)
            result[3*row+column] = a[3*row]*b[column]+a[3*row+1]*b[3+column]+a[3*row+2]*b[6+column];
}

void unfold(const double* symmetric, double* matrix) {
    const int places[] = {0, 1, 2, 1, 3, 4, 2, 4, 5};
    for (int k = 0; k < 9; k++)
        matrix[k] = symmetric[places[k]];
}

void transpose(const double* matrix, double* result) {
    for (int row = 0; row < 3; row++)
        for (int column = 0; column < 3; column++)
            result[3*row+column] = matrix[3*column+row];
}

/** Invert a matrix whose determinant is positive; where it is not, false. */
bool invertMatrix(const double* m, double* result) {
    const double cofactors[] = {m[4]*m[8]-m[5]*m[7], m[2]*m[7]-m[1]*m[8], m[1]*m[5]-m[2]*m[4],
            m[5]*m[6]-m[3]*m[8], m[0]*m[8]-m[2]*m[6], m[2]*m[3]-m[0]*m[5],
            m[3]*m[7]-m[4]*m[6], m[1]*m[6]-m[0]*m[7], m[0]*m[4]-m[1]*m[3]};
    const double determinant = m[0]*cofactors[0]+m[1]*cofactors[3]+m[2]*cofactors[6];
    for (int k = 0; k < 9; k++)
        result[k] = cofactors[k]/determinant;
    // Written so that NaN is not.
    return determinant > 0;
}

} // namespace

void LinkYielding::setEquations(const vector<CouplingEquation>& equations, int numChains) {
    links.clear();
    for (size_t i = 0; i < equations.size(); i++) {
        const CouplingEquation& equation = equations[i];
        if (equation.places[0].pack < 0 || equation.places[1].pack < 0)
            continue;
        Link link = {};
        link.equation = i;
        for (int side = 0; side < 2; side++)
            link.chains[side] = equation.places[side].chain;
        copy_n(equation.stiffness, 6, link.stiffness);
        links.push_back(link);
    }
    firstSide.assign(numChains+1, 0);
    for (const Link& link : links)
        for (int chain : link.chains)
            firstSide[chain+1]++;
    for (int chain = 0; chain < numChains; chain++)
        firstSide[chain+1] += firstSide[chain];
    sides.resize(2*links.size());
    numberOfSide.assign(2*links.size(), 0);
    vector<int> counts(numChains, 0);
    for (int i = 0; i < (int) links.size(); i++)
        for (int side = 0; side < 2; side++) {
            const int chain = links[i].chains[side];
            numberOfSide[2*i+side] = counts[chain];
            sides[firstSide[chain]+counts[chain]++] = {i, side};
        }
}

void LinkYielding::find(const vector<PackStep*>& packs, CoupledEquations& coupled, Precision precision,
        const Loop& loop) {
    if (links.empty())
        return;
    const double least = precision == Precision::Double ? LEAST_YIELDING : LEAST_YIELDING_IN_SINGLE_PRECISION;
    coupled.findCompliances(packs, compliances, loop);
    for (Link& link : links) {
        double stiffness[9], byPlace[2][9], product[9], remaining[9], turned[9];
        unfold(link.stiffness, stiffness);
        for (int side = 0; side < 2; side++) {
            double compliance[9];
            unfold(&compliances[12*link.equation+6*side], compliance);
            multiplyMatrices(stiffness, compliance, byPlace[side]);
        }
        multiplyMatrices(byPlace[1], byPlace[0], product);
        for (int k = 0; k < 9; k++)
            remaining[k] = (k%4 == 0 ? 1+least : 0)-product[k];
        double inverse[9];
        // What rounding has left nothing of is as if the other place were held.
        if (!invertMatrix(remaining, inverse))
            fill_n(inverse, 9, 0.0);
        multiplyMatrices(inverse, stiffness, link.between);
        transpose(link.between, turned);
        multiplyMatrices(byPlace[1], turned, link.ofPlace[0]);
        multiplyMatrices(byPlace[0], link.between, link.ofPlace[1]);
    }
}
