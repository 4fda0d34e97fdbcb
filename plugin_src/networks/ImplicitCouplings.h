#ifndef CYLCHAIN_IMPLICIT_COUPLINGS_H_
#define CYLCHAIN_IMPLICIT_COUPLINGS_H_

#include "couplings/CouplingImpulses.h"
#include "networks/ReflectedGaps.h"
#include <utility>
#include <vector>

namespace cylchain {

/** What a step of coupled chains begins with. */
struct CoupledStart {
    /** Three doubles for each particle. */
    const double* positions;
    const StepSettings& settings;
    const ChainPlaces& places;
    /** Whether each chain takes the step; others do not move. */
    const std::vector<bool>& taken;
    /** The packs that take part in an iteration, as they are while it goes on. */
    const PackFlags& active;
    /** Whether a place takes part: one that is on no chain or on one that takes the step. */
    bool takes(const PlaceOnChain& place) const {
        return place.pack < 0 || taken[place.chain];
    }
};

/** A place as it is reported. */
inline BrokenCoupling::Place describePlace(const PlaceOnChain& place) {
    return {place.chain, place.pack < 0 ? -1 : place.node};
}

/** What couplings make of packs that rest: see ImplicitCouplings::getRests(). */
enum class Rests {Possible, Worthwhile, Wrong};

/**
 * The couplings of a force: forces between places of chains, or on places of chains, that an implicit step has in its
 * equations. NetworkStep calls these functions in the order in which they stand here.
 */
class ImplicitCouplings {
public:
    virtual ~ImplicitCouplings() {
    }
    /** Whether they are gaps, as those of contacts and walls. */
    virtual bool areGaps() const {
        return false;
    }
    /** Take a number, for their noise: among the forces of a step that are gaps, or among those that are none. */
    virtual void setNumber(int) {
    }
    /** What receives their forces, or NULL. */
    virtual CouplingImpulses* getImpulses() const {
        return nullptr;
    }
    /**
     * Whether a coupling is so stiff in one direction that a step in single precision loses the digits of what lies
     * across.
     *
     * @param besideGaps  whether the step has gaps
     */
    virtual bool needDoublePrecision(const ChainPlaces&, double, bool) const {
        return false;
    }
    /** Of gaps, about the largest softness k c, see ContactRest: c is how far a force moves it in the step. */
    virtual double findLargestSoftness(const CoupledStart&) {
        return 0;
    }
    /** What takes their place in steps in which gaps are too soft to be resolved. */
    virtual ImplicitCouplings& getHardOnes() {
        return *this;
    }
    /** Let virtual sites that they have on curves of beam elements follow these. */
    virtual void placeSites(double*) const {
    }
    /** Describe the start of a step, and draw its noise. */
    virtual void begin(const CoupledStart& start, const Loop& loop) = 0;
    /** Begin a stage, see PackStep. The end of the stage before is where particles have been moved to. */
    virtual void beginStage(int, int, const double*) {
    }
    /**
     * Add the equations of an iteration, linearised where particles have been moved to. Those between packs that take
     * no part may be left out.
     *
     * @param moved  positions after the last iteration, three doubles for each particle
     */
    virtual void linearise(int, const double*, std::vector<CouplingEquation>&) {
    }
    /** Whether setCompliances() is to be called after the first iteration has been solved. */
    virtual bool needsCompliances() const {
        return false;
    }
    /** Of couplings between two places that move, the stiffness of the stiffest, over their friction in a step. */
    virtual double getStiffness() const {
        return 0;
    }
    /**
     * Of couplings that need equations which are solved well, the stiffness of the stiffest, over the friction of its
     * places in a step. Those are couplings that turn, those of beam elements, which bend 2 % too little otherwise, and
     * in the scheme of second order all that are stiff.
     */
    virtual double getDemandingStiffness() const {
        return 0;
    }
    /** What solving the equations may leave of the energy of the error that it begins with. */
    virtual double getRelativeTolerance() const {
        return 0.05;
    }
    /** Take note of how forces move the places of the equations: see CoupledEquations::findCompliances(). */
    virtual void setCompliances(const double*) {
    }
    /**
     * Take note of what the linear equations have found.
     *
     * @param moves  for each equation, how its first place moves against its second
     * @param moved  where particles are now
     * @return whether another iteration is needed
     */
    virtual bool finishIteration(const double*, const double*) {
        return false;
    }
    /**
     * Add gaps that may be closed where an iteration has led, and find where those that are known are now.
     *
     * @param settled  whether chains and other couplings have converged, and gaps where they are known
     * @return whether another iteration is needed, whatever the gaps are
     */
    virtual bool findGaps(int, bool, const double*, ReflectedGaps&) {
        return false;
    }
    /**
     * Whether packs that have converged may rest while others go on. It is worthwhile where few packs go on for long,
     * and wrong where couplings are so stiff that one of their places must not move alone.
     */
    virtual Rests getRests() const {
        return Rests::Possible;
    }
    /**
     * Find gaps again whose places stay in iterations, where all has converged.
     *
     * @return whether any of them is another one, so that another iteration may be needed
     */
    virtual bool followAgain(ReflectedGaps&) {
        return false;
    }
    /**
     * Mark the packs that need another iteration, after finishIteration() has said that one is needed.
     *
     * @return whether that is known; if not, all do
     */
    virtual bool markUnfinished(PackFlags&) const {
        return false;
    }
    /**
     * Find chains by which the step has gone wrong when the equations are solved, so that it must be divided.
     */
    virtual void findFailures(const double* moved, std::vector<bool>& failed) = 0;
    /**
     * Find the coupling by which a step that cannot be divided any more has gone wrong: call it after findFailures().
     *
     * @param equations  the own ones of the last iteration
     * @param culprit    receives it
     * @return whether there is one
     */
    virtual bool findCulprit(const double* moved, const CouplingEquation* equations, BrokenCoupling& culprit) const = 0;
    /** Add the forces in the step that has been solved: the means over it where they are known, or those at its end. */
    virtual void findPushes(const double*, std::vector<Push>&) const {
    }
    /** Mark the chains that these couplings may act on in a step: all, if that is not known before. */
    virtual void findTouched(const ChainPlaces&, std::vector<bool>& touched) const {
        touched.assign(touched.size(), true);
    }
    /** Add pairs of chains that these couplings join, so that a step is divided for both. */
    virtual void findNeighbours(std::vector<std::pair<int, int> >& pairs) const = 0;
};

} // namespace cylchain

#endif /*CYLCHAIN_IMPLICIT_COUPLINGS_H_*/
