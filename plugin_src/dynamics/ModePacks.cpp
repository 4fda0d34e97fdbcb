#include "dynamics/ModePacks.h"
#include "dynamics/PackPlaces.h"
#include <algorithm>
#include <numeric>
#include <stdexcept>
#include <string>
#include <tuple>

using namespace cylchain;
using namespace std;

/** Chains are alike if these are equal. The longest come first, so that threads end together. */
static auto keyOf(const Chain& chain, const BeadModes& modes) {
    return make_tuple(-(int) chain.nodes.size(), chain.planar, modes.stiffness, modes.contourForce,
            modes.bendingStiffness, modes.nodeFriction);
}

/**
 * Where single precision is right: where lengths and bends fluctuate by much more than it rounds them, that is for
 * lambda d^2/k_B T and the persistence length over that of a bond.
 */
const double LARGEST_STIFFNESS = 1e9;

bool ModePacks::Wide::isUsed(const StepSettings& settings) const {
    if (settings.precision == Precision::Double ||
            (settings.precision == Precision::Automatic && 2*chains <= pack.pack.lanes))
        return false;
    const BeadModes& modes = pack.family->modes;
    const double length = modes.contourForce/modes.stiffness;
    const double stiffness = length*length*max(modes.stiffness, modes.bendingStiffness);
    // Written so that NaN is not right.
    return settings.kT > 0 && stiffness <= LARGEST_STIFFNESS*settings.kT;
}

/** Chains of a family side by side. */
template <class Scalar> static ModePack<Scalar> packOf(const shared_ptr<const ModeFamily<Scalar> >& family,
        const vector<Chain>& chains, const int* members, int count, int lanes) {
    const Chain& chain = chains[*members];
    ModePack<Scalar> result = {emptyPack<Scalar>({(int) chain.nodes.size(), (int) chain.segments.size(), chain.bending,
            chain.stretching, chain.closed, chain.planar, true, false}, lanes), family};
    for (int lane = 0; lane < count; lane++)
        placeChain(result.pack, lane, chains[members[lane]], members[lane]);
    sortTethers(result.pack);
    return result;
}

ModePacks::ModePacks(const vector<Chain>& chains, int lanes, int wideLanes) {
    vector<BeadModes> modes;
    for (const Chain& chain : chains) {
        string reason;
        const optional<BeadModes> found = findModes(chain, reason);
        if (!found)
            return;
        modes.push_back(*found);
    }
    vector<int> order(chains.size());
    iota(order.begin(), order.end(), 0);
    auto key = [&] (int chain) {return keyOf(chains[chain], modes[chain]);};
    stable_sort(order.begin(), order.end(), [&] (int a, int b) {return key(a) < key(b);});
    for (size_t first = 0, last; first < order.size(); first = last) {
        last = first+1;
        while (last < order.size() && key(order[last]) == key(order[first]))
            last++;
        addFamily(chains, vector<int>(order.begin()+first, order.begin()+last), modes[order[first]], lanes, wideLanes);
    }
}

void ModePacks::addFamily(const vector<Chain>& chains, const vector<int>& members, const BeadModes& modes, int lanes,
            int wideLanes) {
    const int count = members.size(), nodes = chains[members[0]].nodes.size();
    const shared_ptr<const ModeFamily<double> > family = make_shared<ModeFamily<double> >(modes, nodes);
    const shared_ptr<const ModeFamily<float> > wideFamily = make_shared<ModeFamily<float> >(modes, nodes);
    for (int start = 0; start < count; start += wideLanes) {
        const int together = min(count-start, wideLanes), firstPack = packs.size();
        for (int first = 0, number; first < together; first += number) {
            number = min(lanes, together-first);
            packs.push_back(packOf(family, chains, &members[start+first], number, lanesFor(number, lanes)));
        }
        wide.push_back({packOf(wideFamily, chains, &members[start], together, wideLanes), firstPack,
                (int) packs.size(), together});
    }
}

vector<int> ModePacks::getPacksOfStep(const StepSettings& settings) const {
    if (packs.empty())
        throw invalid_argument("A chain has no modes");
    vector<int> result;
    for (size_t i = 0; i < wide.size(); i++) {
        if (wide[i].isUsed(settings))
            result.push_back(packs.size()+i);
        else
            for (int pack = wide[i].first; pack < wide[i].last; pack++)
                result.push_back(pack);
    }
    return result;
}
