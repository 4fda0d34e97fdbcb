#ifndef CYLCHAIN_PERIODIC_BOX_H_
#define CYLCHAIN_PERIODIC_BOX_H_

namespace cylchain {

/** Take a displacement to its nearest image in a box, which is nine doubles: its three vectors. */
void takeToNearestImage(double* displacement, const double* box);

} // namespace cylchain

#endif /*CYLCHAIN_PERIODIC_BOX_H_*/
