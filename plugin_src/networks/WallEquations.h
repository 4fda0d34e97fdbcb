#ifndef CYLCHAIN_WALL_EQUATIONS_H_
#define CYLCHAIN_WALL_EQUATIONS_H_

#include "networks/ImplicitCouplings.h"
#include "networks/RestGap.h"
#include "networks/WallPositions.h"
#include <vector>

namespace cylchain {

/**
 * Walls in an implicit step.
 *
 * The first two iterations know of none: one alone does not know how segments turn. Where they lead, y*, a
 * particle may be beyond a face, with the depth d(y*) > 0. The force is
 *
 *     -k (b+d(y)) grad d   where d(y) > -b
 *
 * with b of a RestGap: what diffuses into a stiff wall comes back to where it began; with b = 0, particles would
 * heap up at it. The pressure on a flat wall is that of the density before it. Where a stretch of a chain is beyond a
 * face, its deepest nodes come back, and take along what is beside them: if each came back, filaments that walls press
 * on would be 10 % too straight.
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
    bool markUnfinished(PackFlags& packs) const override;
    /** Chains fail if iterations end before a depth has settled, or if they pass what keeps them outside. */
    void findFailures(const double* moved, std::vector<bool>& failed) override;
    bool findCulprit(const double* moved, const CouplingEquation* equations, BrokenCoupling& culprit) const override;
    void findPushes(const double* moved, std::vector<Push>& pushes) const override;
    void findNeighbours(std::vector<std::pair<int, int> >&) const override {
        // Walls join no chains.
    }
private:
    /** A particle that has been beyond a face in this step. */
    struct State {
        /** Its number in the wall. */
        int particle;
        int face;
        RestGap restGap;
        /** The depth is offset+gradient.y. */
        double gradient[3] = {}, offset = 0;
        /** The number of its equation in the last iteration, or -1. */
        int equation = -1;
        /** What isLastChange() takes for the change of its depth in the iteration before. */
        double changeBefore = 0;
        /** The force that the last iteration has found, times grad d, and the second derivative of d across grad d. */
        double force = 0, curvature = 0;
        /** Whether another iteration is needed for it. */
        bool unfinished = true;
        /** Whether the tangent plane is too far from the face where the last iteration has led. */
        bool deviates = false;
    };
    struct Part {
        std::vector<State> states;
        /** The packs that need another iteration, some of them more than once. */
        std::vector<int> unfinished;
    };
    WallPosition positionOf(int particle, const double* positions) const {
        return cylchain::positionOf(system->particles[particle], positions);
    }
    double findDepthAt(const State& state, const double* positions) const;
    bool takesPart(int particle) const {
        return places[particle].pack >= 0 && (*active)[places[particle].pack];
    }
    void finishPart(int part, const double* moves, const double* moved);
    bool isBesideDeeper(int particle, int face, double depth, const double* moved) const;
    RestGap findRestGap(int particle, int face, double depth) const;
    const WallSystem* system = nullptr;
    const Loop* loop = nullptr;
    const PackFlags* active = nullptr;
    const double* begun = nullptr;
    double stepSize = 0, tolerance = 0, wallDepth = 0;
    int numFaces = 0, iterations = 0;
    /**
     * For each particle of the wall: where it is, how a force moves it, whether it moves together with its neighbours,
     * and a bit for each face that it has a state of.
     */
    std::vector<PlaceOnChain> places;
    std::vector<double> responses;
    std::vector<char> together;
    std::vector<unsigned char> reached;
    std::vector<RoomBeforeWall> rooms;
    std::vector<Part> parts;
};

} // namespace cylchain

#endif /*CYLCHAIN_WALL_EQUATIONS_H_*/
