#ifndef CYLCHAIN_ENGINE_PACKS_H_
#define CYLCHAIN_ENGINE_PACKS_H_

#include "dynamics/ChainEngine.h"
#include "dynamics/ChainPieces.h"
#include "dynamics/ModePacks.h"
#include "dynamics/PackFilling.h"
#include "dynamics/WidePack.h"
#include <memory>
#include <mutex>
#include <vector>

namespace cylchain {

/** The packs of a ChainEngine. */
struct ChainEngine::Implementation {
    /** Chains whose modes are used may be all or none. */
    explicit Implementation(const std::vector<Chain>& ofModes) : modes(ofModes, bestKernels().lanes,
            bestKernels().wide.lanes) {
    }
    /** Packs are counted through all of these. Wide ones are in the order of those that they replace. */
    std::vector<ChainPack<double> > packs;
    std::vector<WidePack> wide;
    /** The chains of each pack in double precision, the longest first. */
    std::vector<std::vector<int> > members;
    PropertyTables<double> tables;
    PropertyTables<float> wideTables;
    ModePacks modes;
    /** Those of each pack in double precision whose chains are few and long, or NULL. */
    std::vector<std::unique_ptr<ChainPieces> > pieces;
    /** Whether chains come and go. All wide packs are used then, or none: where single precision is right for all. */
    bool mayChange = false;
    std::unique_ptr<WidePack> limits;
    /** Held where wide packs and their tables are made. */
    std::mutex making;
    /** Add a pack of some chains. */
    void add(const std::vector<Chain>& chains, const std::vector<int>& own, int lanes);
    /** Let a pack have its members as they are now. */
    void fill(int pack, const std::vector<Chain>& chains, int lanes);
    /** The wide pack in place of some packs. */
    WidePack widePackOf(const std::vector<Chain>& chains, int first, int last) const;
    /** Find where single precision is right for all chains that may be in wide packs. */
    void findLimits(const std::vector<Chain>& chains);
    /**
     * Find packs for chains that have changed, so that those of a pack are of similar length.
     *
     * @return the packs that have other chains, or chains that have changed, in ascending order
     */
    std::vector<int> placeChains(const std::vector<Chain>& chains, const std::vector<int>& changed);
    bool isOfModes(int pack) const {
        return pack >= (int) (packs.size()+wide.size());
    }
    ChainPieces* piecesOf(int pack) const {
        return pack < (int) pieces.size() ? pieces[pack].get() : NULL;
    }
    /** Call a function with a pack: one in double precision, a wide one, or the number of one of modes. */
    template <class Double, class Single, class Modes> decltype(auto) with(int pack, Double ofDouble, Single ofSingle,
                Modes ofModes) const {
        const int count = packs.size();
        if (pack < count)
            return ofDouble(packs[pack]);
        return isOfModes(pack) ? ofModes(pack-count-(int) wide.size()) : ofSingle(wide[pack-count]);
    }
};

} // namespace cylchain

#endif /*CYLCHAIN_ENGINE_PACKS_H_*/
