// Included into the namespace of an instruction set. It does not compile alone.

/**
 * Implicit steps of a pack. Chains whose equations were not solved take theirs in parts.
 */

/** Means over the parts of a divided step, for the lanes whose step is divided. */
template <int W> class MeanOfParts {
public:
    /** From now on, the settings record the forces of a part. */
    MeanOfParts(const Pack& pack, StepSettings& settings) : pack(pack), whole(settings.segmentForces) {
        if (whole == NULL)
            return;
        part.resize(whole->size());
        for (int chain : pack.chain)
            if (chain >= 0)
                part[chain].resize((*whole)[chain].size());
        settings.segmentForces = &part;
    }
    /** Add one of so many parts, the first of which begins anew. */
    void add(int number, int parts, const bool* divided) const {
        for (int i = 0; i < W && whole != NULL; i++)
            for (int s = 0; divided[i] && s < pack.segmentsOfLane[i]; s++) {
                SegmentForces& mean = (*whole)[pack.chain[i]][s];
                if (number == 0)
                    mean = SegmentForces();
                mean.add(part[pack.chain[i]][s], 1.0/parts);
            }
    }
private:
    const Pack& pack;
    std::vector<std::vector<SegmentForces> >* const whole;
    std::vector<std::vector<SegmentForces> > part;
};

/** The number of joints that can be twisted, with the first one of rings, which comes twice. */
inline int numTwists(const Pack& pack) {
    return pack.twist.isPresent() ? pack.segments+1 : 0;
}

/** Memory for the twists of a step: at its start, with what they are computed from, and how much they change. */
struct TwistMemory {
    Scratch twists, exact, changes;
    template <int W> typename DoubleLanes<W>::Type* reserveChanges(const Pack& pack) {
        return changes.reserve<typename DoubleLanes<W>::Type>(numTwists(pack)*DoubleLanes<W>::REGISTERS);
    }
};

/** Bring the vectors of segments into lanes, for chains with twist in double precision as well. */
template <int W> void gatherExactSegments(const Pack& pack, const double* positions, const double* box,
            [[maybe_unused]] TwistMemory& memory, StepStart<W>& start) {
    constexpr int REGISTERS = DoubleLanes<W>::REGISTERS, lanes = W/REGISTERS;
    if (REGISTERS == 1 || !pack.twist.isPresent())
        gatherSegments<W>(pack, positions, box, start.segments);
    if constexpr (REGISTERS == 1)
        start.exact = start.segments;
    else if (pack.twist.isPresent()) {
        auto* const exact = memory.exact.reserve<Vector<typename DoubleLanes<W>::Type> >((pack.nodes-1)*REGISTERS);
        forSegments<W>(pack, positions, box, [&] (int s, int i, const double* d) {
            auto& segment = exact[s*REGISTERS+i/lanes];
            lane(segment.x, i%lanes) = d[0];
            lane(segment.y, i%lanes) = d[1];
            lane(segment.z, i%lanes) = d[2];
        });
        for (int s = 0; s < pack.nodes-1; s++)
            start.segments[s] = fromDouble<W>(exact+s*REGISTERS);
        start.exact = exact;
    }
}

/**
 * Call a function with each twist in lanes: its chain and its number there, its node and its lane. The one more of
 * rings that are bent at rest, their last one, has the place of node 0, which is that of no joint there.
 */
template <int W, class Function> CYLCHAIN_INLINE void forTwists(const Pack& pack, Function function) {
    const int ofFirst = pack.closed ? pack.segments : 0, ofLast = pack.closed ? 0 : pack.segments;
    forPlacesOfLanes<W>(numTwists(pack), [&] (int node, int i) {
        if (pack.chain[i] < 0 || node > pack.segmentsOfLane[i] ||
                (node == 0 && pack.closed && !pack.twist.isBentAtRest()))
            return;
        function(pack.chain[i], node == 0 ? ofFirst : node == pack.segments ? ofLast : node, node, i);
    });
}

/** Bring twists into lanes, less those at rest. */
template <int W> void gatherTwists(const Pack& pack, const std::vector<std::vector<double> >& ofChains,
            typename Lanes<W>::Type* twists) {
    for (int node = 0; node < numTwists(pack); node++)
        twists[node] = typename Lanes<W>::Type {};
    forTwists<W>(pack, [&] (int chain, int joint, int node, int i) {
        lane(twists[node], i) = ofChains[chain][pack.firstNode[i]+joint]-pack.twist.rest[node*W+i];
    });
}

