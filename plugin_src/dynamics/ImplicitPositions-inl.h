// Included into the namespace of an instruction set. It does not compile alone.

/**
 * New nodes that no linear equations give: where an iteration begins, and lengths after segments have turned.
 */

template <int W> class ImplicitPositions {
    typedef typename Lanes<W>::Type Real;
    typedef Vector<Real> Vec;
public:
    explicit ImplicitPositions(const ImplicitState<W>& step) : step(step), pack(step.pack), n(step.n),
            segments(step.segments), rest(step.rest) {
    }
    /**
     * Begin the second stage where the noise of the first would have taken chains, had it been that of the whole step.
     */
    void extrapolate(Vec* y) const {
        const Real scale = splat<Real>(1/NOISE_OF_FIRST), free = pack.closed ? Real{} : loaded<Real>(pack.free, 0);
        Vec end = y[0];
        for (int node = 0; node < n; node++) {
            const Vec found = y[node];
            y[node] = found+found*((scale-1)*free);
            rest[node] = found-end;
            if (node > 0)
                rest[node] = rest[node]+segments[node-1].difference;
            end = found;
        }
        if (!pack.closed)
            rebuild(y, [&] (int s, const Vec&) {return root(rest[s+1].dot(rest[s+1]));});
    }
    /**
     * Begin the iteration where the flow carries chains as a whole, if no node of them is fixed. Segments stay what
     * they are, and the matrix symmetric.
     */
    void carryAlong(Vec* y) const {
        const LaneFlow<W> flow(step.settings.flow, pack.planar, step.start.nodes[0]);
        const Vec first = step.start.nodes[0];
        const Vec halfway = first+flow.at(first)*splat<Real>(Scalar(0.5)*step.h*step.shareOfForces());
        const Real free = loaded<Real>(pack.free, 0);
        const Vec carried = flow.at(halfway)*(free*(step.h*step.shareOfForces()));
        for (int node = 0; node < n; node++)
            y[node] = y[node]+carried;
    }
    /**
     * Segments that turn far become longer when their ends move along straight lines. Give them the directions that
     * they have now, and the lengths that the linear equations mean.
     */
    void resetLengths(Vec* y) const {
        rebuild(y, [&] (int s, const Vec& difference) {return Lengths<W>::meantLength(step, s, difference);});
    }
private:
    const ImplicitState<W>& step;
    const Pack& pack;
    const int n;
    const ImplicitSegment<Real>* const segments;
    Vec* const rest;

    /** Give segments other lengths, around the same mean of all nodes. Chains with fixed nodes stay as they are. */
    template <class Function> CYLCHAIN_INLINE void rebuild(Vec* y, Function lengthOf) const {
        Vec sum = {}, shifted = {}, end = y[0], moved = y[0];
        Real count = Real{};
        for (int node = 0; node < n; node++) {
            const Real mobile = property<Real>(pack, node, Pack::Mobile);
            if (node > 0) {
                const Vec change = y[node]-end, difference = segments[node-1].difference+change;
                moved = moved+change+difference*(lengthOf(node-1, difference)/root(difference.dot(difference))-1);
                end = y[node];
            }
            sum = sum+end*mobile;
            shifted = shifted+moved*mobile;
            count = count+mobile;
            rest[node] = moved;
        }
        const Vec back = (sum-shifted)*(1/larger<Real>(count, splat<Real>(1)));
        const Real free = loaded<Real>(pack.free, 0);
        for (int node = 0; node < n; node++)
            y[node] = y[node]+(rest[node]+back-y[node])*free;
    }
};
