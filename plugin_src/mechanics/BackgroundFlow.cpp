#include "mechanics/BackgroundFlow.h"
#include "mechanics/PeriodicBox.h"
#include <algorithm>
#include <cmath>

using namespace cylchain;
using namespace std;

bool BackgroundFlow::varies() const {
    return any_of(gradient, gradient+9, [] (double derivative) {return derivative != 0;});
}

void BackgroundFlow::getVelocity(const double* x, double* result) const {
    double r[] = {x[0]-origin[0], x[1]-origin[1], x[2]-origin[2]};
    if (box != NULL)
        takeToNearestImage(r, box);
    for (int i = 0; i < 3; i++)
        result[i] = velocity[i]+gradient[3*i]*r[0]+gradient[3*i+1]*r[1]+gradient[3*i+2]*r[2];
}

BackgroundFlow BackgroundFlow::carriedAlong(double time, bool planar) const {
    // The sum of (t G)^k/(k+1)!, which applies to all columns of velocity and gradient.
    const int size = planar ? 2 : 3;
    BackgroundFlow result = *this;
    for (int column = 0; column < 4; column++) {
        double term[3] = {}, sum[3] = {};
        for (int i = 0; i < size; i++)
            term[i] = sum[i] = (column < 3 ? gradient[3*i+column] : velocity[i]);
        for (int k = 2; k < 100; k++) {
            double next[3] = {};
            for (int i = 0; i < size; i++)
                for (int j = 0; j < size; j++)
                    next[i] += gradient[3*i+j]*term[j]*time/k;
            bool counts = false;
            for (int i = 0; i < size; i++) {
                sum[i] += term[i] = next[i];
                counts |= fabs(next[i]) > 1e-17*fabs(sum[i]);
            }
            if (!counts)
                break;
        }
        for (int i = 0; i < 3; i++)
            (column < 3 ? result.gradient[3*i+column] : result.velocity[i]) = sum[i];
    }
    return result;
}
