#include "growth/ChainsInStep.h"
#include "mechanics/PeriodicBox.h"

using namespace cylchain;
using namespace std;

const vector<Vec3d>& ChainsInStep::getNodes(int index) {
    Present& known = present[index];
    if (known.isKnown)
        return known.nodes;
    known.isKnown = true;
    for (int particle : getChain(index).nodes) {
        const double* x = positions+3*(size_t) particle;
        Vec3d node = {x[0], x[1], x[2]};
        if (!known.nodes.empty() && step.takesNearestImages) {
            const Vec3d& last = known.nodes.back();
            double along[] = {node.x-last.x, node.y-last.y, node.z-last.z};
            takeToNearestImage(along, step.box);
            node = last+Vec3d {along[0], along[1], along[2]};
        }
        known.nodes.push_back(node);
    }
    return known.nodes;
}

bool ChainsInStep::isAnyFixed(int index, int firstNode, int count) const {
    const vector<bool>& fixed = getChain(index).fixed;
    for (int node = firstNode; node < firstNode+count && node < static_cast<int>(fixed.size()); node++)
        if (fixed[node])
            return true;
    return false;
}

void ChainsInStep::beginAround() {
    if (!aroundIsKnown)
        for (Surroundings* all : around)
            all->begin(positions, chains, step.box);
    aroundIsKnown = true;
}

double ChainsInStep::findChange(const EndChange& change) {
    beginAround();
    double difference = 0;
    for (Surroundings* all : around)
        difference += all->findChange(change);
    return difference;
}

void ChainsInStep::show(int index, const vector<Vec3d>& nodes, const vector<double>& along) {
    beginAround();
    for (Surroundings* all : around)
        all->show(system.chains[index].chain, nodes, along);
}

void ChainsInStep::set(int index, const vector<Vec3d>& nodes) {
    present[index].isKnown = present[index].hasChanged = true;
    present[index].nodes = nodes;
}

void ChainsInStep::move(int index, int other, double beyond) {
    beginAround();
    for (Surroundings* all : around)
        all->move(system.chains[index].chain, system.chains[other].chain, beyond);
}

void ChainsInStep::addCut(const ChainCut& cut, GrowthChanges& changes) {
    changes.cuts.push_back(cut);
    const auto found = hands.find(cut.chain);
    if (found == hands.end())
        return;
    vector<ActingHand> before;
    before.swap(found->second);
    for (ActingHand& hand : before) {
        followCut(cut, hand);
        if (hand.chain >= 0)
            hands[hand.chain].push_back(hand);
    }
}

void ChainsInStep::finish(const GrowthState& state, ChainList& list, double* all, GrowthChanges& changes) const {
    for (size_t i = 0; i < present.size(); i++) {
        if (!present[i].hasChanged)
            continue;
        changes.chains.push_back(i);
        Chain& chain = list.getChain(system.chains[i].chain);
        setMonomers(chain, system.tables[system.chains[i].table], state.ranges[i]);
        const vector<Vec3d>& nodes = present[i].nodes;
        auto put = [&] (int particle, const Vec3d& x) {
            double* to = all+3*(size_t) particle;
            to[0] = x.x;
            to[1] = x.y;
            to[2] = x.z;
        };
        for (size_t node = 0; node < chain.nodes.size(); node++)
            put(chain.nodes[node], nodes[node]);
        for (int spare : chain.spareNodes)
            put(spare, nodes.back());
    }
}
