#ifndef CYLCHAIN_MODE_PACKS_H_
#define CYLCHAIN_MODE_PACKS_H_

#include "dynamics/ModePack.h"
#include <vector>

namespace cylchain {

/**
 * All chains in packs for their modes, first in double precision and then, for the chains of several of these, in
 * single precision. There are none if a chain has no modes.
 */
class ModePacks {
public:
    /**
     * @param lanes      the largest number of lanes in double precision
     * @param wideLanes  the number of lanes in single precision
     */
    ModePacks(const std::vector<Chain>& chains, int lanes, int wideLanes);
    /** Get the packs that a step takes, which hold each chain once. */
    std::vector<int> getPacksOfStep(const StepSettings& settings) const;
    bool isWide(int pack) const {
        return pack >= (int) packs.size();
    }
    const ModePack<double>& get(int pack) const {
        return packs[pack];
    }
    const ModePack<float>& getWide(int pack) const {
        return wide[pack-packs.size()].pack;
    }
    int getNumWideChains(int pack) const {
        return isWide(pack) ? wide[pack-packs.size()].chains : 0;
    }
private:
    /** A pack that takes the place of some in double precision. */
    struct Wide {
        ModePack<float> pack;
        int first, last, chains;
        bool isUsed(const StepSettings& settings) const;
    };
    void addFamily(const std::vector<Chain>& chains, const std::vector<int>& members, const BeadModes& modes,
            int lanes, int wideLanes);
    std::vector<ModePack<double> > packs;
    std::vector<Wide> wide;
};

} // namespace cylchain

#endif /*CYLCHAIN_MODE_PACKS_H_*/
