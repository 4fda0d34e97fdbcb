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
#define CYLCHAIN_ANGULAR_BENDING_MODELS(ENTRY) \
    ENTRY(KratkyPorod, "kratky-porod") \
    ENTRY(Quadratic, "quadratic") \
    ENTRY(InscribedCircle, "inscribed-circle")

/**
 * All bending energies: those of an angle, and one of the vectors u1 and u2 of the segments, whose force is linear in
 * the nodes.
 *
 * - BondDifference: (b/2) |u2-u1|^2, with b per square of a length: Panja, Barkema and van Leeuwen, Phys. Rev. E 2015,
 *   92, 032603, eq. (8)
 */
#define CYLCHAIN_BENDING_MODELS(ENTRY) \
    CYLCHAIN_ANGULAR_BENDING_MODELS(ENTRY) \
    ENTRY(BondDifference, "bond-difference")

namespace cylchain {

enum class BendingModel {CYLCHAIN_BENDING_MODELS(CYLCHAIN_ENUMERATOR)};

/** Whether the force of a joint is linear in its nodes. */
constexpr bool isLinear(BendingModel model) {
    return model == BendingModel::BondDifference;
}

/** Whether a model is the last of those of an angle. */
constexpr bool isLastAngular(BendingModel model) {
    return static_cast<int>(model)+1 == static_cast<int>(BendingModel::BondDifference);
}

template <> struct Names<BendingModel> {
    static constexpr const char* ALL[] = {CYLCHAIN_BENDING_MODELS(CYLCHAIN_NAME)};
};

} // namespace cylchain

#endif /*CYLCHAIN_BENDING_MODELS_H_*/
