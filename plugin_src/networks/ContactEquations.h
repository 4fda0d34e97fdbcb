#ifndef CYLCHAIN_CONTACT_EQUATIONS_H_
#define CYLCHAIN_CONTACT_EQUATIONS_H_

#include "couplings/ContactSearch.h"
#include "networks/CapsuleMotion.h"
#include "networks/CapsulePairs.h"
#include "networks/CapsulePlaces.h"
#include "networks/ImplicitCouplings.h"
#include "networks/PairSelection.h"
#include "networks/PlaceResponses.h"
#include <cstddef>
#include <utility>
#include <vector>

namespace cylchain {

/** The capsules whose contacts steps have, which must exist while steps are taken. */
struct ContactSystem {
    ContactSearch* search = nullptr;
    /** k_c. */
    double stiffness = 0;
    /** The periodic box, if distances are those of nearest images, or NULL. */
    const double* box = nullptr;
    /** Capsules that end at virtual sites on curves of beam elements, and these sites, which are particles. */
    const std::vector<CapsuleOnCurve>* onCurves = nullptr;
    const std::vector<CurveSite>* sites = nullptr;
    /** Receives their forces. */
    CouplingImpulses* impulses = nullptr;
};

/**
 * Contacts of capsules in an implicit step.
 *
 * The first iteration knows of none. Where it leads, y*, and the way there show which pairs may touch; they have the
 * gaps g*, which go on being negative where two segments have passed through each other. Where an iteration leads them
 * behind their surfaces, they come back to where the step began, see ContactRest. With a force from the surface on,
 * contacts would act too early by 0.58 of what diffusion moves them by in a step. Small steps resolve a contact.
 * Segments that have crossed in the end fail.
 *
 * Where two capsules touch may jump: from a segment to its neighbour, or between the ends of nearly parallel ones. So
 * it is looked for in the first iterations alone; after that, each pair keeps the fractions where it touches. What
 * comes back keeps them from the beginning.
 */
class ContactEquations : public ImplicitCouplings {
public:
    /** Set what touches. */
    void setContacts(const ContactSystem& contacts);
    void begin(const CoupledStart& start, const Loop& loop) override;
    void beginStage(int stage, int numStages, const double* moved) override;
    void linearise(int iteration, const double* moved, std::vector<CouplingEquation>& equations) override;
    bool finishIteration(const double* moves, const double* moved) override;
    double getRelativeTolerance() const override;
    Rests getRests() const override {
        return Rests::Worthwhile;
    }
    bool markUnfinished(PackFlags& packs) const override;
    void findFailures(const double* moved, std::vector<bool>& failed) override;
    bool findCulprit(const double* moved, const CouplingEquation* equations, BrokenCoupling& culprit) const override;
    void findPushes(const double* moved, std::vector<Push>& pushes) const override;
    void findNeighbours(std::vector<std::pair<int, int> >& neighbours) const override;
private:
    /** What is needed to find how places on a capsule respond to forces, and the least of these responses. */
    struct Mobility {
        double least = 0;
        LateralFriction friction;
    };
    struct Part {
        std::vector<CouplingEquation> equations;
        /** For each equation, twice the number of its pair, and one more for the second contact. */
        std::vector<int> contacts;
        /** Pairs that were crossed, or which were looked for. */
        std::vector<int> pairs;
    };
    /** Pairs that are looked at in lanes, in memory of a thread. */
    struct Looks {
        std::vector<const ContactPair*> due;
        std::vector<int> numbers;
        std::vector<PairOutlook> outlooks;
        static Looks& ofThread() {
            static thread_local Looks memory;
            memory.due.clear();
            memory.numbers.clear();
            return memory;
        }
    };
    template <class Function> bool markPairs(bool all, Function findIn);
    bool markCapsule(int capsule);
    void mark(int pair);
    bool takesPart(int capsule) const {
        return packs[capsule] >= 0 && (*active)[packs[capsule]];
    }
    bool isUnfinished(int equation, const double* move);
    void findPairs(const double* moved);
    void findNewPairs(const double* moved);
    double restGapOf(const PairContact& contact) const;
    bool addEquation(int pair, int which, Part& part);
    double responseOf(int capsule, double fraction) const;
    double softnessOf(const ContactPair& pair, const Contact& contact) const;
    bool isLookedFor(int pair) const;
    bool waits(int pair, const PairOutlook& outlook);
    bool isApart(int pair, const PairOutlook& outlook, double overlap);
    void look(int run, bool first, Part& part);
    void evaluate(int pair, bool first, const PairOutlook* outlook, Part& part);
    bool anyComeNear(const double* moved);
    template <class Due, class Found> void findByOutlook(bool all, int run, Part& part, Due isDue,
            Found isFound) const;
    void findNear(int firstNew, int run, Part& part);
    bool anyCross();
    void findCrossed(bool all, int run, Part& part) const;
    ContactSearch* search = nullptr;
    double stiffness = 0;
    const Loop* loop = nullptr;
    const PackFlags* active = nullptr;
    const double *begun = nullptr, *box = nullptr;
    const std::vector<CapsuleOnCurve>* onCurves = nullptr;
    PlaceResponses responses;
    double kT = 0, stepSize = 0, wallDepth = 0, reach = 0, reaches[2] = {};
    CapsulePlaces places;
    /** The packs of these places. */
    std::vector<int> packs;
    std::vector<Mobility> mobilities;
    CapsulePairs pairs;
    /** Those of the last search. */
    std::vector<ContactPair> found;
    CapsuleMotion motion;
    PairSelection selection;
    /** Whether anyCross() has seen all pairs, and the packs that have moved since it was called. */
    bool crossingsKnown = false;
    PackFlags movedSince;
    std::vector<Part> parts;
    /** All equations of the iteration, the first of these, and which contacts they are of, as in a part. */
    const std::vector<CouplingEquation>* equations = nullptr;
    std::size_t firstEquation = 0;
    std::vector<int> contactsOfEquations;
    /** The pairs that were crossed where they were evaluated last, and whether none is now. */
    std::vector<int> crossed;
    bool clear = false;
    /** Whether capsules move too far to look for contacts, in the periodic box or anywhere: the step is divided. */
    bool movesTooFar = false, isEndless = false;
    /** The packs that need another iteration. */
    PackFlags unfinished;
    /** The number of an equation that has not settled in the last iteration, or -1. */
    int unsettled = -1;
    int iterations = 0;
};

} // namespace cylchain

#endif /*CYLCHAIN_CONTACT_EQUATIONS_H_*/
