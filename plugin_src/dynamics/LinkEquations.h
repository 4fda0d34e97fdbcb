#ifndef CYLCHAIN_LINK_EQUATIONS_H_
#define CYLCHAIN_LINK_EQUATIONS_H_

#include "couplings/Links.h"
#include "dynamics/ImplicitCouplings.h"
#include <vector>

namespace cylchain {

/**
 * Links in an implicit step.
 *
 * A link of rest length zero has the three components of r, the vector from its second place to its first, as
 * coordinates, each with the energy k q^2/2, and the force
 *
 *     -k (theta r(y)+(1-theta) r(x)-(2 theta-1)^(1/2) r_random),    theta = max(1/2, 1-1/(h sum k'/zeta)),
 *
 * with the friction zeta of each of its places and the stiffness k' of all links there, and r_random drawn from the
 * equilibrium of r. Other links have one coordinate q, a function of the distance, as segments have: the force -T along
 * the mean of r(x) and r(y) with
 *
 *     T = k (theta q(y)+(1-theta) q(x)-(2 theta-1)^(1/2) q_random),
 *
 * a stiffness T/2d against turning, and the metric force -k_B T k (2 theta-1) H C t/(1+k theta t.C t) with the Hessian
 * H = (1-t t)/d of the distance and the compliance C of its places.
 */
class LinkEquations : public ImplicitCouplings {
public:
    /**
     * Set the links that steps have, which must exist while steps are taken, and how distances are measured. Links that
     * are on no chain are left out.
     *
     * @param force  a number of the force that they belong to, for their noise
     */
    void setLinks(const std::vector<Link>* links, const LinkBoxes& boxes, int force);
    void begin(const CoupledStart& start, const Loop& loop) override;
    void beginStage(int stage, int numStages, const double* moved) override;
    void linearise(int iteration, const double* moved, std::vector<CouplingEquation>& equations) override;
    bool needsCompliances() const override {
        return anyTurns;
    }
    void setCompliances(const double* compliances) override;
    bool finishIteration(const double* moves, const double* moved) override;
    void findFailures(const double* moved, std::vector<bool>& failed) const override;
    void findNeighbours(std::vector<std::pair<int, int> >& pairs) const override;
private:
    /** What a step keeps of a link. */
    struct State {
        const Link* link;
        PlaceOnChain places[2];
        /** Whether it has a direction: one coordinate instead of three. */
        bool turns;
        /** The image of the first place against the second. */
        double shift[3];
        double start[3], length, coordinate, random[3], theta;
        /** What a stage makes of these: the force is -k (implicit q(y)+constant). */
        double implicit, constant[3];
        /** Of the last iteration: direction, distance, tension, its response, and the tension after it. */
        double direction[3], distance, tension, response, multiplier;
        double metricForce[3];
    };
    void addStiffness(const ChainPlaces& places);
    void describe(const CoupledStart& start, State& state) const;
    void drawNoise(const CoupledStart& start);
    void vectorOf(const State& state, const double* positions, double* r) const;
    std::vector<State> states;
    const std::vector<Link>* links = nullptr;
    LinkBoxes boxes;
    const double* begun = nullptr;
    double kT = 0, stepSize = 0, shareOfMetricForces = 1;
    bool anyTurns = false;
    int force = 0;
    /** Of all links on the segment that begins with a particle. */
    std::vector<double> stiffness;
    std::vector<std::uint32_t> chains, parts;
    std::vector<double> normals;
};

} // namespace cylchain

#endif /*CYLCHAIN_LINK_EQUATIONS_H_*/
