#ifndef CYLCHAIN_WALL_GAPS_H_
#define CYLCHAIN_WALL_GAPS_H_

#include "networks/ImplicitCouplings.h"
#include "networks/WallEquations.h"
#include "networks/WallPositions.h"
#include <vector>

namespace cylchain {

/**
 * Walls in an implicit step: a gap between each particle and each face that it may reach. Gaps are those of the real
 * face at the start and at the end of the step; the force is along the gradient half-way between.
 */
class WallGaps : public ImplicitCouplings {
public:
    /** Set the wall and its particles, and what receives its forces; they must exist while steps are taken. */
    void setWalls(const WallSystem* system, CouplingImpulses* impulses);
    bool areGaps() const override {
        return true;
    }
    void setNumber(int number) override {
        force = number;
    }
    CouplingImpulses* getImpulses() const override {
        return impulses;
    }
    ImplicitCouplings& getHardOnes() override {
        return hard;
    }
    void begin(const CoupledStart& start, const Loop& loop) override;
    void beginStage(int stage, int numStages, const double* moved) override;
    bool findGaps(int iteration, bool settled, const double* moved, ReflectedGaps& gaps) override;
    Rests getRests() const override {
        return Rests::Wrong;
    }
    void findFailures(const double* moved, std::vector<bool>& failed) override;
    bool findCulprit(const double* moved, const CouplingEquation* equations, BrokenCoupling& culprit) const override;
    void findPushes(const double* moved, std::vector<Push>& pushes) const override;
    void findNeighbours(std::vector<std::pair<int, int> >&) const override {
        // Walls join no chains.
    }
private:
    /** A gap between a particle and a face. */
    struct State {
        int particle, face, gap;
        /** The gap from the hard surface, less that from the face. */
        double depth;
    };
    /** What a chunk of particles adds. */
    struct Part {
        std::vector<State> states;
        std::vector<Gap> gaps;
    };
    WallPosition positionOf(int particle, const double* positions) const {
        return cylchain::positionOf(system->particles[particle], positions);
    }
    void follow(const State& state, const double* moved, Gap& gap) const;
    void findNew(int part, const double* moved);
    /** Those of steps that do not resolve contacts beside them. */
    WallEquations hard;
    const WallSystem* system = nullptr;
    CouplingImpulses* impulses = nullptr;
    const Loop* loop = nullptr;
    const double* begun = nullptr;
    ReflectedGaps* all = nullptr;
    double kT = 0;
    int numFaces = 0, force = 0;
    /**
     * For each particle of the wall: where it is, about how a force moves it, whether each face has a gap, and how far
     * it may go from where it was seen last before it may have another.
     */
    std::vector<PlaceOnChain> places;
    std::vector<double> responses;
    std::vector<unsigned char> reached;
    std::vector<RoomBeforeWall> rooms;
    std::vector<Part> parts;
    std::vector<State> states;
};

} // namespace cylchain

#endif /*CYLCHAIN_WALL_GAPS_H_*/
