#ifndef CYLCHAIN_END_GROWTH_H_
#define CYLCHAIN_END_GROWTH_H_

#include "growth/ChainsInStep.h"
#include "growth/GrowthEvent.h"
#include <vector>

namespace cylchain {

/**
 * Ends that gain and lose monomers, and change their states.
 *
 * Monomers come at the rate k_on c min(1, exp(-dV/k_B T)), and go at k_off min(1, exp(-dV/k_B T)), with dV the change
 * of the energies of all that is around. The shape of the chain is that of equilibrium before and after (ChainShapes).
 */
class EndGrowth {
public:
    EndGrowth(const GrowthSystem& system, ChainShapes& shapes) : system(system), shapes(shapes) {
    }
    /** Add what may happen to the ends of a chain. */
    void listEvents(const GrowthState& state, int index, const ChainsInStep& chains,
            std::vector<GrowthEvent>& events) const;
    /** Let an event happen at a time, unless energies or a lack of nodes are against it. */
    void apply(GrowthState& state, const GrowthEvent& event, double time, double kT, RandomNumbers& random,
            ChainsInStep& chains);
private:
    double shareOfRates(const GrowthState& state, int index, const EndState& now) const;
    void block(GrowthState& state, const GrowthEvent& event, double time, RandomNumbers& random) const;
    void changeState(GrowthState& state, const GrowthEvent& event, double time, RandomNumbers& random) const;
    void setEndState(GrowthState& state, const GrowthEvent& event, double time, RandomNumbers& random) const;
    const GrowthSystem& system;
    ChainShapes& shapes;
};

} // namespace cylchain

#endif /*CYLCHAIN_END_GROWTH_H_*/
