#ifndef CYLCHAIN_CANDIDATE_PAIRS_H_
#define CYLCHAIN_CANDIDATE_PAIRS_H_

#include "couplings/ContactSearch.h"
#include "networks/CapsuleMotion.h"
#include "networks/CapsulePlaces.h"
#include "networks/Gap.h"
#include "networks/PairList.h"
#include <cstdint>
#include <vector>

namespace cylchain {

/**
 * The pairs of capsules whose gaps may be closed in an implicit step, and those that cross in it.
 *
 * A search finds all pairs that come near. A pair becomes a candidate when its gap at the start and the end, from the
 * hard surface that is drawn for it, may be closed, or when it may cross: it is looked at again only after its capsules
 * have travelled as far as that needs. Capsules that move far in later iterations are searched for again.
 */
class CandidatePairs {
public:
    /**
     * Set the capsules, which must exist as long as this is used.
     *
     * @param stiffness  of contacts
     * @param box        the periodic box, if distances are those of nearest images, or NULL
     */
    void setSearch(ContactSearch* search, double stiffness, const double* box);
    /** What random numbers belong to, beside the numbers of capsules. */
    void setForce(int number) {
        force = number;
    }
    /** @param responses  about how far a force moves the place of each capsule that it moves most */
    void begin(const CoupledStart& start, const CapsulePlaces& places, const std::vector<double>& responses,
            const Loop& loop);
    /**
     * Follow capsules to where an iteration has led them.
     *
     * @param settled  whether all known gaps have converged: then pairs of capsules that have moved far are looked for
     * @return false if capsules move too far to look for pairs
     */
    bool follow(bool settled, const double* moved, const GapNoise& noise);
    /** Get the pairs that the last follow() has made candidates. */
    const std::vector<int>& getNew() const {
        return candidates;
    }
    /** Get whether some capsules have moved farther than pairs were searched for. */
    bool mayLackPairs() const {
        return motion.exceedsReach();
    }
    const ContactPair& get(int pair) const {
        return pairs.get(pair);
    }
    double radiiOf(int pair) const {
        const std::vector<Capsule>& capsules = search->getSystem().capsules;
        return capsules[get(pair).a].radius+capsules[get(pair).b].radius;
    }
    /** Get how far the capsules of a pair have travelled in all iterations. */
    double getWay(int pair) const {
        return motion.getWay(get(pair).a, get(pair).b);
    }
    /** See cylchain::placeHardSurface(). The stiffness of the gap is known; receives its keys, too. */
    double placeHardSurface(int pair, double begun, Gap& gap) const;
    /** Get the candidates and other pairs that have passed through each other where the last iteration has led. */
    const std::vector<int>& getCrossed();
    /** Get whether a capsule of a pair took part in the last iteration. */
    bool hasMoved(int pair) const {
        return takesPart(get(pair).a) || takesPart(get(pair).b);
    }
    bool movesTooFar() const {
        return tooFar;
    }
    /** Say what has gone wrong: a motion that is too long, or a crossing. */
    bool findCulprit(const double* moved, BrokenCoupling& culprit) const;
private:
    struct Looks;
    void findPairs(const double* moved, const PairFilter& known);
    void findNewPairs(const double* moved);
    bool mayClose(int pair, double before, double after, double& room) const;
    void drawSurfaces(int first, int last);
    void select(int firstNew);
    bool takesPart(int capsule) const {
        return !places->isHeld(capsule) && (*active)[places->get(capsule).pack];
    }
    std::uint32_t keyOf(const ContactPair& pair) const {
        return (std::uint32_t) force*0x9E3779B1u+pair.a;
    }
    ContactSearch* search = nullptr;
    const double* box = nullptr;
    double stiffness = 0, kT = 0;
    int force = 0;
    const Loop* loop = nullptr;
    const double* begun = nullptr;
    const CapsulePlaces* places = nullptr;
    const PackFlags* active = nullptr;
    const std::vector<double>* responses = nullptr;
    const GapNoise* noise = nullptr;
    double slack = 0, reach = 0;
    CapsuleMotion motion;
    PairList pairs;
    /** For each pair, how far both capsules must have travelled before its gap may be closed, or -1 of a candidate. */
    std::vector<double> rooms;
    /** For each pair, the exponential variate that its hard surface is found with. */
    std::vector<double> surfaces;
    /** Those of the last search. */
    std::vector<ContactPair> found;
    /** Of chunks of pairs, and of all. */
    std::vector<std::vector<int> > parts;
    std::vector<int> candidates, crossed;
    bool crossedAreKnown = false;
    /** Whether capsules move too far to look for pairs, in the periodic box or anywhere: the step is divided. */
    bool tooFar = false, isEndless = false;
};

} // namespace cylchain

#endif /*CYLCHAIN_CANDIDATE_PAIRS_H_*/
