#include "mechanics/BackgroundFlow.h"
#include "mechanics/PeriodicBox.h"
#include <algorithm>

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
