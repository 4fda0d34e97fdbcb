#ifndef OPENMM_STATECOLUMNS_H_
#define OPENMM_STATECOLUMNS_H_

#include <cstddef>
#include <iosfwd>
#include <string>
#include <type_traits>
#include <vector>

namespace OpenMM {

class SerializationNode;

/**
 * Numbers in columns that have names: what a Force stores of a Context beside positions, in checkpoints and in XML.
 */
class StateColumns {
public:
    /**
     * Add a column.
     */
    template <class T> void put(const std::string& name, const std::vector<T>& values) {
        Column column = {name, !std::is_integral<T>::value, {}, {}};
        if constexpr (std::is_integral<T>::value)
            column.integers.assign(values.begin(), values.end());
        else
            column.reals.assign(values.begin(), values.end());
        columns.push_back(column);
    }
    /**
     * Add a column of one number.
     */
    template <class T> void put(const std::string& name, T value) {
        put(name, std::vector<T>(1, value));
    }
    /**
     * Get whether there is a column.
     */
    bool has(const std::string& name) const;
    /**
     * Get a column; an exception is thrown if there is none of this name, with numbers of this kind.
     */
    template <class T> std::vector<T> get(const std::string& name) const {
        const Column& column = find(name, !std::is_integral<T>::value);
        if constexpr (std::is_integral<T>::value)
            return std::vector<T>(column.integers.begin(), column.integers.end());
        else
            return column.reals;
    }
    /**
     * Get the number of a column of one number.
     */
    template <class T> T getOne(const std::string& name) const {
        const std::vector<T> values = get<T>(name);
        checkOne(name, values.size());
        return values[0];
    }
    void write(std::ostream& stream) const;
    void write(SerializationNode& node) const;
    /**
     * Read columns; an exception is thrown if a stream ends before they do.
     */
    static StateColumns read(std::istream& stream);
    static StateColumns read(const SerializationNode& node);
private:
    struct Column {
        std::string name;
        bool isReal;
        std::vector<long long> integers;
        std::vector<double> reals;
    };
    const Column& find(const std::string& name, bool isReal) const;
    static void checkOne(const std::string& name, std::size_t size);
    std::vector<Column> columns;
};

} // namespace OpenMM

#endif /*OPENMM_STATECOLUMNS_H_*/
