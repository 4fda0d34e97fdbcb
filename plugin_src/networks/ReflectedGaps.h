#ifndef CYLCHAIN_REFLECTED_GAPS_H_
#define CYLCHAIN_REFLECTED_GAPS_H_

#include "networks/CoupledEquations.h"
#include "networks/Gap.h"
#include "networks/GapResponses.h"
#include "networks/ReflectedMotion.h"
#include <cstddef>
#include <vector>

namespace cylchain {

/**
 * The gaps of contacts and walls in an implicit step.
 *
 * In each iteration, the equations are solved without their forces, and say where gaps end then. ReflectedMotion finds
 * the forces from that; the equations take them, and the next iteration begins where they lead. What responses lack of
 * where they lead is corrected from one iteration to the next.
 */
class ReflectedGaps {
public:
    /** Begin a step without gaps. */
    void begin(const StepSettings& settings, const ChainPlaces& places);
    /** What gaps are drawn with. */
    const GapNoise& getNoise() const {
        return motion.getNoise();
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
    bool anyUnfinished(const Loop& loop);
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
    void findRoles(const std::vector<char>& goingOn);
    void complete(const std::vector<PackStep*>& packs, CoupledEquations& coupled, bool single, const Loop& loop);
    bool takesPart(int gap, int side) const;
    bool waits(int gap, int side) const;
    bool isPushed(int gap, int side) const;
    void findFreeEnds(const CoupledEquations& coupled, const Loop& loop);
    void predictEnds(const CoupledEquations& coupled, const Loop& loop);
    bool wouldPush(const Gap& gap) const;
    bool isTorn(int gap) const;
    bool isBehind(int gap) const;
    bool deviates(int gap, double share) const;
    template <class Flags> void markChains(int gap, Flags& chains) const;
    std::vector<Gap> gaps;
    GapResponses responses;
    ReflectedMotion motion {gaps, responses};
    double kT = 0;
    Precision precision = Precision::Double;
    /** The packs that take part in an iteration. */
    const PackFlags* active = nullptr;
    /**
     * For each gap: the force; the end without forces, that which is predicted, and by how much corrections have
     * changed in the last iteration.
     */
    std::vector<double> forces, free, predicted, changes;
    /**
     * For each side of each gap: how much farther forces have moved it than responses say; the force that its chain had
     * when it moved last, and how far forces would have moved it since.
     */
    std::vector<double> corrections, applied, lacking;
    /** Whether each gap has got other places or gradients since forces were found, and how far it has come. */
    std::vector<char> turned, progress;
    std::vector<GapRole> roles;
    /** For each chain, whether it has a gap whose force is found. */
    std::vector<char> hasPushed;
    /** The first equation of each gap, and one behind those of all. */
    std::vector<std::size_t> firstEquations;
};

} // namespace cylchain

#endif /*CYLCHAIN_REFLECTED_GAPS_H_*/
