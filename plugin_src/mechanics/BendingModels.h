#ifndef CYLCHAIN_BENDING_MODELS_H_
#define CYLCHAIN_BENDING_MODELS_H_

#include "mechanics/Enumerators.h"

/**
 * The bending energies of a joint whose segments have tangents with the cosine c and the angle theta, for a stiffness
 * b, which is a/l0. A new one takes an entry here, the struct of its name in BendingModels-inl.h, which has its
 * formulas, and the same energy in openmm_cylchain, among BENDING_POTENTIALS.
 *
 * - KratkyPorod: b (1-c), eq. (26)
 * - Quadratic: (b/2) theta^2
 * - InscribedCircle: 2b (1-c)/(1+c), eq. (27), which diverges where a joint folds back
 */
#define CYLCHAIN_BENDING_MODELS(ENTRY) \
    ENTRY(KratkyPorod, "kratky-porod") \
    ENTRY(Quadratic, "quadratic") \
    ENTRY(InscribedCircle, "inscribed-circle")

namespace cylchain {

enum class BendingModel {CYLCHAIN_BENDING_MODELS(CYLCHAIN_ENUMERATOR)};

template <> struct Names<BendingModel> {
    static constexpr const char* ALL[] = {CYLCHAIN_BENDING_MODELS(CYLCHAIN_NAME)};
};

} // namespace cylchain

#endif /*CYLCHAIN_BENDING_MODELS_H_*/
