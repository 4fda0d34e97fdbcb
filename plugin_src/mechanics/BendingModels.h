#ifndef CYLCHAIN_BENDING_MODELS_H_
#define CYLCHAIN_BENDING_MODELS_H_

#include "mechanics/Enumerators.h"

/**
 * The bending energies of a joint, for a stiffness b, and the kind of its bends.
 *
 * Angular ones depend on the tangents of the joint's segments, which have the cosine c and the angle theta; b is a/l0:
 *
 * - KratkyPorod: b (1-c), eq. (26)
 * - Quadratic: (b/2) theta^2
 * - InscribedCircle: 2b (1-c)/(1+c), eq. (27), which diverges where a joint folds back
 *
 * Linear ones depend on the vectors u1 and u2 of the segments, so that their forces are linear in the nodes; b is per
 * square of a length:
 *
 * - BondDifference: (b/2) |u2-u1|^2: Panja, Barkema and van Leeuwen, Phys. Rev. E 2015, 92, 032603, eq. (8)
 *
 * A new one takes an entry here, the struct of its name in BendingModels-inl.h, which has its formulas, and the same
 * energy in openmm_cylchain, among BENDING_POTENTIALS.
 */
#define CYLCHAIN_BENDING_MODELS(ENTRY) \
    ENTRY(KratkyPorod, "kratky-porod", Angular) \
    ENTRY(Quadratic, "quadratic", Angular) \
    ENTRY(InscribedCircle, "inscribed-circle", Angular) \
    ENTRY(BondDifference, "bond-difference", Linear)

namespace cylchain {

enum class BendingModel {CYLCHAIN_BENDING_MODELS(CYLCHAIN_ENUMERATOR)};

/** The kinds of bends. Steps have a kind of coordinates for each: see dynamics/coordinates. */
enum class BendKind {Angular, Linear};

/** The kind of the bends of a model. */
constexpr BendKind kindOf(BendingModel model) {
    switch (model) {
#define CYLCHAIN_CASE(entry, name, kind) case BendingModel::entry: return BendKind::kind;
        CYLCHAIN_BENDING_MODELS(CYLCHAIN_CASE)
#undef CYLCHAIN_CASE
    }
    noOtherEntry();
}

constexpr bool isAngular(BendingModel model) {
    return kindOf(model) == BendKind::Angular;
}

/** Whether the forces of joints are linear in their nodes. */
constexpr bool isLinear(BendingModel model) {
    return kindOf(model) == BendKind::Linear;
}

template <> struct Names<BendingModel> {
    static constexpr const char* ALL[] = {CYLCHAIN_BENDING_MODELS(CYLCHAIN_NAME)};
};

} // namespace cylchain

#endif /*CYLCHAIN_BENDING_MODELS_H_*/
