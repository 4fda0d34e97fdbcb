#ifndef CYLCHAIN_REFLECTED_MOTION_H_
#define CYLCHAIN_REFLECTED_MOTION_H_

#include "networks/Gap.h"
#include "networks/GapColors.h"
#include "networks/GapResponses.h"
#include <cstddef>
#include <vector>

namespace cylchain {

/** Gaps that a thread looks at together. */
const int CHUNK_OF_GAPS = 64;

/** What an iteration makes of a gap: its force is found, or it shares a chain with such, or it does not. */
enum class GapRole : char {Pushed, Beside, Apart};

/**
 * The forces of gaps that share chains, from where they start and would end without forces, and from how they move each
 * other.
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
 * threads do so at once with gaps that share no chain. Random numbers stay what they are in all iterations of a step.
 *
 * Soft surfaces are hard ones at random depths: see placeHardSurface().
 */
class ReflectedMotion {
public:
    /** Gaps and responses must exist as long as this. */
    ReflectedMotion(const std::vector<Gap>& gaps, const GapResponses& responses) : gaps(gaps), responses(responses) {
    }
    ReflectedMotion(const ReflectedMotion&) = delete;
    ReflectedMotion& operator=(const ReflectedMotion&) = delete;
    /** Begin a step without gaps. */
    void begin(const StepSettings& settings);
    /** What gaps are drawn with. */
    const GapNoise& getNoise() const {
        return noise;
    }
    /** Take note of the gaps that have been added, whose ports there are. */
    void addGaps() {
        all.sort(gaps.size(), responses);
    }
    /** Whether draw() knows all gaps. */
    bool isComplete() const {
        return bridges.size() == gaps.size()*parts;
    }
    /** Choose the number of parts, which does not become less in a step; false if it stays what it is. */
    bool chooseParts();
    /** Draw the random numbers that are not there yet, and correlate them where responses are new. */
    void draw(const Loop& loop);
    /**
     * Find the forces.
     *
     * @param roles   forces of gaps that are not pushed stay what they are
     * @param free    the ends of gaps without forces
     * @param forces  receives those of gaps that are pushed, the means over the step
     */
    void findForces(const std::vector<GapRole>& roles, const std::vector<double>& free, std::vector<double>& forces,
            const Loop& loop);
    /** Let forces on each side of gaps, which a function gives, move all ports of the chains there. */
    template <class Function> void moveSides(Function forceOf, const Loop& loop) {
        motions.assign(responses.countPorts()+1, 0.0);
        all.visit(false, loop, [&] (int i) {
            for (int side = 0; side < 2; side++)
                if (const double force = forceOf(i, side); force != 0)
                    moveChain(i, side, force, false);
            return 0.0;
        });
    }
    /** How far moveSides() has moved a gap's side. */
    double getMotion(int gap, int side) const {
        return motions[responses.getPort(gap, side)];
    }
    /** How far a gap moves without being noticed: thermally behind its surface, or in the step. */
    double getScale(int gap) const;
private:
    void drawNumbers(const Loop& loop);
    void correlate(const std::vector<double>& normals, std::vector<double>& sums, const Loop& loop) const;
    void findNoise(const Loop& loop);
    void findSharesAtStart(const Loop& loop);
    void findForcesOfPart(int part, const std::vector<GapRole>& roles, const Loop& loop);
    double findPush(int gap, int part) const;
    double findPushOfSpring(int gap, int part, double end) const;
    void move(int gap, double push, bool reflects);
    void moveChain(int gap, int side, double push, bool reflects);
    void noteMotion(int gap);
    const std::vector<Gap>& gaps;
    const GapResponses& responses;
    GapNoise noise;
    double kT = 0;
    int parts = 1;
    /** For each gap and part: exponential variates, a bridge of Brownian motion, and what both are made of. */
    std::vector<double> reflections, bridges, ofReflections, ofBridges;
    /** The share of each part in the force of each gap. */
    std::vector<double> pushes;
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

#endif /*CYLCHAIN_REFLECTED_MOTION_H_*/
