#ifndef CYLCHAIN_STAGE_WEIGHTS_H_
#define CYLCHAIN_STAGE_WEIGHTS_H_

#include <cmath>

namespace cylchain {

/** The stages of particles, links and walls are those of chains: see dynamics/ImplicitState-inl.h. */
const double DIAGONAL = 1-M_SQRT1_2, NOISE_OF_FIRST = DIAGONAL/(1-DIAGONAL);

} // namespace cylchain

#endif /*CYLCHAIN_STAGE_WEIGHTS_H_*/
