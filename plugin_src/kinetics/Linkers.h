#ifndef CYLCHAIN_LINKERS_H_
#define CYLCHAIN_LINKERS_H_

#include "couplings/Place.h"
#include "couplings/TwistedContour.h"
#include "couplings/Walls.h"
#include "mechanics/ChainList.h"
#include <cstddef>
#include <cstdint>
#include <functional>
#include <limits>
#include <vector>

namespace cylchain {

/** What a hand has to do with an end of chains that grow. */
struct HandAtEnd {
    /** The plus end (1), the minus end (0), or either (2), or -1 for none, and how near to it counts as there. */
    int end = -1;
    double range = 0;
    bool isAt(int one) const {
        return end == one || end == 2;
    }
    /** Whether it binds there alone, and whether it stays there while the end grows, once it has come. */
    bool bindsThere = false, tracks = false;
    /** The state that an end changes to while it is there, from another one; -1 if it changes none. */
    int freeState = -1, heldState = -1;
    /** The chains the ends of which it changes. */
    std::vector<int> changes = {};
    /** The rate at which it takes monomers off an end, and how many of them do so at most. */
    double offRate = 0;
    int sites = std::numeric_limits<int>::max();
    /** The rate of unbinding there without load, or -1 if it is that of the hand. */
    double unbindingRate = -1;
};

/** The part of a chain to which a hand binds: what is near to an end, or all else. */
struct BindingRange {
    /** The plus end (1), the minus end (0), or either (2); -1 if it binds to all of the chain. */
    int end = -1;
    /** How near to it is near. */
    double range = 0;
    /** Whether it binds to all else. */
    bool excluded = false;
};

/** An end at which a hand is that changes its state. */
struct HeldEnd {
    int chain, end, freeState, heldState;
};

/**
 * How a hand binds to filaments, walks along them and unbinds. Lengths along a filament are those of its segments at
 * rest.
 */
struct Hand {
    /** The rate of binding per length of filament, where that strains no spring. */
    double bindingRate = 0;
    /** The largest distance between the other hand, or the anchor, and the place where it binds. */
    double reach = 0;
    /** The rate of unbinding without load, k. */
    double unbindingRate = 0;
    /**
     * The share lambda of the energy U of the spring that speeds up unbinding: it binds with exp(-(1-lambda) U/k_B T)
     * and unbinds with k exp(lambda U/k_B T).
     */
    double strainShare = 0;
    /** If positive, unbinding has the rate k exp(F/F_u) under the load F: Bell's law. */
    double unbindingForce = 0;
    /** A second pathway has the rate k_c exp(-F/F_c): k_c, and F_c if it is not zero. */
    double catchRate = 0, catchForce = 0;
    /** The speed without load, towards the plus end; towards the minus end if negative. */
    double speed = 0;
    /** The load that stops it. */
    double stallForce = 0;
    /** Whether a load above that makes it walk backward. */
    bool walksBackward = false;
    /** Whether it stays at the end to which it has walked, or lets go. */
    bool holdsAtEnds = false;
    /** If positive, it binds to sites this far apart along filaments, which hold one hand each. */
    double siteSpacing = 0;
    /** If positive, a hand slides at random, and under the force of the spring, with this friction. */
    double slidingFriction = 0;
    /** The rate at which it cuts chains that grow where it is bound. */
    double severingRate = 0;
    BindingRange bindingRange;
    HandAtEnd atEnd;
    HandOnHelix helix;
    /** Whether the rate of unbinding depends on what the spring does. */
    bool isLoaded() const {
        return strainShare > 0 || unbindingForce > 0 || (catchRate > 0 && catchForce > 0);
    }
    /** The chains to which it binds, in ascending order. */
    std::vector<int> chains;
};

/** Linkers of a kind: two hands on a spring, or a hand on a spring that is anchored. */
struct LinkerType {
    /** The numbers of hands; the first is -1 if linkers are anchored. */
    int hands[2] = {-1, -1};
    double stiffness = 0, restLength = 0;
    /** Whether both hands may bind to the same chain. */
    bool sameChain = false;
    /** The second hand to bind does so where the cosine of the angle between both chains is between these. */
    double leastCosine = -1, largestCosine = 1;
    /** Whether the second hand binds only while the first one is bound, which binds only before it. */
    bool transActivated = false;
    /** Whether hands unbind only where and when they could bind by these rules. */
    bool reversible = true;
    /**
     * If positive, both hands bind at once, the second one so far from the first one along the same chain, towards its
     * plus end; and they unbind at once.
     */
    double loadingDistance = 0;
    bool loadsPairs() const {
        return loadingDistance > 0;
    }
    bool hasAngles() const {
        return leastCosine > -1 || largestCosine < 1;
    }
    /** Whether a hand may bind while the other one is held, or is not. */
    bool mayBind(int side, bool isOtherHeld) const {
        if (loadsPairs())
            return side == 0 && !isOtherHeld;
        return !transActivated || (side == 1) == isOtherHeld;
    }
    /** Whether a hand stays as long as the other one is held. */
    bool mustStay(int side) const {
        return transActivated && reversible && side == 0;
    }
    /**
     * Linkers that are not bound are anywhere in this volume; that of the periodic box if it is zero. Where their
     * concentration is kept, the volume has no effect.
     */
    double volume = 0;
    /** If not negative, there are always this many unbound linkers in a volume, beside those that are bound. */
    double concentration = -1;
    /**
     * If not negative, linkers that are not bound have positions of their own, with this diffusion coefficient. Those
     * that are planar stay in the plane z = 0.
     */
    double diffusion = -1;
    bool planar = false;
    /** What they are within then; those of the System if there are none. */
    std::vector<Wall> walls = {};
    bool diffuses() const {
        return diffusion >= 0;
    }
};

/** What captures hands that walk past it along a chain. */
struct Barrier {
    int chain;
    /** The length along the chain. */
    double position;
    /** It captures hands that walk towards the plus end (1), the minus end (-1), or either (0). */
    int direction;
    /** How likely it captures a hand, which it then holds until it lets it go on with this rate. */
    double captureProbability, releaseRate;
    bool captures(double speed) const {
        return speed != 0 && (direction == 0 || (direction > 0) == (speed > 0));
    }
};

/** What holds chains that begin as branches by a nucleator: a linker of each of some types. */
struct BranchJoint {
    int nucleator;
    /** They must be of nothing else. */
    std::vector<int> types;
    /** Where they hold the mother, beyond the place of the branch, and the branch. */
    std::vector<double> onMother, onBranch;
};

/** Where a hand is bound. */
struct HandPlace {
    /** -1 if it is not. */
    int chain = -1;
    /** The length along the chain from its minus end. */
    double position = 0;
    bool isBound() const {
        return chain >= 0;
    }
};

/** The torque of its chain on a hand, about the direction towards the plus end. */
typedef std::function<double(const Hand& hand, const HandPlace& place)> TorqueOnHand;

/** Let a place be on the part of a chain that was cut to which it belongs, or on none if that has vanished. */
template <class AlongChain> void followCut(const ChainCut& cut, AlongChain& place) {
    if (place.chain == cut.chain && place.position > cut.along)
        place.chain = cut.part;
}

/** A hand that cuts the chain to which it is bound, or takes monomers off an end: where it is, its rate in 1/ps. */
struct ActingHand {
    int chain;
    double position, rate;
    /** The end, or -1 if it cuts. */
    int end;
};

/** A linker. */
struct Linker {
    /** Its number among all linkers there have ever been: its random numbers belong to it. */
    std::uint32_t number = 0;
    int type = 0;
    /** The number of the anchor in the place of its first hand, or -1. */
    int anchor = -1;
    HandPlace hands[2];
    bool isHeld(int side) const {
        return hands[side].isBound() || (side == 0 && anchor >= 0);
    }
    /** Whether its spring joins two places. */
    bool pulls() const {
        return isHeld(0) && isHeld(1);
    }
};

/** How often hands have bound, and unbound for whatever reason. */
struct LinkerEvents {
    std::uint64_t bindings = 0, unbindings = 0;
};

/** The number of the LinkerKinetics that has derived arrays of a state; those of a copy are not known. */
struct KnownTo {
    std::uint64_t number = 0;
    KnownTo() = default;
    KnownTo(const KnownTo&) {
    }
    KnownTo& operator=(const KnownTo&) {
        number = 0;
        return *this;
    }
};

/** The coordinates of linkers that have no position. */
const double NO_POSITION = std::numeric_limits<double>::quiet_NaN();

/** All that changes while linkers bind and unbind. */
struct LinkerState {
    /** In the order of their numbers. What is changed between steps is changed in a copy. */
    std::vector<Linker> linkers;
    /**
     * Of each linker, the integral of its rates over time until its next event, which has an exponential distribution
     * with the mean 1; if it is not positive, or not there, it is drawn when it is needed.
     */
    std::vector<double> clocks;
    /** Of each linker that diffuses and is not bound, three numbers, and NaN of others; empty if none diffuses. */
    std::vector<double> positions;
    std::uint32_t nextNumber = 0;
    /** How many steps have been taken. */
    std::uint64_t steps = 0;
    /** Of each type of linkers; none before the first step. */
    std::vector<LinkerEvents> events;
    KnownTo knownTo;
    double getClock(std::size_t linker) const {
        return linker < clocks.size() ? clocks[linker] : 0;
    }
};

/** Kinds of linkers, what they are anchored at, and the temperature. */
struct LinkerSystem {
    std::vector<Hand> hands;
    std::vector<LinkerType> types;
    std::vector<Place> anchors;
    double kT = 0;
    std::vector<Barrier> barriers = {};
    /** Linkers that diffuse are within all of these, or those of their type. */
    std::vector<Wall> walls = {};
    const std::vector<Wall>& wallsOf(const LinkerType& type) const {
        return type.walls.empty() ? walls : type.walls;
    }
    bool anyDiffuses() const {
        for (const LinkerType& type : types)
            if (type.diffuses())
                return true;
        return false;
    }
    /** Whether a linker is of those that diffuse, and holds nothing. */
    bool isFree(const Linker& linker) const {
        return types[linker.type].diffuses() && !linker.isHeld(0) && !linker.isHeld(1);
    }
};

} // namespace cylchain

#endif /*CYLCHAIN_LINKERS_H_*/
