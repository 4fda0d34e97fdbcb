#include "networks/BodyEquations.h"
#include "mechanics/SymmetricMatrices.h"
#include <algorithm>

using namespace cylchain;
using namespace std;

namespace {

/** Of a planar body: it neither moves across its plane nor turns about directions in it. */
const int ACROSS_PLANE[] = {2, 3, 4};

/** How far a place moves by each of the six unknowns. */
struct PlaceMoves {
    double moves[6][3];
    explicit PlaceMoves(const double* arm) {
        for (int i = 0; i < 6; i++) {
            double unit[6] = {};
            unit[i] = 1;
            BodyEquations::findMove(unit, arm, moves[i]);
        }
    }
};

} // namespace

void BodyEquations::findMove(const double* change, const double* arm, double* move) {
    cross(change+3, arm, move);
    for (int k = 0; k < 3; k++)
        move[k] += change[k];
}

void BodyEquations::addForce(const double* force, const double* arm, double* sums) {
    double torque[3];
    cross(arm, force, torque);
    for (int k = 0; k < 3; k++) {
        sums[k] += force[k];
        sums[3+k] += torque[k];
    }
}

void BodyEquations::addBlock(const double* block, double factor, int first, double* matrix) {
    int entry = 0;
    for (int row = 0; row < 3; row++)
        for (int column = row; column < 3; column++, entry++) {
            matrix[6*(first+row)+first+column] += factor*block[entry];
            if (column > row)
                matrix[6*(first+column)+first+row] += factor*block[entry];
        }
}

void BodyEquations::addStiffness(const double* stiffness, const double* arm, double* matrix) {
    const PlaceMoves place(arm);
    for (int i = 0; i < 6; i++) {
        double force[3];
        multiply(stiffness, place.moves[i], force);
        for (int j = 0; j < 6; j++)
            matrix[6*j+i] += dot(place.moves[j], force);
    }
}

void BodyEquations::findCompliance(const double* inverse, const double* arm, double* compliance) {
    const PlaceMoves place(arm);
    double half[6][3] = {};
    for (int i = 0; i < 6; i++)
        for (int j = 0; j < 6; j++)
            for (int k = 0; k < 3; k++)
                half[i][k] += inverse[6*i+j]*place.moves[j][k];
    int entry = 0;
    for (int row = 0; row < 3; row++)
        for (int column = row; column < 3; column++, entry++) {
            compliance[entry] = 0;
            for (int i = 0; i < 6; i++)
                compliance[entry] += place.moves[i][row]*half[i][column];
        }
}

void BodyEquations::invertSix(const double* matrix, double* inverse) {
    const int n = 6;
    double rest[n*n];
    copy_n(matrix, n*n, rest);
    fill_n(inverse, n*n, 0.0);
    for (int i = 0; i < n; i++)
        inverse[n*i+i] = 1;
    for (int pivot = 0; pivot < n; pivot++) {
        const double scale = 1/rest[n*pivot+pivot];
        for (int k = 0; k < n; k++) {
            rest[n*pivot+k] *= scale;
            inverse[n*pivot+k] *= scale;
        }
        for (int row = 0; row < n; row++) {
            const double factor = rest[n*row+pivot];
            for (int k = 0; k < n && row != pivot; k++) {
                rest[n*row+k] -= factor*rest[n*pivot+k];
                inverse[n*row+k] -= factor*inverse[n*pivot+k];
            }
        }
    }
}

void BodyEquations::invertSix(const double* matrix, bool planar, bool turns, double* inverse) {
    bool fixed[6] = {};
    for (int i : ACROSS_PLANE)
        fixed[i] = planar;
    for (int i = 3; i < 6; i++)
        fixed[i] |= !turns;
    double reduced[36];
    for (int i = 0; i < 6; i++)
        for (int j = 0; j < 6; j++)
            reduced[6*i+j] = !fixed[i] && !fixed[j] ? matrix[6*i+j] : i == j;
    invertSix(reduced, inverse);
    for (int i = 0; i < 6; i++)
        if (fixed[i])
            inverse[7*i] = 0;
}

void BodyEquations::multiplySix(const double* matrix, const double* vector, double* result) {
    for (int i = 0; i < 6; i++) {
        result[i] = 0;
        for (int j = 0; j < 6; j++)
            result[i] += matrix[6*i+j]*vector[j];
    }
}
