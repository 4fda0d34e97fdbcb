// Included into the namespace of an instruction set. It does not compile alone.

/** The vectors from the points of tethers to their nodes. A node may have several, in any lanes. */
template <int W> struct Tethers : OnNodes {
    typedef typename Lanes<W>::Type Real;
    typedef Vector<Real> Vec;
    typedef ImplicitState<W> State;
    static CYLCHAIN_INLINE bool isIn(const Pack& pack) {
        return !pack.tethers.empty();
    }
    static void describe(const State& step, int node) {
        const Pack& pack = step.pack;
        for (int number = pack.firstTethers[node]; number < pack.firstTethers[node+1]; number++) {
            const LaneTether& tether = pack.tethers[number];
            ImplicitTether& result = step.tethers[number];
            std::copy(step.start.tethers[number].d, step.start.tethers[number].d+3, result.start);
            double friction = pack.nodeFriction[tether.lane];
            for (int side = node-1; side <= node; side++) {
                const int s = pack.closed && side < 0 ? pack.segments-1 : side;
                if (s >= 0 && s < pack.segmentsOfLane[tether.lane]) {
                    Real parallel = property<Real>(pack, s, Pack::Parallel);
                    Real extensional = property<Real>(pack, s, Pack::Extensional);
                    Real l0 = property<Real>(pack, s, Pack::RestLength);
                    const double length = lane(l0, tether.lane);
                    friction += 0.25*lane(parallel, tether.lane)+lane(extensional, tether.lane)/(length*length);
                }
            }
            result.theta = std::fmax(0.5, 1-friction/(step.h*tether.stiffness+TINY));
            for (double& random : result.random)
                random = 0;
        }
    }
    static void draw(const State& step, const NoisePlaces<W>&, const PlaceNormals<Real>&, int node) {
        const Pack& pack = step.pack;
        for (int number = pack.firstTethers[node]; number < pack.firstTethers[node+1]; number++) {
            const LaneTether& tether = pack.tethers[number];
            const double deviation = std::sqrt(step.settings.kT/(tether.stiffness+TINY));
            const NoisePlaces<1> place = {(Word) pack.chain[tether.lane], (Word) tether.number};
            Scalar normals[4];
            drawNormals<1, 2>(noiseKey(step.settings), NoiseKind::Tether, place, normals);
            for (int k = 0; k < 3; k++)
                step.tethers[number].random[k] = pack.planar && k == 2 ? 0 : deviation*normals[k];
        }
    }
    static void prepare(const State& step, const Vec* y, int node) {
        const Pack& pack = step.pack;
        Vec moved = y[node];
        for (int number = pack.firstTethers[node]; number < pack.firstTethers[node+1]; number++) {
            const int i = pack.tethers[number].lane;
            ImplicitTether& tether = step.tethers[number];
            tether.implicit = step.stage == Stage::Only ? tether.theta : DIAGONAL;
            const Scalar components[] = {lane(moved.x, i), lane(moved.y, i), lane(moved.z, i)};
            for (int k = 0; k < 3; k++)
                switch (step.stage) {
                    case Stage::Only:
                        tether.constant[k] = tether.start[k]-std::sqrt(2*tether.theta-1)*tether.random[k];
                        break;
                    case Stage::First:
                        tether.constant[k] = DIAGONAL*(tether.start[k]-NOISE_OF_FIRST*tether.random[k]);
                        break;
                    case Stage::Second:
                        tether.constant[k] =
                                tether.start[k]+(1-DIAGONAL)*components[k]-2*DIAGONAL*tether.random[k];
                        break;
                }
        }
    }
    template <class Row> static void add(const State& step, int node, const Vec* y, Row& row) {
        const Pack& pack = step.pack;
        Vec moved = y[node];
        for (int number = pack.firstTethers[node]; number < pack.firstTethers[node+1]; number++) {
            const int i = pack.tethers[number].lane;
            const ImplicitTether& tether = step.tethers[number];
            const Scalar stiffness = pack.tethers[number].stiffness, implicit = stiffness*tether.implicit;
            lane(row.right.x, i) -= implicit*lane(moved.x, i)+stiffness*tether.constant[0];
            lane(row.right.y, i) -= implicit*lane(moved.y, i)+stiffness*tether.constant[1];
            lane(row.right.z, i) -= implicit*lane(moved.z, i)+stiffness*tether.constant[2];
            lane(row.diagonal.xx, i) += implicit;
            lane(row.diagonal.yy, i) += implicit;
            lane(row.diagonal.zz, i) += implicit;
        }
    }
    static void addForces(const Pack& pack, int node, const double* positions, const double* box, Vec* f,
            ChainEnergy* energy) {
        for (int number = pack.firstTethers[node]; number < pack.firstTethers[node+1]; number++) {
            const LaneTether& tether = pack.tethers[number];
            double d[3];
            tetherVector(pack, tether, positions, box, d);
            lane(f[node].x, tether.lane) -= tether.stiffness*d[0];
            lane(f[node].y, tether.lane) -= tether.stiffness*d[1];
            lane(f[node].z, tether.lane) -= tether.stiffness*d[2];
            if (energy != NULL)
                energy->tethers += 0.5*tether.stiffness*(d[0]*d[0]+d[1]*d[1]+d[2]*d[2]);
        }
    }
};
