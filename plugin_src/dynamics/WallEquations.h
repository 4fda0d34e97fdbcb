#ifndef CYLCHAIN_WALL_EQUATIONS_H_
#define CYLCHAIN_WALL_EQUATIONS_H_

#include "couplings/Walls.h"
#include "dynamics/ImplicitCouplings.h"
#include <vector>

namespace cylchain {

/**
 * Walls in an implicit step.
 *
 * The first two iterations of a stage know of none: one alone does not know how segments turn. Where they lead, y*, a
 * particle may be beyond a face by b = d(y*)-max(0, d(x)) more than where it began, x, with the depth d. The force is
 *
 *     -k (beta b+d(y)) grad d   where d(y) > -beta b
 *
 * with a share beta that goes from 0 for soft walls to 1 for stiff ones. A stiff wall mirrors what diffuses into it, as
 * it would throw a diffusing particle back; with beta = 0, particles would heap up at it. The pressure on a flat wall
 * is that of the density before it with any beta; see shareMirrored() for how it is chosen.
 *
 * Depths are taken from the iterate, and from the tangent plane to an iterate after some iterations. Each force is
 * along the gradient of one depth, so that faces of slabs and boxes, which are flat, are exact.
 */
class WallEquations : public ImplicitCouplings {
public:
    /** Set the wall and its particles, which must exist while steps are taken. */
    void setWalls(const WallSystem* system);
    void begin(const CoupledStart& start, const Loop& loop) override;
    void beginStage(int stage, int numStages, const double* moved) override;
    void linearise(int iteration, const double* moved, std::vector<CouplingEquation>& equations) override;
    bool finishIteration(const double* moves, const double* moved) override;
    /** A wall has no other side that a step could get to: chains fail if iterations end before a depth has settled. */
    void findFailures(const double* moved, std::vector<bool>& failed) const override;
    void findNeighbours(std::vector<std::pair<int, int> >&) const override {
        // Walls join no chains.
    }
private:
    /** A particle that has been beyond a face in this stage. */
    struct State {
        /** Its number in the wall. */
        int particle;
        int face;
        /** What is mirrored: beta b. */
        double mirrored;
        /** The depth is offset+gradient.y. */
        double gradient[3], offset;
        /** The number of its equation in the last iteration, or -1. */
        int equation;
        /** The force that the last iteration has found, times grad d, and the second derivative of d across grad d. */
        double force, curvature;
        /** Whether another iteration is needed for it. */
        bool unfinished;
    };
    struct Part {
        std::vector<State> states;
        bool unfinished;
    };
    double findDepthAt(const State& state, const double* positions) const;
    bool finishPart(int part, const double* moves, const double* moved);
    double findMirrored(int particle, int face, double depth) const;
    const WallSystem* system = nullptr;
    const Loop* loop = nullptr;
    const double* begun = nullptr;
    double stepSize = 0, tolerance = 0, implicit = 1;
    int numFaces = 0, iterations = 0;
    /** For each particle of the wall: where it is, its friction, and a bit for each face that it has a state of. */
    std::vector<PlaceOnChain> places;
    std::vector<double> frictions;
    std::vector<unsigned char> reached;
    std::vector<Part> parts;
};

/**
 * Get the share beta of what is beyond a wall that is mirrored, for a = h k/zeta: how stiff the wall is for the
 * friction zeta and the step h.
 *
 * With it, a particle that diffuses to a flat wall is as often beyond it as in equilibrium: the surface excess is
 * (pi k_B T/2k)^(1/2).
 */
double shareMirrored(double a);

} // namespace cylchain

#endif /*CYLCHAIN_WALL_EQUATIONS_H_*/
