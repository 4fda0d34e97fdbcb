#ifndef CYLCHAIN_LINKER_KINETICS_H_
#define CYLCHAIN_LINKER_KINETICS_H_

#include "couplings/Contours.h"
#include "couplings/Links.h"
#include "kinetics/LinkerRegion.h"
#include "kinetics/Linkers.h"
#include "kinetics/RandomNumbers.h"
#include "kinetics/SegmentCells.h"
#include "mechanics/Loop.h"
#include <cstddef>
#include <cstdint>
#include <unordered_set>
#include <vector>

namespace cylchain {

/** A step in which linkers bind, unbind and walk. */
struct KineticStep {
    /** Those of all particles, which do not move. */
    const double* positions;
    LinkBoxes boxes;
    /** The volume of linkers that are not bound, if theirs is not given. */
    double volume;
    double stepSize;
    std::uint32_t seed;
    /** The number of the Force, to which random numbers belong. */
    std::uint32_t force;
    /** Of hands that a torque stops. */
    TorqueOnHand torqueOnHand = nullptr;
};

/**
 * Linkers that bind to chains, walk along them and unbind.
 *
 * In a step, each linker is a Markov process in continuous time, in which all chains stand still; then hands that are
 * bound walk for as long as the step takes. A hand that has bound in the step walks as far as all others do, and as the
 * chain will move: in the other order it would hold that back, which was slower by the share of hands that unbind in a
 * step. With c the rate of binding per length, the reach R, the volume v = (4 pi/3) (R_1 R_2)^(3/2), and
 * U the energy of the spring between two places,
 *
 *     unbound -> one hand bound           c v/V for each length of chains, V the volume of unbound linkers,
 *     one hand bound -> both hands bound  c exp(-(1-lambda) U/k_B T) for each length of chains within reach,
 *     a hand unbinds                      k exp(lambda U/k_B T), or k exp(F/F_u), plus k_c exp(-F/F_c).
 *
 * With the first law of unbinding, without speed, and if no place within which the spring counts is out of reach, the
 * process and its inverse are equally likely in equilibrium, whatever the step is. Binding is drawn by thinning: places
 * are proposed along all segments around, and accepted by their energy.
 *
 * Linkers of a type that diffuses have positions while they are not bound. In a step they move first, with the
 * coefficient D; a hand then binds with the rate c (R'/R)^(3/2) for each length of chains within its own reach R of the
 * position, R' being that of the other hand, and unbinds to anywhere in a sphere with the radius R. With the density n
 * of linkers, that is the rate c v n for each length of chains, and one way is as likely as the other: numbers in
 * equilibrium are those without positions. In the plane, v is the area pi R_1 R_2, and the rate c R'/R. Neither moves
 * nor unbinding leave the region; what would do so does not happen, and the same is missing on the way back.
 *
 * There may be rules for which hands bind. They multiply rates of binding by zero or one, by where chains are in the
 * step, and, where they are reversible, rates of unbinding by the same number. So one way stays as likely as the other:
 * equilibrium has all of the states that there are without a rule on angles, between which chains turn.
 *
 * Linkers that load as pairs bind both hands in one event, and unbind both in one: with the sum of the rates of both.
 *
 * A hand that walks past a barrier may be captured. It is at the very place of the barrier then, or off the middle of
 * its site, and is known by that: as long as it is there, it does not walk.
 *
 * Hands slide as a part of a step of their own, after events: with the spring's energy U(s) at the length s along the
 * chain, and the friction f, by ds = -U' dt/f+(2 k_B T/f)^(1/2) dW. A move is proposed that is exact for the harmonic
 * energy with the slope at s and the stiffness of the spring, and accepted by Metropolis and Hastings: equilibrium is
 * exact at any step.
 *
 * Each linker has a clock: the integral of its rates over time until its next event. Steps take it down, and only where
 * it runs out is anything drawn. Most rates follow from the type of a linker, from what it holds, and from how many
 * pieces of chains are around the piece that it holds: a step looks at two numbers of a linker, and nothing else.
 * Random numbers belong to the seed, the number of the step and that of the linker. Linkers are independent of each
 * other, except for sites that hold one hand each: what happens to linkers whose hands bind to sites is in the order
 * of time.
 */
class LinkerKinetics {
public:
    /**
     * @param chains  the chains of the System; they are not needed any more afterwards
     */
    LinkerKinetics(const LinkerSystem& system, const ChainList& chains);
    /** Set the temperature. */
    void setTemperature(double kT) {
        system.kT = kT;
    }
    /** Set within which walls linkers are that diffuse. */
    void setWalls(const std::vector<Wall>& walls) {
        system.walls = walls;
    }
    /** Give positions to linkers that diffuse and have none; false if there is no room within the walls. */
    bool placeFree(LinkerState& state, const KineticStep& step) const {
        return placeFreeLinkers(state, system, step.boxes.distances, step.seed, step.force);
    }
    /**
     * Take note that chains have grown, shrunk, or were cut. Hands beyond an end let go, or stay there.
     *
     * @param cuts  where chains were cut, one after the other: hands keep their lengths along them
     * @param step  where chains are, and to which random numbers belong
     * @return whether there were any such hands, or hands on other chains than before
     */
    bool setChains(const ChainList& chains, const std::vector<ChainCut>& cuts, LinkerState& state,
            const KineticStep& step);
    /**
     * Take a step.
     *
     * @param links  the springs of linkers that join two places then, unless it is NULL
     * @return the number of a linker the rates of which are too large for the step, or -1; or -2 less the number of a
     *         type, if too many of its linkers come out of their concentration
     */
    long long advance(LinkerState& state, const KineticStep& step, const Loop& loop,
            std::vector<Link>* links = nullptr);
    /** Describe the springs of linkers that join two places. */
    void describe(const LinkerState& state, std::vector<Link>& links) const;
private:
    /** Between the two places of a linker: from the first to the second, and what the spring does. */
    struct Spring {
        double vector[3] = {0, 0, 0}, distance = 0, energy = 0, force = 0;
    };
    /** The energy of a linker, and the mean and the variance of the move that is proposed to a hand which slides. */
    struct Slope {
        double energy, mean, variance;
    };
    /** Where hands are that bind to sites: numbers of chain, spacing and site. */
    typedef std::unordered_set<std::uint64_t> Sites;
    struct Event;
    struct Pending;
    /** After so many events of a linker in a step, or so many rounds of a ring, something is wrong with rates. */
    static constexpr int MOST_EVENTS = 100000;
    /** Linkers that a thread looks at together: enough of them pull for what is asked for ahead. */
    static constexpr int CHUNK = 512;
    struct Count {
        /** Of each type. */
        std::vector<LinkerEvents> events;
        long long failed = -1;
    };
    /** What is known of linkers of a type that hold the same: where their rates come from. */
    struct Kind {
        /** The sum of rates other than of binding around; -1 where it depends on the spring. */
        double rate = 0;
        /** Of binding, for each piece around. */
        double perPiece = 0;
        /** Of a hand that walks without a load, towards the plus end, if the linker holds nothing else. */
        double velocity = 0;
        /** Of linkers that are not bound and have positions: the width of the distribution of a move. */
        double width = 0;
        /** If not zero, they are taken to have so many pieces around them, wherever they are. */
        unsigned most = 0;
        bool isFree = false, isPlanar = false;
        /** Whether hands move that are bound to no sites, and whether any of them slides. */
        bool walks = false, slides = false, isStoppedByTorque = false;
        bool atAnchor = false, sameChain = false, needsSites = false, pulls = false;
        /** Whether a step has nothing to do for it as long as its clock does not run out. */
        bool rests = false;
    };
    /**
     * What a step needs to know of a linker: its kind, and its anchor, or where the number around its piece is; the
     * number of one that is free.
     */
    struct Watch {
        int kind = 0, where = -1;
    };
    bool usesSites(const LinkerType& type) const;
    Place placeOf(const Linker& linker, int side) const;
    Spring measure(const Linker& linker, const KineticStep& step) const;
    bool isAligned(const HandPlace& first, const HandPlace& second, const LinkerType& type,
            const KineticStep& step) const;
    bool isInRange(const Hand& hand, const HandPlace& place) const;
    double energyOf(const LinkerType& type, double distance) const;
    double reduced(double energy) const;
    double proposalRate(const Hand& hand) const;
    double unbindingRate(const Hand& hand, const HandPlace& place, double energy, double force) const;
    bool isAtItsEnd(const Hand& hand, const HandPlace& place) const;
    static int findTrackedEnd(const Hand& hand, const HandPlace& place, const Contours& contours);
    double captureRate(const LinkerType& type, int side, const KineticStep& step) const;
    double pull(const Linker& linker, int side, const Spring& spring, const KineticStep& step, double& stiffness) const;
    double speedUnder(const Hand& hand, double drive, double pull) const;
    double driveOf(const Hand& hand, const HandPlace& place, const KineticStep& step) const;
    void slide(Linker& linker, const KineticStep& step, RandomNumbers& random, Count& count) const;
    void slideHand(Linker& linker, int side, const KineticStep& step, double duration, bool isShort,
            RandomNumbers& random, Count& count) const;
    void slideFreely(const Hand& hand, HandPlace& place, double variance, double noise, double level) const;
    Slope slopeAt(const Linker& linker, int side, const KineticStep& step, double duration,
            bool isShort) const;
    void walk(Linker& linker, const KineticStep& step, RandomNumbers& random, Count& count) const;
    void walkPart(Linker& linker, const KineticStep& step, double duration, RandomNumbers& random, Count& count) const;
    bool walksNow(const Linker& linker, int side) const;
    bool findPartner(const LinkerType& type, const HandPlace& first, const Sites* sites, HandPlace& found) const;
    const Barrier* heldBy(const Hand& hand, const HandPlace& place) const;
    const Barrier* findBarrier(const Hand& hand, int chain, double from, double to, RandomNumbers& random) const;
    bool isCaptured(const Hand& hand, HandPlace& place, double move, RandomNumbers& random) const;
    bool isCapturedAtSite(const Hand& hand, HandPlace& place, RandomNumbers& random) const;
    void letGo(const Hand& hand, HandPlace& place) const;
    bool draw(LinkerState& state, const KineticStep& step, Pending& next) const;
    void apply(LinkerState& state, const KineticStep& step, Pending& next, Sites* sites, Count& count) const;
    void stayOnChain(Linker& linker, int side, Count& count) const;
    bool staysBeyond(const Hand& hand, const HandPlace& place) const;
    void walkAll(Linker& linker, const KineticStep& step, Watch& watch, RandomNumbers& random, Count& count) const;
    void sumLengths();
    void findKinds(const KineticStep& step);
    void findMarks(const KineticStep& step);
    void know(LinkerState& state);
    Watch watch(const Linker& linker) const;
    int pieceOf(const Watch& watch) const;
    bool looksAtPiece(const Watch& watch) const;
    double freeRate(const LinkerType& type, int side) const;
    unsigned countAroundFree(int type, const double* position) const {
        const unsigned most = kinds[4*type].most;
        return most > 0 ? most : cells.getMostAround(position);
    }
    void diffuse(LinkerState& state, const KineticStep& step, int first, int last) const;
    bool proposeToFree(const Linker& linker, const double* position, int side, const KineticStep& step,
            RandomNumbers& random, const Sites* sites, HandPlace& found) const;
    bool findRelease(const Linker& linker, int side, const KineticStep& step, RandomNumbers& random,
            double* position) const;
    void release(LinkerState& state, std::size_t index, int side, const HandPlace& before, const Contours& contours,
            const KineticStep& step, RandomNumbers& random) const;
    void releaseFromEnd(LinkerState& state, std::size_t index, const HandPlace* held, const Contours& before,
            const KineticStep& step) const;
    void walkOne(LinkerState& state, std::size_t index, const KineticStep& step, Count& count);
    bool toProposed(int number, const SegmentPiece& piece, double where, const Sites* sites, HandPlace& found) const;
    void addLink(const Linker& linker, std::vector<Link>& links) const;
    int countAround(const Watch& watch, const KineticStep& step) const;
    double findRate(const LinkerState& state, int index, const KineticStep& step) const;
    bool passes(double& clock, double rate, double stepSize) const;
    void advanceChunk(LinkerState& state, const KineticStep& step, int chunk);
    void removeUnbound(LinkerState& state);
    void takeTogether(LinkerState& state, const KineticStep& step, Count& count);
    const SegmentCells::Around& lookAround(const Linker& linker, int side, const KineticStep& step,
            SegmentCells::Around& ofAnchor) const;
    void vectorTo(const HandPlace& place, const double* from, const KineticStep& step, double* vector) const;
    bool proposePlace(const Linker& linker, int side, const KineticStep& step, RandomNumbers& random,
            const Sites* sites, HandPlace& found) const;
    bool captureAnywhere(const Linker& linker, int side, RandomNumbers& random, const Sites* sites,
            HandPlace& found) const;
    void hop(Linker& linker, int side, int direction, RandomNumbers& random, Sites* sites, Count& count) const;
    std::uint64_t siteOf(const Hand& hand, const HandPlace& place) const;
    bool hasSite(const Hand& hand, int chain, double site) const;
    bool toSite(const Hand& hand, HandPlace& place) const;
    bool toEnd(const Hand& hand, HandPlace& place) const;
    void bind(Linker& linker, int side, const HandPlace& place, Sites* sites, Count& count) const;
    void unbind(Linker& linker, int side, Sites* sites, Count& count) const;
    LinkerSystem system;
    Contours contours;
    /** For each hand, which chains it binds to, and the sums of their lengths in the order of Hand::chains. */
    std::vector<std::vector<char> > binds;
    std::vector<std::vector<double> > sums;
    /** For each hand, the number of its spacing among different ones, or -1 if it needs no sites. */
    std::vector<int> spacings;
    /** For each type and what its linkers hold. */
    std::vector<Kind> kinds;
    double largestReach = 0;
    bool anySites = false, anyConcentration = false, anyAnchors = false, anyBinding = false, anyDiffuses = false;
    SegmentCells cells;
    /** Of anchors, while the grid of cells is what it was. */
    std::vector<std::uint32_t> marks;
    std::uint64_t gridOfMarks = 0;
    /** Of the state that was advanced last. */
    const LinkerState* known = nullptr;
    std::vector<Watch> watches;
    Sites taken;
    const std::uint64_t ownNumber;
    std::vector<Count> counts;
    /** Linkers of each chunk that join two places, and those with sites whose clocks may run out. */
    std::vector<std::vector<int> > pulling, competing;
};

} // namespace cylchain

#endif /*CYLCHAIN_LINKER_KINETICS_H_*/
