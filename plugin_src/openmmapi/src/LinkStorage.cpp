#include "openmm/internal/LinkStorage.h"
#include "openmm/OpenMMException.h"
#include "openmm/internal/CheckpointValues.h"
#include "openmm/internal/CylinderChainLinkForceImpl.h"
#include "openmm/internal/LinkDescription.h"
#include "openmm/serialization/SerializationNode.h"
#include <algorithm>
#include <istream>
#include <ostream>
#include <string>
#include <vector>

using namespace cylchain;
using namespace std;

namespace OpenMM {

/**
 * A table in columns, as it is stored.
 */
struct StoredTable {
    vector<int> numbers, active;
    LinkColumns columns;
    int nextNumber = 0;
    StoredTable() = default;
    explicit StoredTable(const LinkTable& table) : nextNumber(table.getNextNumber()) {
        for (const LinkEntry& entry : table.getEntries()) {
            numbers.push_back(entry.link.number);
            active.push_back(entry.active);
            columns.add(entry.link);
        }
    }
    LinkTable getTable() const {
        return makeTable(numbers, columns, active, nextNumber);
    }
};

static const char* const END_PROPERTIES[] = {"first1", "second1", "first2", "second2"};
static const char* const FRACTION_PROPERTIES[] = {"fraction1", "fraction2"};
static const char* const POINT_PROPERTIES[] = {"x", "y", "z"};
static const char* const PARAMETER_PROPERTIES[] = {"restLength", "stiffness", "maximumExtension"};

void writeTable(SerializationNode& node, const LinkTable& table) {
    const StoredTable stored(table);
    const vector<string> models = namesOf<StretchingModel>();
    node.setIntProperty("nextNumber", stored.nextNumber);
    for (size_t i = 0; i < stored.numbers.size(); i++) {
        SerializationNode& link = node.createChildNode("Link");
        link.setIntProperty("number", stored.numbers[i]).setBoolProperty("active", stored.active[i] != 0)
                .setStringProperty("stretchingModel", models[stored.columns.models[i]]);
        for (int k = 0; k < 4; k++)
            link.setIntProperty(END_PROPERTIES[k], stored.columns.ends[4*i+k]);
        for (int k = 0; k < 2; k++)
            link.setDoubleProperty(FRACTION_PROPERTIES[k], stored.columns.fractions[2*i+k]);
        for (int k = 0; k < 3; k++) {
            link.setDoubleProperty(PARAMETER_PROPERTIES[k], stored.columns.parameters[3*i+k]);
            if (stored.columns.ends[4*i+2] < 0)
                link.setDoubleProperty(POINT_PROPERTIES[k], stored.columns.points[3*i+k]);
        }
    }
}

int findStretchingModel(const string& name) {
    const vector<string> names = namesOf<StretchingModel>();
    const auto found = find(names.begin(), names.end(), name);
    if (found == names.end())
        throw OpenMMException("CylinderChainLinkForce: There is no stretching model "+name);
    return found-names.begin();
}

LinkTable readTable(const SerializationNode& node) {
    StoredTable stored;
    stored.nextNumber = node.getIntProperty("nextNumber");
    for (const SerializationNode& link : node.getChildren()) {
        stored.numbers.push_back(link.getIntProperty("number"));
        stored.active.push_back(link.getBoolProperty("active"));
        stored.columns.models.push_back(findStretchingModel(link.getStringProperty("stretchingModel")));
        for (const char* name : END_PROPERTIES)
            stored.columns.ends.push_back(link.getIntProperty(name));
        for (const char* name : FRACTION_PROPERTIES)
            stored.columns.fractions.push_back(link.getDoubleProperty(name));
        for (const char* name : PARAMETER_PROPERTIES)
            stored.columns.parameters.push_back(link.getDoubleProperty(name));
        for (const char* name : POINT_PROPERTIES)
            stored.columns.points.push_back(link.getDoubleProperty(name, 0));
    }
    return stored.getTable();
}

static vector<CylinderChainLinkForceImpl*> findLinkForces(ContextImpl& context) {
    vector<CylinderChainLinkForceImpl*> forces;
    for (ForceImpl* impl : context.getForceImpls()) {
        CylinderChainLinkForceImpl* force = dynamic_cast<CylinderChainLinkForceImpl*>(impl);
        if (force != NULL)
            forces.push_back(force);
    }
    return forces;
}

static void giveTables(const vector<LinkTable>& tables, ContextImpl& context) {
    const vector<CylinderChainLinkForceImpl*> forces = findLinkForces(context);
    if (tables.size() != forces.size())
        throw OpenMMException("CylinderChainIntegrator: The State or checkpoint has the links of "+
                to_string(tables.size())+" CylinderChainLinkForces, but the System has "+to_string(forces.size()));
    for (size_t i = 0; i < forces.size(); i++)
        forces[i]->setTable(tables[i]);
}

static const char* const WITHIN_LINKS = "the links of a CylinderChainLinkForce";

template <class T> static void writeValues(ostream& stream, const vector<T>& values) {
    stream.write(reinterpret_cast<const char*>(values.data()), values.size()*sizeof(T));
}

template <class T> static vector<T> readValues(istream& stream, size_t count) {
    // One by one, so that a checkpoint which is cut off cannot ask for more memory than it has.
    vector<T> values;
    for (size_t i = 0; i < count; i++)
        values.push_back(readValue<T>(stream, WITHIN_LINKS)); // NOLINT(performance-inefficient-vector-operation)
    return values;
}

void writeLinks(ostream& stream, ContextImpl& context) {
    const vector<CylinderChainLinkForceImpl*> forces = findLinkForces(context);
    writeValue(stream, (int) forces.size());
    for (CylinderChainLinkForceImpl* force : forces) {
        const StoredTable stored(force->getTable());
        writeValue(stream, stored.nextNumber);
        writeValue(stream, (int) stored.numbers.size());
        writeValues(stream, stored.numbers);
        writeValues(stream, stored.active);
        writeValues(stream, stored.columns.ends);
        writeValues(stream, stored.columns.fractions);
        writeValues(stream, stored.columns.points);
        writeValues(stream, stored.columns.models);
        writeValues(stream, stored.columns.parameters);
    }
}

void readLinks(istream& stream, ContextImpl& context) {
    vector<LinkTable> tables;
    const int numTables = readValue<int>(stream, WITHIN_LINKS);
    for (int i = 0; i < numTables; i++) {
        StoredTable stored;
        stored.nextNumber = readValue<int>(stream, WITHIN_LINKS);
        const size_t count = max(0, readValue<int>(stream, WITHIN_LINKS));
        stored.numbers = readValues<int>(stream, count);
        stored.active = readValues<int>(stream, count);
        stored.columns.ends = readValues<int>(stream, 4*count);
        stored.columns.fractions = readValues<double>(stream, 2*count);
        stored.columns.points = readValues<double>(stream, 3*count);
        stored.columns.models = readValues<int>(stream, count);
        stored.columns.parameters = readValues<double>(stream, 3*count);
        tables.push_back(stored.getTable());
    }
    giveTables(tables, context);
}

void writeLinks(SerializationNode& node, ContextImpl& context) {
    for (CylinderChainLinkForceImpl* force : findLinkForces(context))
        writeTable(node.createChildNode("Links"), force->getTable());
}

void readLinks(const SerializationNode& node, ContextImpl& context) {
    vector<LinkTable> tables;
    for (const SerializationNode& child : node.getChildren())
        if (child.getName() == "Links")
            tables.push_back(readTable(child));

    // That of a System without such Forces, or of an earlier version, says nothing about links.

    if (!tables.empty())
        giveTables(tables, context);
}

} // namespace OpenMM
