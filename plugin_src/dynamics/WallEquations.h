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
 *     -k (m+d(y)) grad d   where d(y) > -m
 *
 * with m = findMirrored(b, ...). A stiff wall mirrors what diffuses into it, as it would throw a diffusing particle
 * back; with m = 0, particles would heap up at it. The pressure on a flat wall is that of the density before it.
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
    bool findCulprit(const double* moved, const CouplingEquation* equations, BrokenCoupling& culprit) const override;
    void findNeighbours(std::vector<std::pair<int, int> >&) const override {
        // Walls join no chains.
    }
private:
    /** A particle that has been beyond a face in this stage. */
    struct State {
        /** Its number in the wall. */
        int particle;
        int face;
        /** What is mirrored: m. */
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
    double findMirroredOf(int particle, int face, double depth) const;
    const WallSystem* system = nullptr;
    const Loop* loop = nullptr;
    const double* begun = nullptr;
    double stepSize = 0, tolerance = 0, mirrorDepth = 0, implicit = 1;
    int numFaces = 0, iterations = 0;
    /** For each particle of the wall: where it is, its friction, and a bit for each face that it has a state of. */
    std::vector<PlaceOnChain> places;
    std::vector<double> frictions;
    std::vector<unsigned char> reached;
    std::vector<Part> parts;
};

/**
 * Find b for an overlap that is predicted, of a wall or a contact with the stiffness k where the friction is zeta.
 *
 * A step that does not resolve the potential, a = h k/zeta >= 1, mirrors: not at the surface, but at the depth
 * d = (pi k_B T/2k)^(1/2) behind it. So much room a soft wall has beyond its surface in equilibrium, the integral of
 * exp(-k x^2/2 k_B T). Then what diffuses is as dense in front of a flat wall as in equilibrium, up to the surface
 * itself. What is linear responds to the force k (b-g) with g = g*+a (b-g), which gets to g = -g*-2d with
 *
 *     b = -d+(1+2/a) max(0, -g*-d).
 *
 * A step that resolves it has b = -beta g* with a share beta from 0 on, so that the surface excess is that of
 * equilibrium, (pi k_B T/2k)^(1/2).
 *
 * @param overlap  -g*
 * @param depth    of findDepthOfMirror()
 */
double findMirrored(double overlap, double a, double depth);
/** Find the depth at which steps mirror that do not resolve a stiffness. */
double findDepthOfMirror(double kT, double stiffness);

} // namespace cylchain

#endif /*CYLCHAIN_WALL_EQUATIONS_H_*/
