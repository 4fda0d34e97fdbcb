#include "ReferenceCalcCylinderChainLinkForceKernel.h"
#include "ReferenceContextData.h"
#include <algorithm>

using namespace OpenMM;
using namespace cylchain;
using namespace std;

/**
 * Links are given to threads in blocks of this size.
 */
static const int LINKS_OF_BLOCK = 1024;

ReferenceCalcCylinderChainLinkForceKernel::ReferenceCalcCylinderChainLinkForceKernel(string name,
        const Platform& platform, ContextImpl& context) : CalcCylinderChainLinkForceKernel(name, platform),
        loop(context), periodic(false), nearestParticles(false) {
}

void ReferenceCalcCylinderChainLinkForceKernel::initialize(const System&, bool periodic, bool nearestParticles) {
    this->periodic = periodic;
    this->nearestParticles = nearestParticles;
}

LinkBoxes ReferenceCalcCylinderChainLinkForceKernel::getBoxes(ContextImpl& context) const {
    const double* box = &extractData(context).periodicBoxVectors[0][0];
    LinkBoxes boxes;
    boxes.distances = periodic ? box : NULL;
    boxes.segments = nearestParticles ? box : NULL;
    return boxes;
}

ImplicitCouplings* ReferenceCalcCylinderChainLinkForceKernel::getEquations(ContextImpl& context,
        const vector<Link>& links) {
    equations.setLinks(&links, getBoxes(context));
    return &equations;
}

double ReferenceCalcCylinderChainLinkForceKernel::execute(ContextImpl& context, const vector<Link>& links,
        bool includeForces, bool, int& outOfRange) {
    ReferencePlatform::PlatformData& data = extractData(context);
    const double* positions = &(*data.positions)[0][0];
    const LinkBoxes boxes = getBoxes(context);
    const int count = links.size();
    pulls.resize(count);
    loop.run((count+LINKS_OF_BLOCK-1)/LINKS_OF_BLOCK, [&] (int block) {
        const int end = min(count, (block+1)*LINKS_OF_BLOCK);
        for (int i = block*LINKS_OF_BLOCK; i < end; i++)
            pulls[i] = computePull(links[i], positions, boxes);
    });

    // Sums do not depend on the order in which threads have finished.

    double* forces = &(*data.forces)[0][0];
    double energy = 0;
    outOfRange = -1;
    for (int i = 0; i < count; i++) {
        if (!pulls[i].inRange && outOfRange == -1)
            outOfRange = i;
        energy += pulls[i].energy;
        if (includeForces) {
            addForce(links[i].first, pulls[i].force, -1, forces);
            addForce(links[i].second, pulls[i].force, 1, forces);
        }
    }
    return energy;
}
