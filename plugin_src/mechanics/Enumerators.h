#ifndef CYLCHAIN_ENUMERATORS_H_
#define CYLCHAIN_ENUMERATORS_H_

#include <iterator>
#include <string>
#include <vector>

/**
 * What follows from a list of models, schemes or precisions: a macro that calls another one for each entry, with its
 * name in C++, its name for users and perhaps more.
 *
 * The number of an entry is its position. Stored Integrators hold it, so that new schemes and precisions come last;
 * stored Systems hold the names of models.
 */
#define CYLCHAIN_ENUMERATOR(entry, ...) entry,
#define CYLCHAIN_NAME(entry, name, ...) name,

namespace cylchain {

/** The names of the entries of an enumeration; each list specialises it. */
template <class Enumeration> struct Names;

/** The number of entries of an enumeration. */
template <class Enumeration> constexpr int countOf() {
    return static_cast<int>(std::size(Names<Enumeration>::ALL));
}

/** Whether an enumeration has an entry with a number. */
template <class Enumeration> constexpr bool isEntry(int number) {
    return number >= 0 && number < countOf<Enumeration>();
}

/** Whether a value is that of an entry. */
template <class Enumeration> constexpr bool isEntry(Enumeration value) {
    return isEntry<Enumeration>(static_cast<int>(value));
}

/** The number of entries for which something holds. */
template <class Enumeration> constexpr int countWhere(bool (*holds)(Enumeration)) {
    int count = 0;
    for (int i = 0; i < countOf<Enumeration>(); i++)
        count += holds(static_cast<Enumeration>(i)) ? 1 : 0;
    return count;
}

/**
 * Where a switch over all entries of a list ends. What takes numbers from outside has refused those of no entry; see
 * isEntry().
 */
[[noreturn]] inline void noOtherEntry() {
    __builtin_unreachable();
}

/** The names of all entries, in the order of their numbers. */
template <class Enumeration> std::vector<std::string> namesOf() {
    return {std::begin(Names<Enumeration>::ALL), std::end(Names<Enumeration>::ALL)};
}

} // namespace cylchain

#endif /*CYLCHAIN_ENUMERATORS_H_*/
