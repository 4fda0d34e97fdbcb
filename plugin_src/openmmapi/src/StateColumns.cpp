#include "openmm/internal/StateColumns.h"
#include "openmm/OpenMMException.h"
#include "openmm/internal/CheckpointValues.h"
#include "openmm/serialization/SerializationNode.h"
#include <algorithm>
#include <limits>
#include <locale>
#include <sstream>

using namespace OpenMM;
using namespace std;

bool StateColumns::has(const string& name) const {
    return any_of(columns.begin(), columns.end(), [&] (const Column& column) {return column.name == name;});
}

const StateColumns::Column& StateColumns::find(const string& name, bool isReal) const {
    for (const Column& column : columns)
        if (column.name == name && column.isReal == isReal)
            return column;
    throw OpenMMException("The State, checkpoint or file has no "+name);
}

void StateColumns::checkOne(const string& name, size_t size) {
    if (size != 1)
        throw OpenMMException("The State, checkpoint or file has "+to_string(size)+" numbers of "+name+", not one");
}

static const char* const WITHIN = "the state of a Force";

template <class T> static void writeValues(ostream& stream, const vector<T>& values) {
    writeValue(stream, (long long) values.size());
    stream.write(reinterpret_cast<const char*>(values.data()), values.size()*sizeof(T));
}

template <class T> static void readValues(istream& stream, vector<T>& values) {
    // One by one, so that a checkpoint which is cut off cannot ask for more memory than it has.
    for (long long i = readValue<long long>(stream, WITHIN); i > 0; i--)
        values.push_back(readValue<T>(stream, WITHIN)); // NOLINT(performance-inefficient-vector-operation)
}

void StateColumns::write(ostream& stream) const {
    writeValue(stream, (int) columns.size());
    for (const Column& column : columns) {
        writeText(stream, column.name);
        writeValue(stream, column.isReal);
        writeValues(stream, column.integers);
        writeValues(stream, column.reals);
    }
}

StateColumns StateColumns::read(istream& stream) {
    StateColumns result;
    for (int i = readValue<int>(stream, WITHIN); i > 0; i--) {
        Column column;
        column.name = readText(stream, WITHIN);
        column.isReal = readValue<bool>(stream, WITHIN);
        readValues(stream, column.integers);
        readValues(stream, column.reals);
        result.columns.push_back(column);
    }
    return result;
}

template <class T> static string asText(const vector<T>& values) {
    ostringstream text;
    text.imbue(locale::classic());
    text.precision(numeric_limits<double>::max_digits10);
    for (const T& value : values)
        text << value << ' ';
    return text.str();
}

template <class T> static vector<T> asValues(const string& name, const string& given) {
    istringstream text(given);
    text.imbue(locale::classic());
    vector<T> values;
    for (T value; text >> value;)
        values.push_back(value);
    if (!text.eof())
        throw OpenMMException("There is something else than numbers among "+name);
    return values;
}

void StateColumns::write(SerializationNode& node) const {
    for (const Column& column : columns)
        node.createChildNode(column.isReal ? "Reals" : "Integers").setStringProperty("name", column.name)
                .setStringProperty("values", column.isReal ? asText(column.reals) : asText(column.integers));
}

StateColumns StateColumns::read(const SerializationNode& node) {
    StateColumns result;
    for (const SerializationNode& child : node.getChildren()) {
        Column column = {child.getStringProperty("name"), child.getName() == "Reals", {}, {}};
        const string& values = child.getStringProperty("values");
        if (column.isReal)
            column.reals = asValues<double>(column.name, values);
        else
            column.integers = asValues<long long>(column.name, values);
        result.columns.push_back(column);
    }
    return result;
}
