#include "ReferenceUpdateCylinderChainGrowthKernel.h"
#include "ReferenceContextData.h"

using namespace OpenMM;
using namespace cylchain;
using namespace std;

void ReferenceUpdateCylinderChainGrowthKernel::initialize(const GrowthSystem& system,
        const vector<BendingModel>& bending, const vector<StretchingModel>& stretching, const vector<char>& planar) {
    growth = make_unique<ChainGrowth>(system, bending, stretching, planar);
}

GrowthChanges ReferenceUpdateCylinderChainGrowthKernel::execute(ContextImpl& context, GrowthState& state,
        GrowthStep step, bool periodic, ChainList& chains, const vector<Surroundings*>& around) {
    ReferencePlatform::PlatformData& data = extractData(context);
    step.box = &data.periodicBoxVectors[0][0];
    step.takesNearestImages = periodic;
    return growth->advance(state, step, chains, &(*data.positions)[0][0], around);
}

void ReferenceUpdateCylinderChainGrowthKernel::placeSpareNodes(ContextImpl& context, const vector<Chain>& chains) {
    vector<Vec3>& positions = *extractData(context).positions;
    for (const Chain& chain : chains)
        for (int spare : chain.spareNodes)
            positions[spare] = positions[chain.nodes.empty() ? chain.spareNodes[0] : chain.nodes.back()];
}
