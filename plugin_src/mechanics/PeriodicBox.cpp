#include "mechanics/PeriodicBox.h"
#include <cmath>

using namespace cylchain;
using namespace std;

void cylchain::takeToNearestImage(double* displacement, const double* box) {
    for (int k = 2; k >= 0; k--) {
        const double images = floor(displacement[k]/box[4*k]+0.5);
        for (int j = 0; j < 3; j++)
            displacement[j] -= images*box[3*k+j];
    }
}