/** Write how much the twists of some lanes change. */
template <int W> void scatterTwists(const Pack& pack, const StepSettings& settings,
            const typename DoubleLanes<W>::Type* changes, const bool* taken) {
    const double* const all = reinterpret_cast<const double*>(changes);
    forTwists<W>(pack, [&] (int chain, int joint, int node, int i) {
        if (settings.twistChangesOfPieces != NULL)
            settings.twistChangesOfPieces[pack.particles[node*W+i]] = all[node*W+i];
        else if (taken == NULL || taken[i])
            (*settings.twistChanges)[chain][joint] = all[node*W+i];
    });
}

/** Where a step would begin if its nodes had moved already, and its twists changed. */
template <int W> void moveStart(const Pack& pack, const StepStart<W>& start,
            const Vector<typename Lanes<W>::Type>* moved, const typename DoubleLanes<W>::Type* turned, bool needsNodes,
            const StepStart<W>& result) {
    for (int node = 0; needsNodes && node < pack.nodes; node++)
        result.nodes[node] = start.nodes[node]+moved[node];
    for (int s = 0; s < pack.nodes-1; s++)
        result.segments[s] = start.segments[s]+(moved[s+1]-moved[s]);
    for (int node = 0; node < numTwists(pack); node++)
        result.twists[node] = start.twists[node]+fromDouble<W>(turned+node*DoubleLanes<W>::REGISTERS);
    for (std::size_t i = 0; i < pack.tethers.size(); i++) {
        const LaneTether& tether = pack.tethers[i];
        Vector<typename Lanes<W>::Type> change = moved[tether.node];
        result.tethers[i].d[0] = start.tethers[i].d[0]+lane(change.x, tether.lane);
        result.tethers[i].d[1] = start.tethers[i].d[1]+lane(change.y, tether.lane);
        result.tethers[i].d[2] = start.tethers[i].d[2]+lane(change.z, tether.lane);
    }
}

/** Take one step of the scheme that begins from somewhere, and return the number of iterations: see ImplicitStep. */
template <int W> using TakeStep = int (*)(const Pack& pack, const StepSettings& settings, const StepStart<W>& start,
        const Vector<typename Lanes<W>::Type>* forces, Vector<typename Lanes<W>::Type>* y, bool* failed,
        typename DoubleLanes<W>::Type* turned);

template <int W, bool CLOSED> int takeImplicitStep(const Pack& pack, const StepSettings& settings,
            const StepStart<W>& start, const Vector<typename Lanes<W>::Type>* forces,
            Vector<typename Lanes<W>::Type>* y, bool* failed, typename DoubleLanes<W>::Type* turned) {
    static thread_local typename ImplicitStep<W, CLOSED>::Memory memory;
    return ImplicitStep<W, CLOSED>(pack, settings, start, memory).take(forces, y, failed, turned);
}

/**
 * Advance the lanes that failed, from the start, by the same time in more and more parts. They follow the Brownian path
 * of the step, so that what failed is not left out of the noise.
 */
template <int W> void divideStep(TakeStep<W> takeStep, const Pack& pack, const StepStart<W>& start,
            const Vector<typename Lanes<W>::Type>* f, StepSettings settings, Vector<typename Lanes<W>::Type>* y,
            bool* failed, typename DoubleLanes<W>::Type* turned, const int* planned) {
    typedef typename Lanes<W>::Type Real;
    static thread_local Scratch vectors, tethers;
    static thread_local TwistMemory ofWhole, ofPart;
    const double h = settings.stepSize;
    const std::uint64_t step = settings.step;
    const int level = settings.level, n = pack.nodes;
    const MeanOfParts<W> mean(pack, settings);
    Vector<Real>* moved = vectors.reserve<Vector<Real> >(4*n);
    Vector<Real>* change = moved+n;
    const int joints = numTwists(pack), turns = joints*DoubleLanes<W>::REGISTERS;
    auto* const turnedSoFar = ofWhole.reserveChanges<W>(pack);
    auto* const turnedInPart = ofPart.reserveChanges<W>(pack);
    const StepStart<W> from = {moved+2*n, moved+3*n, tethers.reserve<TetherVector>(pack.tethers.size()),
            ofPart.twists.reserve<Real>(joints), start.exact, moved};
    for (int division = 1; division <= LARGEST_DIVISION_OF_CHAIN && level+division <= LARGEST_LEVEL; division++) {
        bool isTried[W], anyIsTried = false;
        for (int i = 0; i < W; i++) {
            isTried[i] = failed[i] && division >= planned[i];
            anyIsTried |= isTried[i];
        }
        if (!anyIsTried)
            continue;
        const int parts = 1<<division;
        settings.stepSize = h/parts;
        settings.level = level+division;
        bool failedNow[W] = {}, failedPart[W];
        for (int node = 0; node < n; node++)
            moved[node] = Vector<Real> {};
        for (int turn = 0; turn < turns; turn++)
            turnedSoFar[turn] = typename DoubleLanes<W>::Type {};
        bool hope = true;
        for (int part = 0; part < parts && hope; part++) {
            settings.step = (step<<division)+part;
            moveStart<W>(pack, start, moved, turnedSoFar, settings.flow.present, from);
            takeStep(pack, settings, from, f, change, failedPart, turnedInPart);
            for (int node = 0; node < n; node++)
                moved[node] = moved[node]+change[node];
            for (int turn = 0; turn < turns; turn++)
                turnedSoFar[turn] = turnedSoFar[turn]+turnedInPart[turn];
            mean.add(part, parts, isTried);
            hope = false;
            for (int i = 0; i < W; i++) {
                failedNow[i] |= failedPart[i];
                hope |= isTried[i] && !failedNow[i];
            }
        }
        bool any = false;
        for (int i = 0; i < W; i++) {
            if (isTried[i] && !failedNow[i]) {
                failed[i] = false;
                for (int node = 0; node < n; node++) {
                    lane(y[node].x, i) = lane(moved[node].x, i);
                    lane(y[node].y, i) = lane(moved[node].y, i);
                    lane(y[node].z, i) = lane(moved[node].z, i);
                }
                for (int joint = 0; joint < joints; joint++)
                    reinterpret_cast<double*>(turned)[joint*W+i] = reinterpret_cast<double*>(turnedSoFar)[joint*W+i];
            }
            any |= failed[i];
        }
        if (!any)
            return;
    }
}

