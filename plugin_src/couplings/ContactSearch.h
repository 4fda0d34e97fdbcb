#ifndef CYLCHAIN_CONTACT_SEARCH_H_
#define CYLCHAIN_CONTACT_SEARCH_H_

#include "couplings/CapsuleGeometry.h"
#include "couplings/Capsules.h"
#include "mechanics/Loop.h"
#include <functional>
#include <limits>
#include <memory>
#include <stdexcept>
#include <vector>

namespace cylchain {

/** A periodic box is too narrow for capsules, so far as they move: two of them might meet twice. */
class NarrowBoxError : public std::invalid_argument {
public:
    using std::invalid_argument::invalid_argument;
};

/** Where a capsule moves to is not finite, or too far away for the search. */
class EndlessMotionError : public std::invalid_argument {
public:
    using std::invalid_argument::invalid_argument;
};

/** A first look at a pair of capsules at y. */
struct PairOutlook {
    /** The distance less the radii, not signed, and the sum of these. */
    double gap, radii;
    /** Whether they may have crossed. */
    bool mayCross;
    /** Whether evaluate() finds no contact: it is that of a neighbor. */
    bool isOfNeighbor;
};

/** Whether a pair of capsules is left out of a search. The first one has the lesser number. */
typedef std::function<bool(int a, int b)> PairFilter;

/**
 * Finds capsules that touch each other, and where.
 *
 * Positions are arrays of three doubles for each particle: x at the start of a step, y at its end. In between,
 * particles move along straight lines. The two may be the same.
 */
class ContactSearch {
public:
    /**
     * @param system         the capsules. std::invalid_argument says what is wrong with them.
     * @param nearestImages  whether each segment is taken as its shortest image in a periodic box. If not, the
     *                       particles of a chain must be images that belong together.
     */
    explicit ContactSearch(const CapsuleSystem& system, bool nearestImages = false);
    ~ContactSearch();
    const CapsuleSystem& getSystem() const;
    /** Search among other capsules from now on. */
    void setSystem(const CapsuleSystem& system);
    /** Give a capsule another radius, which is not negative. Pairs that were found with other radii may lack some. */
    void setRadius(int capsule, double radius);
    /** Get whether two capsules never touch each other. */
    bool isExcluded(int a, int b) const;
    /** Get the capsule of the same chain that begins where one ends, or ends where it begins, or -1. */
    int getNeighbor(int capsule, bool atEnd) const;
    /**
     * Find the pairs of capsules whose surfaces come within reach of each other at x or at y, or that may pass through
     * each other on the way to y, or to where both have moved on by the reach together, sorted by a and b. They do not
     * depend on how the loop is run.
     *
     * @param box    the three vectors of a periodic box (nine doubles, in reduced form), or NULL. Its widths must be
     *               more than twice the extent of a capsule in a step with its diameter and the reach, so that two
     *               capsules do not meet twice; NarrowBoxError says so if not, and EndlessMotionError if y is not
     *               finite.
     * @param reach  not negative
     * @param pairs  receives the pairs
     * @param run    runs the parts of the search; one after the other if there is none
     * @param known  pairs that are left out, if any: those that others know. It is called by several threads.
     */
    void findPairs(const double* x, const double* y, const double* box, double reach, std::vector<ContactPair>& pairs,
            const Loop& run = Loop(), const PairFilter& known = PairFilter());
    /**
     * Find the same pairs as far as some capsules are in them, which have another y than in the search before. Others
     * are taken to be where they were when they were searched for last. A few pairs are farther apart. This takes less
     * time where capsules are few; it throws the same errors.
     *
     * @param capsules  some capsules, each of them once
     * @param pairs     receives the pairs, in an order that does not depend on how the loop is run
     * @param run       runs the parts of the search; one after the other if there is none
     * @param known     as for the other search
     */
    void findPairsOf(const std::vector<int>& capsules, const double* x, const double* y,
            std::vector<ContactPair>& pairs, const Loop& run = Loop(), const PairFilter& known = PairFilter());
    /**
     * Find the contacts of a pair at y: none, one or two. Several threads may do so at the same time. With
     * nearestImages, the box is that of the last search.
     *
     * Two segments touch where they are nearest to each other. If they are nearly parallel, at both ends of their
     * overlap, each with half of the stiffness. If they have crossed between x and y, they touch where they crossed,
     * the normal is that of before, and the gap is the distance along it, less the radii: the signed distance goes on.
     * Segments that stay in one plane cross where an end goes through the other; if two ends do, they touch at both.
     * Where that end is a joint, both segments there have half of the stiffness.
     *
     * A sphere on a path that comes nearer to the axis of a segment, or to another sphere, than 0.7 of the sum of radii
     * touches where it is nearest on its way; its normal is that of x, and the gap is signed along it. Two spheres do
     * so only where that makes their distance negative: one that is deep in another keeps its equilibrium.
     *
     * Around a joint, segments that share it may see one and the same contact. It is counted once:
     * - A contact at a joint is that of the segment that ends there (s = 1), and of none if the distance falls as one
     *   goes on into the other segment.
     * - Of two segments that both touch the same capsule on the inner side of a bend, the one with the lesser gap
     *   counts. The energy is continuous where that changes from one to the other, as long as the chain's radius of
     *   curvature is more than twice the distance at which capsules touch. A neighbor that was crossed counts alone.
     *
     * Capsules that are excluded do not take contacts from their neighbors.
     *
     * @param contacts  room for two
     * @param limit     contacts with a gap that is not less are left out, which takes less time
     * @return the number of contacts; -1 if the capsules are not nearer than the limit, and the gap of the first
     *         contact is theirs
     */
    int evaluate(const ContactPair& pair, const double* x, const double* y, Contact* contacts,
            double limit = std::numeric_limits<double>::infinity()) const;
    /** Take note of x and y, for the functions below. */
    void setMotion(const double* x, const double* y, const Loop& run);
    /**
     * Take note of where some capsules are now. Several threads may do so at the same time, each with its own capsules.
     */
    void updateMotion(const std::vector<int>& capsules, const double* y);
    /** Ask for what is known of two capsules, which is needed soon. */
    void prefetchMotion(int a, int b) const;
    /**
     * Take a first look at some pairs, many at once. Several threads may do so at the same time.
     *
     * @param outlooks  receives as many
     */
    void findOutlooks(const ContactPair* const* pairs, int count, PairOutlook* outlooks) const;
    /** Find the contacts of a pair at y, as the other function of this name does. */
    int evaluate(const ContactPair& pair, Contact* contacts,
            double limit = std::numeric_limits<double>::infinity()) const;
    /** Get the axes of a pair, at y or else at x. */
    SegmentPair getSegments(const ContactPair& pair, bool atEnd) const;
    /**
     * Get whether the capsules of a pair pass through each other on the way from x to y, an odd number of times.
     * Spheres do if they come nearer to an axis than 0.7 of the sum of radii, and end on the other side of it.
     */
    bool crosses(const ContactPair& pair, const double* x, const double* y) const;
    /** The same from what setMotion() and updateMotion() have taken note of. */
    bool crosses(const ContactPair& pair) const;
private:
    struct Implementation;
    std::unique_ptr<Implementation> implementation;
};

} // namespace cylchain

#endif /*CYLCHAIN_CONTACT_SEARCH_H_*/
