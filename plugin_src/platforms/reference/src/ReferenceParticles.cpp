#include "ReferenceParticles.h"
#include "openmm/reference/ReferenceVirtualSites.h"

using namespace OpenMM;
using namespace std;

void ReferenceParticles::move(vector<Vec3>& newPositions, double stepSize, int steps) {
    data.positions->swap(newPositions);
#if CYLCHAIN_OPENMM_VERSION >= 804
    data.virtualSites->computePositions(context.getSystem(), *data.positions, data.periodicBoxVectors);
#else
    data.virtualSites->computePositions(context.getSystem(), *data.positions);
#endif
    data.time += steps*stepSize;
    data.stepCount += steps;
}
