#include "openmm/CylinderChainGrowthForce.h"
#include "openmm/internal/StateColumns.h"
#include "openmm/serialization/ObjectProxy.h"
#include <memory>
#include <string>
#include <vector>

using namespace OpenMM;
using namespace std;

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
        int chain, table, pool, first, last, least, minusState, plusState;
        bool vanishes;
        double rate;
        vector<double> shares;
        force.getGrowingChainParameters(i, chain, table, pool, first, last, least, vanishes);
        force.getSevering(i, rate, minusState, plusState, shares);
        SerializationNode& own = chains.createChildNode("GrowingChain").setIntProperty("chain", chain)
                .setIntProperty("table", table).setIntProperty("pool", pool).setIntProperty("firstMonomer", first)
                .setIntProperty("lastMonomer", last).setIntProperty("leastMonomers", least)
                .setBoolProperty("vanishes", vanishes)
                .setBoolProperty("monomersHaveStates", force.getMonomersHaveStates(i))
                .setDoubleProperty("severingRate", rate).setIntProperty("severedMinusState", minusState)
                .setIntProperty("severedPlusState", plusState);
        StateColumns severing;
        severing.put("shares", shares);
        severing.write(own.createChildNode("Severing"));
        for (int end : {0, 1}) {
            int initialState;
            vector<double> rates, switchRates;
            vector<int> next;
            force.getEndStates(i, end, initialState, rates, next, switchRates);
            StateColumns columns;
            columns.put("initialState", initialState);
            columns.put("rates", rates);
            columns.put("statesAfter", next);
            columns.put("switchRates", switchRates);
            bool isRegular;
            double energyOfLoad;
            force.getEndTiming(i, end, isRegular, energyOfLoad);
            columns.put("isRegular", isRegular ? 1 : 0);
            columns.put("energyOfLoad", energyOfLoad);
            vector<double> lengths, blockedRates;
            force.getEndSwitching(i, end, lengths, blockedRates);
            columns.put("lengthsOfRates", lengths);
            columns.put("blockedRates", blockedRates);
            force.getSwitchingOfShortest(i, end, switchRates);
            columns.put("ratesOfShortest", switchRates);
            columns.write(own.createChildNode("End"));
        }
    }
    SerializationNode& nucleators = node.createChildNode("Nucleators");
    for (int i = 0; i < force.getNumNucleators(); i++) {
        double rate;
        int order, monomers, region;
        vector<double> parameters;
        Vec3 direction;
        vector<int> members;
        force.getNucleatorParameters(i, rate, order, monomers, region, parameters, direction, members);
        StateColumns columns;
        columns.put("rate", rate);
        columns.put("order", order);
        columns.put("monomers", monomers);
        columns.put("region", region);
        columns.put("parameters", parameters);
        columns.put("direction", vector<double> {direction[0], direction[1], direction[2]});
        columns.put("chains", members);
        double angle, stiffness, distance, beyond;
        vector<int> mothers;
        force.getBranching(i, angle, stiffness, distance, beyond, mothers);
        columns.put("mothers", mothers);
        columns.put("branch", vector<double> {angle, stiffness, distance, beyond});
        columns.write(nucleators.createChildNode("Nucleator"));
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
        const int index = force->addGrowingChain(own.getIntProperty("chain"), own.getIntProperty("table"),
                own.getIntProperty("pool"), own.getIntProperty("firstMonomer"), own.getIntProperty("lastMonomer"),
                own.getIntProperty("leastMonomers"), own.getBoolProperty("vanishes"));
        force->setMonomersHaveStates(index, own.getBoolProperty("monomersHaveStates"));
        force->setSevering(index, own.getDoubleProperty("severingRate"), own.getIntProperty("severedMinusState"),
                own.getIntProperty("severedPlusState"),
                StateColumns::read(own.getChildNode("Severing")).get<double>("shares"));
        int end = 0;
        for (auto& child : own.getChildren())
            if (child.getName() == "End") {
                const StateColumns columns = StateColumns::read(child);
                force->setEndTiming(index, end, columns.getOne<int>("isRegular") != 0,
                        columns.getOne<double>("energyOfLoad"));
                force->setEndStates(index, end, columns.getOne<int>("initialState"), columns.get<double>("rates"),
                        columns.get<int>("statesAfter"), columns.get<double>("switchRates"));
                force->setEndSwitching(index, end, columns.get<double>("lengthsOfRates"),
                        columns.get<double>("blockedRates"));
                force->setSwitchingOfShortest(index, end++, columns.get<double>("ratesOfShortest"));
            }
    }
    for (auto& nucleator : node.getChildNode("Nucleators").getChildren()) {
        const StateColumns columns = StateColumns::read(nucleator);
        const vector<double> direction = columns.get<double>("direction");
        const vector<double> branch = columns.get<double>("branch");
        const int index = force->addNucleator(columns.getOne<double>("rate"), columns.getOne<int>("order"),
                columns.getOne<int>("monomers"), columns.getOne<int>("region"), columns.get<double>("parameters"),
                Vec3(direction.at(0), direction.at(1), direction.at(2)), columns.get<int>("chains"));
        force->setBranching(index, branch.at(0), branch.at(1), branch.at(2), branch.at(3),
                columns.get<int>("mothers"));
    }
    return force;
}

static const bool isGrowthForceRegistered =
        registerProxy<CylinderChainGrowthForce>("CylinderChainGrowthForce", 2, write, readGrowthForce);
