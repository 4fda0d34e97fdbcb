#include "openmm/CylinderChainGrowthForce.h"
#include "openmm/internal/StateColumns.h"
#include "openmm/serialization/ObjectProxy.h"
#include <memory>
#include <string>
#include <vector>

using namespace OpenMM;
using namespace std;

/** The names of the rates of a chain, in their order. */
static const char* const RATES[] = {"minusOnRate", "minusOffRate", "plusOnRate", "plusOffRate"};
/** Those of an end that has dynamic instability. */
static const char* const RATES_OF_INSTABILITY[] = {"shrinkingOnRate", "shrinkingOffRate", "catastropheRate",
        "rescueRate"};

static void write(const CylinderChainGrowthForce& force, SerializationNode& node) {
    SerializationNode& tables = node.createChildNode("Tables");
    for (int i = 0; i < force.getNumTables(); i++) {
        int monomersPerSegment;
        vector<double> segments, joints;
        force.getTable(i, monomersPerSegment, segments, joints);
        StateColumns columns;
        columns.put("monomersPerSegment", monomersPerSegment);
        columns.put("segments", segments);
        columns.put("joints", joints);
        columns.write(tables.createChildNode("Table"));
    }
    SerializationNode& pools = node.createChildNode("Pools");
    for (int i = 0; i < force.getNumPools(); i++) {
        double concentration, volume;
        force.getPoolParameters(i, concentration, volume);
        pools.createChildNode("Pool").setDoubleProperty("concentration", concentration)
                .setDoubleProperty("volume", volume);
    }
    SerializationNode& chains = node.createChildNode("GrowingChains");
    for (int i = 0; i < force.getNumGrowingChains(); i++) {
        int chain, table, pool, first, last, least;
        double rates[4];
        force.getGrowingChainParameters(i, chain, table, pool, first, last, least, rates[0], rates[1], rates[2],
                rates[3]);
        SerializationNode& own = chains.createChildNode("GrowingChain").setIntProperty("chain", chain)
                .setIntProperty("table", table).setIntProperty("pool", pool).setIntProperty("firstMonomer", first)
                .setIntProperty("lastMonomer", last).setIntProperty("leastMonomers", least);
        for (int k = 0; k < 4; k++)
            own.setDoubleProperty(RATES[k], rates[k]);
        for (int end : {0, 1}) {
            force.getDynamicInstability(i, end, rates[0], rates[1], rates[2], rates[3]);
            SerializationNode& instability = own.createChildNode("DynamicInstability");
            for (int k = 0; k < 4; k++)
                instability.setDoubleProperty(RATES_OF_INSTABILITY[k], rates[k]);
        }
    }
}

static unique_ptr<CylinderChainGrowthForce> readGrowthForce(const SerializationNode& node) {
    unique_ptr<CylinderChainGrowthForce> force(new CylinderChainGrowthForce());
    for (auto& table : node.getChildNode("Tables").getChildren()) {
        const StateColumns columns = StateColumns::read(table);
        force->addTable(columns.getOne<int>("monomersPerSegment"), columns.get<double>("segments"),
                columns.get<double>("joints"));
    }
    for (auto& pool : node.getChildNode("Pools").getChildren())
        force->addPool(pool.getDoubleProperty("concentration"), pool.getDoubleProperty("volume"));
    for (auto& own : node.getChildNode("GrowingChains").getChildren()) {
        double rates[4];
        for (int k = 0; k < 4; k++)
            rates[k] = own.getDoubleProperty(RATES[k]);
        force->addGrowingChain(own.getIntProperty("chain"), own.getIntProperty("table"), own.getIntProperty("pool"),
                own.getIntProperty("firstMonomer"), own.getIntProperty("lastMonomer"),
                own.getIntProperty("leastMonomers"), rates[0], rates[1], rates[2], rates[3]);
        int end = 0;
        for (auto& instability : own.getChildren()) {
            for (int k = 0; k < 4; k++)
                rates[k] = instability.getDoubleProperty(RATES_OF_INSTABILITY[k]);
            force->setDynamicInstability(force->getNumGrowingChains()-1, end++, rates[0], rates[1], rates[2], rates[3]);
        }
    }
    return force;
}

static const bool isGrowthForceRegistered =
        registerProxy<CylinderChainGrowthForce>("CylinderChainGrowthForce", 1, write, readGrowthForce);
