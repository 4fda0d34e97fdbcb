#ifndef CYLCHAIN_PACK_STEP_H_
#define CYLCHAIN_PACK_STEP_H_

#include "dynamics/ChainEngine.h"
#include "dynamics/TermBlocks.h"
#include "mechanics/ElementHold.h"
#include <cmath>
#include <cstddef>

namespace cylchain {

/**
 * One side of a coupling, in the equations of a pack: a place on a segment of one of its lanes, the force on it, and
 * how much less that becomes for each displacement of the place, a symmetric matrix (xx, xy, xz, yy, yz, zz).
 */
struct CouplingTerm {
    /** The segment is the one between this node and the next. */
    int node, lane;
    /** Of the segment, and what is held of a beam element there. */
    double fraction;
    ElementHold hold;
    double force[3], stiffness[6];
};

/** How much of its change an iteration makes: a part, or less where that would turn a segment by more than so far. */
struct ShareOfChange {
    double part = 1, largestTurn = HUGE_VAL;
};

/**
 * An implicit step of a pack, taken one iteration at a time, so that couplings between chains of different packs can
 * enter its equations. See NetworkStep.
 *
 * In each iteration, the linear equations of a chain are (A + sum S^T K S) change = right + sum S^T F for the terms of
 * couplings, with A and right as in ImplicitEquations-inl.h; S takes the displacement of a place from those of nodes.
 */
class PackStep {
public:
    virtual ~PackStep() {
    }
    /**
     * Begin a step: describe its start, and draw its noise.
     *
     * @param taken  whether to take the step, for each lane; the chains of others stay where they are
     */
    virtual void begin(const double* positions, const double* forces, const double* box,
            const StepSettings& settings, const bool* taken) = 0;
    /** The number of stages of the step's scheme. */
    virtual int getNumStages() const = 0;
    /** Begin a stage, with the number of 0 on. */
    virtual void beginStage(int stage) = 0;
    /**
     * Take note of the forces on places that the equations of the last iteration had, which know no turns, or that are
     * known now: three numbers for each term of the next call of eliminate(). Only packs that may move together are
     * told.
     */
    virtual void setExpectedForces(const double*) {
    }
    /**
     * Linearise the equations, and solve them as if no coupling joined two places of packs.
     *
     * @param terms  in the order of their nodes; they must not change before advance()
     * @param moves  receives the change of each term's place, in TermBlocks as all vectors of terms
     */
    virtual void eliminate(const CouplingTerm* terms, int numTerms, double* moves) = 0;
    /** Ask for the memory that eliminate() begins with. */
    virtual void prefetchStart() const {
    }
    /** Ask for the memory that begins what comes with the same elimination. */
    virtual void prefetchElimination() const {
    }
    /** Find how forces on the places of the terms move them, with the same elimination. */
    virtual void respond(const double* forces, double* moves) = 0;
    /** The same in single precision. */
    virtual void respond(const float* forces, float* moves) = 0;
    /** The same for several vectors of forces, one behind the other, of which each has so many numbers. */
    virtual void respondToEach(const double* forces, double* moves, int count, std::size_t size) {
        for (int i = 0; i < count; i++)
            respond(forces+i*size, moves+i*size);
    }
    virtual void respondToEach(const float* forces, float* moves, int count, std::size_t size) {
        for (int i = 0; i < count; i++)
            respond(forces+i*size, moves+i*size);
    }
    /** Whether there may be more places than unknowns that move them, as on rigid bodies: see keepWhatMoves(). */
    virtual bool mayMoveTogether() const {
        return false;
    }
    /** Take off of forces on the places of the terms what moves none of them. */
    virtual void keepWhatMoves(double*) {
    }
    /** The same in single precision. */
    virtual void keepWhatMoves(float*) {
    }
    /**
     * Find for each term how a force on its place moves this place: a symmetric matrix in the order of a term's
     * stiffness.
     */
    virtual void findCompliances(double* compliances) = 0;
    /** Whether setJointStiffness() is to be called in the first iteration. */
    virtual bool needsJointStiffness() const {
        return false;
    }
    /**
     * Take note of how stiff what holds each term's place is when the other place of its coupling can move: a symmetric
     * matrix in the order of a term's stiffness, which is that where it cannot.
     */
    virtual void setJointStiffness(const double*) {
    }
    /**
     * End the iteration: add what forces on the places of the terms do, and move the nodes.
     *
     * @param forces      on the places of the terms, or NULL if there are none
     * @param share       how much of the change of nodes to make, and how far it may turn a segment
     * @param unfinished  receives, for each lane, whether another iteration is needed
     * @param moves       receives the change of each term's place with these forces, if there are any
     */
    virtual void advance(const double* forces, const ShareOfChange& share, bool* unfinished, double* moves) = 0;
    /** Find lanes a segment of which changes by too much, so that the step must be divided. */
    virtual void findExcessiveChanges(bool* failed) const = 0;
    /** Write where the nodes of the lanes that take the step are, if they began at some positions. */
    virtual void getPositions(const double* start, double* positions) const = 0;
    /** Write how far the nodes of the lanes that take the step have moved since it began. */
    virtual void getDisplacements(double* displacements) const = 0;
};

} // namespace cylchain

#endif /*CYLCHAIN_PACK_STEP_H_*/
