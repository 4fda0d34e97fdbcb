#ifndef CYLCHAIN_BODY_STEP_H_
#define CYLCHAIN_BODY_STEP_H_

#include "dynamics/PackStep.h"
#include "mechanics/RigidBody.h"
#include <vector>

namespace cylchain {

/**
 * Rigid bodies in an implicit step, as a pack whose lanes hold one body each. A term's node is the number of a particle
 * of the body.
 *
 * A body whose centre moves by u and which turns by the Gibbs vector g takes its particle i from x+a_i to
 * x+u+a'_i, with a'-a = g x (a+a')/2, so that a force F_i there does the work F.u+g.((a+a')/2 x F). With the friction
 * zeta against motion, the friction Z against turning where the body is turned half-way, and a fluid that moves with v
 * and turns with omega,
 *
 *     zeta (u/h-v) = sum F_i+f_random,    Z (g/h-omega) = sum (a_i+a'_i)/2 x F_i+t_random+t_metric.
 *
 * The turn has the same vector g in the frames before, half-way and after, so that steps there and back have the same
 * noise, and the measure of all orientations is kept. What equations resist by depends on how the body is turned: the
 * metric torque makes up for that, as that of links in LinkEquations does. With the stiffness K of what holds each
 * place and the compliance C of the place,
 *
 *     t_metric = k_B T sum (A_yz, A_zx, A_xy),    A = K C-C K.
 *
 * A body that nothing holds off its centre turns by the rotation vector h Z^-1 (t+t_random) instead, which is right to
 * a higher order.
 */
class BodyStep : public PackStep {
public:
    /** @param bodies  they must exist as long as this object */
    explicit BodyStep(const std::vector<RigidBody>& bodies);
    void begin(const double* positions, const double* forces, const double* box, const StepSettings& settings,
            const bool* taken) override;
    int getNumStages() const override {
        return 1;
    }
    void beginStage(int) override {
    }
    void setExpectedForces(const double* forces) override {
        expectedForces = forces;
    }
    void eliminate(const CouplingTerm* terms, int numTerms, double* moves) override;
    void respond(const double* forces, double* moves) override;
    void respond(const float* forces, float* moves) override;
    bool mayMoveTogether() const override {
        return true;
    }
    void keepWhatMoves(double* forces) override;
    void keepWhatMoves(float* forces) override;
    void findCompliances(double* compliances) override;
    bool needsJointStiffness() const override {
        return settings.kT > 0;
    }
    void setJointStiffness(const double* stiffness) override;
    void advance(const double* forces, const ShareOfChange& share, bool* unfinished, double* moves) override;
    void findExcessiveChanges(bool* failed) const override;
    void getPositions(const double* start, double* positions) const override;
    void getDisplacements(double* displacements) const override;
private:
    /** What a step knows of a body. */
    struct State {
        bool taken, settled;
        RigidFrame start, now;
        /** At the start: the sum of forces, and of their products with places in the frame of the body, row by row. */
        double force[3], moments[9];
        /** Noise: the force, and the torque in the frame of the body. */
        double randomForce[3], randomTorque[3];
        /** How far the fluid takes the centre, and turns the body. */
        double drift[3], spin[3];
        double metricTorque[3];
        /** That of frames of chains, as it is known in an iteration. */
        double frameTorque[3];
        /** How far the centre has moved, and the turn. */
        double moved[3], turned[3];
        /** The friction against turning half-way, and the noise of it. */
        double rotationalFriction[6], turnedRandomTorque[3];
        /** Of the equations of an iteration: their matrix and its inverse, and the motion and the turn they lead to. */
        double matrix[36], inverse[36], change[6];
        /** Whether a coupling holds the body off its centre. */
        bool held;
        /** Products of the forces of couplings that are expected with their places, in the way of moments. */
        double pulls[9];
        /** The inverse of the sum of STS, see keepWhatMoves(); known once that has been asked for. */
        double projection[36];
    };
    void describeFlow(const RigidBody& own, State& body) const;
    void drawNoise();
    void sumForces(const RigidBody& own, const double* forces, State& body) const;
    void describeHalfway(const RigidBody& own, State& body) const;
    void addFriction(const RigidBody& own, const State& body, double* matrix) const;
    void findMetricTorques();
    void findProjections();
    template <class Number> void project(Number* onPlaces);
    void setRight(const RigidBody& own, const State& body, double* right) const;
    void turnFreely(const RigidBody& own, State& body) const;
    void findArms();
    template <class Number> void gatherForces(const Number* onPlaces);
    template <class Number> void respondAs(const Number* forces, Number* moves);
    void gatherMoves(double* moves) const;
    void makeChange(State& body, const ShareOfChange& share) const;
    bool isUnfinished(const State& body) const;
    template <class Function> void visitPlaces(Function function) const;
    const std::vector<RigidBody>& bodies;
    std::vector<RigidFrameFinder> finders;
    StepSettings settings = {};
    std::vector<State> states;
    /** The bodies that take the step. */
    std::vector<int> going;
    /** Places whose stiffness is known, as terms; nothing else is of them. */
    std::vector<CouplingTerm> joints;
    /** Where the place of each term is against the centre now. */
    std::vector<double> arms;
    /** Six numbers for each body: forces, and what they lead to. */
    std::vector<double> right, found;
    bool knowsProjections = false;
    const double *positions = nullptr, *expectedForces = nullptr;
    const CouplingTerm* terms = nullptr;
    int numTerms = 0;
};

} // namespace cylchain

#endif /*CYLCHAIN_BODY_STEP_H_*/
