// Included into the namespace of an instruction set. It does not compile alone.

/**
 * Random numbers in lanes, as Noise.h describes them. The functions are compiled by themselves, in NoiseLoops-inl.h: no
 * multiplication may be fused with an addition there.
 */

/** A chain and one of its parts in each lane. */
template <int W> struct NoisePlaces {
    typename Lanes<W>::Bits chain, part;
};

/** Draw the first normal numbers of each lane's place: those of PAIRS pairs. */
template <int W, int PAIRS> void drawNormals(const NoiseKey& key, NoiseKind kind, const NoisePlaces<W>& places,
        typename Lanes<W>::Type* normals);

/**
 * Draw the first candidate of each lane's place: two normal numbers, and one that is uniform between 0 and 1, to accept
 * it or not.
 */
template <int W> void drawCandidates(const NoiseKey& key, NoiseKind kind, const NoisePlaces<W>& places,
        typename Lanes<W>::Type* normals, typename Lanes<W>::Type& uniform);

/**
 * Draw coordinates of the lengths of FENE segments from equilibrium, over their maximum extensions.
 *
 * @param stiffness    k D^2/k_B T
 * @param coordinates  one normal number for each, which becomes the coordinate unless it is rejected
 */
template <int W> void drawFeneCoordinates(const NoiseKey& key, const NoisePlaces<W>& places,
        typename Lanes<W>::Type stiffness, typename Lanes<W>::Type& coordinates);

/** Draw another candidate for one place; the first one has the number 0. */
void drawCandidate(const NoiseKey& key, NoiseKind kind, std::uint32_t chain, std::uint32_t part, std::uint32_t draw,
        double* normals, double& uniform);

/** Draw two numbers that are uniform between 0 and 1 for one place. */
void drawUniforms(const NoiseKey& key, NoiseKind kind, std::uint32_t chain, std::uint32_t part, std::uint32_t draw,
        double* uniforms);

/** The functions of Noise.h. */
void drawWordsOf(const NoiseKey& key, NoiseKind kind, std::uint32_t draw, const std::uint32_t* chains,
        const std::uint32_t* parts, int count, std::uint32_t* words);
void drawNormalsOf(const NoiseKey& key, NoiseKind kind, const std::uint32_t* chains, const std::uint32_t* parts,
        int count, double* normals);
void drawFeneCoordinatesOf(const NoiseKey& key, const std::uint32_t* chains, const std::uint32_t* segments,
        const double* stiffness, int count, double* coordinates);
