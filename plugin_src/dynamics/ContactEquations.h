#ifndef CYLCHAIN_CONTACT_EQUATIONS_H_
#define CYLCHAIN_CONTACT_EQUATIONS_H_

#include "couplings/ContactSearch.h"
#include "dynamics/ImplicitCouplings.h"
#include <vector>

namespace cylchain {

/**
 * Contacts of capsules in an implicit step.
 *
 * The first iteration knows of none. Where it leads, y*, and the way there show which pairs may touch; they have the
 * gaps g*, which go on being negative where two segments have passed through each other. The others have the force
 *
 *     k_c (b-g(y)) n   where g(y) < b,     b = beta min(-g*, b_max) where g* < 0, or else 0:
 *
 * a predicted overlap is mirrored, as a wall would throw a diffusing particle back; with b = 0, contacts would act too
 * early by 0.58 of what diffusion moves them by in a step. The share beta is that of walls, see shareMirrored(): small
 * steps resolve a contact. Segments that have crossed in the end fail.
 *
 * Where two capsules touch may jump: from a segment to its neighbour, or between the ends of nearly parallel ones. So
 * it is looked for in the first iterations alone; after that, each pair keeps the fractions where it touches.
 */
class ContactEquations : public ImplicitCouplings {
public:
    /**
     * Set what touches, which must exist while steps are taken.
     *
     * @param stiffness  k_c
     * @param box        the periodic box, if distances are those of nearest images, or NULL
     */
    void setContacts(ContactSearch* search, double stiffness, const double* box);
    void begin(const CoupledStart& start, const Loop& loop) override;
    void beginStage(int stage, int numStages, const double* moved) override;
    void linearise(int iteration, const double* moved, std::vector<CouplingEquation>& equations) override;
    bool finishIteration(const double* moves, const double* moved) override;
    void findFailures(const double* moved, std::vector<bool>& failed) const override;
    void findNeighbours(std::vector<std::pair<int, int> >& neighbours) const override;
private:
    /** A pair of capsules. */
    struct State {
        ContactPair pair;
        /** Whether it may touch in this step; if not, the gap that it is predicted to have. */
        bool near;
        double gap;
        /** The overlaps that are mirrored, and where it touches. */
        double mirrored[2];
        Contact contacts[2];
        int count;
        /** Whether it touched in the last iteration. */
        bool touched[2];
    };
    /** Where a capsule is: its place at fraction 0, and by how much the fraction grows along it. */
    struct CapsulePlace {
        PlaceOnChain place;
        double direction;
        /** How far a unit force moves it in the step. */
        double response;
    };
    struct Part {
        std::vector<CouplingEquation> equations;
        bool crossed;
    };
    void findPairs(const double* moved);
    void takeNoteOf(int capsule, const double* moved);
    bool findPairsOf(const std::vector<int>& capsules, const double* moved, double slack);
    void evaluate(State& state, const double* moved, bool first, Part& part) const;
    void updateContacts(State& state, const double* moved) const;
    bool anyComeNear(const double* moved);
    bool anyCross(const double* moved);
    PlaceOnChain placeOf(int capsule, double fraction) const;
    ContactSearch* search = nullptr;
    double stiffness = 0;
    const Loop* loop = nullptr;
    const double *begun = nullptr, *box = nullptr;
    double kT = 0, reach = 0;
    std::vector<CapsulePlace> places;
    std::vector<ContactPair> pairs;
    std::vector<int> movers;
    std::vector<State> states;
    /** Where the ends of each capsule were when its pairs were looked for, and by how much they have moved since. */
    std::vector<double> searched, motion;
    std::vector<Part> parts;
    std::vector<double> normals;
    /** Whether any contact was crossed where it was evaluated last, and whether none is now. */
    bool crossed = false, clear = false;
    int iterations = 0;
};

} // namespace cylchain

#endif /*CYLCHAIN_CONTACT_EQUATIONS_H_*/
