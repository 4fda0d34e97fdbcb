#include "HostForces.h"
#include "openmm/common/ContextSelector.h"
#include "openmm/internal/ContextImpl.h"
#include <algorithm>
#include <cmath>

using namespace OpenMM;
using namespace std;

/**
 * Platforms add forces in units of 2^-32 kJ/(mol nm), and none larger than this.
 */
static const double UNITS = 4294967296.0, LARGEST = 2147483000.0;

HostForces::HostForces(ComputeContext& cc) : cc(cc) {
}

vector<Vec3>& HostForces::begin(ContextImpl& context) {
    context.getPositions(positions);
    forces.assign(positions.size(), Vec3());
    return positions;
}

void HostForces::add() {
    ContextSelector selector(cc);
    const size_t padded = cc.getPaddedNumAtoms();
    ArrayInterface& buffer = cc.getLongForceBuffer();
    numbers.resize(buffer.getSize());
    buffer.download(numbers.data());
    const vector<int>& order = cc.getAtomIndex();
    for (int slot = 0; slot < cc.getNumAtoms(); slot++)
        for (int k = 0; k < 3; k++) {
            // What is not finite becomes the largest force, which a step takes for one that is not.

            const double force = forces[order[slot]][k];
            const double limited = isfinite(force) ? max(-LARGEST, min(LARGEST, force)) : LARGEST;
            numbers[slot+k*padded] += (long long) (limited*UNITS);
        }
    buffer.upload(numbers.data());
}
