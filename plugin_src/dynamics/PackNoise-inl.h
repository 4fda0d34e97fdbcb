// Included into the namespace of an instruction set. It does not compile alone.

/**
 * Where a pack and a step stand among random numbers.
 */

inline NoiseKey noiseKey(const StepSettings& settings) {
    return {(std::uint32_t) settings.seed, (std::uint32_t) settings.level, settings.step};
}

/** The first part of each chain of a pack. */
template <int W> inline NoisePlaces<W> noisePlaces(const Pack& pack) {
    NoisePlaces<W> places;
    for (int i = 0; i < W; i++) {
        reinterpret_cast<Word*>(&places.chain)[i] = pack.chain[i];
        reinterpret_cast<Word*>(&places.part)[i] = pack.firstNode[i];
    }
    return places;
}

/** The random force on a node, before friction colours it. */
template <class Real> CYLCHAIN_INLINE Vector<Real> nodeNoise(const Real* normals, bool planar) {
    return {normals[0], normals[1], planar ? Real{} : normals[2]};
}

/** The random forces of a segment: that on its middle and that on its ends, before friction colours them. */
template <class Real> CYLCHAIN_INLINE void forceNoise(const Real* normals, bool planar, Vector<Real>& a,
        Vector<Real>& b) {
    a = {normals[0], normals[1], planar ? Real{} : normals[2]};
    b = {normals[3], normals[4], planar ? Real{} : normals[5]};
}
