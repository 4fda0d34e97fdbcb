#ifndef CYLCHAIN_PACK_STEP_SOURCE_H_
#define CYLCHAIN_PACK_STEP_SOURCE_H_

#include "dynamics/PackStep.h"
#include <memory>
#include <vector>

namespace cylchain {

/** Packs of chains that are no ChainEngine's, and steps of them that can be coupled to others. */
class PackStepSource {
public:
    virtual ~PackStepSource() {
    }
    /** Get the number of packs, which hold each chain once. */
    virtual int getNumPacks() const = 0;
    /** Create an object that takes steps of a pack. */
    virtual std::unique_ptr<PackStep> createStep(int pack) const = 0;
    /** Get the chain of each lane of a pack, or -1. */
    virtual const std::vector<int>& getChainsOfLanes(int pack) const = 0;
};

} // namespace cylchain

#endif /*CYLCHAIN_PACK_STEP_SOURCE_H_*/
