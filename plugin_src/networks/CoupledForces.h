#ifndef CYLCHAIN_COUPLED_FORCES_H_
#define CYLCHAIN_COUPLED_FORCES_H_

#include "networks/ParticleStep.h"
#include <vector>

namespace cylchain {

class ImplicitCouplings;

/** Forces that couple chains with each other and with particles outside of them, for implicit steps to take. */
struct CoupledForces {
    /** Those that are gaps come last; NULL for each where a platform has no equations of it. */
    std::vector<ImplicitCouplings*> couplings;
    /** The particles outside chains that these forces act on, in ascending order. */
    std::vector<CoupledParticle> particles;
    bool empty() const {
        return couplings.empty();
    }
};

} // namespace cylchain

#endif /*CYLCHAIN_COUPLED_FORCES_H_*/
