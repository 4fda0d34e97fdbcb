#ifndef CYLCHAIN_REFLECTED_GAPS_H_
#define CYLCHAIN_REFLECTED_GAPS_H_

#include "networks/CoupledEquations.h"
#include "networks/Gap.h"
#include "networks/GapColors.h"
#include "networks/GapResponses.h"
#include <cstddef>
#include <vector>

namespace cylchain {

/**
 * The forces of contacts and walls in an implicit step.
 *
 * Let the step without them be linear and reversible, with the equilibrium k_B T K^-1, and C its response to a force
 * that acts during the step. Gaps n with gradients N then keep the equilibrium of hard surfaces at n = 0 exactly,
 * whatever the step and the load, if their forces F are the local times at the end of the step of Brownian motion with
 * the covariance 2 k_B T G, G = N^T C N, that goes from the gaps a at the start to the gaps b at the end without
 * forces and is reflected at zero along G: the end is n = b+G F. All terms of the probability of a step with loads and
 * with modes that relax in it are symmetric in start and end, and the law of reflected motion is exp(-F.n/k_B T) times
 * what is symmetric in a and n. See Harrison and Reiman, Ann. Probab. 1981, 9, 302.
 *
 * For one gap, the motion between a and b has gone to the minimum
 *
 *     m = ((a+b)-((a-b)^2+4 k_B T G E)^(1/2))/2,      F = max(0, -m)/G
 *
 * with an exponential variate E of mean one. Gaps that share chains are found in parts of the step: in each, the ends
 * move on by a share of b-a and by a bridge of Brownian motion with the covariance 2 k_B T G, and every gap takes the
 * law of one, with what others push in this part whole at its end and by a share at its start: what opens the gap by a
 * third; and what closes it the other way round, by 0.4 times the square of the correlation of both, since one is
 * pushed while the other one is open.
 * Gaps that move together have variates E that are correlated as their motion is: those that move as one are reflected
 * as one. With one gap on each chain, all this is exact. Going through the gaps in turn finds the forces of a part;
 * threads do so at once with gaps that share no chain.
 *
 * Soft surfaces are hard ones at random depths: see placeHardSurface().
 */
class ReflectedGaps {
public:
    /** Begin a step without gaps. */
    void begin(const StepSettings& settings, const ChainPlaces& places);
    /** What gaps are drawn with. */
    const GapNoise& getNoise() const {
        return noise;
    }
    /** Add a gap; returns its number. */
    int add(const Gap& gap);
    Gap& get(int number) {
        return gaps[number];
    }
    /** Take another one in place of a gap, whose places or gradients have changed. */
    void turn(int number, const Gap& gap);
    const Gap& get(int number) const {
        return gaps[number];
    }
    int size() const {
        return gaps.size();
    }
    /** Add an equation for each gap: it has no force yet, but places. */
    void addEquations(std::vector<CouplingEquation>& equations, const Loop& loop);
    /**
     * Find the forces, and let the equations of an iteration take them, which have been solved without.
     *
     * Forces are found of gaps on chains that go on. Chains of packs that take no part stay where they are: what forces
     * that change would move there is known from their responses, and must be little.
     *
     * @param active   the packs that take part in the iteration
     * @param goingOn  the chains in them that need it, among them those of gaps that have just been found
     */
    void push(const std::vector<PackStep*>& packs, const PackFlags& active, const std::vector<char>& goingOn,
            CoupledEquations& coupled, const CoupledEquations::Demands& demands, const Loop& loop);
    /** Whether a gap is not where the equations have led it, after its end has been found there. */
    bool isUnfinished(int number) const;
    bool anyUnfinished();
    /** Whether chains that have converged may rest: one place of a link must not move alone while gaps push it. */
    bool allowRests() const {
        return !responses.haveLinks();
    }
    /** Mark the chains that need another iteration, after anyUnfinished(). */
    void markUnfinished(std::vector<char>& chains) const;
    /** Mark the chains of gaps that are unfinished. */
    void findFailures(std::vector<bool>& failed) const;
    /** The force of a gap, the mean over the step: per length if its gradient is one. */
    double getForce(int number) const {
        return number < (int) forces.size() ? forces[number] : 0;
    }
private:
    int chooseParts() const;
    void drawNumbers(const Loop& loop);
    void correlate(const std::vector<double>& normals, std::vector<double>& sums, const Loop& loop) const;
    void findNoise(const Loop& loop);
    void findRoles(const std::vector<char>& goingOn);
    void complete(const std::vector<PackStep*>& packs, CoupledEquations& coupled, bool single, const Loop& loop);
    bool takesPart(int gap, int side) const;
    bool waits(int gap, int side) const;
    double motionOf(int gap, int side) const;
    template <class Function> void moveAll(Function forceOf, const Loop& loop);
    void findFreeEnds(const CoupledEquations& coupled, const Loop& loop);
    void predictEnds(const CoupledEquations& coupled, const Loop& loop);
    void findPushes(const Loop& loop);
    void findPushesOfPart(int part, const Loop& loop);
    double findPush(int gap, int part) const;
    double findPushOfSpring(int gap, int part, double end) const;
    void move(int gap, double push, bool reflects);
    void moveChain(int gap, int side, double push, bool reflects);
    void noteMotion(int gap);
    void findSharesAtStart(const Loop& loop);
    double scaleOf(int gap) const;
    bool wouldPush(const Gap& gap) const;
    bool isTorn(int gap) const;
    bool isBehind(int gap) const;
    bool deviates(int gap, double share) const;
    template <class Flags> void markChains(int gap, Flags& chains) const;
    std::vector<Gap> gaps;
    GapNoise noise;
    double kT = 0;
    Precision precision = Precision::Double;
    int parts = 1;
    /** The packs that take part in an iteration. */
    const PackFlags* active = nullptr;
    /**
     * For each gap: the force and its share in each part; the end without forces, that which is predicted, and by how
     * much corrections have changed in the last iteration.
     */
    std::vector<double> forces, pushes, free, predicted, changes;
    /**
     * For each side of each gap: how much farther forces have moved it than responses say; the force that its chain had
     * when it moved last, and how far forces would have moved it since.
     */
    std::vector<double> corrections, applied, lacking;
    /** Whether each gap has got other places or gradients since forces were found. */
    std::vector<char> turned;
    /** What an iteration makes of a gap: its force is found, or it shares a chain with such, or it does not. */
    enum class Role : char {Pushed, Beside, Apart};
    std::vector<Role> roles;
    /** For each chain, whether it has a gap whose force is found. */
    std::vector<char> hasPushed;
    /** The first equation of each gap, and one behind those of all. */
    std::vector<std::size_t> firstEquations;
    GapResponses responses;
    /** For each gap and part: exponential variates, a bridge of Brownian motion, and what both are made of. */
    std::vector<double> reflections, bridges, ofReflections, ofBridges;
    /** A gap in a part of the step: where it begins and would end without forces, and the force that is found. */
    struct GapInPart {
        double start, end, response, ofChains, variate, tolerance, push;
        /** The end of the part, where the next one begins. */
        double reached;
        /** Those that it does not have are behind all others, and do not move. */
        int ports[2];
        bool isReflected;
    };
    std::vector<GapInPart> inPart;
    /** All gaps, and those that are pushed in a part. */
    GapColors all, pushed;
    /** For each port, how far forces move it in a part, and what of those on other gaps counts at its start. */
    std::vector<double> motions, motionsAtStart;
    /** Whether that has changed since its gap was looked at. */
    std::vector<char> haveMoved;
    /** For each chain, how far a force on each port moves all others at the start of a part. */
    std::vector<std::vector<double> > sharesAtStart;
};

} // namespace cylchain

#endif /*CYLCHAIN_REFLECTED_GAPS_H_*/
