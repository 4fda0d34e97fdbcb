#ifndef CYLCHAIN_BEAM_ENGINE_H_
#define CYLCHAIN_BEAM_ENGINE_H_

#include "dynamics/ChainEngine.h"
#include "dynamics/PackStepSource.h"
#include "mechanics/BeamChain.h"
#include <memory>
#include <vector>

namespace cylchain {

/**
 * Forces and displacements of many chains of beam elements, in packs like those of ChainEngine: they are independent of
 * each other, and no result depends on which thread computes what. Positions, forces and displacements are arrays of
 * three doubles for each particle.
 */
class BeamEngine : public PackStepSource {
public:
    /** The longest element that a step takes, over its persistence length. */
    static constexpr double LONGEST_ELEMENT = 1;
    /**
     * @param chains      the chains; no particle may belong to two of them
     * @param firstNoise  the number by which the noise of the first chain is known, and those that follow
     */
    explicit BeamEngine(const std::vector<BeamChain>& chains, int firstNoise = 0);
    ~BeamEngine();
    int getNumPacks() const override;
    /** Create an object that takes steps of scheme "implicit" of a pack whose chains are coupled to others. */
    std::unique_ptr<PackStep> createStep(int pack) const override;
    const std::vector<int>& getChainsOfLanes(int pack) const override;
    /** Get the particles of a pack. */
    ParticleRange getParticles(int pack) const;
    /** Set the forces on the particles of a pack to zero. */
    void clearForces(int pack, double* forces) const;
    /** Add the forces on the particles of a pack. See ChainEngine::addForces(). */
    ChainEnergy addForces(int pack, const double* positions, double* forces, const double* box,
            bool includeEnergy) const;
    /**
     * Compute the displacements of a pack in a step of scheme "implicit", the only one there is for beams, without
     * flow. The forces are those from outside the chains. A chain whose equations are not solved takes the step in
     * parts. Elements that are longer than a persistence length are refused.
     *
     * @return the first instability found, with the number of the chain, or chain = -1 if there is none
     */
    Instability step(int pack, const double* positions, const double* forces, const double* box,
            const StepSettings& settings, double* displacements) const;
private:
    struct Implementation;
    std::unique_ptr<Implementation> implementation;
};

} // namespace cylchain

#endif /*CYLCHAIN_BEAM_ENGINE_H_*/
