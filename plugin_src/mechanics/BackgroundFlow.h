#ifndef CYLCHAIN_BACKGROUND_FLOW_H_
#define CYLCHAIN_BACKGROUND_FLOW_H_

#include <cstddef>

namespace cylchain {

/** A fluid that moves with the velocity velocity+gradient (x-origin); friction is relative to it. */
struct BackgroundFlow {
    bool present = false;
    double velocity[3] = {};
    /** Row by row: the derivatives of the first component of the velocity come first. */
    double gradient[9] = {};
    double origin[3] = {};
    /** The three vectors of a periodic box (nine doubles), to take the image that is nearest to the origin, or NULL. */
    const double* box = NULL;
    /** Whether the velocity is not the same everywhere. */
    bool varies() const;
    /** The velocity at x. */
    void getVelocity(const double* x, double* velocity) const;
    /**
     * The flow whose velocity at x is the mean of that of a particle that is carried along from there for some time,
     * either in space or within a plane of constant z.
     */
    BackgroundFlow carriedAlong(double time, bool planar) const;
};

} // namespace cylchain

#endif /*CYLCHAIN_BACKGROUND_FLOW_H_*/