/** Bring what a step begins with into lanes. */
template <int W> __attribute__((noinline)) void gatherStepStart(const Pack& pack, const double* positions,
            const double* box, const StepSettings& settings, TwistMemory& memory, StepStart<W>& start) {
    if (settings.flow.present)
        gatherStart<W>(pack, positions, box, start.nodes);
    gatherExactSegments<W>(pack, positions, box, memory, start);
    start.twists = memory.twists.reserve<typename Lanes<W>::Type>(numTwists(pack));
    if (pack.twist.isPresent())
        gatherTwists<W>(pack, *settings.twists, start.twists);
    for (std::size_t i = 0; i < pack.tethers.size(); i++) {
        tetherVector(pack, pack.tethers[i], positions, box, start.tethers[i].d);
        if (pack.planar)
            start.tethers[i].d[2] = 0;
    }
}

template <int W> Instability stepPackImplicitly(const Pack& pack, const double* positions, const double* forces,
            const double* box, const StepSettings& settings, double* displacements) {
    typedef typename Lanes<W>::Type Real;
    static thread_local Scratch vectors, tethers;
    static thread_local TwistMemory twists;
    const int n = pack.nodes;
    Vector<Real>* f = vectors.reserve<Vector<Real> >(4*n);
    Vector<Real>* y = f+n;
    StepStart<W> start = {y+n, y+2*n, tethers.reserve<TetherVector>(pack.tethers.size())};
    gatherStepStart<W>(pack, positions, box, settings, twists, start);
    auto* const turned = twists.reserveChanges<W>(pack);
    gatherForces<W>(pack, forces, f);
    bool failed[W];
    Instability result;
    TakeStep<W> takeStep = takeImplicitStep<W, false>;
#ifndef CYLCHAIN_SINGLE_PRECISION
    if (pack.closed)
        takeStep = takeImplicitStep<W, true>;
#endif
    int planned[W];
    bool allArePlanned = true, any = false;
    for (int i = 0; i < W; i++) {
        planned[i] = plannedDivision(pack, settings, i);
        allArePlanned &= planned[i] > 0 || pack.chain[i] < 0;
    }
    if (!allArePlanned)
        result.iterations = takeStep(pack, settings, start, f, y, failed, turned);
    for (int i = 0; i < W; i++) {
        if (allArePlanned)
            failed[i] = pack.chain[i] >= 0;
        else
            result.divided += failed[i] && planned[i] == 0;
        failed[i] |= planned[i] > 0;
        any |= failed[i];
    }
    if (any && settings.mayDivide)
        divideStep<W>(takeStep, pack, start, f, settings, y, failed, turned, planned);
    scatter<W>(pack, y, 1, displacements);
    scatterTwists<W>(pack, settings, turned, NULL);
    for (int i = 0; i < W; i++)
        if (failed[i] && result.chain < 0)
            result.chain = pack.chain[i];
    return result;
}
