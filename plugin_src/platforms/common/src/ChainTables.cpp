#include "ChainTables.h"
#include <algorithm>

using namespace OpenMM;
using namespace OpenMM::layout;
using namespace cylchain;
using namespace std;

static string nameOf(BendingModel model) {
    switch (model) {
#define CYLCHAIN_CASE(entry, name, kind) case BendingModel::entry: return "BENDING_" #entry;
        CYLCHAIN_BENDING_MODELS(CYLCHAIN_CASE)
#undef CYLCHAIN_CASE
    }
    noOtherEntry();
}

static string nameOf(StretchingModel model) {
    switch (model) {
#define CYLCHAIN_CASE(entry, ...) case StretchingModel::entry: return "STRETCHING_" #entry;
        CYLCHAIN_STRETCHING_MODELS(CYLCHAIN_CASE)
#undef CYLCHAIN_CASE
    }
    noOtherEntry();
}

map<string, string> OpenMM::definesFor(const Chain& chain) {
    map<string, string> defines = {{nameOf(chain.bending), "1"}, {nameOf(chain.stretching), "1"}};
    if (chain.closed)
        defines["CLOSED"] = "1";
    if (chain.planar)
        defines["PLANAR"] = "1";
    return defines;
}

/**
 * Whether segments have friction, besides their nodes.
 */
static bool hasSegmentFriction(const Chain& chain) {
    return any_of(chain.segments.begin(), chain.segments.end(), [] (const Segment& segment) {
        return segment.parallel > 0 || segment.perpendicular > 0 || segment.rotational > 0 || segment.extensional > 0;
    });
}

static void addNumbers(const Chain& chain, int index, int firstNode, ChainTable& table) {
    vector<int> numbers(NUM_CHAIN_NUMBERS);
    numbers[CHAIN_NUMBER] = index;
    numbers[CHAIN_FIRST_NODE] = firstNode;
    numbers[CHAIN_NUM_NODES] = chain.nodes.size();
    numbers[CHAIN_IS_FREE] = none_of(chain.fixed.begin(), chain.fixed.end(), [] (bool fixed) {return fixed;});
    numbers[CHAIN_HAS_SEGMENT_FRICTION] = hasSegmentFriction(chain);
    numbers[CHAIN_HAS_TETHERS] = !chain.tethers.empty();
    numbers[CHAIN_HAS_PROPULSION] = any_of(chain.segments.begin(), chain.segments.end(), [] (const Segment& segment) {
        return segment.propulsion != 0;
    });
    table.numbers.insert(table.numbers.end(), numbers.begin(), numbers.end());
    table.properties.push_back(chain.nodeFriction);
}

static void setSegment(const Segment& segment, int dimensions, double* properties, size_t stride) {
    properties[REST_LENGTH*stride] = segment.restLength;
    properties[STIFFNESS*stride] = segment.stiffness;
    properties[INVERSE_EXTENSION*stride] = segment.maximumExtension > 0 ? 1/segment.maximumExtension : 0;
    properties[PARALLEL*stride] = segment.parallel;
    properties[PERPENDICULAR*stride] = segment.perpendicular;
    properties[ROTATIONAL*stride] = segment.rotational;
    properties[EXTENSIONAL*stride] = segment.extensional;
    properties[DRIFT*stride] = segment.rotational == 0 ? 0 :
            dimensions+1-(dimensions-1)*segment.extensional/segment.rotational;
    properties[PROPULSION*stride] = segment.propulsion;
}

ChainTable OpenMM::tabulate(const vector<Chain>& chains, const vector<int>& members, const vector<int>& firstNodes,
        bool chainByChain) {
    const Chain& longest = chains[members[0]];
    ChainTable table;
    table.numChains = members.size();
    table.numPlaces = longest.nodes.size()+(longest.closed ? 2 : 0);
    table.numFields = longest.closed ? NUM_FIELDS_OF_RING : NUM_FIELDS_OF_OPEN_CHAIN;
    table.places.resize((size_t) table.numChains*table.numPlaces*NUM_PROPERTIES);
    const size_t perChain = chainByChain ? (size_t) table.numPlaces*NUM_PROPERTIES : 1;
    const size_t stride = chainByChain ? 1 : table.numChains;
    for (size_t i = 0; i < members.size(); i++) {
        const Chain& chain = chains[members[i]];
        addNumbers(chain, members[i], firstNodes[members[i]], table);
        const size_t own = chain.nodes.size(), unrolled = own+(chain.closed ? 2 : 0);
        for (size_t place = 0; place < unrolled; place++) {
            double* properties = &table.places[i*perChain+place*NUM_PROPERTIES*stride];
            if (place < unrolled-1)
                setSegment(chain.segments[place%chain.segments.size()], chain.planar ? 2 : 3, properties, stride);
            if (place > 0 && place < unrolled-1)
                properties[JOINT*stride] = chain.joints[chain.closed ? place%own : place-1];
            properties[MOBILE*stride] = chain.fixed[place%own] ? 0 : 1;
        }
    }
    return table;
}

TetherTable OpenMM::tabulateTethers(const vector<Chain>& chains) {
    TetherTable table;
    for (const Chain& chain : chains)
        for (size_t node = 0; node < chain.nodes.size(); node++) {
            table.first.push_back(table.properties.size()/NUM_TETHER_PROPERTIES);
            for (size_t number = 0; number < chain.tethers.size(); number++) {
                const Tether& tether = chain.tethers[number];
                if (tether.node == (int) node)
                    table.properties.insert(table.properties.end(), {tether.point[0], tether.point[1],
                            tether.point[2], tether.stiffness, (double) number});
            }
        }
    table.first.push_back(table.properties.size()/NUM_TETHER_PROPERTIES);
    return table;
}
