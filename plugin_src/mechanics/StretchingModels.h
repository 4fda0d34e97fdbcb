#ifndef CYLCHAIN_STRETCHING_MODELS_H_
#define CYLCHAIN_STRETCHING_MODELS_H_

#include "mechanics/Enumerators.h"

/**
 * The stretching energies of a segment of length l, rest length l0 and stiffness k, and whether they keep the length
 * within a range, from l0-D to l0+D. The formulas of each are in the struct of its name in StretchingModels-inl.h.
 *
 * - Harmonic: (k/2) (l-l0)^2, eq. (7)
 * - FENE: -(k/2) D^2 ln(1-((l-l0)/D)^2)
 */
#define CYLCHAIN_STRETCHING_MODELS(ENTRY) \
    ENTRY(Harmonic, "harmonic", false) \
    ENTRY(FENE, "fene", true)

namespace cylchain {

enum class StretchingModel {CYLCHAIN_STRETCHING_MODELS(CYLCHAIN_ENUMERATOR)};

template <> struct Names<StretchingModel> {
    static constexpr const char* ALL[] = {CYLCHAIN_STRETCHING_MODELS(CYLCHAIN_NAME)};
};

/** Whether a model keeps lengths within a range. */
constexpr bool hasRange(StretchingModel model) {
    switch (model) {
#define CYLCHAIN_CASE(entry, name, range) case StretchingModel::entry: return range;
        CYLCHAIN_STRETCHING_MODELS(CYLCHAIN_CASE)
#undef CYLCHAIN_CASE
    }
    noOtherEntry();
}

} // namespace cylchain

#endif /*CYLCHAIN_STRETCHING_MODELS_H_*/
