#ifndef OPENMM_CHECKPOINTVALUES_H_
#define OPENMM_CHECKPOINTVALUES_H_

#include "openmm/OpenMMException.h"
#include <istream>
#include <ostream>
#include <string>

namespace OpenMM {

/**
 * Write a number to a checkpoint.
 */
template <class T> void writeValue(std::ostream& stream, const T& value) {
    stream.write(reinterpret_cast<const char*>(&value), sizeof(value));
}

/**
 * Read a number from a checkpoint; an exception is thrown if it ends before.
 *
 * @param within  what is being read, for the message
 */
template <class T> T readValue(std::istream& stream, const char* within) {
    T value = T();
    stream.read(reinterpret_cast<char*>(&value), sizeof(value));
    if (!stream)
        throw OpenMMException(std::string("loadCheckpoint: The checkpoint ends within ")+within);
    return value;
}

/**
 * Write a text to a checkpoint.
 */
inline void writeText(std::ostream& stream, const std::string& text) {
    writeValue(stream, (int) text.size());
    stream.write(text.data(), text.size());
}

/**
 * Read a text from a checkpoint.
 */
inline std::string readText(std::istream& stream, const char* within) {
    std::string text;
    for (int i = readValue<int>(stream, within); i > 0; i--)
        text.push_back(readValue<char>(stream, within));
    return text;
}

} // namespace OpenMM

#endif /*OPENMM_CHECKPOINTVALUES_H_*/
