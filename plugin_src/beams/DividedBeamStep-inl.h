// Included into the namespace of an instruction set. It does not compile alone.

/**
 * Steps of a pack of beam chains. Chains whose equations were not solved take theirs in parts that follow the Brownian
 * path of the step, so that what failed is not left out of the noise.
 */

template <int W> void divideBeamStep(const BeamPack& pack, const BeamStart<W>& start,
            const SixVector<typename Lanes<W>::Type>* f, StepSettings settings,
            SixVector<typename Lanes<W>::Type>* y, bool* failed, typename BeamStep<W>::Memory& memory) {
    typedef typename Lanes<W>::Type Real;
    static thread_local Scratch vectors;
    const double h = settings.stepSize;
    const std::uint64_t step = settings.step;
    const int level = settings.level, n = pack.nodes;
    static thread_local BeamStartMemory<W> startMemory;
    SixVector<Real>* const moved = vectors.reserve<SixVector<Real> >(2*n);
    SixVector<Real>* const change = moved+n;
    const BeamStart<W> from = startMemory.reserve(pack);
    for (int division = 1; division <= LARGEST_BEAM_DIVISION && level+division <= LARGEST_LEVEL; division++) {
        const int parts = 1<<division;
        settings.stepSize = h/parts;
        settings.level = level+division;
        bool failedNow[W] = {}, failedPart[W];
        std::fill(moved, moved+n, SixVector<Real> {});
        bool hope = true;
        for (int part = 0; part < parts && hope; part++) {
            settings.step = (step<<division)+part;
            *from.first = *start.first+moved[0].position;
            for (int node = 0; node < n; node++) {
                from.control[node] = start.control[node]+moved[node].control;
                if (node < n-1)
                    from.chord[node] = start.chord[node]+(moved[node+1].position-moved[node].position);
            }
            for (std::size_t number = 0; number < pack.tethers.size(); number++) {
                const BeamTether& tether = pack.tethers[number];
                Vector<Real> move = moved[tether.node].position;
                const double of[] = {lane(move.x, tether.lane), lane(move.y, tether.lane), lane(move.z, tether.lane)};
                for (int k = 0; k < 3; k++)
                    from.tethers[3*number+k] = start.tethers[3*number+k]+of[k];
            }
            BeamStep<W>(pack, settings, from, memory).take(f, change, failedPart);
            hope = false;
            for (int node = 0; node < n; node++) {
                moved[node].position = moved[node].position+change[node].position;
                moved[node].control = moved[node].control+change[node].control;
            }
            for (int i = 0; i < W; i++) {
                failedNow[i] |= failedPart[i];
                hope |= failed[i] && !failedNow[i];
            }
        }
        bool any = false;
        for (int i = 0; i < W; i++) {
            if (failed[i] && !failedNow[i]) {
                failed[i] = false;
                for (int node = 0; node < n; node++)
                    for (std::size_t k = 0; k < 6; k++)
                        reinterpret_cast<Scalar*>(y+node)[k*W+i] = reinterpret_cast<Scalar*>(moved+node)[k*W+i];
            }
            any |= failed[i];
        }
        if (!any)
            return;
    }
}

template <int W> Instability stepBeams(const BeamPack& pack, const double* positions, const double* forces,
            const double* box, const StepSettings& settings, double* displacements) {
    typedef typename Lanes<W>::Type Real;
    static thread_local typename BeamStep<W>::Memory memory;
    static thread_local Scratch vectors;
    const int n = pack.nodes;
    static thread_local BeamStartMemory<W> startMemory;
    SixVector<Real>* const f = vectors.reserve<SixVector<Real> >(2*n);
    SixVector<Real>* const y = f+n;
    const BeamStart<W> start = startMemory.reserve(pack);
    gatherBeams<W>(pack, positions, box, start);
    gatherBeamForces<W>(pack, forces, f);
    bool failed[W];
    Instability result;
    result.iterations = BeamStep<W>(pack, settings, start, memory).take(f, y, failed);
    for (int i = 0; i < W; i++)
        result.divided += failed[i];
    if (result.divided > 0 && settings.mayDivide)
        divideBeamStep<W>(pack, start, f, settings, y, failed, memory);
    scatterBeams<W>(pack, y, displacements);
    for (int i = 0; i < W; i++)
        if (failed[i] && result.chain < 0)
            result.chain = pack.chain[i];
    return result;
}
