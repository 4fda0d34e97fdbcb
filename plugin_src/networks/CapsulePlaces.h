#ifndef CYLCHAIN_CAPSULE_PLACES_H_
#define CYLCHAIN_CAPSULE_PLACES_H_

#include "couplings/Capsules.h"
#include "mechanics/Prefetch.h"
#include "networks/CurveSites.h"
#include "networks/ImplicitCouplings.h"
#include <utility>
#include <vector>

namespace cylchain {

/** Where capsules are on what takes a step, or a part of it: others are held. */
class CapsulePlaces {
public:
    /** Find them, where particles are at the start. Capsules on curves are among the capsules. */
    void begin(const CoupledStart& start, const std::vector<Capsule>& capsules,
            const std::vector<CapsuleOnCurve>& onCurves, const Loop& loop);
    int size() const {
        return places.size();
    }
    /** Get the place of a capsule at its fraction 0; its pack is -1 if the capsule is held. */
    const PlaceOnChain& get(int capsule) const {
        return places[capsule].place;
    }
    PlaceOnChain get(int capsule, double fraction) const {
        PlaceOnChain place = places[capsule].place;
        place.fraction += places[capsule].direction*fraction;
        return place;
    }
    /** Ask for what get() needs soon. */
    void prefetchPlace(int capsule) const {
        prefetch(&places[capsule]);
    }
    bool isHeld(int capsule) const {
        return places[capsule].place.pack < 0;
    }
    bool areHeld(const ContactPair& pair) const {
        return isHeld(pair.a) && isHeld(pair.b);
    }
    /** Mark the chains of a pair, or of all capsules, as those that a step has failed for. */
    void fail(const ContactPair& pair, std::vector<bool>& failed) const;
    void failAll(std::vector<bool>& failed) const;
    /** Add the chains of a pair, if both take part. */
    void addNeighbours(const ContactPair& pair, std::vector<std::pair<int, int> >& neighbours) const;
    /** Say which pair, or whose motion, a step has gone wrong by. */
    void name(const ContactPair& pair, BrokenCoupling& culprit) const;
    void nameFastest(const std::vector<Capsule>& capsules, const double* begun, const double* moved,
            BrokenCoupling& culprit) const;
private:
    /** The place at fraction 0, and by how much the fraction on the chain grows along the capsule. */
    struct CapsulePlace {
        PlaceOnChain place;
        double direction;
    };
    std::vector<CapsulePlace> places;
};

} // namespace cylchain

#endif /*CYLCHAIN_CAPSULE_PLACES_H_*/
