// Included into the namespace of an instruction set. It does not compile alone.

/**
 * Steps of chains of beads by their modes: Panja, Barkema and van Leeuwen, Phys. Rev. E 2015, 92, 032603, Section IV.
 *
 * With F the forces of bends and those from outside, and G the rest, a mode of the positions moves by
 *
 *     (1-exp(-z h))/(z x) F + (exp(-z h)-exp(-y h))/((y-z) x) G + [(1-exp(-2 z h)) kT/(z x)]^(1/2) normal numbers,
 *
 * for the friction x of nodes, the rate z at which its bends decay and the sum y of this and the rate of its bonds. The
 * first term is what the paper has, (exp(-z h)-1) R for the position R of the mode, because the mode of the bending
 * forces is -z x R; but these do not lose digits to where the chain is, and forces from outside may join them.
 *
 * The noise of a mode has no memory of that within a step. Steps of different sizes, see Noise.h, follow the same
 * Brownian path in modes that are slower than the steps; in others the sum of two small steps is not a large one.
 */
template <int W> class ModeStep {
    typedef typename Lanes<W>::Type Real;
    typedef Vector<Real> Vec;
    typedef Complex<Real> Pair;
public:
    ModeStep(const ModePack<Scalar>& modes, const StepSettings& settings, Scratch& segmentMemory, Scratch& memory) :
            family(*modes.family), pack(modes.pack), settings(settings), n(pack.nodes),
            dimensions(pack.planar ? 2 : 3), tables(family.getTables()),
            coefficients(family.getCoefficients(settings.stepSize, settings.kT)) {
        segments = segmentMemory.reserve<Vec>(2*n);
        forces = segments+n;
        Pair* pairs = memory.reserve<Pair>(2*dimensions*n);
        for (int axis = 0; axis < dimensions; axis++) {
            given[axis] = pairs+2*axis*n;
            transformed[axis] = given[axis]+n;
        }
    }
    Instability take(const double* positions, const double* outside, const double* box, double* displacements) {
        gatherSegments<W>(pack, positions, box, segments);
        gatherForces<W>(pack, outside, forces);
        addPropulsion<W>(pack, segments, forces);
        addTethers(positions, box);
        Vec carried = {};
        if (settings.flow.present)
            carried = addFlow(positions);
        findForces();
        for (int axis = 0; axis < dimensions; axis++)
            transformFourier(tables->fourier, given[axis], transformed[axis]);
        moveModes();
        for (int pair = 0; pair < dimensions-1; pair++)
            transformFourier(tables->fourier, given[pair], transformed[pair]);
        return moveNodes(carried, displacements);
    }
private:
    void addTethers(const double* positions, const double* box) {
        for (const LaneTether& tether : pack.tethers) {
            double d[3];
            tetherVector(pack, tether, positions, box, d);
            Vec& force = forces[tether.node];
            lane(force.x, tether.lane) -= tether.stiffness*d[0];
            lane(force.y, tether.lane) -= tether.stiffness*d[1];
            if (!pack.planar)
                lane(force.z, tether.lane) -= tether.stiffness*d[2];
        }
    }
    /** Add the drag of the flow relative to the first nodes, and return what these are carried along by. */
    Vec addFlow(const double* positions) {
        const BackgroundFlow flow = settings.flow.carriedAlong(settings.stepSize, pack.planar);
        Vec carried = {};
        for (int i = 0; i < W; i++) {
            double u[3] = {};
            if (pack.chain[i] >= 0)
                flow.getVelocity(positions+3*pack.particles[i], u);
            lane(carried.x, i) = settings.stepSize*u[0];
            lane(carried.y, i) = settings.stepSize*u[1];
            lane(carried.z, i) = pack.planar ? 0 : settings.stepSize*u[2];
        }
        Scalar drag[9];
        for (int k = 0; k < 9; k++)
            drag[k] = family.modes.nodeFriction*flow.gradient[k];
        Vec x = {};
        for (int node = 0; node < n; node++) {
            forces[node].x += x.x*drag[0]+x.y*drag[1]+x.z*drag[2];
            forces[node].y += x.x*drag[3]+x.y*drag[4]+x.z*drag[5];
            if (!pack.planar)
                forces[node].z += x.x*drag[6]+x.y*drag[7]+x.z*drag[8];
            if (node < n-1)
                x = x+segments[node];
        }
        return carried;
    }
    /** Give pairs of the forces of each node to be transformed: of bends and from outside, and the others. */
    void findForces() {
        const Scalar bending = family.modes.bendingStiffness, stiffness = family.modes.stiffness;
        const Scalar contourForce = family.modes.contourForce;
        Vec bendBefore = {}, pushBefore = {}, segment = segments[0], bend = segment*splat<Real>(bending);
        for (int node = 0; node < n; node++) {
            Vec push = {}, next = {}, bendBehind = {}, turn = {};
            if (node < n-1) {
                push = segment*(contourForce/root(segment.dot(segment))-stiffness);
                if (node < n-2)
                    next = segments[node+1];
                bendBehind = (next-segment)*splat<Real>(bending);
                turn = bendBehind-bend;
            }
            const Vec slow = forces[node]+bendBefore-turn, fast = pushBefore-push;
            const int place = fourierPlace(node, n);
            given[0][place] = {slow.x, fast.x};
            given[1][place] = {slow.y, fast.y};
            if (dimensions > 2)
                given[2][place] = {slow.z, fast.z};
            bendBefore = turn;
            pushBefore = push;
            bend = bendBehind;
            segment = next;
        }
    }
    struct Normals {
        Real values[4];
    };
    CYLCHAIN_INLINE Normals drawMode(const NoiseKey& key, NoisePlaces<W>& places, int mode) const {
        Normals normals = {};
        if (settings.kT > 0) {
            places.part = (Word) mode+typename Lanes<W>::Bits {};
            drawNormals<W, 2>(key, NoiseKind::Node, places, normals.values);
        }
        return normals;
    }
    CYLCHAIN_INLINE Real moved(int mode, const Pair& forcesOfMode, Real normal) const {
        return forcesOfMode.re*coefficients->slow[mode]+forcesOfMode.im*coefficients->fast[mode]+
                normal*coefficients->noise[mode];
    }
    /** Take what the modes move by, pair by pair of dimensions, to be transformed back. */
    void moveModes() {
        const NoiseKey key = noiseKey(settings);
        NoisePlaces<W> places = noisePlaces<W>(pack);
        const Normals first = drawMode(key, places, 0);
        Real moves[4] = {}, mirroredMoves[4] = {};
        for (int axis = 0; axis < dimensions; axis++)
            moves[axis] = moved(0, transformed[axis][0], first.values[axis]);
        for (int pair = 0; pair < dimensions-1; pair++)
            given[pair][0] = {moves[2*pair+1], moves[2*pair]};
        for (int mode = 1, mirrored = n-1; mode <= mirrored; mode++, mirrored--) {
            const Normals normals = drawMode(key, places, mode), mirroredNormals = drawMode(key, places, mirrored);
            const Scalar* const rotation = &tables->rotations[2*mode];
            for (int axis = 0; axis < dimensions; axis++) {
                Pair own, other;
                cosinesOfFourier(transformed[axis][mode], transformed[axis][mirrored], rotation, own, other);
                moves[axis] = moved(mode, own, normals.values[axis]);
                mirroredMoves[axis] = moved(mirrored, other, mirroredNormals.values[axis]);
            }
            for (int pair = 0; pair < dimensions-1; pair++)
                fourierOfCosines<Real>({moves[2*pair], moves[2*pair+1]}, {mirroredMoves[2*pair],
                        mirroredMoves[2*pair+1]}, rotation, given[pair][mode], given[pair][mirrored]);
        }
    }
    /** Write displacements, and look for bonds that change more than they should. */
    Instability moveNodes(const Vec& carried, double* displacements) {
        Real largest = {}, sum = {};
        Vec before = {};
        for (int node = 0; node < n; node++) {
            const int place = fourierPlace(node, n);
            const Pair& xy = transformed[0][place];
            Vec move = {xy.im, xy.re, Real{}};
            if (dimensions > 2)
                move.z = transformed[1][place].im;
            if (node > 0) {
                const Vec change = move-before;
                const Real square = change.dot(change);
                largest = larger<Real>(largest, square);
                sum = sum+square;
            }
            before = move;
            forces[node] = move+carried;
        }
        scatter<W>(pack, forces, 1, displacements);
        Instability result;
        for (int i = 0; i < W; i++) {
            // Written so that NaN counts as unstable.
            const bool stable = lane(largest, i) < coefficients->largestChange && std::isfinite(lane(sum, i));
            if (!stable && pack.chain[i] >= 0 && result.chain < 0)
                result.chain = pack.chain[i];
        }
        return result;
    }
    const ModeFamily<Scalar>& family;
    const Pack& pack;
    const StepSettings& settings;
    const int n, dimensions;
    const std::shared_ptr<const CosineTables<Scalar> > tables;
    const std::shared_ptr<const ModeCoefficients<Scalar> > coefficients;
    Vec *segments, *forces;
    Pair *given[3], *transformed[3];
};

template <int W> Instability stepPackOfModes(const ModePack<Scalar>& modes, const double* positions,
            const double* forces, const double* box, const StepSettings& settings, double* displacements) {
    static thread_local Scratch segmentMemory, memory;
    return ModeStep<W>(modes, settings, segmentMemory, memory).take(positions, forces, box, displacements);
}
