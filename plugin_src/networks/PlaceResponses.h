#ifndef CYLCHAIN_PLACE_RESPONSES_H_
#define CYLCHAIN_PLACE_RESPONSES_H_

#include "networks/ChainPlaces.h"
#include <vector>

namespace cylchain {

/**
 * How a unit force across a chain moves the place that it acts on in a step of the length h.
 *
 * A beam with the rigidity kappa and the friction zeta for each length is moved as one that lies on a foundation of the
 * stiffness zeta/h, over the length w = (kappa h/zeta)^(1/4): at the distance s from an end by
 *
 *     h/(2^(3/2) zeta w) (1+exp(-2x) (1+2 cos x (cos x-sin x))),  x = s/(2^(1/2) w),
 *
 * see M. Hetenyi, Beams on Elastic Foundation, 1946. A chain much shorter than w moves as a rod, a segment much longer
 * than w as if it were alone. What lies between is found within 20 %: within 7 % for ten segments or more.
 */
class PlaceResponses {
public:
    /** Set chains, which must exist while responses are found, and the length of the step. */
    void begin(const ChainPlaces& places, double stepSize);
    double find(const PlaceOnChain& place) const {
        return find(place, places->findLateralFriction(place));
    }
    /** The same where the friction of the segment is at hand: see ChainPlaces::findLateralFriction(). */
    double find(const PlaceOnChain& place, const LateralFriction& friction) const;
    /** Find what no place of a chain, or a particle, responds less than. It takes less time. */
    double findLeast(int chain) const;
    /**
     * Get whether places of a chain at neighbouring nodes are moved together by what moves one of them. Those of beam
     * elements are: several of them are on one element.
     */
    bool moveTogether(int chain) const;
private:
    /** A chain, as a beam and as a rod. */
    struct Beam {
        double length = 0, wave = 0, bending = 0, whole = 0;
        /** The least response of a place. */
        double least = 0;
        int segments = 0;
        bool closed = false;
    };
    void describe(double friction, double rigidity, Beam& beam) const;
    const ChainPlaces* places = nullptr;
    double stepSize = 0;
    std::vector<Beam> beams;
};

} // namespace cylchain

#endif /*CYLCHAIN_PLACE_RESPONSES_H_*/
