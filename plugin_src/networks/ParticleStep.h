#ifndef CYLCHAIN_PARTICLE_STEP_H_
#define CYLCHAIN_PARTICLE_STEP_H_

#include "dynamics/PackStep.h"
#include <vector>

namespace cylchain {

/** A particle outside chains that couplings take hold of, and its friction. */
struct CoupledParticle {
    int particle;
    double friction;
};

/**
 * Particles outside chains in an implicit step, as a pack whose lanes hold one particle each. With the friction zeta, a
 * particle at x in a flow u gets, besides the forces of couplings,
 *
 *     zeta ((y-x)/h-u) = f+f_random.
 */
class ParticleStep : public PackStep {
public:
    explicit ParticleStep(const std::vector<CoupledParticle>& particles);
    void begin(const double* positions, const double* forces, const double* box, const StepSettings& settings,
            const bool* taken) override;
    int getNumStages() const override;
    void beginStage(int stage) override;
    void eliminate(const CouplingTerm* terms, int numTerms, double* moves) override;
    void respond(const double* forces, double* moves) override;
    void respond(const float* forces, float* moves) override;
    void findCompliances(double* compliances) override;
    void advance(const double* forces, const ShareOfChange& share, bool* unfinished, double* moves) override;
    void findExcessiveChanges(bool* failed) const override;
    void getPositions(const double* start, double* positions) const override;
    void getDisplacements(double* displacements) const override;
private:
    void solve(int particle, const double* force, double* move) const;
    template <class Number> void gatherForces(const Number* onPlaces);
    void gatherMoves(double* moves) const;
    template <class Number> void respondAs(const Number* forces, Number* moves);
    const std::vector<CoupledParticle> particles;
    StepSettings settings = {};
    std::vector<bool> taken;
    /** Three numbers for each particle. */
    std::vector<double> forces, noise, drift, moved, change, right;
    /** Of the equations of each particle, a symmetric matrix. */
    std::vector<double> inverse;
    const CouplingTerm* terms = nullptr;
    int numTerms = 0;
    double shareOfForces = 1, shareOfNoise = 1;
};

} // namespace cylchain

#endif /*CYLCHAIN_PARTICLE_STEP_H_*/
