#ifndef CYLCHAIN_LINK_EQUATIONS_H_
#define CYLCHAIN_LINK_EQUATIONS_H_

#include "couplings/Links.h"
#include "networks/ImplicitCouplings.h"
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
 * equilibrium of r. Other links have one coordinate q, a function of the distance d, as segments have: the force -T J
 * with
 *
 *     T = k (theta q(y)+(1-theta) q(x)-(2 theta-1)^(1/2) q_random),    J = (r(x)+r(y))/(d(x)+d(y)).
 *
 * J is a discrete gradient: J.(r(y)-r(x)) = d(y)-d(x), however far a link turns. With it, steps there and back differ
 * by the energy of the link, as detailed balance wants it, and by the ratio of the determinants of their equations,
 * which the metric force makes up for, with the compliance C of its places without the link:
 *
 *     -k_B T k theta (C J-J (J.C J)) (1/d(x)+1/d(y))/2 / (1+k theta J.C J).
 *
 * The equations of an iteration have J J^T in place of the product of J with the new direction, and T/(d(x)+d(y))
 * across.
 */
class LinkEquations : public ImplicitCouplings {
public:
    /**
     * Set the links that steps have, which must exist while steps are taken, and how distances are measured. Links that
     * are on no chain are left out.
     */
    void setLinks(const std::vector<Link>* links, const LinkBoxes& boxes);
    void setNumber(int number) override {
        force = number;
    }
    /** Beside gaps, no link may be as stiff: how it yields is what its stiffness leaves of them. */
    bool needDoublePrecision(const ChainPlaces& places, double stepSize, bool besideGaps) const override;
    void begin(const CoupledStart& start, const Loop& loop) override;
    void beginStage(int stage, int numStages, const double* moved) override;
    void linearise(int iteration, const double* moved, std::vector<CouplingEquation>& equations) override;
    bool needsCompliances() const override {
        return anyTurns;
    }
    double getStiffness() const override {
        return largestStiffness;
    }
    double getDemandingStiffness() const override {
        return demandingStiffness;
    }
    void setCompliances(const double* compliances) override;
    bool finishIteration(const double* moves, const double* moved) override;
    Rests getRests() const override;
    bool markUnfinished(PackFlags& packs) const override;
    void findFailures(const double* moved, std::vector<bool>& failed) override;
    bool findCulprit(const double* moved, const CouplingEquation* equations, BrokenCoupling& culprit) const override;
    void findTouched(const ChainPlaces& places, std::vector<bool>& touched) const override;
    void findNeighbours(std::vector<std::pair<int, int> >& pairs) const override;
private:
    /** What a step keeps of a link: first what each iteration needs of all links, then what those that turn have. */
    struct State {
        const Link* link;
        PlaceOnChain places[2];
        /** Where their segments begin, or -1. */
        int particles[2];
        /** Whether it has a direction: one coordinate instead of three. */
        bool turns;
        /** Whether compliances are known, and whether no other link is on its segments. */
        bool compliant, alone;
        /** The image of the first place against the second. */
        double shift[3];
        double start[3], length;
        /** What a stage makes of these: the force is -k (implicit q(y)+constant). */
        double implicit, constant[3];
        /** Of the last iteration: the vector from place to place with which it began, and its response. */
        double now[3], response;
        /** The squared change of the last iteration, times the response, and what isLastChange() takes for it. */
        double change, changeBefore;
        /** How its places have moved while one of their packs took no part. */
        double drift[3];
        /** Where a stage begins. */
        double coordinate, random[3], theta;
        /** The least friction of its places. */
        double friction[2];
        /** Of the last iteration: direction, distance, tension, the slope of it, and the tension after it. */
        double direction[3], distance, tension, slope, multiplier;
        /** How its places move apart by a force between them, without this link. */
        double compliance[6];
        /** The direction of the first iteration as a unit vector, and how a unit force along it moves them apart. */
        double first[3], firstResponse[3];
    };
    void place(const CoupledStart& start, const Link& link, State& state) const;
    void prefetchPlaces(const State& state, const double* positions) const;
    void addStiffness(const ChainPlaces& places);
    void describe(const CoupledStart& start, State& state) const;
    void drawNoise(const CoupledStart& start);
    void select();
    void linearise(State& state, const double* moved, CouplingEquation& equation) const;
    bool isUnfinished(State& state, const double* move, const double* moved) const;
    double findChange(const State& state, const double* move) const;
    bool turnsTooMuch(const State& state, const double* move, double least) const;
    bool hasFailed(std::size_t number, const double* moved) const;
    double describeMetric(const State& state, const double* r, double* force) const;
    void vectorOf(const State& state, const double* positions, double* r) const;
    std::vector<State> states;
    /** Those of packs that take part in the iteration: its equations. */
    std::vector<int> selected;
    /** Whether each needs another iteration. */
    std::vector<char> unfinished;
    const Loop* loop = nullptr;
    const PackFlags* active = nullptr;
    const std::vector<Link>* links = nullptr;
    LinkBoxes boxes;
    const double* begun = nullptr;
    double kT = 0, stepSize = 0, shareOfMetricForces = 1, largestStiffness = 0, demandingStiffness = 0;
    /** The same of links that turn alone. */
    double turningStiffness = 0;
    bool anyTurns = false;
    /** Of the force that they belong to. */
    int force = 0;
    /** Of all links on the segment that begins with a particle. */
    std::vector<double> stiffness;
    std::vector<std::uint32_t> chains, parts;
    std::vector<double> normals;
};

} // namespace cylchain

#endif /*CYLCHAIN_LINK_EQUATIONS_H_*/
