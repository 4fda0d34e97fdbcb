#include "ReferenceCalcCylinderChainLinkForceKernel.h"
#include <algorithm>

using namespace OpenMM;
using namespace cylchain;
using namespace std;

/**
 * Links are given to threads in blocks of this size.
 */
static const int LINKS_OF_BLOCK = 1024;

ReferenceCalcCylinderChainLinkForceKernel::ReferenceCalcCylinderChainLinkForceKernel(string name,
        const Platform& platform, shared_ptr<HostParticles> particles) :
        CalcCylinderChainLinkForceKernel(name, platform), particles(particles), periodic(false),
        nearestParticles(false) {
}

void ReferenceCalcCylinderChainLinkForceKernel::initialize(const System&, bool periodic, bool nearestParticles) {
    this->periodic = periodic;
    this->nearestParticles = nearestParticles;
}

LinkBoxes ReferenceCalcCylinderChainLinkForceKernel::getBoxes() const {
    const double* box = &particles->getBox()[0][0];
    LinkBoxes boxes;
    boxes.distances = periodic ? box : NULL;
    boxes.segments = nearestParticles ? box : NULL;
    return boxes;
}

/** Links may be others in each step, and their places are particles of any kind. */
void ReferenceCalcCylinderChainLinkForceKernel::include(const vector<Link>& links) {
    if (!particles->areCopies())
        return;
    vector<int> own;
    for (const Link& link : links) {
        addParticles(link.first, own);
        addParticles(link.second, own);
    }
    particles->include(own);
}

ImplicitCouplings* ReferenceCalcCylinderChainLinkForceKernel::getEquations(ContextImpl&, const vector<Link>& links) {
    include(links);
    equations.setLinks(&links, getBoxes());
    return &equations;
}

double ReferenceCalcCylinderChainLinkForceKernel::execute(ContextImpl&, const vector<Link>& links,
        bool includeForces, bool, int& outOfRange) {
    include(links);
    particles->update();
    const double* positions = &particles->getPositions()[0][0];
    const LinkBoxes boxes = getBoxes();
    const int count = links.size();
    pulls.resize(count);
    particles->getLoop().run((count+LINKS_OF_BLOCK-1)/LINKS_OF_BLOCK, [&] (int block) {
        const int end = min(count, (block+1)*LINKS_OF_BLOCK);
        for (int i = block*LINKS_OF_BLOCK; i < end; i++)
            pulls[i] = computePull(links[i], positions, boxes);
    });

    // Sums do not depend on the order in which threads have finished.

    double* forces = &particles->beginForces()[0][0];
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
    if (includeForces)
        particles->endForces();
    return energy;
}
