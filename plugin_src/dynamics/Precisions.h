#ifndef CYLCHAIN_PRECISIONS_H_
#define CYLCHAIN_PRECISIONS_H_

#include "mechanics/Enumerators.h"

/**
 * The precision that chains are computed in. Positions, forces and displacements are doubles in any case.
 *
 * - Automatic: mixed precision where it is right, and faster.
 * - Mixed: single precision within a step, wherever it is right: see docs/design/implicit_scheme.md.
 * - Double: double precision.
 */
#define CYLCHAIN_PRECISIONS(ENTRY) \
    ENTRY(Automatic, "automatic") \
    ENTRY(Mixed, "mixed") \
    ENTRY(Double, "double")

namespace cylchain {

enum class Precision {CYLCHAIN_PRECISIONS(CYLCHAIN_ENUMERATOR)};

template <> struct Names<Precision> {
    static constexpr const char* ALL[] = {CYLCHAIN_PRECISIONS(CYLCHAIN_NAME)};
};

} // namespace cylchain

#endif /*CYLCHAIN_PRECISIONS_H_*/
