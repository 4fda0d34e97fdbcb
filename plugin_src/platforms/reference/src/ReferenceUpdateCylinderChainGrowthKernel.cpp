#include "ReferenceUpdateCylinderChainGrowthKernel.h"

using namespace OpenMM;
using namespace cylchain;
using namespace std;

void ReferenceUpdateCylinderChainGrowthKernel::initialize(const GrowthSystem& system,
        const vector<BendingModel>& bending, const vector<StretchingModel>& stretching, const vector<char>& planar) {
    growth = make_unique<ChainGrowth>(system, bending, stretching, planar);
}

GrowthChanges ReferenceUpdateCylinderChainGrowthKernel::execute(ContextImpl&, GrowthState& state,
        GrowthStep step, bool periodic, ChainList& chains, const vector<Surroundings*>& around) {
    particles->update();
    step.box = &particles->getBox()[0][0];
    step.takesNearestImages = periodic;
    GrowthChanges changes = growth->advance(state, step, chains, &particles->getPositions()[0][0], around);
    if (!changes.chains.empty())
        particles->writePositions();
    return changes;
}

void ReferenceUpdateCylinderChainGrowthKernel::placeSpareNodes(ContextImpl&, const vector<Chain>& chains) {
    particles->update();
    vector<Vec3>& positions = particles->getPositions();
    bool anyMoves = false;
    for (const Chain& chain : chains)
        for (int spare : chain.spareNodes) {
            const Vec3& place = positions[chain.nodes.empty() ? chain.spareNodes[0] : chain.nodes.back()];
            anyMoves |= positions[spare] != place;
            positions[spare] = place;
        }
    if (anyMoves)
        particles->writePositions();
}
