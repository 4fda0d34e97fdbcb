#ifndef CYLCHAIN_SURFACE_EQUATIONS_H_
#define CYLCHAIN_SURFACE_EQUATIONS_H_

#include "networks/ImplicitCouplings.h"
#include "networks/WallPositions.h"
#include <vector>

namespace cylchain {

/**
 * Particles that are held on a surface, in an implicit step.
 *
 * The depth d of each, with the energy k d^2/2, is a coordinate as the distance of a link is, see LinkEquations: the
 * force is -T J with
 *
 *     T = k (theta d(y)+(1-theta) d(x)-(2 theta-1)^(1/2) d_random),    J.(y-x) = d(y)-d(x),
 *
 * theta = max(1/2, 1-zeta/(h k)), the friction zeta of the particle, and J the mean gradient of the depth on the way.
 * Planes have one J. Elsewhere it turns, and steps there and back differ by the determinants of their equations, which
 * the metric force makes up for: with the mean H of the second derivatives of d at both ends, and the compliance C,
 *
 *     -k_B T k theta H C J/(1+k theta J.C J).
 */
class SurfaceEquations : public ImplicitCouplings {
public:
    /** Set the surface and its particles, and what receives its forces; they must exist while steps are taken. */
    void setWalls(const WallSystem* system, CouplingImpulses* impulses);
    void setNumber(int number) override {
        force = number;
    }
    CouplingImpulses* getImpulses() const override {
        return impulses;
    }
    bool needDoublePrecision(const ChainPlaces& places, double stepSize, bool besideGaps) const override;
    void begin(const CoupledStart& start, const Loop& loop) override;
    void linearise(int iteration, const double* moved, std::vector<CouplingEquation>& equations) override;
    bool needsCompliances() const override {
        return turns;
    }
    double getDemandingStiffness() const override {
        return turns ? largestStiffness : 0;
    }
    void setCompliances(const double* compliances) override;
    bool finishIteration(const double* moves, const double* moved) override;
    Rests getRests() const override;
    bool markUnfinished(PackFlags& packs) const override;
    void findFailures(const double* moved, std::vector<bool>& failed) override;
    bool findCulprit(const double* moved, const CouplingEquation* equations, BrokenCoupling& culprit) const override;
    void findPushes(const double* moved, std::vector<Push>& pushes) const override;
    void findNeighbours(std::vector<std::pair<int, int> >&) const override {
        // A surface joins no chains.
    }
private:
    struct State {
        /** Its number among the particles of the surface. */
        int particle;
        PlaceOnChain place;
        /** Whether no other particle of its chain is held. */
        bool alone = true, compliant = false, unfinished = true;
        /** That of the particle, the share theta times k, and the rest of T. */
        double friction, response, constant;
        double start[3], curvature[6];
        /** Of the last iteration: J, T, how T changes along J, and T after it; the metric force, and the whole one. */
        double direction[3], tension = 0, slope = 0, multiplier = 0, metric[3], pull[3];
        /** What isLastChange() takes for the change of the depth in the iteration before. */
        double changeBefore = 0, change = 0;
        /** How a force moves the particle without this coupling; J of the first iteration as a unit vector, and C J. */
        double compliance[6], first[3], firstResponse[3];
    };
    void describe(const CoupledStart& start, State& state) const;
    void drawNoise(const CoupledStart& start);
    void linearise(State& state, const double* moved, CouplingEquation& equation) const;
    double describeMetric(State& state, const double* curvature, const double* gradient) const;
    bool isUnfinished(State& state, const double* move, const double* moved) const;
    const WallSystem* system = nullptr;
    CouplingImpulses* impulses = nullptr;
    const Loop* loop = nullptr;
    const PackFlags* active = nullptr;
    const double* begun = nullptr;
    double kT = 0, stepSize = 0, largestStiffness = 0;
    bool turns = false;
    int force = 0;
    std::vector<State> states;
    /** Those of packs that take part in the iteration: its equations. */
    std::vector<int> selected;
};

} // namespace cylchain

#endif /*CYLCHAIN_SURFACE_EQUATIONS_H_*/
